"""Sharing and hoisting keep every value, exactly, and take work away."""

import random
from collections import Counter

import pytest
from test_expressions import random_expression
from toy import ARGUMENTS, FIELDS, GROUPS, array, function, let, put, random_data, run

from codegen.operations import count_operations
from codegen.programs import ContractError, Loop, read_array, read_function
from codegen.sharing import share
from codegen.tangents import Rules

MODEL = tuple(read_array(name, FIELDS, "field", "toy") for name in FIELDS)


def read(data, arguments=ARGUMENTS, rules=None):
    (name,) = data["sets"]
    return read_function(data, MODEL if name == "toy" else (), name, arguments, GROUPS, (rules or Rules()).reads)


def random_program(rng):
    """A function of random steps: accumulators changed in loops and used after them, lets in every scope."""
    once, wheel = ["nu_1", "nu_2", "gain", "N"], ["chi", "cos_alpha"]
    numbers = Counter()

    def expression(names):
        data = random_expression(rng, 3)
        return rename(data, names)

    def rename(data, names):
        if isinstance(data, str):
            return rng.choice(names)
        return [data[0], *(rename(d, names) for d in data[1:])] if isinstance(data, list) and data[0] != "/" else data

    def lets(names, count):
        body = []
        for _ in range(count):
            numbers["let"] += 1
            name = f"v{numbers['let']}"
            body.append(let(name, expression(names)))
            names = [*names, name]
        return body, names

    body, names = lets(once, 3)
    body += [{"var": "s", "expr": expression(names)}, {"var": "t", "expr": 0}]
    for turn in range(2):
        inner, inside = lets([*names, *wheel], 3)
        deep, deepest = lets([*inside, "spin", "cos_kappa", "slot"], 2)
        deep += [{"add": "t", "expr": expression(deepest)}]
        inner += [{"loop": "j", "body": deep}, {"add": "s", "expr": expression([*inside, "t"])}]
        inner += [{"update": "s", "expr": ["*", "s", ["/", 1, 2]]}]
        if turn:
            inner += [put(["chi_dot", "i"], expression(inside))]
        body += [{"loop": "i", "body": inner}, let(f"after{turn}", expression([*names, "s", "t"]))]
        names = [*names, f"after{turn}"]
    body += [put(["nu_dot", k], expression([*names, "s", "t"])) for k in range(3)]
    return function("random", "Random.", "nu chi spins", "nu_dot chi_dot", body)


@pytest.mark.parametrize("seed", range(12))
def test_random_programs_keep_their_values(seed):
    rng = random.Random(seed)
    before = read(random_program(rng))
    after = share(before)
    data = random_data(before, 2, 3, rng)
    assert run(after, 2, 3, data) == run(before, 2, 3, data)


@pytest.mark.parametrize("seed", range(8))
def test_work_never_grows(seed):
    turns = {"once": 1, "wheel": 4, "slot": 5, "roller": 20}

    def total(function, kinds):
        counts = count_operations(function)
        return sum(turns[place] * counts[place][kind] for place in turns for kind in kinds)

    before = read(random_program(random.Random(seed)))
    after = share(before)
    for kinds in (["sqrt"], ["sincos"], ["add", "mul", "div", "sqrt", "sincos"]):
        assert total(after, kinds) <= total(before, kinds), kinds


def shared(body):
    arguments = ARGUMENTS | array("nu", [3], a=[0], b=[1], c=[2])
    return share(read(function("f", "F.", "nu chi", "nu_dot chi_dot", body), arguments))


def names(body):
    return [node.name for node in body if not isinstance(node, Loop) and node.kind == "let"]


def test_one_reciprocal_for_many_divisions():
    a_over_c, b_over_c = ["*", "a", ["^", "c", -1]], ["*", "b", ["^", "c", -1]]
    f = shared([put(["nu_dot", 0], a_over_c), put(["nu_dot", 1], b_over_c), put(["nu_dot", 2], ["^", "c", -2])])
    assert names(f.body) == ["inv_c"]
    assert count_operations(f)["once"] == {"add": 0, "mul": 3, "div": 1, "sqrt": 0, "sincos": 0, "exp": 0}


def test_what_a_loop_does_not_change_is_computed_before_it():
    f = shared([{"loop": "i", "body": [put(["chi_dot", "i"], ["*", "chi", ["sin", "a"], "b", ["^", "c", -1]])]}])
    assert count_operations(f)["wheel"] == {"add": 0, "mul": 1, "div": 0, "sqrt": 0, "sincos": 0, "exp": 0}
    inside = [let("x", ["*", "a", "b"]), put(["chi_dot", "i"], ["*", "chi", "x"])]
    counts = count_operations(shared([{"loop": "i", "body": inside}, put(["nu_dot", 0], ["*", "a", "b"])]))
    assert [counts[place]["mul"] for place in ("once", "wheel")] == [1, 1]


@pytest.mark.parametrize("body, message", [
    ([put(["nu_dot", 0], "zeta")], "unknown symbol zeta"),
    ([put(["nu_dot", 0], "chi")], "outside the loop over i"),
    ([put(["nu_dot", 3], "a")], "does not fit shape"),
    ([put(["force", 0], "a")], "no such output"),
    ([let("a", 1)], "the name is taken"),
    ([let("x", 1), let("x", 2)], "the name is taken"),
    ([{"add": "x", "expr": 1}], "not a var"),
    ([let("2x", 1)], "not an identifier"),
    ([let("x", 0.5)], "not an expression"),
    ([{"loop": "k", "body": []}], "loop over k"),
    ([{"do": "x", "expr": 1}], "unknown step"),
])  # fmt: skip
def test_what_breaks_the_contract_is_named(body, message):
    with pytest.raises(ContractError, match=message) as raised:
        shared(body)
    assert "toy.f" in str(raised.value)

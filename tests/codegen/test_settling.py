"""Settled and tightened functions keep every value, exactly; sums that are none go; degrees are those of the values."""

import random
from dataclasses import replace
from fractions import Fraction

import pytest
from test_sharing import random_program, read
from toy import ARGUMENTS, array, exact, function, let, put, random_data, run

from codegen.degrees import MIXED, Degree, degrees_of
from codegen.expressions import Canonical, Number, Order
from codegen.operations import count_operations
from codegen.programs import CONSTANTS, Element, Loop, steps
from codegen.settling import settled, tightened
from codegen.tangents import Column, Rules, Tangents, Together


def program(body):
    arguments = ARGUMENTS | array("nu", [3], a=[0], b=[1], c=[2])
    return read(function("f", "F.", "nu chi", "nu_dot chi_dot", body), arguments)


def wheels(*body):
    return {"loop": "i", "body": list(body)}


def canonical(f):
    return Canonical(Order([*f.elements, *(step.name for step in steps(f.body)), *CONSTANTS]))


@pytest.mark.parametrize("change", [settled, tightened])
@pytest.mark.parametrize("seed", range(40))
def test_random_programs_keep_their_values(change, seed):
    rng = random.Random(seed)
    before = read(random_program(rng))
    if any(isinstance(step.expression, Number) for step in steps(before.body) if step.kind == "let"):
        pytest.skip("a polynomial stands for the cosine here, which of zero is not 1")
    data = random_data(before, 2, 3, rng)
    assert run(change(before), 2, 3, data) == run(before, 2, 3, data)


def test_a_sum_to_which_nothing_is_added_is_its_start():
    f = settled(program([{"var": "s", "expr": 0}, {"var": "t", "expr": "b"}, wheels({"add": "t", "expr": "s"}),
                         put(["nu_dot", 0], ["+", "s", "t", "a"])]))  # fmt: skip
    assert not any(isinstance(node, Loop) for node in f.body)
    assert count_operations(f)["once"]["add"] == 1


def test_a_sum_is_joined_up_to_where_it_is_read_first():
    body = [{"var": "s", "expr": 0}, {"add": "s", "expr": "a"}, put(["nu_dot", 0], "s"), {"add": "s", "expr": "b"},
            put(["nu_dot", 1], "s")]  # fmt: skip
    f = settled(program(body))
    assert [step.kind for step in f.body] == ["var", "put", "add", "put"]


def test_common_factors_are_taken_out_and_products_in_one_piece():
    f = tightened(program([let("p", ["*", "a", "b"]), put(["nu_dot", 0], ["*", "p", "c"]),
                           put(["nu_dot", 1], ["+", ["*", "a", "b"], ["*", "a", "c"]])]))  # fmt: skip
    assert [step.kind for step in f.body] == ["put", "put"]
    assert count_operations(f)["once"] == {"add": 1, "mul": 3, "div": 0, "sqrt": 0, "sincos": 0, "exp": 0}


STEPS = [
    let("p", ["*", "a", "a", "b"]), {"var": "s", "expr": 0}, {"var": "t", "expr": 0}, {"var": "u", "expr": 0},
    wheels(let("x", ["*", "a", "chi"]), {"add": "s", "expr": "x"}, {"add": "t", "expr": ["+", "x", "chi"]},
           {"add": "u", "expr": "chi"}, {"add": "s", "expr": ["*", "a", "b"]}),
    let("q", ["*", "s", ["^", "p", -1]]), let("r", ["+", "s", "u"]),
    put(["nu_dot", 0], "q"), put(["nu_dot", 1], ["*", "t", "p"]), put(["nu_dot", 2], ["+", "r", ["*", "s", "b", "u"]]),
]  # fmt: skip


def test_degrees():
    f = program([*STEPS[:-1], let("w", ["*", "b", ["sin", "a"]]), put(["nu_dot", 2], ["*", "r", "w"])])
    found = degrees_of(f.body, {"a": 1}, Rules(), frozenset(), canonical(f))
    known = {name: found.get(name, 0) for name in ("p", "x", "s", "t", "u", "q", "r", "w")}
    assert known == {"p": 2, "x": 1, "s": 1, "t": MIXED, "u": 0, "q": -1, "r": MIXED, "w": MIXED}
    assert degrees_of(f.body, {"a": 1}, Rules(), frozenset({"s", "u"}), canonical(f))["s"] is MIXED
    assert degrees_of(f.body, {"a": 1}, Rules().holding(["x"]), frozenset(), canonical(f))["t"] == 0
    assert Degree({"a": 3})(canonical(f).read(["^", "a", 2])) is MIXED, "no slope is such a multiple"


def test_a_rule_has_a_degree_where_it_is_a_multiple_of_its_step():
    f = program([let("p", ["*", "a", "b"]), put(["nu_dot", 0], "p")])
    c = canonical(f)
    for slope, degree in ((["*", 1, "b"], 1), (["*", 2, "b"], 2), ("c", MIXED)):
        rules = Rules({"p": {"a": c.read(slope)}})
        assert degrees_of(f.body, {"a": 1}, rules, frozenset(), c)["p"] == degree


def test_a_rule_is_read_with_what_symbols_stand_for():
    f = program([let("q", ["^", "b", -1]), let("p", ["*", "a", "q"]), put(["nu_dot", 0], "p")])
    c = canonical(f)
    for slope, by_both, by_one in ((["*", -1, "q", "p"], 0, -1), (["*", -1, "q", "q"], MIXED, MIXED)):
        rules = Rules({"p": {"a": c.read("q"), "b": c.read(slope)}})
        found = [degrees_of(f.body, of, rules, frozenset(), c)["p"] for of in ({"a": 1, "b": 1}, {"b": 1})]
        assert found == [by_both, by_one]


@pytest.mark.parametrize("seed", range(10))
def test_slopes_by_degrees_are_the_slopes(seed):
    """The same column with its rate and without, exactly; sums that have degrees have no sums of slopes beside them."""
    f = program(STEPS)
    data = random_data(f, 3, 4, random.Random(seed))
    data["nu"][(2,)] = exact(Fraction(1, data["nu"][(0,)]))
    c, target = canonical(f), lambda element: element
    columns = [Column("a", {"a": c.read(1)}, target), Column("a", {"a": c.read(1)}, target, c.read("c"), {"a": 1})]
    bodies = [Tangents(c, Rules()).carried(f.body, [column], keep=False) for column in columns]
    plain, short = (run(replace(f, body=body), 3, 4, data) for body in bodies)
    assert plain == short and len(plain) == 3
    assert [sum(step.kind == "add" for step in steps(body)) for body in bodies] == [4 + 3, 4 + 1]


def grown_together(c, together):
    """The columns of a and b."""
    own = Column("a", {"a": c.read(1)}, lambda element: element, c.read("c"), {"a": 1}, together)
    return [own, Column("b", {"b": c.read(1)}, lambda element: None)]


@pytest.mark.parametrize("power", [1, -1])
@pytest.mark.parametrize("seed", range(10))
def test_slopes_of_sums_follow_where_numbers_grow_together(seed, power):
    """From those by the other number, exactly, and without a sum; not where a loop reads the sum, two loops add to
    it or where it has no degree. Also where one falls as the other grows."""
    other = "b" if power == 1 else ["^", "b", -1]
    inside = ["+", ["*", "a", other, "chi"], ["*", "a", "a"]]
    f = program([*({"var": name, "expr": 0} for name in "stuv"),
                 wheels(*({"add": name, "expr": inside} for name in "stu"), {"add": "v", "expr": ["+", "a", inside]}),
                 wheels({"add": "t", "expr": ["*", "a", "b"]}, let("x", ["*", "u", "chi"]), {"add": "v", "expr": "x"}),
                 put(["nu_dot", 0], ["*", "s", "b"]), put(["nu_dot", 1], "t"), put(["nu_dot", 2], "v")])  # fmt: skip
    data = random_data(f, 3, 4, random.Random(seed))
    data["nu"][(2,)] = exact(Fraction(1, data["nu"][(0,)]))
    c = canonical(f)
    together = Together({"a": 1, "b": power}, {"b": c.read(["*", "b", ["^", "a", -1]])}, {"a": 1, "b": power})
    bodies = [Tangents(c, Rules()).carried(f.body, grown_together(c, of), keep=False) for of in ((), (together,))]
    plain, short = (run(replace(f, body=body), 3, 4, data) for body in bodies)
    assert plain == short and len(plain) == 3
    added = [{step.name for step in steps(body) if step.kind == "add"} for body in bodies]
    assert added[0] - added[1] == {"s_by_a"} and added[0] >= {f"{name}_by_a" for name in "stuv"}


@pytest.mark.parametrize("seed", range(10))
def test_of_sums_that_are_named_these_alone_follow(seed):
    inside = ["+", ["*", "a", "b", "chi"], ["*", "a", "a"]]
    f = program([*({"var": name, "expr": 0} for name in "st"),
                 wheels(*({"add": name, "expr": inside} for name in "st")),
                 put(["nu_dot", 0], ["*", "s", "b"]), put(["nu_dot", 1], "t")])  # fmt: skip
    data = random_data(f, 3, 4, random.Random(seed))
    data["nu"][(2,)] = exact(Fraction(1, data["nu"][(0,)]))
    c, powers = canonical(f), {"a": 1, "b": 1}
    bodies = []
    for sums in ("", "s"):
        together = Together(powers, {"b": c.read(["*", "b", ["^", "a", -1]])}, powers, sums=frozenset(sums))
        bodies.append(Tangents(c, Rules()).carried(f.body, grown_together(c, (together,)), keep=False))
    every, named = (run(replace(f, body=body), 3, 4, data) for body in bodies)
    assert every == named and len(every) == 2
    added = [{step.name for step in steps(body) if step.kind == "add"} for body in bodies]
    assert added[1] - added[0] == {"t_by_a"} and "s_by_a" not in added[1]


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_a_slope_that_another_follows_from_follows_from_none(seed, reverse):
    """Of a with b, and of b with d: that by b follows, that by a is added up, whichever column is the first."""
    body = [{"var": "s", "expr": 0},
            wheels({"add": "s", "expr": ["+", ["*", "a", "b", "d", "chi"], ["*", "a", "a", "d", "d"]]}),
            put(["nu_dot", 0], "s")]  # fmt: skip
    arguments = ARGUMENTS | array("nu", [5], a=[0], b=[1], d=[2], over_a=[3], over_b=[4])
    f = read(function("f", "F.", "nu chi", "nu_dot chi_dot", body), arguments)
    data = random_data(f, 3, 4, random.Random(seed))
    for place in (0, 1):
        data["nu"][(3 + place,)] = exact(Fraction(1, data["nu"][(place,)]))
    c = canonical(f)

    def columns(follow):
        for place, (name, other) in enumerate(["ab", "bd"]):
            powers, ratios = {name: 1, other: 1}, {other: c.read(["*", other, ["^", name, -1]])}
            target = lambda element, place=place: Element(element.array, (place,))  # noqa: E731
            together = [Together(powers, ratios, powers)] if follow else ()
            yield Column(name, {name: c.read(1)}, target, c.read(f"over_{name}"), {name: 1}, together)
        yield Column("d", {"d": c.read(1)}, lambda element: None)

    bodies = [
        Tangents(c, Rules()).carried(f.body, list(columns(follow))[:: -1 if reverse else 1], keep=False)
        for follow in (False, True)
    ]
    plain, short = (run(replace(f, body=body), 3, 4, data) for body in bodies)
    assert plain == short and len(plain) == 2
    added = [{step.name for step in steps(body) if step.kind == "add"} for body in bodies]
    assert added[0] - added[1] == {"s_by_b"} and "s_by_a" in added[1]


@pytest.mark.parametrize("seed", range(10))
def test_sums_follow_from_their_slopes_where_numbers_grow_together(seed):
    """Of a in two powers, exactly and without adding up; not from a start, nor where a loop reads the sum."""
    inside = ["*", "a", ["+", ["*", "b", "chi"], "d"]]
    body = [*({"var": name, "expr": 0} for name in "stu"), {"var": "v", "expr": "a"},
            wheels({"add": "s", "expr": inside}, {"add": "t", "expr": ["*", "a", inside]}, {"add": "u", "expr": inside},
                   {"add": "v", "expr": inside}),
            wheels(let("x", ["*", "u", "chi"]), {"add": "u", "expr": "x"}),
            put(["nu_dot", 0], ["*", "s", "t"]), put(["nu_dot", 1], "u"), put(["nu_dot", 2], "v")]  # fmt: skip
    arguments = ARGUMENTS | array("nu", [4], a=[0], b=[1], c=[2], d=[3])
    f = read(function("f", "F.", "nu chi", "nu_dot chi_dot", body), arguments)
    data = random_data(f, 3, 4, random.Random(seed))
    data["nu"][(2,)] = exact(Fraction(1, data["nu"][(0,)]))
    c, powers = canonical(f), {"a": 1, "b": 1, "d": 1}
    ratios = {name: c.read(["*", name, ["^", "a", -1]]) for name in "bd"}
    others = [Column(name, {name: c.read(1)}, lambda element: None) for name in "bd"]
    bodies = []
    for numbers in ({}, {name: c.read(name) for name in "bd"}):
        together = Together(powers, ratios, powers, numbers)
        own = Column("a", {"a": c.read(1)}, lambda element: element, c.read("c"), {"a": 1}, [together])
        bodies.append(Tangents(c, Rules()).carried(f.body, [own, *others], keep=False))
    plain, short = (run(replace(f, body=body), 3, 4, data) for body in bodies)
    assert plain == short and len(plain) == 3
    added = [{step.name for step in steps(body) if step.kind == "add"} for body in bodies]
    assert added[0] - added[1] == {"s", "t"} and added[0] >= set("stuv")

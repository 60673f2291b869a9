"""Settled and tightened functions keep every value, exactly; sums that are none go; degrees are those of the values."""

import random
from dataclasses import replace
from fractions import Fraction

import pytest
from test_sharing import random_program, read
from toy import ARGUMENTS, array, exact, function, let, put, random_data, run

from codegen.expressions import Canonical, Number, Order
from codegen.operations import count_operations
from codegen.programs import CONSTANTS, Loop, steps
from codegen.settling import settled, tightened
from codegen.tangents import Column, Rules, Tangents


def program(body):
    arguments = ARGUMENTS | array("nu", [3], a=[0], b=[1], c=[2])
    return read(function("f", "F.", "nu chi", "nu_dot chi_dot", body), arguments)


def wheels(*body):
    return {"loop": "i", "body": list(body)}


def canonical(f):
    return Canonical(Order([*f.elements, *(step.name for step in steps(f.body)), *CONSTANTS]))


@pytest.mark.parametrize("change", [settled, tightened])
@pytest.mark.parametrize("seed", range(12))
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


@pytest.mark.parametrize("change", [settled, tightened])
def test_what_reads_a_sum_stays_before_what_is_added_to_it(change):
    f = program([{"var": "t", "expr": "b"}, {"var": "s", "expr": ["*", "t", "c"]}, let("p", ["*", "t", "a"]),
                 {"add": "t", "expr": "a"}, {"add": "s", "expr": "b"}, put(["nu_dot", 0], ["*", "s", "t"]),
                 put(["nu_dot", 1], ["*", "p", "c"])])  # fmt: skip
    data = random_data(f, 3, 4, random.Random(1))
    assert run(change(f), 3, 4, data) == run(f, 3, 4, data)


STEPS = [
    let("p", ["*", "a", "a", "b"]), {"var": "s", "expr": 0}, {"var": "t", "expr": 0}, {"var": "u", "expr": 0},
    wheels(let("x", ["*", "a", "chi"]), {"add": "s", "expr": "x"}, {"add": "t", "expr": ["+", "x", "chi"]},
           {"add": "u", "expr": "chi"}, {"add": "s", "expr": ["*", "a", "b"]}),
    let("q", ["*", "s", ["^", "p", -1]]), let("r", ["+", "s", "u"]),
    put(["nu_dot", 0], "q"), put(["nu_dot", 1], ["*", "t", "p"]), put(["nu_dot", 2], ["+", "r", ["*", "s", "b", "u"]]),
]  # fmt: skip


@pytest.mark.parametrize("seed", range(3))
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

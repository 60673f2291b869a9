"""What is proportional to a power of a number: found in a program's steps, so that its slope is a multiple of it.

If s grows as the k-th power of p, its slope by p is k s/p, whatever was computed on the way (Euler). The degree is k;
it is 0 where s does not depend on p at all. A sum in a loop that is all of one degree needs no sum of slopes beside it.

A step that stands still has degree 0. One whose slope Maxima's rules give has the degree that these say, where that can
be read off them.

Several numbers may grow together, and all have a degree then, as lengths have where a vehicle becomes larger in
proportion. Of a sum of degree k, with slopes s_p, sum of p s_p = k s gives the slope by one of them from the others'.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .expressions import (
    ONE,
    ZERO,
    Call,
    Canonical,
    Expression,
    Power,
    Product,
    Sum,
    Symbol,
    number,
    operands,
    split_coefficient,
)
from .programs import Loop, Step, steps

if TYPE_CHECKING:
    from .tangents import Rules

MIXED = None  # several degrees, or none
HIGHEST = 4
Degrees = dict[str, int | None]


@dataclass
class Degree:
    """Degrees of expressions, from those of symbols; what is not named has 0."""

    of_symbol: Degrees

    def __call__(self, e: Expression) -> int | None:
        match e:
            case Symbol(name):
                return self.of_symbol.get(name, 0)
            case Sum(terms):
                found = {self(term) for term in terms}
                return found.pop() if len(found) == 1 else MIXED
            case Product(factors):
                found = [self(factor) for factor in factors]
                return MIXED if MIXED in found else bounded(sum(found))
            case Power(base, exponent):
                inner = self(base)
                return MIXED if inner is MIXED else bounded(exponent * inner)
            case Call(_, argument):
                return 0 if self(argument) == 0 else MIXED
        return 0


def bounded(degree: int) -> int | None:
    return degree if abs(degree) <= HIGHEST else MIXED


def degrees_of(
    body: tuple[Step | Loop, ...], seeds: Degrees, rules: "Rules", termwise: frozenset[str], canonical: Canonical
) -> Degrees:
    """The degrees of everything that the steps name.

    seeds     those of what is read
    termwise  sums that are to have none, unless it is 0
    """
    degree = Degree(dict(seeds))
    found, before = degree.of_symbol, None
    lines = [step for step in steps(body) if step.kind != "put"]
    lets = {step.name: step.expression for step in lines if step.kind == "let"}
    changing = {step.name for step in lines if step.kind != "let"}
    empty = set(changing)  # sums to which nothing but zero has been added so far
    while found != before:  # a sum in a loop may be mixed by what comes later
        before = dict(found)
        for step in lines:
            own = of_step(step, degree, rules, canonical, lets)
            if step.name in termwise and own:
                own = MIXED
            if step.name not in changing:
                found[step.name] = own
            elif step.expression != ZERO:
                found[step.name] = own if step.name in empty or own == found[step.name] else MIXED
                empty.discard(step.name)
    return found


def of_step(
    step: Step, degree: Degree, rules: "Rules", canonical: Canonical, lets: Mapping[str, Expression]
) -> int | None:
    """The degree of a step; lets: what it may read, by name."""
    if step.name in rules.still:
        return 0
    if step.kind != "let" or step.name not in rules.slopes:
        return degree(step.expression)
    known = [(degree(Symbol(by)), by, slope) for by, slope in rules.slopes[step.name].items()]
    if any(k is MIXED for k, *_ in known):
        return MIXED
    whole = canonical.sum([canonical.product([number(k), slope, Symbol(by)]) for k, by, slope in known if k])
    known_to = {name: e for name, e in lets.items() if name not in rules.slopes[step.name]}
    for opened in (lambda e: e, lambda e: expanded(e, known_to, canonical)):
        own, found = opened(step.expression), opened(whole)
        multiples = {canonical.product([number(k), own]): k for k in range(-HIGHEST, HIGHEST + 1)}
        if found in multiples:
            return multiples[found]
    return MIXED


def expanded(e: Expression, values: Mapping[str, Expression], canonical: Canonical) -> Expression:
    """A sum of products, with what symbols stand for in their places."""
    if isinstance(e, Symbol):
        return expanded(values[e.name], values, canonical) if e.name in values else e
    parts = [expanded(part, values, canonical) for part in operands(e)]
    match e:
        case Sum():
            return canonical.sum(parts)
        case Product():
            found = [ONE]
            for part in parts or [e]:
                found = [canonical.product([a, b]) for a in found for b in terms_of(part)]
            return canonical.sum(found)
        case Power(_, exponent):
            return canonical.power(parts[0], exponent)
    return e


def terms_of(e: Expression) -> list[Expression]:
    """The terms of a sum, also of one under a minus sign."""
    value, factors = split_coefficient(e)
    if len(factors) != 1 or not isinstance(factors[0], Sum):
        return [e]
    return [Product((number(value), term)) for term in factors[0].terms]

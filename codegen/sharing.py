"""Sharing: what is computed twice gets a name, and what a loop does not change is computed before it.

share() rewrites a function's steps; no step is inlined, moved or joined with another, and each value stays
the same up to the order in which the factors of one product, or the terms of one sum, are taken. In order:
  - the loops' invariant factors of a product, and terms of a sum, are gathered, so that they can move out;
  - 1/x serves every division by x and by powers of x where 1/x is there at all;
  - pairs of factors that several products have in common become one product;
  - every subexpression with two users, or with a user in a deeper loop, becomes a `let` in its home: the
    innermost loop that its symbols need, before the first step there that needs it.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import chain, combinations

from .expressions import (
    Call,
    Expression,
    Number,
    Power,
    Product,
    Sum,
    Symbol,
    negated,
    operands,
    split_coefficient,
    symbols,
    with_coefficient,
    with_operands,
)
from .programs import CONSTANTS, Function, Loop, Step
from .scopes import Names, Placed, PlacedLoop, Scope, flat

LONGEST_NAME = 20


def share(function: Function) -> Function:
    """The same function with shared subexpressions, and a `load` step for every symbol that is read from an
    array.
    """
    names = Names(function)
    body = names.block(function.body)
    home = Homes(names.home)
    expressions = [gather(placed.step.expression, home) for placed in flat(body)]
    expressions = share_pairs(share_reciprocals(expressions))
    program = Program(function, names, home, iter(expressions))
    program.find_shared(zip(expressions, flat(body), strict=True))
    return replace(function, body=program.block(body, ()))


def unsigned(e: Expression) -> tuple[bool, Expression]:
    """(whether a minus sign stands before it, the rest)."""
    value, factors = split_coefficient(e)
    return (True, negated(e)) if value < 0 and factors else (False, e)


def nodes(e: Expression) -> Iterator[Expression]:
    """e and all of its subexpressions, from the inside out."""
    for part in operands(e):
        yield from nodes(part)
    yield e


def is_atom(e: Expression) -> bool:
    return isinstance(e, Number | Symbol)


@dataclass
class Homes:
    """The innermost loop that an expression needs."""

    of_symbol: dict[str, Scope]
    known: dict[Expression, Scope] = field(default_factory=dict)

    def __call__(self, e: Expression) -> Scope:
        if e not in self.known:
            self.known[e] = max((self.of_symbol[name] for name in symbols(e)), key=len, default=())
        return self.known[e]


# Gathering


def gather(e: Expression, home: Homes) -> Expression:
    """e with products and sums nested by how far out their parts can move, and powers by repeated
    squaring.
    """
    parts = [gather(part, home) for part in operands(e)]
    match e:
        case Power(_, exponent):
            return small_power(parts[0], exponent)
        case Product():
            value, factors = split_coefficient(with_operands(e, parts))
            product = nested(factors, abs(value), home)
            return negated(product) if value < 0 else product
        case Sum():
            return nested_sum(parts, home)
    return with_operands(e, parts)


def small_power(base: Expression, exponent: int) -> Expression:
    """A power whose exponents are -1, 2, -2, 3 or -3."""
    if abs(exponent) <= 3:
        return Power(base, exponent)
    square = small_power(Power(base, 2), exponent // 2 if exponent > 0 else -(-exponent // 2))
    if exponent % 2 == 0:
        return square
    return Product((base, square)) if exponent > 0 else Product((Power(base, -1), square))


def by_home(parts: Iterable[Expression], home: Homes) -> list[list[Expression]]:
    """Parts in the same home together, outermost home first."""
    groups: dict[int, list[Expression]] = {}
    for part in parts:
        groups.setdefault(len(home(part)), []).append(part)
    return [groups[depth] for depth in sorted(groups)]


def nested(factors: Iterable[Expression], value: Fraction, home: Homes) -> Expression:
    """The product of a positive number and the factors: ((number * outermost) * ...) * innermost."""
    product = None
    for group in by_home(factors, home):
        members = group if product is None else [product, *group]
        inner = members[0] if len(members) == 1 else Product(tuple(members))
        product = inner if product is not None or value == 1 else Product((Number(value), inner))
    assert product is not None
    return product


def nested_sum(terms: Iterable[Expression], home: Homes) -> Expression:
    """(outermost + ...) + innermost; a group of nothing but negative terms is the negative of a sum."""
    total = None
    for group in by_home(terms, home):
        members = group if total is None else [total, *group]
        if len(members) > 1 and all(unsigned(term)[0] for term in members):
            total = negated(Sum(tuple(map(negated, members))))
        else:
            total = members[0] if len(members) == 1 else Sum(tuple(members))
    assert total is not None
    return total


# Sharing what is not written as one subexpression


def replaced(e: Expression, change: Callable[[Expression], Expression]) -> Expression:
    """e with `change` applied to every subexpression, from the inside out."""
    return change(with_operands(e, [replaced(part, change) for part in operands(e)]))


def share_reciprocals(expressions: list[Expression]) -> list[Expression]:
    """x^-2 as (x^-1)^2 wherever x^-1 is there too."""
    inverted = {e.base for whole in expressions for e in nodes(whole) if isinstance(e, Power) and e.exponent == -1}

    def change(e: Expression) -> Expression:
        if isinstance(e, Power) and e.exponent < -1 and e.base in inverted:
            return Power(Power(e.base, -1), -e.exponent)
        return e

    return [replaced(whole, change) for whole in expressions]


def share_pairs(expressions: list[Expression]) -> list[Expression]:
    """Products nested so that a pair of factors which several have in common is one product. Most common
    pair first.
    """
    expressions = list(expressions)
    products = [products_in(whole) for whole in expressions]
    while True:
        different = dict.fromkeys(chain.from_iterable(products))
        pairs = Counter(
            pair for e in different for pair in combinations(e.factors, 2) if not isinstance(pair[0], Number)
        )
        best = max(pairs, key=lambda pair: pairs[pair], default=None)
        if best is None or pairs[best] < 2:
            return expressions

        def has(e: Expression, pair: tuple[Expression, ...] = best) -> bool:
            return isinstance(e, Product) and len(e.factors) > 2 and set(pair) <= set(e.factors)

        def change(e: Expression, pair: tuple[Expression, ...] = best) -> Expression:
            return Product((Product(pair), *(f for f in e.factors if f not in pair))) if has(e, pair) else e

        for place, own in enumerate(products):
            if any(map(has, own)):
                expressions[place] = replaced(expressions[place], change)
                products[place] = products_in(expressions[place])


def products_in(e: Expression) -> list[Product]:
    return [node for node in nodes(e) if isinstance(node, Product)]


# Naming


@dataclass
class Program:
    """Writes the steps again, with names for what is shared."""

    function: Function
    names: Names
    home: Homes
    expressions: Iterator[Expression]  # of the steps, in order
    shared: set[Expression] = field(default_factory=set)
    uses: Counter = field(default_factory=Counter)
    symbol: dict[Expression, Symbol] = field(default_factory=dict)  # what has its name already
    lines: dict[Scope, list[Step | Loop]] = field(default_factory=dict)
    loads: dict[Scope, set[str]] = field(default_factory=dict)
    taken: set[str] = field(init=False)

    def __post_init__(self) -> None:
        arrays = {a.name for a in (*self.function.arguments, *self.function.fields)}
        self.taken = {*arrays, *self.function.elements, *CONSTANTS, *self.names.plain.values()}

    def find_shared(self, uses: Iterable[tuple[Expression, Placed]]) -> None:
        for e, placed in uses:
            self.count(e, placed.scope)

    def count(self, e: Expression, user: Scope, is_repeated: bool = False) -> None:
        """One more use of e by something that is computed in the scope `user`."""
        _, e = unsigned(e)
        if is_atom(e):
            return
        self.uses[e] += 1
        if is_repeated or self.uses[e] > 1 or len(self.home(e)) < len(user):
            self.shared.add(e)
        if self.uses[e] == 1:
            for part in operands(e):
                self.count(part, self.home(e), isinstance(e, Power) and abs(e.exponent) > 1)

    def block(self, body: tuple[Placed | PlacedLoop, ...], scope: Scope) -> tuple[Step | Loop, ...]:
        lines, loads = self.lines.setdefault(scope, []), self.loads.setdefault(scope, set())
        for node in body:
            if isinstance(node, PlacedLoop):
                lines.append(Loop(node.scope[-1][0], self.block(node.body, node.scope)))
            else:
                lines.append(self.step(node.step, scope))
        return (*self.load_steps(loads), *lines)

    def load_steps(self, names: set[str]) -> list[Step]:
        """Reads of this scope's elements and constants, in the order of their declaration."""
        order = [*CONSTANTS, *self.function.elements]
        return [Step("load", name, target=self.function.elements.get(name)) for name in sorted(names, key=order.index)]

    def step(self, step: Step, scope: Scope) -> Step:
        e = next(self.expressions)
        if step.kind != "let":
            return replace(step, expression=self.value(e))
        name = self.names.plain[step.name]
        if e in self.shared and e not in self.symbol and self.home(e) == scope:
            expression = self.written(e)
            self.symbol[e] = Symbol(name)
        else:
            expression = self.value(e)
        return replace(step, name=name, expression=expression)

    def value(self, e: Expression) -> Expression:
        """e in terms of names; what it needs is written first."""
        negative, e = unsigned(e)
        value = self.unsigned_value(e)
        return negated(value) if negative else value

    def unsigned_value(self, e: Expression) -> Expression:
        if isinstance(e, Symbol):
            return self.read(e)
        if e in self.symbol:
            return self.symbol[e]
        written = self.written(e)
        if e not in self.shared:
            return written
        name = self.new_name(written)
        self.lines[self.home(e)].append(Step("let", name, written))
        self.symbol[e] = Symbol(name)
        return self.symbol[e]

    def written(self, e: Expression) -> Expression:
        return spliced(with_operands(e, [self.value(part) for part in operands(e)]))

    def read(self, e: Symbol) -> Symbol:
        name, home = self.names.plain[e.name], self.names.home[e.name]
        if self.names.elements.get((name, home)) == e.name:
            self.loads[home].add(name)
        return Symbol(name)

    def new_name(self, e: Expression) -> str:
        """A telling name for something simple, t1, t2, ... for the rest."""
        name = telling_name(e)
        if not name or len(name) > LONGEST_NAME or name in self.taken:
            name = next(f"t{k}" for k in range(1, len(self.taken) + 2) if f"t{k}" not in self.taken)
        self.taken.add(name)
        return name


def spliced(e: Expression) -> Expression:
    """e with products in a product, and sums in a sum, opened."""
    match e:
        case Product(factors):
            value, opened = Fraction(1), []
            for inner, rest in map(split_coefficient, factors):
                value *= inner
                opened.extend(rest)
            return with_coefficient(value, opened)
        case Sum(terms):
            opened = []
            for term in terms:
                negative, inner = unsigned(term)
                parts = inner.terms if isinstance(inner, Sum) else (inner,)
                opened.extend(map(negated, parts) if negative else parts)
            return Sum(tuple(opened))
    return e


def telling_name(e: Expression) -> str:
    """sin_chi, R_nu_1, R_per_l, inv_rho, rho_sq; empty where the expression is not that simple."""
    match e:
        case Call(function, Symbol(name)):
            return f"{function}_{name}"
        case Power(Symbol(name), exponent):
            inverse, size = "inv_" if exponent < 0 else "", {1: "", 2: "_sq", 3: "_cubed"}[abs(exponent)]
            return f"{inverse}{name}{size}"
        case Product(factors) if len(factors) <= 3:
            above = [telling_name(f) or name_of(f) for f in factors if not is_inverse(f)]
            below = [telling_name(Power(f.base, -f.exponent)) for f in factors if is_inverse(f)]
            if above and all(above) and all(below):
                return "_per_".join(["_".join(above), *below])
    return ""


def is_inverse(e: Expression) -> bool:
    return isinstance(e, Power) and e.exponent < 0


def name_of(e: Expression) -> str:
    return e.name if isinstance(e, Symbol) else ""

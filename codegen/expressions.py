"""Expressions, immutable and canonical: one text for one expression, whichever Maxima printed it.

The data's form (JSON)                     here
  7, "symbol", ["/", p, q]                 Number, Symbol, Number
  ["+", e, ...]  ["*", e, ...]             Sum, Product
  ["^", e, k]                              Power, k an integer
  ["sin", e]  ["cos", e]  ["sqrt", e]      Call
  ["sum_i", e] and the other SUMS          Call, in equations that are shown

Canonical means, bottom up:
  - sums and products are flat, sorted by an Order, without repeated terms or factors, numbers gathered;
  - a sum's sign is settled (most terms positive; of two choices the one with a positive first term), and what
    is left of it moves out: into the product, the power, the sine;
  - nothing is distributed, factored or inlined. Changes of sign are exact, so values change only as far as
    the order of terms and factors changes rounding.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import isqrt

FUNCTIONS = ("sin", "cos", "sqrt", "exp")
SUMS = ("sum_i", "sum_ij", "sum_j")  # over wheels, their free rollers, those of one wheel: linear


@dataclass(frozen=True, slots=True)
class Number:
    value: Fraction


@dataclass(frozen=True, slots=True)
class Symbol:
    name: str


@dataclass(frozen=True, slots=True)
class Sum:
    terms: tuple["Expression", ...]


@dataclass(frozen=True, slots=True)
class Product:
    factors: tuple["Expression", ...]


@dataclass(frozen=True, slots=True)
class Power:
    base: "Expression"
    exponent: int


@dataclass(frozen=True, slots=True)
class Call:
    function: str
    argument: "Expression"


Expression = Number | Symbol | Sum | Product | Power | Call
ZERO, ONE = Number(Fraction(0)), Number(Fraction(1))


def number(value: int | Fraction) -> Number:
    return Number(Fraction(value))


def operands(e: Expression) -> tuple[Expression, ...]:
    """The direct subexpressions of e."""
    match e:
        case Sum(terms):
            return terms
        case Product(factors):
            return factors
        case Power(base, _):
            return (base,)
        case Call(_, argument):
            return (argument,)
    return ()


def with_operands(e: Expression, new: Sequence[Expression]) -> Expression:
    """e with other direct subexpressions, in the same places. Nothing is sorted."""
    match e:
        case Sum():
            return Sum(tuple(new))
        case Product():
            return Product(tuple(new))
        case Power(_, exponent):
            return Power(new[0], exponent)
        case Call(function, _):
            return Call(function, new[0])
    return e


def symbols(e: Expression) -> set[str]:
    """Names of the symbols in e."""
    if isinstance(e, Symbol):
        return {e.name}
    return set().union(*map(symbols, operands(e)))


def split_coefficient(e: Expression) -> tuple[Fraction, tuple[Expression, ...]]:
    """e as (number, other factors)."""
    match e:
        case Number(value):
            return value, ()
        case Product((Number(value), *rest)):
            return value, tuple(rest)
        case Product(factors):
            return Fraction(1), factors
    return Fraction(1), (e,)


def with_coefficient(value: Fraction, factors: Sequence[Expression]) -> Expression:
    """The inverse of split_coefficient."""
    if not factors or value == 0:
        return Number(value)
    if value != 1:
        return Product((Number(value), *factors))
    return factors[0] if len(factors) == 1 else Product(tuple(factors))


def negated(e: Expression) -> Expression:
    value, factors = split_coefficient(e)
    return with_coefficient(-value, factors)


def natural(name: str) -> tuple:
    """Sort key of a name: nu_2 before nu_10, upper and lower case differ, in a fixed order."""
    return tuple(
        (not part.isdigit(), int(part) if part.isdigit() else 0, part) for part in re.split(r"(\d+)", name) if part
    )


@dataclass
class Order:
    """The total order of expressions: symbols by their place in `names`, all others after them by name."""

    names: Iterable[str] = ()
    rank: dict[str, int] = field(init=False)
    known: dict[Expression, tuple] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.rank = {name: place for place, name in enumerate(dict.fromkeys(self.names))}

    def factor(self, e: Expression) -> tuple:
        """Key of e as a factor: powers beside their bases, what divides last."""
        if e not in self.known:
            self.known[e] = self._factor(e)
        return self.known[e]

    def _factor(self, e: Expression) -> tuple:
        base, exponent = (e.base, e.exponent) if isinstance(e, Power) else (e, 1)
        match base:
            case Number(value):
                key: tuple = (0, value)
            case Symbol(name):
                key = (1, self.rank.get(name, len(self.rank)), natural(name))
            case Call(function, argument):
                key = (2, (*FUNCTIONS, *SUMS).index(function), self.factor(argument))
            case Sum(terms):
                key = (3, tuple(map(self.term, terms)))
            case _:
                key = (4, tuple(map(self.factor, operands(base))))
        return exponent < 0, key, exponent

    def term(self, e: Expression) -> tuple:
        """Key of e as a term: by its factors, the numerical one last."""
        value, factors = split_coefficient(e)
        return tuple(map(self.factor, factors)), value


class Canonical:
    """Builds canonical expressions under one Order."""

    def __init__(self, order: Order | None = None):
        self.order = order or Order()

    def sum(self, terms: Iterable[Expression]) -> Expression:
        gathered: dict[tuple[Expression, ...], Fraction] = {}
        for value, factors in self._flat_terms(terms):
            gathered[factors] = gathered.get(factors, Fraction(0)) + value
        kept = [with_coefficient(value, factors) for factors, value in gathered.items() if value]
        kept.sort(key=self.order.term)
        if len(kept) < 2:
            return kept[0] if kept else ZERO
        signs = [split_coefficient(term)[0] > 0 for term in kept]
        positive = sum(signs)
        if 2 * positive > len(kept) or (2 * positive == len(kept) and signs[0]):
            return Sum(tuple(kept))
        return Product((number(-1), Sum(tuple(map(negated, kept)))))

    def _flat_terms(self, terms: Iterable[Expression]) -> Iterable[tuple[Fraction, tuple[Expression, ...]]]:
        """Terms as (number, factors); sums within, also those under a minus sign, are opened."""
        for term in terms:
            value, factors = split_coefficient(term)
            if abs(value) == 1 and len(factors) == 1 and isinstance(factors[0], Sum):
                for inner, rest in map(split_coefficient, factors[0].terms):
                    yield value * inner, rest
            else:
                yield value, factors

    def product(self, factors: Iterable[Expression]) -> Expression:
        coefficient = Fraction(1)
        exponents: dict[Expression, int] = {}
        for factor in factors:
            value, rest = split_coefficient(factor)
            coefficient *= value
            for e in rest:
                base, exponent = (e.base, e.exponent) if isinstance(e, Power) else (e, 1)
                exponents[base] = exponents.get(base, 0) + exponent
        kept = [base if k == 1 else Power(base, k) for base, k in exponents.items() if k]
        kept.sort(key=self.order.factor)
        return with_coefficient(coefficient, kept)

    def power(self, base: Expression, exponent: int) -> Expression:
        value, factors = split_coefficient(base)
        raised = (Power(f.base, f.exponent * exponent) if isinstance(f, Power) else Power(f, exponent) for f in factors)
        return self.product([number(value**exponent), *raised])

    def call(self, function: str, argument: Expression) -> Expression:
        """sin, cos, sqrt or exp, or a sum; an odd or even function takes the sign of its argument out."""
        value, factors = split_coefficient(argument)
        if function in SUMS:
            if factors and isinstance(factors[0], Sum):  # a sum keeps its signs
                return Call(function, argument)
            return self.product([number(value), Call(function, with_coefficient(Fraction(1), factors))])
        if function == "exp":
            return ONE if argument == ZERO else Call(function, argument)
        if function == "sqrt":
            root = rational_root(argument.value) if isinstance(argument, Number) else None
            return Call(function, argument) if root is None else Number(root)
        if not factors and value == 0:
            return ZERO if function == "sin" else ONE
        if value > 0:
            return Call(function, argument)
        positive = Call(function, negated(argument))
        return negated(positive) if function == "sin" else positive

    def substituted(self, e: Expression, values: Mapping[str, Expression]) -> Expression:
        """e with symbols replaced, canonical anew; e itself where it has none of them."""
        if not symbols(e) & values.keys():
            return e
        match e:
            case Symbol(name):
                return values[name]
            case Power(base, exponent):
                return self.power(self.substituted(base, values), exponent)
            case Call(function, argument):
                return self.call(function, self.substituted(argument, values))
        parts = [self.substituted(part, values) for part in operands(e)]
        return self.sum(parts) if isinstance(e, Sum) else self.product(parts)

    def read(self, data: object) -> Expression:
        """The canonical expression of the JSON form. ValueError says what is not of that form."""
        match data:
            case bool():
                pass
            case int():
                return number(data)
            case str():
                return Symbol(data)
            case ["/", int(p), int(q)] if q != 0:
                return number(Fraction(p, q))
            case ["+", *terms] if terms:
                return self.sum(map(self.read, terms))
            case ["*", *factors] if factors:
                return self.product(map(self.read, factors))
            case ["^", base, int(exponent)] if not isinstance(exponent, bool):
                return self.power(self.read(base), exponent)
            case [str(function), argument] if function in FUNCTIONS or function in SUMS:
                return self.call(function, self.read(argument))
        raise ValueError(f"not an expression: {data!r}")


def rational_root(value: Fraction) -> Fraction | None:
    """The square root of a rational number where that is rational."""
    if value < 0:
        return None
    p, q = isqrt(value.numerator), isqrt(value.denominator)
    return Fraction(p, q) if p * p == value.numerator and q * q == value.denominator else None


def to_json(e: Expression) -> object:
    """The JSON form of e, its terms and factors in their present order."""
    match e:
        case Number(value):
            return int(value) if value.denominator == 1 else ["/", value.numerator, value.denominator]
        case Symbol(name):
            return name
        case Sum(terms):
            return ["+", *map(to_json, terms)]
        case Product(factors):
            return ["*", *map(to_json, factors)]
        case Power(base, exponent):
            return ["^", to_json(base), exponent]
        case Call(function, argument):
            return [function, to_json(argument)]

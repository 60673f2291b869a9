"""LaTeX of equations."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from .expressions import (
    ONE,
    SUMS,
    Call,
    Expression,
    Number,
    Power,
    Sum,
    Symbol,
    negated,
    number,
    split_coefficient,
    with_coefficient,
)
from .infix import has_negative_term, is_negative, reads_as_sum

SIGNS = {"sum_i": r"\sum_{i=1}^{N}", "sum_ij": r"\sum_{i=1}^{N} \sum_{j=2}^{n}", "sum_j": r"\sum_{j=2}^{n}"}
WIDEST = 75  # letters of a line; a fraction is as wide as the longer of its two sides


@dataclass
class Latex:
    """names: LaTeX of the symbols; a symbol that is not there keeps its name, with what follows _ as its
    index.
    """

    names: dict[str, str]

    def expression(self, e: Expression) -> str:
        match e:
            case Number(value):
                return self.fraction([str(abs(value.numerator))], self.side(value.denominator, []), value < 0)
            case Symbol(name):
                return self.symbol(name)
            case Call(function, argument) if function in SUMS:
                return f"{SIGNS[function]} {self.summand(argument)}"
            case Call("sqrt", argument):
                return rf"\sqrt{{{self.expression(argument)}}}"
            case Call(function, argument):
                return rf"\{function} {self.argument(argument)}"
            case Sum(terms):
                return self.sum(terms)
            case Power(base, exponent) if exponent > 0:
                return self.power(base, exponent)
            case _:
                return self.product(e)

    def symbol(self, name: str) -> str:
        if name in self.names:
            return self.names[name]
        stem, *indices = name.split("_")
        stem = stem if len(stem) == 1 or stem.isdigit() else rf"\mathrm{{{stem}}}"
        return f"{stem}_{{{','.join(indices)}}}" if indices else stem

    def summand(self, e: Expression) -> str:
        return rf"\left({self.expression(e)}\right)" if reads_as_sum(e) else self.expression(e)

    def argument(self, e: Expression) -> str:
        return self.symbol(e.name) if isinstance(e, Symbol) else rf"\left({self.expression(e)}\right)"

    def sum(self, terms: tuple[Expression, ...]) -> str:
        first = next((term for term in terms if not is_negative(term)), terms[0])
        rest = [(is_negative(t), negated(t) if is_negative(t) else t) for t in terms if t is not first]
        return self.expression(first) + "".join(f" {'-' if m else '+'} {self.term(t)}" for m, t in rest)

    def term(self, e: Expression) -> str:
        return rf"\left({self.expression(e)}\right)" if isinstance(e, Sum) else self.expression(e)

    def product(self, e: Expression) -> str:
        value, factors = split_coefficient(e)
        if reads_as_sum(e) and value == -1:
            return self.sum(tuple(map(negated, factors[0].terms)))
        above = [f for f in factors if not (isinstance(f, Power) and f.exponent < 0)]
        turned = next((place for place, f in enumerate(above) if value < 0 and has_negative_term(f)), None)
        if turned is not None:  # -a (b - c) as a (c - b)
            value, above[turned] = -value, Sum(tuple(map(negated, above[turned].terms)))
        below = [raised(f.base, -f.exponent) for f in factors if isinstance(f, Power) and f.exponent < 0]
        top, bottom = self.side(abs(value.numerator), above), self.side(value.denominator, below)
        if bottom and len(above) == len(top) == 1:
            top = [self.expression(above[0])]
        if len(below) == len(bottom) == 1:
            bottom = [self.expression(below[0])]
        return self.fraction(top or ["1"], bottom, value < 0)

    def side(self, value: int, factors: list[Expression]) -> list[str]:
        """The factors on one side of the stroke, without a factor 1."""
        return [str(value)] * (value != 1) + [self.factor(f) for f in factors]

    def factor(self, e: Expression) -> str:
        match e:
            case Power():
                return self.power(e.base, e.exponent)
            case Sum():
                return rf"\left({self.expression(e)}\right)"
        return self.expression(e)

    def power(self, base: Expression, exponent: int) -> str:
        match base:
            case Symbol(name):
                return f"{{{self.symbol(name)}}}^{{{exponent}}}"
            case Call("sin" | "cos" as function, argument):
                return rf"\{function}^{{{exponent}}} {self.argument(argument)}"
        return rf"\left({self.expression(base)}\right)^{{{exponent}}}"

    def fraction(self, above: list[str], below: list[str], negative: bool) -> str:
        text = rf"\frac{{{joined(above)}}}{{{joined(below)}}}" if below else joined(above)
        return f"-{text}" if negative else text

    def lines(self, e: Expression) -> list[str]:
        """A long sum, or a product with one, in lines that fit a page; a sum over wheels begins a line."""
        parts = summands(e)
        over = [part for part in parts if is_sum_over(part)]
        if over and width(self.expression(e)) > WIDEST:
            others = tuple(part for part in parts if part not in over)
            lines = self.lines(Sum(others) if len(others) > 1 else others[0]) if others else []
            for part in over:
                lines += self.lines_over(part, is_added=bool(lines))
            return lines
        value, factors = split_coefficient(e)
        long = [f for f in factors if isinstance(f, Sum)]
        if not long or width(self.expression(e)) <= WIDEST:
            return [self.expression(e)]
        terms = long[0].terms if value > 0 else tuple(map(negated, long[0].terms))
        others = with_coefficient(abs(value), [f for f in factors if f is not long[0]])
        first, *rest = self.filled(terms)
        lines = [self.sum(first), *map(self.continued, rest)]
        if others == ONE:
            return lines
        if not rest:
            return [rf"{self.expression(others)} \left( {lines[0]} \right)"]
        return [rf"{self.expression(others)} \Bigl( {lines[0]}", *lines[1:-1], rf"{lines[-1]} \Bigr)"]

    def lines_over(self, part: Expression, is_added: bool) -> list[str]:
        """A sum over wheels, with its sign where it is added to something."""
        value, (sum_over,) = split_coefficient(part)
        sign = "- " if value < 0 else "+ " * is_added
        factor = "" if abs(value) == 1 else rf"{self.expression(number(abs(value)))} \, "
        head, lines = f"{sign}{factor}{SIGNS[sum_over.function]}", self.lines(sum_over.argument)
        if len(lines) == 1:
            return [f"{head} {self.summand(sum_over.argument)}"]
        return [rf"{head} \Bigl( {lines[0]}", *lines[1:-1], rf"{lines[-1]} \Bigr)"]

    def filled(self, terms: tuple[Expression, ...]) -> list[tuple[Expression, ...]]:
        """The terms in lines: as many in each as fit."""
        lines, room = [[terms[0]]], WIDEST - width(self.term(terms[0]))
        for term in terms[1:]:
            room -= width(self.term(term)) + 2
            if room < 0:
                lines.append([])
                room = WIDEST - width(self.term(term))
            lines[-1].append(term)
        return list(map(tuple, lines))

    def continued(self, terms: tuple[Expression, ...]) -> str:
        return "".join(
            f" {'-' if is_negative(t) else '+'} {self.term(negated(t) if is_negative(t) else t)}" for t in terms
        ).strip()


def symbol_names(symbols: Mapping[str, dict], equations: Mapping[str, dict]) -> dict[str, str]:
    """LaTeX of the symbols by name: of the table of symbols, and of those that equations have besides."""
    return {name: entry["latex"] for name, entry in symbols.items()} | equations.get("equation_symbols", {})


def matrix_of(latex: Latex, rows: list[list], read: Callable[[object], Expression]) -> str:
    """A matrix of expressions as data."""
    text = " \\\\\n".join(" & ".join(latex.expression(read(entry)) for entry in row) for row in rows)
    return f"\\begin{{pmatrix}}\n{text}\n\\end{{pmatrix}}"


def summands(e: Expression) -> tuple[Expression, ...]:
    """What e is the sum of: its terms, where it is a sum or minus one."""
    if not reads_as_sum(e):
        return (e,)
    value, factors = split_coefficient(e)
    return factors[0].terms if value > 0 else tuple(map(negated, factors[0].terms))


def is_sum_over(e: Expression) -> bool:
    """A sum over wheels or their rollers, times a number."""
    _, factors = split_coefficient(e)
    return len(factors) == 1 and isinstance(factors[0], Call) and factors[0].function in SUMS


def width(text: str) -> int:
    """About how many letters wide LaTeX is; a fraction is as wide as its longer side."""
    while (fraction := re.search(r"\\frac\{((?:[^{}]|\{[^{}]*\})*)\}\{((?:[^{}]|\{[^{}]*\})*)\}", text)) is not None:
        longer = max(width(fraction[1]), width(fraction[2]))
        text = text[: fraction.start()] + "x" * longer + text[fraction.end() :]
    text = re.sub(r"\\(?:sin|cos|sqrt)\b", "xxx", text)
    text = re.sub(r"\\(?:left|right|Bigl|Bigr|mathrm|,|dot)", "", text)
    return len(re.sub(r"[\s{}_^]", "", re.sub(r"\\[A-Za-z]+", "x", text)))


def raised(base: Expression, exponent: int) -> Expression:
    return base if exponent == 1 else Power(base, exponent)


def joined(factors: list[str]) -> str:
    return r" \, ".join(factors)


def escaped(text: str) -> str:
    """Plain text for LaTeX."""
    text = re.sub(r"([&%$#_{}])", r"\\\1", text.replace("\\", r"\textbackslash "))
    return text.replace("~", r"\textasciitilde ").replace("^", r"\textasciicircum ")

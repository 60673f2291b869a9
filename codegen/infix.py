"""Infix notation, as C and Python share it. Each language says how it writes a symbol, a function and a
ratio.
"""

from .expressions import Call, Expression, Number, Sum, Symbol, negated, split_coefficient
from .operations import fraction
from .programs import INDICES, ContractError, Function, steps

OWN_NAMES = frozenset({*INDICES, "wheels", "rollers_per_wheel", "model", "slots"})


class Infix:
    def symbol(self, name: str) -> str:
        raise NotImplementedError

    def call(self, function: str, argument: str) -> str:
        raise NotImplementedError

    def ratio(self, p: int, q: int) -> str:
        """A rational number that stands alone, p/q with q > 1."""
        raise NotImplementedError

    def expression(self, e: Expression) -> str:
        match e:
            case Number(value):
                return str(value) if value.denominator == 1 else self.ratio(value.numerator, value.denominator)
            case Symbol(name):
                return self.symbol(name)
            case Call(function, argument):
                return self.call(function, self.expression(argument))
            case Sum(terms):
                return self.sum(terms)
            case _:
                return self.product(e)

    def sum(self, terms: tuple[Expression, ...]) -> str:
        """Terms in their order, but a positive one first where there is any."""
        first = next((term for term in terms if not is_negative(term)), terms[0])
        text = self.expression(first)
        for term in terms:
            if term is first:
                continue
            text += f" - {self.term(negated(term))}" if is_negative(term) else f" + {self.term(term)}"
        return text

    def term(self, e: Expression) -> str:
        """What is added to something else; a sum in brackets, so that a motion and its mirror image round alike."""
        return f"({self.expression(e)})" if reads_as_sum(e) else self.expression(e)

    def product(self, e: Expression) -> str:
        value, factors = split_coefficient(e)
        if reads_as_sum(e):
            return self.sum(tuple(map(negated, factors[0].terms)))
        above, below, _ = fraction(e)
        turned = next((place for place, f in enumerate(above) if value < 0 and has_negative_term(f)), None)
        if turned is not None:  # -a*(b - c) as a*(c - b)
            value, above[turned] = -value, Sum(tuple(map(negated, above[turned].terms)))
        text = "*".join(map(self.factor, above)) or "1"
        if below:
            divisor = "*".join(map(self.factor, below))
            text += f"/({divisor})" if len(below) > 1 else f"/{divisor}"
        return f"-{text}" if value < 0 else text

    def factor(self, e: Expression) -> str:
        is_simple = isinstance(e, Symbol | Call) or isinstance(e, Number) and e.value.denominator == 1
        return self.expression(e) if is_simple else f"({self.expression(e)})"


def reads_as_sum(e: Expression) -> bool:
    """A sum, or minus a sum."""
    value, factors = split_coefficient(e)
    return isinstance(e, Sum) or value == -1 and len(factors) == 1 and isinstance(factors[0], Sum)


def is_negative(e: Expression) -> bool:
    return split_coefficient(e)[0] < 0


def has_negative_term(e: Expression) -> bool:
    return isinstance(e, Sum) and any(map(is_negative, e.terms))


def broken(line: str, width: int = 110) -> str:
    """A long line broken before its outermost plus and minus signs; what follows is indented by four more
    spaces.
    """
    lines, indent = [], " " * (len(line) - len(line.lstrip()) + 4)
    while len(line) > width:
        place = _break(line, width)
        if place is None:
            break
        lines.append(line[:place])
        line = indent + line[place + 1 :]
    return "\n".join([*lines, line])


def _break(line: str, width: int) -> int | None:
    """The last of the least nested places before an operator."""
    start, depth = len(line) - len(line.lstrip()), 0
    places: dict[int, int] = {}
    for place, character in enumerate(line[:width]):
        depth += (character in "([") - (character in ")]")
        if place > start and line[place : place + 3] in (" + ", " - "):
            places[depth] = place
    return places[min(places)] if places else None


def local_names(function: Function, reserved: frozenset[str]) -> dict[str, str]:
    """Names that a language's text gives to symbols which are called like an argument or a word of the
    language.

    A wheel's element gets its index, so that chi of chi[i] reads chi_i; all else gets an underscore.
    """
    reserved = reserved | OWN_NAMES | {a.name for a in function.arguments}
    used = {step.name for step in steps(function.body) if step.kind in ("load", "let", "var")}
    taken, names = used | reserved, {}
    for symbol in sorted(used & reserved - {a.name for a in function.inputs if not a.shape}):
        element = function.elements.get(symbol)
        letters = "".join(str(k) for k in element.index) if element else ""
        names[symbol] = f"{symbol}_{letters}"
        if names[symbol] in taken:
            raise ContractError(f"{function.set}.{function.name}: no free name for {symbol}")
    return names

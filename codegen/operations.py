"""How much work a function is, counted on the steps as they are printed."""

from collections import Counter

from .expressions import Call, Expression, Number, Power, Product, Sum, number, operands
from .programs import EARLIER, Function, Loop, Step, steps

KINDS = ("add", "mul", "div", "sqrt", "sincos", "exp")
PLACES = {(): "once", ("i",): "wheel", ("i", "j"): "roller", ("j",): "slot"}
OF_PAIRS = {("i", "k"): "pair", ("i", EARLIER): "earlier"}  # of functions that have such loops


def count_operations(function: Function) -> dict[str, dict[str, int]]:
    """{place: {kind: number}}. Places: once; wheel, slot: for each turn of that loop; roller: for each turn
    of both. Where a function has them: pair, for each wheel, for each wheel; earlier, for each wheel, for each wheel
    before it.

    A product with a power of two counts as one multiplication; sine and cosine count as one each; signs are
    free.
    """
    counts = {place: Counter(dict.fromkeys(KINDS, 0)) for place in PLACES.values()}

    def walk(body: tuple[Step | Loop, ...], around: tuple[str, ...]) -> None:
        for node in body:
            if isinstance(node, Loop):
                walk(node.body, (*around, node.index))
            elif node.expression is not None:
                place = (PLACES | OF_PAIRS)[around]
                counts.setdefault(place, Counter(dict.fromkeys(KINDS, 0)))
                counts[place] += operations(node.expression)
                counts[place]["add"] += node.kind == "add"

    walk(function.body, ())
    return {place: {kind: counted[kind] for kind in KINDS} for place, counted in counts.items()}


def count_intermediates(function: Function) -> int:
    """Number of local values that are computed (not read)."""
    return sum(step.kind in ("let", "var") for step in steps(function.body))


def called_functions(function: Function) -> set[str]:
    """Names of the elementary functions that it calls."""

    waiting = [step.expression for step in steps(function.body) if step.expression is not None]
    found = set()
    while waiting:
        e = waiting.pop()
        waiting.extend(operands(e))
        if isinstance(e, Call):
            found.add(e.function)
    return found


def operations(e: Expression) -> Counter:
    total = sum(map(operations, operands(e)), Counter())
    match e:
        case Sum(terms):
            total["add"] += len(terms) - 1
        case Call(function, _):
            total["sincos" if function in ("sin", "cos") else function] += 1
        case Product() | Power():
            above, below, scale = fraction(e)
            total["mul"] += max(len(above) - 1, 0) + max(len(below) - 1, 0)
            only_scale = len(below) == 1 and scale > 1
            total["mul" if only_scale and scale & (scale - 1) == 0 else "div"] += bool(below)
    return total


def fraction(e: Expression) -> tuple[list[Expression], list[Expression], int]:
    """A product or power as it is printed: what is multiplied above and below the stroke (powers written
    out, signs and ones left out), and the integer factor below."""
    above: list[Expression] = []
    below: list[Expression] = []
    scale = 1
    for factor in e.factors if isinstance(e, Product) else (e,):
        match factor:
            case Number(value):
                scale = value.denominator
                above.extend([Number(abs(value * scale))] if abs(value.numerator) != 1 else [])
                below.extend([number(scale)] if scale != 1 else [])
            case Power(base, exponent):
                (above if exponent > 0 else below).extend([base] * abs(exponent))
            case _:
                above.append(factor)
    return above, below, scale

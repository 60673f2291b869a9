"""A set whose functions are differentiated along any direction: of their arguments, and of the model's constants.

The steps of a function are those that run, with the slope of each beside it (tangents.py); the slopes of what it reads
are further arguments, and further fields of the model, named after it: `chi` and `chi_along`. `prepare` gives these
fields from the slopes of its own arguments.

A set is asked for this by the effect "derivatives_along". It has such functions alone: they give what the function
gives, and then the slopes. Beside "derivatives" a set has a few of them for a model that stays as it is: those of a
switch, and with "second_derivatives" those of the derivatives.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from .expressions import Canonical, Expression, Order, Symbol, symbols
from .programs import CONSTANTS, Array, Element, Function, Loop, Step, steps, without_dead_steps
from .tangents import Body, Column, Rules, Tangents, in_order, slope_name

ALONG, SECOND = "derivatives_along", "second_derivatives"
IMPACT = "impact"
BEFORE_IMPACT = ("contact_axial", "wheel_rates")  # how the rollers at the ground spin: the first that there is
FIRST = ("forward_dynamics_derivatives", "rate_derivatives", "momenta_derivatives")
SUFFIX = "_along"
SHARP = "_sharp"


def along_name(name: str) -> str:
    """The function with slopes; its form for sharp tips ends as the function's own does."""
    return f"{name.removesuffix(SHARP)}{SUFFIX}{SHARP if name.endswith(SHARP) else ''}"


def moved(array: Array) -> Array:
    """What has the slope of an array, in the direction."""
    return replace(array, name=array.name + SUFFIX, meaning=f"slope of {array.name} in the direction")


@dataclass(frozen=True)
class Along:
    """The functions of a set with their slopes in a direction.

    rules     of slopes
    known     steps by name that a rule may read and the function lacks, since it does not need them itself
    values    that symbols have in these
    is_fixed  whether the model stays as it is
    """

    rules: Rules
    known: Mapping[str, Step]
    values: Mapping[str, Expression]
    is_fixed: bool = False

    @classmethod
    def of(
        cls, rules: Rules, functions: Iterable[Function], values: Mapping[str, Expression], is_fixed: bool = False
    ) -> "Along":
        """Where a rule may read what one of these functions computes, with the values that symbols have."""
        known = {step.name: step for f in functions for step in steps(f.body) if step.kind == "let"}
        return cls(rules, known, values, is_fixed)

    def functions(
        self, functions: Sequence[Function], fields: tuple[Array, ...]
    ) -> tuple[list[Function], tuple[Array, ...]]:
        extended = (*fields, *map(moved, fields))
        return [self.function(f, extended) for f in functions], extended

    def beside(self, functions: Sequence[Function], present: Collection[str]) -> list[Function]:
        """What a set that was asked for derivatives has of such functions, beside its own."""
        there = {f.name for f in functions}
        wanted = {*(FIRST if SECOND in present else ())}
        if "derivatives" in present and IMPACT in there:
            wanted |= {IMPACT, next(name for name in BEFORE_IMPACT if name in there)}
        return [self.function(f, f.fields) for f in functions if f.name.removesuffix(SHARP) in wanted]

    def function(self, function: Function, fields: tuple[Array, ...]) -> Function:
        there = {*function.elements, *CONSTANTS}
        body = self._with_what_rules_read(function.body, there)
        names = [*function.elements, *(step.name for step in steps(body)), *CONSTANTS]
        tangents = Tangents(Canonical(Order(names)), self.rules)
        column = Column("along", {}, lambda e: Element(moved(e.array), e.index))
        held = {field.name for field in fields} if self.is_fixed else set()
        moving = {symbol: e for symbol, e in function.elements.items() if e.array.name not in held}
        seeds = {symbol: Symbol(slope_name(symbol, column)) for symbol in moving}
        body = tangents.carried(body, [replace(column, seeds=seeds)])
        elements = {slope_name(symbol, column): column.target(e) for symbol, e in moving.items()}
        inputs, outputs = function.inputs, function.outputs
        return without_dead_steps(replace(
            function, name=function.name if function.prepares else along_name(function.name), body=body, fields=fields,
            summary=f"{function.summary[:-1]}; and the slopes in a direction.",
            elements=function.elements | elements,
            arguments=(*inputs, *map(moved, inputs), *outputs, *map(moved, outputs)),
        ))  # fmt: skip

    def _with_what_rules_read(self, body: Body, there: set[str]) -> Body:
        """The steps, in each loop behind those that the rules of its own steps read and it lacks."""
        there = there | {node.name for node in body if isinstance(node, Step)}
        needed: dict[str, Step] = {}
        for node in body:
            rule = self.rules.slopes.get(node.name, {}) if isinstance(node, Step) and node.kind == "let" else {}
            for by, slope in rule.items():
                if by in there:
                    self._need(symbols(slope) - there, there, needed)
        whole = [self._inside(node, there) for node in (*needed.values(), *body)]
        return in_order(whole) if needed else tuple(whole)

    def _inside(self, node: Step | Loop, there: set[str]) -> Step | Loop:
        return replace(node, body=self._with_what_rules_read(node.body, there)) if isinstance(node, Loop) else node

    def _need(self, names: set[str], there: set[str], needed: dict[str, Step]) -> None:
        for name in sorted(names - needed.keys()):
            step = self.known[name]
            if symbols(step.expression) & self.values.keys():
                step = replace(step, expression=Canonical().substituted(step.expression, self.values))
            self._need(symbols(step.expression) - there, there, needed)
            needed[name] = step

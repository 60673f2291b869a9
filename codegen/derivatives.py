"""The derivatives by numbers of the vehicle that a set was asked for.

Maxima says which functions there are (effects/derivatives.mac, "derivatives" in the data) and the rules of slopes; the
derivatives by state and inputs are programs of its own. Here functions are differentiated as they are computed
(tangents.py). A number of the vehicle reaches a function through the constants of the model: `prepare` is
differentiated once, and its slopes are further constants of the model.

A set is asked for a number by the effect "derivatives_by_" and the number's name, as `prepare` takes it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

from .expressions import ONE, Canonical, Expression, Number, Order, Symbol, symbols
from .programs import CONSTANTS, Array, ContractError, Element, Function, Loop, Step, steps, without_dead_steps
from .tangents import Body, Column, Rules, Tangents, changes_in_loops

REQUEST = "derivatives_by_"
BY_NUMBERS = "_by_numbers"
SHARP = "_sharp"


@dataclass(frozen=True)
class Direction:
    """One component of a number: its name, the number as `prepare` takes it, the component within a wheel's."""

    name: str
    array: Array
    component: tuple[int, ...]

    @property
    def for_each_wheel(self) -> bool:
        return "N" in self.array.shape


@dataclass(frozen=True)
class Derivatives:
    """What the data says of derivatives.

    rules       of slopes
    by_numbers  the functions that are differentiated by numbers
    """

    rules: Rules
    by_numbers: Sequence[str]

    @classmethod
    def read(cls, data: Mapping) -> "Derivatives":
        return cls(Rules.read(data.get("rules", ())), tuple(data.get("by_numbers", ())))

    def added(
        self, functions: Sequence[Function], fields: tuple[Array, ...], effects: Sequence[str]
    ) -> tuple[list[Function], tuple[Array, ...]]:
        """The functions of a set and the fields of its model, with the derivatives that these effects ask for."""
        named = {f.name: f for f in functions}
        found = list(functions)
        asked = [effect.removeprefix(REQUEST) for effect in effects if effect.startswith(REQUEST)]
        if not asked:
            return found, fields
        wanted = [named[n] for name in self.by_numbers for n in (name, name + SHARP) if n in named]
        numbers = Numbers(self.rules, named["prepare"], wanted, asked)
        extended = tuple(fields) + numbers.fields
        found = [numbers.prepare if f.prepares else f for f in found] + [numbers.function(f) for f in wanted]
        return [replace(f, fields=extended) if f.fields else f for f in found], extended


def tangents_of(function: Function, rules: Rules) -> Tangents:
    names = [*function.elements, *(step.name for step in steps(function.body)), *CONSTANTS]
    return Tangents(Canonical(Order(names)), rules)


class Numbers:
    """Derivatives of functions by numbers of the vehicle.

    fields   the slopes of the model's fields
    prepare  the function that computes these too
    """

    def __init__(self, rules: Rules, prepare: Function, wanted: Sequence[Function], asked: Sequence[str]):
        self.rules = rules
        self.directions = list(self._directions(prepare, asked))
        read = set().union(*(symbols(step.expression) for f in wanted for step in steps(f.body)))
        self.sources = [field for field in prepare.fields if field.name in read]
        self.slopes: dict[str, dict[str, Expression]] = {d.name: {} for d in self.directions}
        self._new: dict[str, Array] = {}
        self.prepare = self._prepared(prepare)

    @property
    def fields(self) -> tuple[Array, ...]:
        return tuple(self._new.values())

    def _directions(self, prepare: Function, asked: Sequence[str]) -> Iterator[Direction]:
        given = {a.name: a for a in prepare.inputs}
        for name in asked:
            if name not in given:
                raise ContractError(f"no derivative by {name}; numbers of this set: {', '.join(given)}")
            sizes = [range(size) for size in given[name].shape if isinstance(size, int)]
            for component in product(*sizes):
                yield Direction("_".join([name, *map(str, component)]), given[name], component)

    def _column(self, direction: Direction, prepare: Function) -> Column:
        """Of `prepare`: the direction's symbol moves, the slopes of fields are put."""
        seeds = {
            symbol: ONE
            for symbol, e in prepare.elements.items()
            if e.array == direction.array and tuple(k for k in e.index if isinstance(k, int)) == direction.component
        }
        wanted = {field.name for field in self.sources}

        def target(element: Element) -> Element | None:
            field = element.array
            if field.name not in wanted:
                return None
            shape = field.shape or (("N",) if direction.for_each_wheel else ())
            meaning = f"slope of {field.name} by {direction.name}"
            unit = f"{field.unit} per {direction.array.unit}"
            new = Array(f"{field.name}_by_{direction.name}", shape, "field", unit, meaning)
            return Element(self._new.setdefault(new.name, new), new.indices)

        return Column(direction.name, seeds, target)

    def _prepared(self, prepare: Function) -> Function:
        """`prepare` with the slopes of the fields; a slope that is a number needs no field."""
        tangents, named = tangents_of(prepare, self.rules), {field.name for field in self.sources}
        needed = without_dead_steps(replace(prepare, body=putting(prepare.body, named)))
        columns = [(d, self._column(d, prepare)) for d in self.directions]
        once = [c for d, c in columns if not d.for_each_wheel]
        each = [c for d, c in columns if d.for_each_wheel]
        body = tangents.carried(prepare.body, once)
        if each:
            body = (*body, tangents.own(needed.body, each))
        numbers = {
            step.name: step.expression
            for step in steps(body)
            if step.kind == "put" and step.name in self._new and isinstance(step.expression, Number)
        }
        self._new = {name: field for name, field in self._new.items() if name not in numbers}
        for direction in self.directions:
            for field in self.sources:
                name = f"{field.name}_by_{direction.name}"
                self.slopes[direction.name][field.name] = numbers.get(name) or Symbol(name)
        kept = {f.name for f in prepare.fields} | self._new.keys()
        fields = prepare.fields + self.fields
        return replace(prepare, body=putting(body, kept), fields=fields)

    def function(self, function: Function) -> Function:
        """The derivatives of a function's outputs by the numbers."""
        name = function.name.removesuffix(SHARP) + BY_NUMBERS + (SHARP if function.name.endswith(SHARP) else "")
        outputs: dict[str, Array] = {}
        columns = [(d, self._moved(function, d, outputs)) for d in self.directions]
        once = [c for d, c in columns if not d.for_each_wheel]
        each = [c for d, c in columns if d.for_each_wheel]
        tangents = tangents_of(function, self.rules)
        body = tangents.carried(function.body, once, keep=False)
        elements = {field.name: Element(field, field.indices) for field in self.fields}
        if each and changes_in_loops(function):
            loop, further = tangents.through_all(function, each)
            body, elements = (*body, loop), elements | further
        elif each:
            body = (*body, tangents.own(function.body, each))
        summary = f"Derivatives by numbers of the vehicle: {function.summary[0].lower()}{function.summary[1:]}"
        return without_dead_steps(replace(
            function, name=name, summary=summary, body=body, elements=function.elements | elements,
            fields=function.fields + self.fields, arguments=(*function.inputs, *outputs.values()),
        ))  # fmt: skip

    def _moved(self, function: Function, direction: Direction, outputs: dict[str, Array]) -> Column:
        slopes = self.slopes[direction.name]
        seeds = {name: d for name, d in slopes.items() if name in function.elements and d != Number(0)}
        shape = direction.array.shape

        def target(element: Element) -> Element:
            array = element.array
            own = direction.for_each_wheel
            rest = array.shape[1:] if own and array.shape[:1] == ("N",) else array.shape
            name = f"{array.name}_by_{direction.array.name}"
            meaning = f"derivatives of {array.name} by {direction.array.name}"
            unit = f"{array.unit} per {direction.array.unit}"
            new = outputs.setdefault(name, Array(name, (*shape, *rest), "out", unit, meaning))
            index = element.index[1:] if len(rest) < len(array.shape) else element.index
            return Element(new, (*(("i",) if own else ()), *direction.component, *index))

        return Column(direction.name, seeds, target)


def putting(body: Body, names: set[str]) -> Body:
    """The steps without values for arrays that are not among `names`."""
    kept: list[Step | Loop] = []
    for node in body:
        if isinstance(node, Loop):
            kept.append(replace(node, body=putting(node.body, names)))
        elif node.kind != "put" or node.name in names:
            kept.append(node)
    return tuple(kept)

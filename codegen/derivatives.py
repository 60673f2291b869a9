"""The derivatives by numbers of the vehicle that a set was asked for.

Maxima says which functions there are (effects/derivatives.mac, "derivatives" in the data) and the rules of slopes; the
derivatives by state and inputs are programs of its own. Here functions are differentiated as they are computed
(tangents.py). A number of the vehicle reaches a function through the constants of the model: `prepare` is
differentiated once, and its slopes are further constants of the model.

A set is asked for a number by the effect "derivatives_by_" and the number's name, as `prepare` takes it.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

from .degrees import HIGHEST, Degree, Degrees, degrees_of
from .expressions import (
    ONE,
    ZERO,
    Canonical,
    Expression,
    Order,
    Power,
    Product,
    Symbol,
    negated,
    number,
    split_coefficient,
    symbols,
)
from .programs import CONSTANTS, Array, ContractError, Element, Function, Loop, Step, steps, without_dead_steps
from .settling import settled, taken_out, tightened
from .tangents import Body, Column, Rules, Tangents, Together, changes_in_loops, multiple_name

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
    residuals   the programs that are differentiated in a function's stead; of several the first that a set has
    held        steps of these programs that stand still besides
    positive    numbers that are positive
    together    numbers that grow together, each as a power of the first, and the sums whose slopes by the first follow
                from those by the others (none named: all)
    """

    rules: Rules
    by_numbers: Sequence[str]
    residuals: Sequence["Residual"]
    held: Sequence[str]
    positive: Sequence[str]
    together: Sequence[tuple[Mapping[str, int], frozenset[str]]]

    @classmethod
    def read(cls, data: Mapping) -> "Derivatives":
        residuals = tuple(Residual(*of) for of in data.get("residuals", ()))
        rules, named = Rules.read(data.get("rules", ())), tuple(data.get("by_numbers", ()))
        held, positive = (tuple(data.get(key, ())) for key in ("held", "positive"))
        together = [(dict(of["powers"]), frozenset(of["sums"])) for of in data.get("together", ())]
        return cls(rules, named, residuals, held, positive, together)

    def at(self, values: Mapping[str, Expression]) -> "Derivatives":
        """The same where symbols have these values."""
        return replace(self, rules=self.rules.at(values))

    def added(
        self, functions: Sequence[Function], fields: tuple[Array, ...], effects: Sequence[str]
    ) -> tuple[list[Function], tuple[Array, ...]]:
        """The functions of a set and the fields of its model, with the derivatives that these effects ask for."""
        named = {f.name: f for f in functions}
        programs = {name for of in self.residuals for name in (of.program, of.of_wheel)}
        found = [f for f in functions if f.name not in programs]
        found = [settled(f) if all("derivatives" in case for case in f.cases) else f for f in found]
        asked = [effect.removeprefix(REQUEST) for effect in effects if effect.startswith(REQUEST)]
        if not asked:
            return found, fields
        wanted = [self._program(named, n) for name in self.by_numbers for n in (name, name + SHARP) if n in named]
        numbers = Numbers(self, named["prepare"], wanted, asked)
        extended = tuple(fields) + numbers.fields
        found = [numbers.prepare if f.prepares else without_dead_steps(f) for f in found]
        found += map(numbers.function, wanted)
        return [replace(f, fields=extended) if f.fields else f for f in found], extended

    def _program(self, named: Mapping[str, Function], name: str) -> "Differentiable":
        """What is differentiated for a function's derivatives: its own steps, or those of its residual."""
        own = named[name]
        residual = next((of for of in self.residuals if of.function == name and of.program in named), None)
        if residual is None:
            return Differentiable(own, own.arguments, self.rules)
        program, of_wheel = taken_out(named[residual.program]), named.get(residual.of_wheel)
        return Differentiable(
            replace(program, name=name, summary=own.summary), own.arguments,
            self.rules.holding(self.held), residual.still(program),
            residual.moved(of_wheel) if of_wheel else (), of_wheel.elements if of_wheel else {},
        )  # fmt: skip


@dataclass(frozen=True)
class Residual:
    """What is differentiated in a function's stead.

    program   its name
    start     the first step of the solution there, and
    last      the last one: none where nothing is solved for
    of_wheel  the program for numbers of each wheel, if that is another one
    """

    function: str
    program: str
    start: str
    last: str
    of_wheel: str

    def still(self, program: Function) -> tuple[int, int]:
        """The places of the first step that stands still, the sums that are solved with among them, and of the first
        behind these."""
        if not self.last:
            return 0, 0
        names = ["" if isinstance(node, Loop) else node.name for node in program.body]
        return min(k for k, step in enumerate(names) if step in ("", self.start)), names.index(self.last) + 1

    def moved(self, program: Function) -> Body:
        """The steps that do not stand still."""
        first, behind = self.still(program)
        return (*program.body[:first], *program.body[behind:])


@dataclass(frozen=True)
class Differentiable:
    """A function of which derivatives are asked.

    arguments  those that a user knows: outputs among them are differentiated, others are storage
    rules      of slopes
    still      the places of the first step that stands still and of the first behind these
    own        the steps that are differentiated by numbers of each wheel, where these are others
    own_elements  what those read from arrays
    """

    function: Function
    arguments: Sequence[Array]
    rules: Rules
    still: tuple[int, int] = (0, 0)
    own: Body = ()
    own_elements: Mapping[str, Element] = field(default_factory=dict)

    @property
    def before(self) -> Body:
        return self.function.body[: self.still[0]]

    @property
    def body(self) -> Body:
        """The steps that are differentiated."""
        return (*self.before, *self.function.body[self.still[1] :])

    @property
    def of_wheel(self) -> Body:
        """The steps that are differentiated by numbers of each wheel."""
        return self.own or self.body

    def read_by_wheels(self, known: Body) -> list[Step]:
        """What these know from before their loops, and other steps do not give."""
        names = {step.name for step in steps(known)}
        return [node for node in self.own if isinstance(node, Step) and node.kind == "let" and node.name not in names]

    @property
    def elements(self) -> dict[str, Element]:
        return {**self.function.elements, **self.own_elements}

    def around_still(self, slopes: Body) -> Body:
        """The steps of `body` with slopes, and those that stand still in their place."""
        own = self.function.body[slice(*self.still)]
        return (*self.before, *own, *(node for node in slopes if node not in self.before))

    @property
    def storage(self) -> list[Array]:
        known = {array.name for array in self.arguments}
        return [array for array in self.function.outputs if array.name not in known]


def tangents_of(function: Function, rules: Rules) -> Tangents:
    names = [*function.elements, *(step.name for step in steps(function.body)), *CONSTANTS]
    return Tangents(Canonical(Order(names)), rules)


class Numbers:
    """Derivatives of functions by numbers of the vehicle.

    fields   the slopes of the model's fields
    prepare  the function that computes these too
    """

    def __init__(self, known: Derivatives, prepare: Function, wanted: Sequence[Differentiable], asked: Sequence[str]):
        self.rules, self.positive = known.rules, known.positive
        given = {array.name for array in prepare.inputs}
        self.alike = [({name: k for name, k in of.items() if name in given}, sums) for of, sums in known.together]
        self.directions = list(self._directions(prepare, asked))
        lines = [step for of in wanted for step in steps((*of.body, *of.own))]
        read = set().union(*(symbols(step.expression) | self.rules.reads.get(step.name, set()) for step in lines))
        self.sources = [field for field in prepare.fields if field.name in read]
        self.slopes: dict[str, dict[str, Expression]] = {d.name: {} for d in self.directions}
        self.degrees: dict[str, Degrees] = {}
        self.rates: dict[str, Symbol] = {}
        self.together: dict[str, list[Together]] = {}
        self._new: dict[str, Array] = {}
        self._undifferentiated, self._names, self._multiples = prepare, {}, set()
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
        """`prepare` with the slopes of the fields; one that is a number or another field needs no field."""
        tangents, named = tangents_of(prepare, self.rules), {field.name for field in self.sources}
        needed = without_dead_steps(replace(prepare, body=putting(prepare.body, named)), self.rules.reads)
        columns = [(d, self._column(d, prepare)) for d in self.directions]
        self._names = {column.name: list(column.seeds) for _, column in columns}
        once = [c for d, c in columns if not d.for_each_wheel]
        each = [c for d, c in columns if d.for_each_wheel]
        body = tangents.carried(prepare.body, once)
        if each:
            body = (*body, tangents.own(needed.body, each))
        known = known_already(body, self._new, named)
        self._new = {name: field for name, field in self._new.items() if name not in known}
        rates = []
        for direction, column in columns:
            positive = not direction.for_each_wheel and direction.name in self.positive
            degrees = self._degrees({column.name: 1}) if positive else {}
            for source in self.sources:
                name = f"{source.name}_by_{direction.name}"
                self.slopes[direction.name][source.name] = known.get(name) or Symbol(name)
            if degrees:
                rates += self._rate(direction, self._names[direction.name], prepare)
                self.degrees[direction.name] = degrees
        for powers, sums in self.alike:
            rates += self._grown_together(powers, sums, prepare, tangents)
        body = (*body, *rates)
        kept = {f.name for f in prepare.fields} | self._new.keys()
        fields = prepare.fields + self.fields
        return replace(prepare, body=putting(body, kept), fields=fields)

    def _degrees(self, powers: Mapping[str, int]) -> Degrees:
        """Of the fields, where positive numbers grow, each by a power. Nothing stands still in `prepare`: what it
        computes has the degree of its own expression, and no rule is asked."""
        prepare = self._undifferentiated
        seeds = {name: k for of, k in powers.items() for name in self._names[of]}
        canonical = tangents_of(prepare, self.rules).canonical
        found = Degree(degrees_of(prepare.body, seeds, Rules(), frozenset(), canonical))
        put = {step.name: found(step.expression) for step in steps(prepare.body) if step.kind == "put"}
        return {field.name: put[field.name] for field in self.sources}

    def _rate(self, direction: Direction, named: list[str], prepare: Function) -> list[Step]:
        """One over a number, by its names, and multiples of that."""
        unit, meaning = f"1 per {direction.array.unit}", f"one over {direction.name}"
        field = Array(f"inverse_{direction.name}", (), "field", unit, meaning)
        inverse = [Power(Symbol(name), -1) for name in named]
        self.rates[direction.name], further = self._field_of(inverse, field, prepare)
        for times in range(2, HIGHEST + 1):
            name = multiple_name(self.rates[direction.name], times)
            multiple = Array(name, (), "field", unit, f"{times} over {direction.name}")
            self._new[name] = multiple
            self._multiples.add(name)
            further.append(Step("put", name, Product((number(times), inverse[0])), Element(multiple, ())))
        return further

    def _field_of(self, values: Sequence[Expression], new: Array, prepare: Function) -> tuple[Symbol, list[Step]]:
        """The field that has one of these values: a further one, and what gives it the first of them, where the model
        has none that is just that."""
        lets = {step.name: step.expression for step in steps(prepare.body) if step.kind == "let"}
        for step in steps(prepare.body):
            e = step.expression
            if step.kind == "put" and (lets.get(e.name) if isinstance(e, Symbol) else e) in values:
                return Symbol(step.name), []
        self._new[new.name] = new
        return Symbol(new.name), [Step("put", new.name, values[0], Element(new, ()))]

    def _grown_together(
        self, powers: Mapping[str, int], sums: frozenset[str], prepare: Function, tangents: Tangents
    ) -> list[Step]:
        """What the slopes by the first of the numbers that grow together follow from, where all are asked for."""
        if len(powers) < 2 or not self._names.keys() >= powers.keys():
            return []
        own, *others = powers
        ratios, numbers, further = {}, {}, []
        for other in others:
            names = product(self._names[other], self._names[own])
            values = [tangents.canonical.product([Symbol(a), Power(Symbol(b), -1)]) for a, b in names]
            field = Array(f"{other}_per_{own}", (), "field", "1", f"{other} over {own}")
            ratios[other], new = self._field_of(values, field, prepare)
            given = next(array for array in prepare.inputs if array.name == other)
            itself = Array(f"{other}_itself", (), "field", given.unit, given.meaning)
            numbers[other], too = self._field_of([Symbol(name) for name in self._names[other]], itself, prepare)
            further += [*new, *too]
        self.together.setdefault(own, []).append(Together(self._degrees(powers), ratios, powers, numbers, sums))
        return further

    def function(self, program: Differentiable) -> Function:
        """The derivatives of a function's outputs by the numbers."""
        function = program.function
        name = function.name.removesuffix(SHARP) + BY_NUMBERS + (SHARP if function.name.endswith(SHARP) else "")
        outputs: dict[str, Array] = {}
        columns = [(d, self._moved(program, d, outputs)) for d in self.directions]
        once = [c for d, c in columns if not d.for_each_wheel]
        each = [c for d, c in columns if d.for_each_wheel]
        tangents = tangents_of(function, program.rules)
        early = frozenset(step.name for step in steps(program.before) if step.kind == "var")
        body = program.around_still(tangents.carried(program.body, once, keep=False, termwise=early))
        elements = {field.name: Element(field, field.indices) for field in (*self.sources, *self.fields)}
        if each and changes_in_loops(program.body):
            loop, further = tangents.through_all(function, each)
            body, elements = (*body, loop), elements | further
        elif each:
            body = (*body, *program.read_by_wheels(body), tangents.own(program.of_wheel, each))
        summary = f"Derivatives by numbers of the vehicle: {function.summary[0].lower()}{function.summary[1:]}"
        found = replace(
            function, name=name, summary=summary, body=body, elements=program.elements | elements,
            fields=function.fields + self.fields, arguments=(*function.inputs, *outputs.values()),
        )  # fmt: skip
        return tightened(without_unread_storage(found, program.storage))

    def _moved(self, program: Differentiable, direction: Direction, outputs: dict[str, Array]) -> Column:
        slopes = self.slopes[direction.name]
        seeds = {name: d for name, d in slopes.items() if name in program.elements and d != ZERO}
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

        rate, degrees = self.rates.get(direction.name), self.degrees.get(direction.name, {})
        together, known = self.together.get(direction.name, ()), frozenset(self._multiples)
        return Column(direction.name, seeds, target, rate, degrees, together, known)


def known_already(body: Body, new: Iterable[str], fields: Collection[str]) -> dict[str, Expression]:
    """Those of the new fields that are numbers, or another field or its negative."""
    lets = {step.name: step.expression for step in steps(body) if step.kind == "let"}
    puts = {step.name: step.expression for step in steps(body) if step.kind == "put"}
    holds = {puts[name]: Symbol(name) for name in fields if name in puts}

    def found(e: Expression) -> Expression | None:
        sign, factors = split_coefficient(e)
        if not factors:
            return e
        if abs(sign) != 1 or len(factors) > 1 or not isinstance(factors[0], Symbol):
            return None
        own, symbol = None, factors[0]
        if symbol in holds:
            own = holds[symbol]
        elif symbol.name in lets:
            own = found(lets[symbol.name])
        return own if own is None or sign > 0 else negated(own)

    known = {name: found(puts[name]) for name in new if name in puts}
    return {name: e for name, e in known.items() if e is not None}


def without_unread_storage(function: Function, storage: Sequence[Array]) -> Function:
    """The function without dead steps, and with those of these arrays as further outputs that a derivative reads."""
    bare = without_dead_steps(replace(function, body=putting(function.body, {a.name for a in function.outputs})))
    read = {e.array for step in steps(bare.body) for e in map(function.elements.get, symbols(step.expression)) if e}
    kept = [array for array in storage if array in read]
    if not kept:
        return bare
    return without_dead_steps(replace(function, arguments=(*function.inputs, *kept, *function.outputs)))


def putting(body: Body, names: set[str]) -> Body:
    """The steps without values for arrays that are not among `names`."""
    kept: list[Step | Loop] = []
    for node in body:
        if isinstance(node, Loop):
            kept.append(replace(node, body=putting(node.body, names)))
        elif node.kind != "put" or node.name in names:
            kept.append(node)
    return tuple(kept)

"""Derivatives of functions: their steps differentiated one by one, by the chain rule, as further steps.

What is differentiated is the program that runs, so that a form that keeps its digits has derivatives that keep theirs.
The slope of a step is written after Maxima's rules where it has one (a form that is proved), else by the rules of
expressions below. A column is the direction of a derivative; nothing is computed along it that is zero.

  - A column of one number is carried through the steps as they stand (`carried`).
  - A number of each wheel has a column for each wheel. Where the loops over the wheels only add up, the wheel's own
    part is all that there is, and one further loop serves all wheels (`own`). Where a loop changes what it reads, as
    the fold of rows for sharp tips does, each wheel's column goes through all wheels, k, again (`through_all`).
  - Where numbers that grow together have columns, a loop's sums have their slopes by one of them from the others'
    (degrees.py); and such a sum follows itself from these, where it is proportional to a power of that one.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from .degrees import HIGHEST, MIXED, Degree, Degrees, bounded, degrees_of
from .expressions import ZERO, Call, Canonical, Expression, Number, Power, Product, Sum, Symbol, number, symbols
from .programs import OWN, ContractError, Element, Function, Loop, Step, steps

Body = tuple[Step | Loop, ...]
Slopes = dict[str, Expression]
AGAIN = "_k"  # after the names of what is computed again for the wheels k


@dataclass(frozen=True)
class Together:
    """What a column follows from, where numbers grow together, or one falls as others grow.

    degrees  of what is read from arrays, in all these numbers together
    ratios   what each other number is of the column's own, by the name of its column
    powers   of the column's own number, by which the others grow
    numbers  the other numbers themselves, by the names of their columns
    sums     those that it holds for, where it does not for all
    """

    degrees: Degrees
    ratios: Mapping[str, Expression]
    powers: Mapping[str, int]
    numbers: Mapping[str, Expression] = field(default_factory=dict)
    sums: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Column:
    """The direction of a derivative.

    seeds    the slopes of what is read from arrays
    target   where an output's slope is put
    rate     1/p, where the direction is that of a positive number p whose powers are sought in the steps (degrees.py)
    degrees  of what is read from arrays then
    together  what the slopes of sums follow from, if they do from those by other numbers: the first that a sum has a
              degree in
    known     multiples of the rate that are read from arrays, by their names
    """

    name: str
    seeds: Mapping[str, Expression]
    target: Callable[[Element], Element | None]
    rate: Symbol | None = None
    degrees: Degrees = field(default_factory=dict)
    together: Sequence[Together] = ()
    known: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Rules:
    """slopes: {step: {what it depends on: slope}}, as Maxima proved them; still: steps that get none, since they lead
    to such ones alone or stand still."""

    slopes: Mapping[str, Mapping[str, Expression]] = field(default_factory=dict)
    still: frozenset[str] = frozenset()

    @classmethod
    def read(cls, data: Sequence[Mapping]) -> "Rules":
        read = Canonical().read
        return cls(
            {rule["name"]: {by: read(slope) for by, slope in rule["by"].items()} for rule in data},
            frozenset(name for rule in data for name in rule["inner"]),
        )

    @cached_property
    def reads(self) -> dict[str, set[str]]:
        """What the slope of a step reads, by the step's name."""
        return {name: set(by).union(*map(symbols, by.values())) for name, by in self.slopes.items()}

    def at(self, values: Mapping[str, Expression]) -> "Rules":
        """The same where symbols have these values."""
        put = Canonical().substituted
        slopes = {name: {by: put(e, values) for by, e in of.items()} for name, of in self.slopes.items()}
        return replace(self, slopes=slopes)

    def holding(self, names: Iterable[str]) -> "Rules":
        """The same where these steps stand still."""
        return replace(self, still=self.still.union(names))


@dataclass
class Tangents:
    """The steps of derivatives of a program."""

    canonical: Canonical
    rules: Rules
    degree: Degree | None = None  # along the direction of a column with a rate
    rate: Expression = ZERO
    once: frozenset[str] = frozenset()  # steps outside of loops
    following: dict[str, tuple[int, Together]] = field(default_factory=dict)  # sums: their degree, the other columns
    proportional: dict[str, tuple[int, Together]] = field(default_factory=dict)  # the same of those with a degree

    def along(self, body: Body, column: Column, termwise: frozenset[str]) -> "Tangents":
        """Those for a column: with the degrees of the steps, where it has a rate."""
        if column.rate is None:
            return self
        found = degrees_of(body, column.degrees, self.rules, termwise, self.canonical)
        once = {node.name for node in body if isinstance(node, Step) and node.kind == "let"}
        following: dict[str, tuple[int, Together]] = {}
        proportional: dict[str, tuple[int, Together]] = {}
        for together in column.together:
            joint = degrees_of(body, together.degrees, self.rules, termwise, self.canonical)
            sums = sums_of_one_loop(body) - termwise
            for name in sums & together.sums if together.sums else sums:
                if joint[name] is not MIXED:
                    (following if found[name] is MIXED else proportional).setdefault(name, (joint[name], together))
        return replace(self, degree=Degree(found), rate=column.rate, once=frozenset(once), following=following,
                       proportional=proportional)  # fmt: skip

    def multiple(self, e: Expression, degree: int | None) -> Expression | None:
        """The slope of an expression that has a degree."""
        if degree is MIXED:
            return None
        if not degree:
            return ZERO
        sign, times = (1, degree) if degree > 0 else (-1, -degree)
        rate = self.rate if times == 1 else Symbol(multiple_name(self.rate, times))
        return self.canonical.product([number(sign), rate, e])

    def multiples(self) -> list[Step]:
        """What slopes are multiples by, where it is not the rate itself."""
        rate = self.rate
        return [
            Step("let", multiple_name(rate, times), self.canonical.product([number(times), rate]))
            for times in range(2, HIGHEST + 1) if self.degree
        ]  # fmt: skip

    def derivative(self, e: Expression, slopes: Mapping[str, Expression]) -> Expression:
        """The slope of an expression, from those of its symbols."""
        c = self.canonical
        if self.degree and isinstance(e, Sum | Product) and self.degree(e) is not MIXED:
            return self.multiple(e, self.degree(e))
        match e:
            case Symbol(name):
                return ZERO if self.degree and self.degree(e) == 0 else slopes.get(name, ZERO)
            case Sum(terms):
                return c.sum([self.derivative(term, slopes) for term in self.gathered(terms)])
            case Product(factors):
                parts = [(self.derivative(f, slopes), [g for g in factors if g is not f]) for f in factors]
                return c.sum([c.product([d, *rest]) for d, rest in parts if d != ZERO])
            case Power(base, exponent):
                inner = self.derivative(base, slopes)
                return ZERO if inner == ZERO else c.product([number(exponent), c.power(base, exponent - 1), inner])
            case Call(function, argument):
                inner = self.derivative(argument, slopes)
                return ZERO if inner == ZERO else c.product([*self.outer(function, argument), inner])
        return ZERO

    def gathered(self, terms: Sequence[Expression]) -> list[Expression]:
        """The terms, those of one degree as one."""
        if not self.degree:
            return list(terms)
        own = [(self.degree(term), term) for term in terms]
        degrees = dict.fromkeys(k for k, _ in own if k)
        alike = [self.canonical.sum([term for k, term in own if k == degree]) for degree in degrees]
        return [*alike, *(term for k, term in own if k is MIXED)]

    def outer(self, function: str, x: Expression) -> list[Expression]:
        """The factors of the slope of an elementary function."""
        c = self.canonical
        match function:
            case "sin":
                return [c.call("cos", x)]
            case "cos":
                return [number(-1), c.call("sin", x)]
            case "sqrt":
                return [Number(number(1).value / 2), c.power(c.call("sqrt", x), -1)]
        return [c.call("exp", x)]

    def has_degree(self, name: str) -> bool:
        return self.degree is not None and self.degree.of_symbol.get(name, 0) is not MIXED

    def of_product(self, e: Product, name: Symbol, slopes: Mapping[str, Expression]) -> Expression:
        """The slope of a product that has a name: a multiple of it for the factors that have degrees."""
        whole = bounded(sum(self.degree(f) or 0 for f in e.factors))
        if whole is MIXED:
            return self.derivative(e, slopes)
        moving = [f for f in e.factors if self.degree(f) is MIXED]
        parts = [
            self.canonical.product([self.derivative(f, slopes), *(g for g in e.factors if g is not f)]) for f in moving
        ]
        return self.canonical.sum([self.multiple(name, whole), *parts])

    def slope(self, step: Step, slopes: Mapping[str, Expression]) -> Expression:
        if step.kind != "put" and step.name in self.rules.still:
            return ZERO
        if self.degree and step.kind == "let":
            own = self.multiple(Symbol(step.name), self.degree(Symbol(step.name)))
            if own is not None:
                return own
            if isinstance(step.expression, Product) and step.name not in self.rules.slopes:
                return self.of_product(step.expression, Symbol(step.name), slopes)
        if step.kind != "let" or step.name not in self.rules.slopes:
            return self.derivative(step.expression, slopes)
        parts = ((slope, slopes.get(by, ZERO)) for by, slope in self.rules.slopes[step.name].items())
        return self.canonical.sum([self.canonical.product([a, b]) for a, b in parts if b != ZERO])

    def moving(self, body: Body, seeds: Mapping[str, Expression]) -> set[str]:
        """The names whose slopes are not zero."""
        found, before = set(seeds), -1
        while len(found) > before:
            before = len(found)
            for step in steps(body):
                if step.kind != "put" and self.slope(step, dict.fromkeys(found, Symbol("?"))) != ZERO:
                    found.add(step.name)
        return found

    def carried(
        self, body: Body, columns: Sequence[Column], keep: bool = True, termwise: frozenset[str] = frozenset()
    ) -> Body:
        """The steps with the slopes along the columns beside them.

        keep      also the outputs themselves
        termwise  sums whose slopes are sums in any case, since they have other values where these slopes are read
        """
        own = without_chains({column.name: self.along(body, column, termwise) for column in columns})
        moving = {column.name: own[column.name].moving(body, column.seeds) for column in columns}
        changing = {step.name for step in steps(body) if step.kind == "var"}
        changing |= {slope_name(name, column) for name in changing for column in columns}
        known = {column.name: dict(column.seeds) for column in columns}
        multiples = [
            step for column in columns for step in own[column.name].multiples() if step.name not in column.known
        ]  # fmt: skip
        lines = in_order([*multiples, *self._carried(body, columns, own, known, moving, changing, keep)])
        return lines if keep else without_sums(lines, self.of_slopes(body, columns, own, moving))

    def of_slopes(
        self, body: Body, columns: Sequence[Column], own: Mapping[str, "Tangents"], moving: Mapping[str, set[str]]
    ) -> Slopes:
        """The sums from zero that follow from their slopes. Along a column the sum has the degree k, and where the
        numbers grow together j: of their slopes the others' add up to j - k times the sum."""
        c, found = self.canonical, {}
        from_zero = {node.name for node in body if isinstance(node, Step) and node.kind == "var"
                     and node.expression == ZERO}  # fmt: skip
        for column in columns:
            for name, (degree, together) in own[column.name].proportional.items():
                others = [of for of in together.numbers if not own[of].has_degree(name) and name in moving[of]]
                known = [column.name, *(of for of in together.numbers if own[of].has_degree(name))]
                left = degree - sum(together.powers[of] * own[of].degree(Symbol(name)) for of in known)
                if left and others and name in from_zero and not any(name in own[of].following for of in others):
                    parts = [(of, Symbol(f"{name}_by_{of}")) for of in others]
                    terms = [c.product([number(together.powers[of]), together.numbers[of], d]) for of, d in parts]
                    found[name] = c.product([c.power(number(left), -1), c.sum(terms)])
        return found

    def _carried(self, body, columns, own_tangents, known, moving, changing, keep) -> Iterator[Step | Loop]:
        known = {name: dict(slopes) for name, slopes in known.items()}
        for node in body:
            if isinstance(node, Loop):
                inside = self._carried(node.body, columns, own_tangents, known, moving, changing, keep)
                yield replace(node, body=in_order(inside))
                yield from self._following(node, columns, own_tangents, known)
                continue
            for column in columns:
                slopes, tangents = known[column.name], own_tangents[column.name]
                own = slope_name(node.name, column)
                if node.kind != "put" and node.name in tangents.following:
                    continue
                d = tangents.slope(node, slopes)
                if node.kind == "put":
                    yield from put_slope(node, column, d)
                elif node.kind == "let":
                    yield from self.named(node, own, d, slopes, changing)
                elif tangents.has_degree(node.name):
                    slopes[node.name] = tangents.multiple(Symbol(node.name), tangents.degree(Symbol(node.name)))
                elif node.name in moving[column.name] and not (node.kind == "add" and d == ZERO):
                    slopes[node.name] = Symbol(own)
                    yield Step(node.kind, own, d)
            if keep or node.kind != "put":
                yield node

    def _following(
        self, loop: Loop, columns: Sequence[Column], own: Mapping[str, "Tangents"], known: Mapping[str, Slopes]
    ) -> Iterator[Step]:
        """The slopes of what a loop has added up that follow from those along other columns."""
        added = dict.fromkeys(step.name for step in loop.body if isinstance(step, Step) and step.kind == "add")
        for column in columns:
            for name in (name for name in added if name in own[column.name].following):
                slopes = known[column.name]
                slopes[name] = Symbol(slope_name(name, column))
                yield Step("let", slope_name(name, column), own[column.name].from_others(name, column, own, known))

    def from_others(
        self, name: str, column: Column, own: Mapping[str, "Tangents"], known: Mapping[str, Slopes]
    ) -> Expression:
        """The slope of a sum from those along the columns of the other numbers that grow together."""
        c, terms = self.canonical, []
        degree, together = self.following[name]
        for other, ratio in together.ratios.items():
            if own[other].has_degree(name):
                degree -= together.powers[other] * own[other].degree(Symbol(name))
            else:
                terms.append(c.product([number(-together.powers[other]), ratio, known[other].get(name, ZERO)]))
        return c.sum([c.product([number(degree), self.rate, Symbol(name)]), *terms])

    def named(self, step: Step, name: str, d: Expression, slopes: Slopes, changing: set[str]) -> Iterator[Step]:
        """The slope of a `let`: a step of its own where it is more than a number or another name."""
        if isinstance(d, Number) or isinstance(d, Symbol) and d.name not in changing:
            slopes[step.name] = d
        else:
            slopes[step.name] = Symbol(name)
            yield Step("let", name, d)

    def own(self, body: Body, columns: Sequence[Column]) -> Loop:
        """A loop over the wheels: each wheel's column, where what the loops add up is read after them alone."""
        known = {column.name: dict(column.seeds) for column in columns}
        made: dict[str, Step] = {}
        lines: list[Step] = []
        for node in body:
            for step in node.body if isinstance(node, Loop) and node.index == "i" else [node]:
                if isinstance(step, Loop):
                    self._refuse_moving(step, known)
                else:
                    self._own(step, isinstance(node, Loop), columns, known, made, lines)
        return Loop("i", in_order(lines))

    def _refuse_moving(self, loop: Loop, known: Mapping[str, Slopes]) -> None:
        for slopes in known.values():
            if any(self.slope(step, slopes) != ZERO for step in steps(loop.body)):
                raise ContractError("a loop over rollers depends on what is differentiated")

    def _own(self, step: Step, in_loop: bool, columns, known, made: dict[str, Step], lines: list[Step]) -> None:
        if in_loop and step.kind == "let":
            if made.setdefault(step.name, step).expression != step.expression:
                raise ContractError(f"two loops give {step.name} a value")
            if made[step.name] is step:
                lines.append(step)
        for column in columns:
            slopes, name = known[column.name], slope_name(step.name, column)
            d = self.slope(step, slopes)
            if step.kind == "put":
                lines += put_slope(step, column, d)
            elif step.kind == "let":
                if not (in_loop and made[step.name] is not step):
                    lines += self.named(step, name, d, slopes, set())
            elif step.kind == "update" and (d != ZERO or slopes.get(step.name, ZERO) != ZERO):
                raise ContractError(f"{step.name} is changed within a loop")
            elif step.kind == "var":
                slopes[step.name] = d
            elif d != ZERO:
                slopes[step.name] = self.canonical.sum([slopes.get(step.name, ZERO), d])

    def through_all(self, function: Function, columns: Sequence[Column]) -> tuple[Loop, dict[str, Element]]:
        """A loop over the wheels i: each wheel's column through all wheels k; and the elements that it reads."""
        of_wheel = {name: e for name, e in function.elements.items() if "i" in e.index}
        again = {name: name + AGAIN for name in [*of_wheel, *(s.name for s in steps(function.body) if s.kind != "put")]}
        elements = {
            name + AGAIN: Element(e.array, tuple("k" if k == "i" else k for k in e.index))
            for name, e in of_wheel.items()
        }
        rules = Rules(
            {again.get(name, name): self.renamed(by, again) for name, by in self.rules.slopes.items()},
            frozenset(again.get(name, name) for name in self.rules.still),
        )
        at = lambda name, d: self.canonical.product([Symbol(OWN), d]) if name in of_wheel else d  # noqa: E731
        moved = [
            replace(column, seeds={again.get(name, name): at(name, d) for name, d in column.seeds.items()})
            for column in columns
        ]
        body = tuple(self._again(function.body, again))
        return Loop("i", Tangents(self.canonical, rules).carried(body, moved, keep=False)), elements

    def renamed(self, by: Mapping[str, Expression], names: Mapping[str, str]) -> dict[str, Expression]:
        values = {name: Symbol(new) for name, new in names.items()}
        return {names.get(name, name): self.canonical.substituted(slope, values) for name, slope in by.items()}

    def _again(self, body: Body, names: Mapping[str, str]) -> Iterator[Step | Loop]:
        values = {name: Symbol(new) for name, new in names.items()}
        for node in body:
            if isinstance(node, Loop):
                yield Loop("k" if node.index == "i" else node.index, tuple(self._again(node.body, names)))
            else:
                expression = self.canonical.substituted(node.expression, values)
                yield replace(node, name=names.get(node.name, node.name), expression=expression)


def without_chains(own: Mapping[str, Tangents]) -> dict[str, Tangents]:
    """The tangents of columns, by name: a slope that others follow from is added up, and follows from none itself."""

    def direct(following: Mapping[str, tuple[int, Together]]) -> dict[str, tuple[int, Together]]:
        return {
            name: (degree, together) for name, (degree, together) in following.items()
            if not any(name in own[other].following for other in together.ratios)
        }  # fmt: skip

    return {column: replace(tangents, following=direct(tangents.following)) for column, tangents in own.items()}


def without_sums(body: Body, values: Slopes) -> Body:
    """The steps where sums are not added up, but have these values behind their loops."""
    is_start = lambda node: isinstance(node, Step) and node.kind in ("var", "add") and node.name in values  # noqa: E731
    kept: list[Step | Loop] = []
    for node in body:
        if isinstance(node, Loop):
            added = [step.name for step in node.body if is_start(step)]
            kept.append(replace(node, body=tuple(step for step in node.body if not is_start(step))))
            kept += [Step("let", name, values[name]) for name in added]
        elif not is_start(node):
            kept.append(node)
    return tuple(kept)


def multiple_name(rate: Symbol, times: int) -> str:
    return f"{rate.name}_times_{times}"


def slope_name(name: str, column: Column) -> str:
    return f"{name}_by_{column.name}"


def put_slope(step: Step, column: Column, d: Expression) -> list[Step]:
    """The slope of an output, where it is wanted."""
    target = column.target(step.target)
    return [] if target is None else [Step("put", target.array.name, d, target)]


def in_order(body: Iterable[Step | Loop]) -> Body:
    """The steps, each slope behind the steps that its rule reads."""
    lines = list(body)
    places = {node.name: place for place, node in enumerate(lines) if isinstance(node, Step) and node.kind == "let"}
    at = lambda place, node: (  # noqa: E731
        max([place, *(places.get(name, 0) for name in symbols(node.expression))])
        if isinstance(node, Step) and node.kind == "let"
        else place
    )
    keys = [at(place, node) for place, node in enumerate(lines)]
    return tuple(
        lines[place] for place in sorted(range(len(lines)), key=lambda place: (keys[place], keys[place] != place))
    )


def sums_of_one_loop(body: Body) -> set[str]:
    """What one loop adds up, and nothing reads or changes within a loop."""
    loops = [node for node in body if isinstance(node, Loop)]
    inside = [(place, step) for place, loop in enumerate(loops) for step in steps(loop.body)]
    read = set().union(*(symbols(step.expression) for _, step in inside))
    outside = [(None, node) for node in body if isinstance(node, Step)]
    changes = {(s.name, s.kind, place) for place, s in (*inside, *outside) if s.kind in ("add", "update")}
    count = Counter(name for name, *_ in changes)
    return {name for name, kind, place in changes if count[name] == 1 and kind == "add" and place is not None} - read


def changes_in_loops(body: Body) -> bool:
    """Whether a loop over the wheels changes what it reads."""
    loops = [node for node in body if isinstance(node, Loop)]
    return any(step.kind == "update" for loop in loops for step in steps(loop.body))

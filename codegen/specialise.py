"""The kernel of a set of effects, made from the programs that hold every effect.

An effect that is absent is its symbols at their neutral values, which the registry of effects names: they are put in,
what becomes zero is dropped, and so are the arguments, the fields of the model and the functions that belong to it.
Nothing of it is left: no branch, no product with zero, no state.
"""

import hashlib
from collections.abc import Collection, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from types import MappingProxyType

from .along import ALONG, SECOND, Along
from .derivatives import REQUEST, SHARP, Derivatives, putting
from .expressions import Canonical, Expression, Number, Order, Symbol, symbols
from .programs import (
    CONSTANTS,
    Array,
    ContractError,
    EffectSet,
    Element,
    Function,
    Loop,
    Step,
    steps,
    without_dead_steps,
)

LONGEST_NAME = 150
# Effects that most scenes do not have, and that each general set has: the engine has a form of nu' without all of them.
OFTEN_ABSENT = (
    "axle_sticking",
    "roller_sticking",
    "axle_viscous",
    "axle_coulomb",
    "roller_viscous",
    "roller_coulomb",
    "slope",
)


@dataclass(frozen=True)
class State:
    """A quantity that an effect integrates.

    function  generated function whose output `rate` is its rate
    kind      core, where it feeds back, or account
    size      what it is measured in: energy, momentum or speed
    models    roller models that have it
    case      effects beside which it is there; "-x" stands for x absent
    """

    name: str
    function: str
    rate: str
    kind: str
    size: str
    models: tuple[str, ...]
    case: tuple[str, ...]


@dataclass(frozen=True)
class Registry:
    """The effects that a set may have beside its roller model, in order.

    neutral  {name: {symbol: neutral value}}
    needs    {name: effects without which it does nothing}
    states   what effects integrate beside nu, chi and the pose, in the registry's order
    """

    neutral: Mapping[str, Mapping[str, Expression]]
    needs: Mapping[str, Sequence[str]]
    states: Sequence["State"] = ()
    derivatives: Derivatives = Derivatives.read({})

    @classmethod
    def read(cls, effects: Sequence[Mapping], derivatives: Mapping = MappingProxyType({})) -> "Registry":
        """From the effects of the derivation's data and what it says of derivatives; those that are not optional are
        no choice."""
        read = Canonical(Order()).read
        chosen = [effect for effect in effects if effect.get("optional")]
        states = [s for effect in chosen for s in effect.get("states", ()) if s["size"] != "angle"]
        return cls(
            {e["name"]: {symbol: read(value) for symbol, value in e["neutral"].items()} for e in chosen},
            {e["name"]: e.get("needs", ()) for e in chosen},
            tuple(
                State(
                    *(s[k] for k in ("name", "function", "rate", "kind", "size")), tuple(s["models"]), tuple(s["case"])
                )
                for s in states
            ),
            Derivatives.read(derivatives),
        )

    @property
    def reads(self) -> dict[str, set[str]]:
        """What is needed beside what a step reads, by the step's name: what its slope reads, and what stands in its
        place where an effect is absent."""
        found = {name: set(read) for name, read in self.derivatives.rules.reads.items()}
        for values in self.neutral.values():
            for symbol, value in values.items():
                found[symbol] = found.get(symbol, set()) | symbols(value)
        return found

    def integrated(self, effects: "EffectSet") -> list[State]:
        """What a set integrates beside nu, chi and the pose."""
        states = [s for s in self.states if effects.base in s.models and is_there(s.case, effects.effects)]
        return list({state.name: state for state in reversed(states)}.values())[::-1]

    def ordered(self, effects: Sequence[str]) -> tuple[str, ...]:
        """The effects and what they need, in the registry's order. ContractError for one that it does not know."""
        asked = sorted({name for name in effects if name.startswith(REQUEST) or name in (ALONG, SECOND)})
        unknown = sorted({*effects} - self.neutral.keys() - {*asked})
        if unknown:
            raise ContractError(f"unknown effects: {', '.join(unknown)}")
        needs = any(name.startswith(REQUEST) or name == SECOND for name in asked)
        own = {*effects, *([REQUEST.removesuffix("_by_")] if needs else [])} - {*asked}
        wanted = {*own, *(needed for name in own for needed in self.needs[name])}
        return (*(name for name in self.neutral if name in wanted), *asked)

    def set_name(self, base: str, effects: Sequence[str]) -> str:
        """The name of a set: its roller model and its effects, without those that another one needs."""
        return set_name(base, effects, self.needs)

    def absent(self, effects: Sequence[str]) -> dict[str, Expression]:
        """The neutral values of all symbols of the effects that are not there. Such symbols in them have theirs."""
        found = {
            symbol: value
            for name, values in self.neutral.items()
            if name not in effects
            for symbol, value in values.items()
        }
        own = Canonical(Order())
        return {s: own.substituted(v, found) if symbols(v) & found.keys() else v for s, v in found.items()}


def set_name(base: str, effects: Sequence[str], needs: Mapping[str, Sequence[str]]) -> str:
    """The set of a roller model and further effects; what another one of them needs is not named. A name too long for a
    file ends in a digest of it."""
    implied = {needed for name in effects for needed in needs.get(name, ())}
    named = [name for name in effects if name not in implied and not name.startswith(REQUEST)]
    asked = [name.removeprefix(REQUEST) for name in effects if name.startswith(REQUEST)]
    name = "_".join([base, *named, *(["by"] if asked else []), *asked])
    if len(name) <= LONGEST_NAME:
        return name
    return f"{name[:LONGEST_NAME]}_{hashlib.sha256(name.encode()).hexdigest()[:16]}"


def specialised(
    base: EffectSet,
    effects: Sequence[str],
    registry: Registry,
    meaning: str = "",
    names: Collection[str] | None = None,
) -> EffectSet:
    """The set of the base's roller model with these further effects, with what they need, and no others.

    names  of the functions that it has; None: all that the effects call for
    """
    present = registry.ordered(effects)
    name, neutral = registry.set_name(base.name, present), registry.absent(present)
    fields = _there(base.fields, present)
    by_numbers = any(effect.startswith(REQUEST) for effect in present)
    beside = registry.derivatives.rules.reads if by_numbers else {}
    functions = [
        _function(replace(f, set=name, fields=fields), present, neutral, beside)
        for f in base.functions
        if is_called_for(f, present) and (names is None or f.name in names)
    ]
    known = _known_fields(functions)
    if known:
        fields = tuple(field for field in fields if field.name not in known)
        functions = [_function(replace(f, fields=fields), present, known, beside) for f in functions]
    values = neutral | known
    derivatives = registry.derivatives.at(values)
    if ALONG in present:
        functions, fields = Along.of(derivatives.rules, base.functions, values).functions(functions, fields)
    else:
        functions, fields = derivatives.added(functions, fields, present)
        functions += Along.of(derivatives.rules, base.functions, values, is_fixed=True).beside(functions, present)
    return EffectSet(name, present, meaning, *_needed(fields, tuple(functions)), base=base.name)


def without(
    effects: EffectSet, registry: Registry, absent: Sequence[str], name: str, case: str, known: Mapping[str, Expression]
) -> list[Function]:
    """A function of a set, and its form for sharp tips, while some of its effects do nothing; with the same arguments.

    absent  these effects
    case    what stands behind its name then
    known   values of other symbols then
    """
    values = {symbol: value for effect in absent for symbol, value in registry.neutral[effect].items()} | known
    found = [f for f in (effects.function(name), effects.function(f"{name}{SHARP}")) if f is not None]
    renamed = [replace(f, name=f.name.replace(name, f"{name}{case}")) for f in found]
    own = [_function(f, effects.effects, values, {}) for f in renamed]
    return [replace(f, arguments=whole.arguments) for f, whole in zip(own, renamed, strict=True)]


def _known_fields(functions: Sequence[Function]) -> dict[str, Expression]:
    """Fields that `prepare` gives a number, which then stands wherever they are read."""
    puts = [step for f in functions if f.prepares for step in steps(f.body) if step.kind == "put"]
    known = [step for step in puts if isinstance(step.expression, Number) and not step.target.index]
    return {step.name: step.expression for step in known}


def _needed(
    fields: tuple[Array, ...], functions: tuple[Function, ...]
) -> tuple[tuple[Array, ...], tuple[Function, ...]]:
    """The fields of the model that a function reads, and the functions with these: what nobody reads is not kept."""
    read = {e.array.name for f in functions if not f.prepares for e in _elements_read(f)}
    kept = tuple(field for field in fields if field.name in read)
    return kept, tuple(_prepared(f, kept) if f.prepares else replace(f, fields=kept) for f in functions)


def _elements_read(function: Function) -> list[Element]:
    used = set().union(*(symbols(step.expression) for step in steps(function.body)))
    return [element for symbol, element in function.elements.items() if symbol in used]


def _prepared(prepare: Function, fields: tuple[Array, ...]) -> Function:
    """`prepare` for these fields alone, with the arguments that it then needs."""
    names = {field.name for field in fields}
    body = without_dead_steps(replace(prepare, fields=fields, body=putting(prepare.body, names)))
    needed = {element.array.name for element in _elements_read(body)}
    return replace(body, arguments=tuple(a for a in prepare.arguments if a.name in needed))


def is_called_for(function: Function, present: Sequence[str]) -> bool:
    """Whether one of the function's cases holds."""
    return any(is_there(case, present) for case in function.cases)


def is_there(case: Sequence[str], present: Sequence[str]) -> bool:
    """Whether a case holds; "-x" stands for x absent."""
    return all(effect[1:] not in present if effect.startswith("-") else effect in present for effect in case)


def _there(arrays: Sequence[Array], present: Sequence[str]) -> tuple[Array, ...]:
    return tuple(array for array in arrays if not array.effect or array.effect in present)


def _function(
    function: Function, present: Sequence[str], neutral: Mapping[str, Expression], beside: Mapping[str, Set[str]]
) -> Function:
    """A function with these effects alone; beside: what slopes of its steps read, where these are asked for."""
    arguments = _there(function.arguments, present)
    known = {array.name for array in (*arguments, *function.fields)}
    elements = {symbol: e for symbol, e in function.elements.items() if e.array.name in known}
    names = [*function.elements, *(step.name for step in steps(function.body)), *CONSTANTS]
    by_rules = frozenset().union(*(beside.get(step.name, ()) for step in steps(function.body)))
    body = _Specialiser(Canonical(Order(names)), known, by_rules).block(function.body, dict(neutral))
    left = without_dead_steps(replace(function, arguments=arguments, elements=elements, body=body), beside)
    return replace(left, arguments=_asked_for(left, arguments))


def _asked_for(function: Function, arguments: Sequence[Array]) -> tuple[Array, ...]:
    """The arguments without those that an effect brings and no step reads, as where it acts through another one alone
    that is absent."""
    read = {element.array.name for element in _elements_read(function)}
    return tuple(a for a in arguments if not a.effect or a.role == "out" or a.name in read)


@dataclass
class _Specialiser:
    canonical: Canonical
    arrays: set[str]  # arguments and fields that are there
    by_rules: frozenset[str]  # what slopes of steps read by name: these steps stay, whatever their values

    def block(self, body: tuple[Step | Loop, ...], values: dict[str, Expression]) -> tuple[Step | Loop, ...]:
        """The steps that are left. values: what symbols stand for, here and around."""
        values, kept = dict(values), []
        accumulators = {step.name for step in steps(body) if step.kind == "var"}
        for node in body:
            if isinstance(node, Loop):
                inner = self.block(node.body, values)
                kept += [replace(node, body=inner)] if inner else []
            elif not self.is_dropped(node, values):
                expression = self.canonical.substituted(node.expression, values)
                if node.kind == "let" and node.name not in self.by_rules and is_trivial(expression, accumulators):
                    values[node.name] = expression
                elif not (node.kind == "add" and expression == Number(0)):
                    kept.append(replace(node, expression=expression))
        return tuple(kept)

    def is_dropped(self, step: Step, values: Mapping[str, Expression]) -> bool:
        """Whether the step gives a value to what has its neutral one, or to an array that is not there."""
        return step.name not in self.arrays if step.kind == "put" else step.name in values


def is_trivial(e: Expression, accumulators: set[str]) -> bool:
    """A number, or another name for what does not change."""
    return isinstance(e, Number) or (isinstance(e, Symbol) and not symbols(e) & accumulators)

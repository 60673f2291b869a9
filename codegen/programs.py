"""A kernel as steps: what the derivation says of one function, checked, with canonical expressions.

A scope is one block of the program: the function's own block, or one loop's. Loops run over wheels ("i",
index 0 ... N-1) and over free-roller slots ("j", index 0 ... n-2). A symbol comes from one of these places:
  - the model's fields and the arguments' elements, which need the loops that their indices name;
  - N, n (the two counts), slot (1 ... n-1 in a "j" loop) and pi;
  - in a "k" loop, which goes over all wheels within an "i" loop and which derivatives alone have: own, 1 where the two
    wheels are the same and 0 elsewhere;
  - elements of outputs that the function has put there itself, to read them again: its own wheel's, and in a loop over
    the earlier wheels ("earlier", index 0 ... i-1) theirs;
  - steps: `let` (assigned once), `var` (an accumulator: declared, then changed by `add` and `update`).

Steps that belong together are a group: in the data {"use": name} stands for the steps of that name. Groups are opened
while a function is read; each step keeps the name of its group.
"""

import re
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from .expressions import Canonical, Expression, Order, symbols

EARLIER = "earlier"
INDICES = ("i", "j", "k", EARLIER)
OWN = "own"
CONSTANTS = {"N": "", "n": "", "pi": "", "slot": "j", OWN: "ik"}  # name: indices that it needs
SHAPES = {"N": "i", "n-1": "j"}
IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")


class ContractError(ValueError):
    """The derivation's data is not what codegen can render; the message names the function and the step."""


@dataclass(frozen=True)
class Array:
    """A model field or an argument. shape: integers, "N", "n-1"; role: in, out, field."""

    name: str
    shape: tuple[int | str, ...]
    role: str
    unit: str
    meaning: str
    effect: str = ""  # the effect that it belongs to; without that it is not there

    @property
    def indices(self) -> tuple[str, ...]:
        """The loops that one element needs."""
        return tuple(SHAPES[size] for size in self.shape if size in SHAPES)


@dataclass(frozen=True)
class Element:
    """One element of an array, for instance spins[i][j]."""

    array: Array
    index: tuple[int | str, ...]


@dataclass(frozen=True)
class Step:
    """kind: let, var, add, update (a name), put (a target), load (a name; the target it is read from, or
    none for a constant)."""

    kind: str
    name: str
    expression: Expression | None = None
    target: Element | None = None
    group: str = ""  # the group of steps that it is one of


@dataclass(frozen=True)
class Loop:
    index: str
    body: tuple["Step | Loop", ...]


@dataclass(frozen=True)
class Function:
    set: str
    name: str
    summary: str
    equations: tuple[str, ...]
    arguments: tuple[Array, ...]
    fields: tuple[Array, ...]  # the model's; empty for a set without a model
    elements: dict[str, Element]  # every symbol that is read from an array
    body: tuple[Step | Loop, ...]
    cases: tuple[tuple[str, ...], ...] = ((),)  # effects that call for the function, see specialise.py
    groups: tuple[str, ...] = ()  # the groups of steps that it is made of, in order
    sources: Mapping[str, str] = field(default_factory=dict)  # the file in maxima/ of each group

    @property
    def inputs(self) -> list[Array]:
        return [a for a in self.arguments if a.role == "in"]

    @property
    def outputs(self) -> list[Array]:
        return [a for a in self.arguments if a.role == "out"]

    @property
    def prepares(self) -> bool:
        """Whether this function writes the model instead of reading it."""
        return self.name == "prepare" and bool(self.fields)

    @property
    def reads_model(self) -> bool:
        return bool(self.fields) and not self.prepares


@dataclass(frozen=True)
class EffectSet:
    """The functions of a set of effects, with the fields of its model.

    A base has the programs of one roller model with every effect in them; `effects` are those that make the model. The
    set that is made of a base has `effects` beside those.
    """

    name: str
    effects: tuple[str, ...]
    meaning: str
    fields: tuple[Array, ...]
    functions: tuple[Function, ...]
    base: str = ""

    def function(self, name: str) -> Function | None:
        return next((f for f in self.functions if f.name == name), None)


def steps(body: tuple[Step | Loop, ...]) -> Iterator[Step]:
    """All steps, in order, those in loops once."""
    for node in body:
        if isinstance(node, Loop):
            yield from steps(node.body)
        else:
            yield node


def without_dead_steps(function: Function, beside: Mapping[str, Set[str]] = MappingProxyType({})) -> Function:
    """The function without steps that no output depends on, and with the groups of those that are left.

    beside: by the name of a step, what is needed where the step is beside what it reads itself, as what its slope reads
    """
    needed: set[str] = set()
    body = _live(function.body, needed)[0]
    while not (further := set().union(*(beside.get(step.name, ()) for step in steps(body)))) <= needed:
        needed |= further
        body = _live(function.body, needed)[0]
    return replace(function, body=body, groups=tuple(dict.fromkeys(s.group for s in steps(body) if s.group)))


def _live(body: tuple[Step | Loop, ...], after: set[str]) -> tuple[tuple[Step | Loop, ...], set[str]]:
    """(the steps that are needed, the names needed before them). after: names needed after the last step."""
    needed, kept = set(after), []
    for node in reversed(body):
        if isinstance(node, Loop):
            inner, before = _live(node.body, needed)
            while not before <= needed:  # a turn of the loop reads what the turn before it has written
                needed |= before
                inner, before = _live(node.body, needed)
            kept += [replace(node, body=inner)] if inner else []
        elif node.kind == "put" or node.name in needed:
            if node.kind in ("let", "var"):
                needed.discard(node.name)
            needed |= symbols(node.expression)
            kept.append(node)
    return tuple(reversed(kept)), needed


def read_array(name: str, table: Mapping[str, dict], role: str, where: str) -> Array:
    """The array `name` of the data's table of fields or of arguments; where: the set or function that has it."""
    if name not in table:
        raise ContractError(f"{where}: {name} is not in the table of {'fields' if role == 'field' else 'arguments'}")
    data = table[name]
    shape = tuple(data["shape"])
    if any(not isinstance(size, int) and size not in SHAPES for size in shape):
        raise ContractError(f"{name}: unknown shape {list(shape)}")
    return Array(name, shape, role, data.get("unit", ""), data.get("meaning", ""), data.get("effect", ""))


def read_function(
    data: dict,
    fields: tuple[Array, ...],
    set_name: str,
    table: Mapping[str, dict],
    groups: Mapping[str, dict] | None = None,
    beside: Mapping[str, Set[str]] = MappingProxyType({}),
) -> Function:
    """The function of the JSON form, for one of its sets. ContractError where it breaks the contract.

    table: the data's arguments by name; groups: its groups of steps by name, {"body": steps, ...} each;
    beside: by the name of a step, what is needed where the step is beside what it reads itself: what its slope reads,
    and what stands in its place in some sets.
    """
    where = f"{set_name}.{data['name']}"
    try:
        opened = list(_opened(data["body"], groups or {}))
        arguments = _arguments(data, table, where, has_model=bool(fields))
        function = Function(
            set_name, data["name"], data["summary"], tuple(data["equations"]), arguments, fields, {}, (),
            tuple(map(tuple, data.get("cases", [[]]))),
            sources={name: of["source"] for name, of in (groups or {}).items()},
        )  # fmt: skip
        elements = _elements(function, table)
        names = [*elements, *_declared(opened), *CONSTANTS]
        reader = _Reader(replace(function, elements=elements), Canonical(Order(names)))
        return without_dead_steps(replace(reader.function, body=reader.block(opened, {}, ())), beside)
    except (KeyError, TypeError, ValueError) as problem:
        kind = f"{type(problem).__name__}: " if isinstance(problem, KeyError) else ""
        raise ContractError(f"{where}: {kind}{problem}") from problem


def _opened(body: list, groups: Mapping[str, dict], group: str = "") -> Iterator[dict]:
    """The steps with each {"use": name} replaced by that group's steps."""
    for node in body:
        if "use" in node:
            if node["use"] not in groups:
                raise ContractError(f"no group of steps {node['use']}")
            yield from _opened(groups[node["use"]]["body"], groups, node["use"])
        elif "loop" in node:
            yield node | {"body": list(_opened(node["body"], groups, group))}
        else:
            yield node | {"group": group}


def _declared(body: list) -> Iterator[str]:
    for node in body:
        yield from (_declared(node["body"]) if "loop" in node else filter(None, [node.get("let"), node.get("var")]))


def _arguments(data: dict, table: Mapping[str, dict], where: str, has_model: bool) -> tuple[Array, ...]:
    """The inputs, then the outputs. Only where there is a model do they belong to effects. An input that the function
    takes beside an effect alone is [name, effect]."""
    given = [(name, "") if isinstance(name, str) else tuple(name) for name in data["inputs"]]
    arrays = [read_array(name, table, "in", where) for name, _ in given]
    arrays = [replace(a, effect=effect or a.effect) for a, (_, effect) in zip(arrays, given, strict=True)]
    arrays += [read_array(name, table, "out", where) for name in data["outputs"]]
    return tuple(arrays if has_model else (replace(array, effect="") for array in arrays))


def _elements(function: Function, table: Mapping[str, dict]) -> dict[str, Element]:
    """Symbols read from arrays: the model's fields and scalar inputs by their own name, then what the table of
    arguments names, of outputs what is kept in them.
    """
    inputs = function.inputs
    own = [*(function.fields if function.reads_model else ()), *(a for a in inputs if not a.shape)]
    elements = {a.name: Element(a, a.indices) for a in own}
    for array in inputs:
        for symbol, (name, *index) in table[array.name].get("elements", {}).items():
            if name != array.name:
                raise ContractError(f"element {symbol}: of {name}, and stands with {array.name}")
            elements[symbol] = _element(array, index)
    for array in function.outputs:
        for symbol, (_, *index) in table[array.name].get("kept", {}).items():
            elements[symbol] = _element(array, index)
    return elements


def _element(array: Array, index: list) -> Element:
    if len(index) != len(array.shape) or not all(map(_fits, index, array.shape)):
        raise ContractError(f"{array.name}: index {list(index)} does not fit shape {list(array.shape)}")
    return Element(array, tuple(index))


def _fits(k: int | str, size: int | str) -> bool:
    if isinstance(k, int) and isinstance(size, int):
        return 0 <= k < size
    return isinstance(size, str) and (SHAPES.get(size) == k or (size, k) == ("N", EARLIER))


@dataclass
class _Reader:
    function: Function
    canonical: Canonical

    def block(self, body: list, known: dict[str, str], indices: tuple[str, ...]) -> tuple[Step | Loop, ...]:
        """Steps of one scope. known: kinds of the steps' names so far, in this scope and around it."""
        known = dict(known)
        return tuple(self.node(node, known, indices) for node in body)

    def node(self, node: dict, known: dict[str, str], indices: tuple[str, ...]) -> Step | Loop:
        if "loop" in node:
            index = node["loop"]
            known_index = index in SHAPES.values() or (index, indices) == (EARLIER, ("i",))
            if not known_index or index in indices or (index == "i" and indices):
                raise ContractError(f"loop over {index} within {list(indices)}")
            return Loop(index, self.block(node["body"], known, (*indices, index)))
        kind = next((k for k in ("let", "var", "add", "update", "put") if k in node), None)
        if kind is None:
            raise ContractError(f"unknown step {sorted(node)}")
        expression = self.canonical.read(node["expr"])
        for name in sorted(symbols(expression)):
            self.check_symbol(name, node[kind], known, indices)
        if kind == "put":
            return Step("put", node["put"][0], expression, self.target(node["put"], indices), node["group"])
        name = node[kind]
        self.check_name(kind, name, known)
        known.setdefault(name, kind)
        return Step(kind, name, expression, group=node["group"])

    def check_symbol(self, name: str, where: object, known: dict[str, str], indices: tuple[str, ...]) -> None:
        if name in known:
            return
        if name in CONSTANTS:
            needs = tuple(CONSTANTS[name])
        elif name in self.function.elements:
            needs = tuple(k for k in self.function.elements[name].index if k in INDICES)
        else:
            raise ContractError(f"{where}: unknown symbol {name}")
        if not set(needs) <= set(indices):
            raise ContractError(f"{where}: {name} stands outside the loop over {', '.join(needs)}")

    def check_name(self, kind: str, name: str, known: dict[str, str]) -> None:
        if kind in ("add", "update"):
            if known.get(name) != "var":
                raise ContractError(f"{kind} {name}: not a var here")
        elif name in known or name in self.function.elements or name in CONSTANTS or name in INDICES:
            raise ContractError(f"{kind} {name}: the name is taken")
        elif not IDENTIFIER.match(name):
            raise ContractError(f"{kind} {name}: not an identifier")

    def target(self, put: list, indices: tuple[str, ...]) -> Element:
        name, *index = put
        targets = self.function.fields if self.function.prepares else self.function.outputs
        array = next((a for a in targets if a.name == name), None)
        if array is None:
            raise ContractError(f"put {put}: no such output")
        element = _element(array, index)
        if any(k in INDICES and k not in indices for k in index):
            raise ContractError(f"put {put}: outside its loop")
        return element


def signature_to_json(function: Function) -> dict:
    """What a function is called with, as data."""
    return {
        "set": function.set,
        "name": function.name,
        "summary": function.summary,
        "equations": list(function.equations),
        "arguments": [array_to_json(a) | {"role": a.role} for a in function.arguments],
    }


def array_to_json(array: Array) -> dict:
    data = {"name": array.name, "shape": list(array.shape), "unit": array.unit, "meaning": array.meaning}
    return data | ({"effect": array.effect} if array.effect else {})

"""Scopes: every symbol of a function gets a name of its own and the loop that it lives in.

Then an expression says by itself how far out of the loops it can move, and two equal expressions are one
value.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from .expressions import Expression, Symbol, operands, symbols, with_operands
from .programs import CONSTANTS, INDICES, Function, Loop, Step, steps

Scope = tuple[tuple[str, int], ...]  # loops around a step, outermost first: (index, number of the loop)


@dataclass(frozen=True)
class Placed:
    """A step whose symbols are unique in the function, and the scope where it stands."""

    step: Step
    scope: Scope


@dataclass(frozen=True)
class PlacedLoop:
    scope: Scope
    body: "tuple[Placed | PlacedLoop, ...]"


def flat(body: "tuple[Placed | PlacedLoop, ...]") -> Iterator[Placed]:
    """All steps, in order."""
    for node in body:
        if isinstance(node, Placed):
            yield node
        else:
            yield from flat(node.body)


def rename(e: Expression, names: dict[str, str]) -> Expression:
    if isinstance(e, Symbol):
        return Symbol(names.get(e.name, e.name))
    return with_operands(e, [rename(part, names) for part in operands(e)])


@dataclass
class Names:
    """Gives each symbol of each scope a unique name, `symbol@number`, and remembers the scope that it lives
    in.

    An accumulator gets a new name in every step until its last change, so that nothing made of it is shared;
    after that it is as good as a `let`.
    """

    function: Function
    home: dict[str, Scope] = field(default_factory=dict)
    plain: dict[str, str] = field(default_factory=dict)  # unique name: name in the program
    elements: dict[tuple[str, Scope], str] = field(default_factory=dict)  # unique names of what arrays hold
    loops: int = 0

    def unique(self, name: str, scope: Scope) -> str:
        new = f"{name}@{len(self.plain)}"
        self.home[new], self.plain[new] = scope, name
        return new

    def block(self, body: tuple, scope: Scope = (), known: dict[str, str | None] | None = None) -> tuple:
        """The steps of one scope, placed. known: unique names of earlier steps; None while an accumulator
        changes.
        """
        known = dict(known or {})
        own = {node.name for node in body if isinstance(node, Step) and node.kind == "var"}
        placed: list[Placed | PlacedLoop] = []
        for place, node in enumerate(body):
            if isinstance(node, Loop):
                self.loops += 1
                inner = (*scope, (node.index, self.loops))
                placed.append(PlacedLoop(inner, self.block(node.body, inner, known)))
            else:
                placed.append(self.step(node, scope, known))
            changed_later = {step.name for step in steps(body[place + 1 :]) if step.kind in ("add", "update")}
            for name in own & known.keys() - changed_later:
                known[name] = known[name] or self.unique(name, scope)
        return tuple(placed)

    def step(self, step: Step, scope: Scope, known: dict[str, str | None]) -> Placed:
        renamed = {name: self.use(name, scope, known) for name in sorted(symbols(step.expression))}
        expression, name = rename(step.expression, renamed), step.name
        if step.kind == "let":
            name = self.unique(name, scope)
            known[step.name] = name
        elif step.kind == "var":
            known[name] = None
        return Placed(replace(step, name=name, expression=expression), scope)

    def use(self, name: str, scope: Scope, known: dict[str, str | None]) -> str:
        """Unique name of a symbol that a step of this scope reads."""
        if name in known:
            return known[name] or self.unique(name, scope)
        element = self.function.elements.get(name)
        needs = element.index if element else CONSTANTS[name]
        depth = max((d for d, (index, _) in enumerate(scope, 1) if index in needs and index in INDICES), default=0)
        key = (name, scope[:depth])
        if key not in self.elements:
            self.elements[key] = self.unique(*key)
        return self.elements[key]

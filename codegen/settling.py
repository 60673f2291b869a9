"""Accumulators that nothing is left to add to, made into what they are.

In a program that holds every effect many sums are for effects alone. Where these are absent, and along a direction that
does not move them, such a sum stays at its start; it costs a name and an addition wherever it is read. Here it becomes
its value, and so does a sum up to what is added right in its block.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from .expressions import ZERO, Canonical, Expression, Number, Order, Symbol, symbols
from .programs import CONSTANTS, Function, Loop, Step, steps, without_dead_steps

Body = tuple[Step | Loop, ...]


def settled(function: Function) -> Function:
    """The same function without accumulators that are none."""
    names = [*function.elements, *(step.name for step in steps(function.body)), *CONSTANTS]
    settler = _Settler(Canonical(Order(names)))
    body, before = function.body, None
    while body != before:
        body, before = settler.block(settler.joined(body), {}), body
    return without_dead_steps(replace(function, body=body))


def changed(body: Body) -> set[str]:
    """What is added to or changed."""
    return {step.name for step in steps(body) if step.kind in ("add", "update")}


@dataclass
class _Settler:
    canonical: Canonical

    def joined(self, body: Body) -> Body:
        """The steps where a sum starts behind what is added to it in its own block before all else that knows it."""
        kept: list[Step | Loop] = []
        for node in body:
            if isinstance(node, Loop):
                kept.append(replace(node, body=self.joined(node.body)))
                continue
            start = self.start_of(node, kept) if node.kind == "add" else None
            if start is None:
                kept.append(node)
            else:
                whole = self.canonical.sum([kept.pop(start).expression, node.expression])
                kept.append(replace(node, kind="var", expression=whole))
        return tuple(kept)

    def start_of(self, node: Step, before: list[Step | Loop]) -> int | None:
        """Where the sum starts that a step adds to, if nothing in between knows it or changes what its start reads."""
        for place in range(len(before) - 1, -1, -1):
            other = before[place]
            if isinstance(other, Step) and other.kind == "var" and other.name == node.name:
                later = changed(tuple(before[place + 1 :]))
                return None if symbols(other.expression) & later else place
            inside = list(steps((other,)))
            if any(step.name == node.name or node.name in symbols(step.expression) for step in inside):
                return None
        return None

    def block(self, body: Body, values: Mapping[str, Expression]) -> Body:
        """The steps that are left. values: what symbols stand for, here and around."""
        values, kept, moving = dict(values), [], changed(body)
        for node in body:
            if isinstance(node, Loop):
                inner = self.block(node.body, values)
                kept += [replace(node, body=inner)] if inner else []
                continue
            expression = self.canonical.substituted(node.expression, values)
            kind = "let" if node.kind == "var" and node.name not in moving else node.kind
            if kind == "let" and is_settled(expression, moving):
                values[node.name] = expression
            elif not (kind == "add" and expression == ZERO):
                kept.append(replace(node, kind=kind, expression=expression))
        return tuple(kept)


def is_settled(e: Expression, moving: set[str]) -> bool:
    """A number, or another name for what does not change."""
    return isinstance(e, Number) or isinstance(e, Symbol) and e.name not in moving

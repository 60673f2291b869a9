"""Accumulators that nothing is left to add to, made into what they are.

In a program that holds every effect many sums are for effects alone. Where these are absent, and along a direction that
does not move them, such a sum stays at its start; it costs a name and an addition wherever it is read. Here it becomes
its value, and so does a sum up to what is added right in its block.

What is differentiated by numbers is tightened besides: products that one other product alone reads are part of it, and
a factor that terms have in common is taken out of their sum. Before it is differentiated, factors that a loop does not
change are taken out of what it adds up.
"""

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from .expressions import (
    ZERO,
    Canonical,
    Expression,
    Number,
    Order,
    Product,
    Sum,
    Symbol,
    operands,
    split_coefficient,
    symbols,
    with_coefficient,
    with_operands,
)
from .programs import CONSTANTS, Function, Loop, Step, steps, without_dead_steps

Body = tuple[Step | Loop, ...]


def settled(function: Function) -> Function:
    """The same function without accumulators that are none."""
    settler, body, before = settler_of(function), function.body, None
    while body != before:
        body, before = settler.block(settler.joined(body), {}), body
    return without_dead_steps(replace(function, body=body))


def tightened(function: Function) -> Function:
    """The same settled, with products in one piece and common factors taken out of sums."""
    found = settled(function)
    body = settler_of(found).opened(found.body)
    return without_dead_steps(replace(found, body=body))


def taken_out(function: Function) -> Function:
    """The same function where factors that a loop does not change are taken out of what it adds up: the slopes of these
    need no sum of their own."""
    changes = Counter(step.name for step in steps(function.body) if step.kind in ("add", "update"))
    known = {name for name, element in function.elements.items() if not element.index}
    known |= {node.name for node in function.body if isinstance(node, Step) and node.kind == "let"}
    starts = {
        node.name: node for node in function.body
        if isinstance(node, Step) and node.kind == "var" and node.expression == ZERO and changes[node.name] == 1
    }  # fmt: skip
    out: dict[str, list[Expression]] = {}
    kept: list[Step | Loop] = []
    for node in function.body:
        own = _factors(node, starts.keys(), known) if isinstance(node, Loop) else {}
        kept.append(replace(node, body=tuple(_without(step, own) for step in node.body)) if own else node)
        for name, factors in own.items():
            kept.append(replace(starts[name], kind="let", expression=Product((*factors, Symbol(apart(name))))))
        out |= own
    renamed = (replace(node, name=apart(node.name)) if node in starts.values() and node.name in out else node
               for node in kept)  # fmt: skip
    return replace(function, body=tuple(renamed))


def apart(name: str) -> str:
    """Of a sum without factors that were taken out of it."""
    return f"{name}_apart"


def _factors(loop: Loop, sums: Collection[str], known: set[str]) -> dict[str, list[Expression]]:
    """The factors, by the sum that a loop adds to and does not read, that are known before it."""
    read = set().union(*(symbols(step.expression) for step in steps(loop.body)))
    found = {}
    for step in loop.body:
        if isinstance(step, Step) and step.kind == "add" and step.name in sums and step.name not in read:
            _, factors = split_coefficient(step.expression)
            outside = [factor for factor in factors if isinstance(factor, Symbol) and factor.name in known]
            if 0 < len(outside) < len(factors):
                found[step.name] = outside
    return found


def _without(step: Step | Loop, factors: Mapping[str, list[Expression]]) -> Step | Loop:
    """A step that adds to a sum, without these factors of it."""
    if not (isinstance(step, Step) and step.name in factors):
        return step
    value, own = split_coefficient(step.expression)
    rest = with_coefficient(value, [factor for factor in own if factor not in factors[step.name]])
    return replace(step, name=apart(step.name), expression=rest)


def settler_of(function: Function) -> "_Settler":
    names = [*function.elements, *(step.name for step in steps(function.body)), *CONSTANTS]
    return _Settler(Canonical(Order(names)))


def users_in(body: Body) -> Counter:
    """How many steps read each name, and how often."""
    return Counter(name for step in steps(body) for name in names_in(step.expression))


def names_in(e: Expression) -> list[str]:
    return [e.name] if isinstance(e, Symbol) else [name for part in operands(e) for name in names_in(part)]


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

    def opened(self, body: Body) -> Body:
        """The steps where a product that one other product of its block alone reads is part of that: two factors that
        it has in common with other products are multiplied once then (sharing.py)."""
        moving, users = changed(body), users_in(body)
        alone = {
            node.name: node.expression
            for node in body
            if isinstance(node, Step) and node.kind == "let" and isinstance(node.expression, Product)
            and users[node.name] == 1 and not symbols(node.expression) & moving
        }  # fmt: skip
        kept: list[Step | Loop] = []
        for node in body:
            if isinstance(node, Loop):
                kept.append(replace(node, body=self.opened(node.body)))
            else:
                kept.append(replace(node, expression=self.collected(self.within_products(node.expression, alone))))
        return tuple(kept)

    def collected(self, e: Expression) -> Expression:
        """The expression where a symbol that several terms of a sum have in common is taken out of them once."""
        e = with_operands(e, [self.collected(part) for part in operands(e)])
        if not isinstance(e, Sum):
            return e
        terms = [split_coefficient(term) for term in e.terms]
        seen = Counter(f for _, factors in terms for f in factors if isinstance(f, Symbol) and len(factors) > 1)
        best = max(seen, key=lambda f: seen[f], default=None)
        if best is None or seen[best] < 2:
            return e
        c = self.canonical
        has = lambda factors: best in factors and len(factors) > 1  # noqa: E731
        inside = [c.product([Number(k), *(g for g in factors if g != best)]) for k, factors in terms if has(factors)]
        others = [with_coefficient(k, factors) for k, factors in terms if not has(factors)]
        return self.collected(c.sum([c.product([best, self.collected(c.sum(inside))]), *others]))

    def within_products(self, e: Expression, values: Mapping[str, Expression]) -> Expression:
        parts = [self.within_products(part, values) for part in operands(e)]
        if not isinstance(e, Product):
            return with_operands(e, parts)
        return self.canonical.product([
            self.within_products(values[f.name], values) if isinstance(f, Symbol) and f.name in values else f
            for f in parts
        ])  # fmt: skip

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

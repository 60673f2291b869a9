"""The number that a printed formula has: its LaTeX, evaluated for a NumericVehicle."""

import re
from dataclasses import dataclass, field

import numpy as np
from numeric_vehicle import NumericVehicle

from codegen.mathtext import Fraction, Leaf, Matrix, Node, Reader, Row, Script, text_of

TERM_ENDS = {"+", "-", "=", ",", ")", "]"}


@dataclass
class Evaluator:
    """index: the wheel (int) or free roller (pair) that each index letter stands for. p: formal momenta."""

    vehicle: NumericVehicle
    p: np.ndarray | None = None
    index: dict = field(default_factory=dict)
    extra: dict = field(default_factory=dict)

    def __call__(self, latex: str) -> object:
        return self.value(Reader.read(latex))

    def sides(self, latex: str) -> list[Node]:
        """What stands between the equality signs."""
        return split(Reader.read(latex), "=")

    def value(self, node: Node) -> object:
        items = list(node.items) if isinstance(node, Row) else [node]
        value, place = self.sum(items, 0)
        assert place == len(items), f"{text_of(node)}: stopped at item {place}"
        return value

    def sum(self, items, place):
        total, first = 0.0, True
        while place < len(items) and (first or sign_of(items[place]) in ("+", "-")):
            sign = 1
            while place < len(items) and sign_of(items[place]) in ("+", "-"):
                sign = -sign if sign_of(items[place]) == "-" else sign
                place += 1
            value, place = self.term(items, place)
            total, first = total + sign * value, False
        return total, place

    def term(self, items, place):
        value = 1.0
        while place < len(items) and sign_of(items[place]) not in TERM_ENDS:
            if isinstance(items[place], Leaf) and items[place].kind == "space":
                place += 1
                continue
            if is_sum(items[place]):
                inner, place = self.over(items, place)
            else:
                inner, place = self.factor(items, place)
            value = value @ inner if np.ndim(value) and np.ndim(inner) else value * inner
        return value, place

    def over(self, items, place):
        """The rest of the term, summed over the index below the sign."""
        below = items[place].below
        letter = text_of(below).strip()[0]
        wheels, rollers = range(self.vehicle.wheels), range(1, self.vehicle.rollers)
        values = [(i, j) for i in wheels for j in rollers] if letter == "s" else list(wheels)
        before, total, end = self.index, 0.0, place
        for number in values:
            self.index = before | {letter: number}
            if letter == "s":  # s is roller j of wheel i
                self.index |= {"i": number[0], "j": number}
            value, end = self.term(items, place + 1)
            total += value
        self.index = before
        return total, end

    def factor(self, items, place):
        node = items[place]
        if sign_of(node) in ("(", "["):
            return self.group(items, place)
        if isinstance(node, Leaf) and node.plain == "sigma" and sign_of(items[place + 1]) == "[":
            return self.sigma(items, place + 1)
        base, power = (node.base, node.above) if isinstance(node, Script) else (node, None)
        if isinstance(base, Leaf) and base.kind == "function":
            argument, end = self.factor(items, place + 1)
            return getattr(np, base.plain)(argument) ** (1 if power is None else self.value(power)), end
        return self.symbol(node), place + 1

    def group(self, items, place):
        """A bracket, perhaps with a power on its closing sign."""
        value, end = self.sum(items, place + 1)
        closing = items[end]
        power = closing.above if isinstance(closing, Script) else None
        return (value if power is None else value ** self.value(power)), end + 1

    def sigma(self, items, place):
        """sigma[f]: sum of f sin(chi)/rho^3 over the wheels, f of bare alpha, chi, rho."""
        total, end, before = 0.0, place, self.index
        for wheel in range(self.vehicle.wheels):
            self.index = before | {"": wheel}
            value, end = self.sum(items, place + 1)
            total += value * np.sin(self.vehicle.chi[wheel]) / self.rho(wheel) ** 3
        self.index = before
        return total, end + 1

    def symbol(self, node: Node) -> object:
        text = re.sub(r"[()\s]", "", text_of(node))
        known = self.known(text)
        if known is not None:
            return known
        match node:
            case Leaf("number", plain, _):
                return float(plain)
            case Row(items) if items and sign_of(items[0]) == "(":
                return self.value(Row(items[1:-1]))
            case Row():
                return self.value(node)
            case Fraction(above, below):
                return self.value(above) / self.value(below)
            case Script(base, None, Leaf(_, "*", _)):  # the print's star: formal momenta are put in
                return Evaluator(self.vehicle, self.vehicle.star, self.index, self.extra).symbol(base)
            case Script(base, below, above) if above is not None:
                inner = base if below is None else Script(base, below, None)
                return self.symbol(inner) ** self.value(above)
        raise KeyError(text)

    def rho(self, wheel):
        return self.vehicle.numbers["l"] * np.cos(self.vehicle.chi[wheel]) - self.vehicle.numbers["r"]

    def known(self, text: str) -> object:
        v = self.vehicle
        plain = (
            v.numbers
            | self.extra
            | {"theta": v.theta, "kappa_1": v.kappa_1, "pi": np.pi, "N": v.wheels, "n": v.rollers}
        )
        plain |= {"nu_1": v.nu[0], "nu_2": v.nu[1], "nu_3": v.nu[2], "nu": v.nu[:, None], "nu^T": v.nu[None, :]}
        if self.p is not None:
            plain |= dict(zip(("p_x", "p_y", "p_theta"), self.p[:3], strict=True))
        if text in plain:
            return plain[text]
        found = re.fullmatch(r"(alpha|chi|rho|tau|p_chi|p_phi|nu|M|kappa|chi')(?:_([iksj])1?)?(\^\*)?", text)
        if not found or (found[2] or "") not in self.index:
            return None
        return self.indexed(found[1], self.index[found[2] or ""])

    def indexed(self, name: str, at) -> object:
        v = self.vehicle
        if isinstance(at, tuple):
            wheel, roller = at
            return {
                "chi": v.chi[wheel] + v.kappa[roller],
                "kappa": v.kappa[roller],
                "nu": v.nu[v.speed_place(wheel, roller)],
                "p_phi": None if self.p is None else self.p[v.place(wheel, roller)],
            }[name]
        values = {"alpha": v.alphas[at], "chi": v.chi[at], "rho": self.rho(at), "chi'": v.rates[v.place(at)]}
        values["tau"] = np.sin(v.chi[at]) / self.rho(at) ** 2
        if name == "M":
            return v.Mi[at]
        if name in ("p_chi", "p_phi") and self.p is not None:
            return self.p[v.place(at) if name == "p_chi" else v.place(at, 0)]
        return values.get(name)

    def tuple(self, node: Node) -> list[float]:
        """factor(a, b, c, ...), perhaps cut off: its entries."""
        items = list(node.items)
        opening = next(k for k, item in enumerate(items) if sign_of(item) == "(")
        before, _ = self.term(items[:opening], 0)
        inner = split(Row(tuple(items[opening + 1 :])), ",")
        parts = [Row(tuple(i for i in part.items if sign_of(i) != ")")) for part in inner]
        return [before * self.value(part) for part in parts if part.items and "..." not in text_of(part)]

    def matrix(self, node: Matrix) -> list[list[object]]:
        return [[self.value(cell) if cell.items else 0.0 for cell in row] for row in node.rows]


def sign_of(node: Node) -> str:
    """The sign that a node is, or closes with."""
    base = node.base if isinstance(node, Script) else node
    return base.plain if isinstance(base, Leaf) and base.kind in ("sign", "fence") else ""


def is_sum(node: Node) -> bool:
    return isinstance(node, Script) and isinstance(node.base, Leaf) and node.base.plain == "sum"


def split(row: Row, sign: str) -> list[Row]:
    """The row's pieces between signs that stand in no bracket."""
    pieces, depth = [[]], 0
    for item in row.items:
        depth += (sign_of(item) in ("(", "[")) - (sign_of(item) in (")", "]"))
        if depth == 0 and isinstance(item, Leaf) and item.plain == sign:
            pieces.append([])
        else:
            pieces[-1].append(item)
    return [Row(tuple(piece)) for piece in pieces]

"""Taylor series of motions in which unknown forces keep something: y' = f(t, y, z), where z keeps h(y) = 0.

Each pass through f gives one more coefficient. What it leaves of the conditions is linear in the coefficients of z of
the same order, with a matrix that is known at the start, so that one small linear system gives them. Use it inside
omniroll.studies.accuracy.reference.digits, of an order larger by 2 than that of the series.
"""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from flint import arb, arb_mat, arb_series

PROBES = 12  # places within a step where a margin is looked at
HALVINGS = 8  # before Newton's rule locates a zero
LANDED = 1e-37  # of a step: Newton's rule has ended
MOST = 60  # steps of Newton's rule
FULL = 1e-34  # of an unknown: it is found
Row = list[Any]


class Motion(Protocol):
    """A phase. Time counts from its start; all numbers are series in it, or plain.

    unknowns  how many numbers z there are
    """

    unknowns: int

    def rates(self, time: Any, y: Row, z: Row) -> Row:
        """y'."""

    def kept(self, time: Any, y: Row, z: Row) -> Row:
        """Functions of y, and of t z, that stay zero; linear in z."""


class Series:
    """The coefficients `y` and `z` of a motion about a state.

    start  of the unknowns, from where Newton's rule finds them
    """

    def __init__(self, motion: Motion, y: Row, order: int, start: Row | None = None):
        self.motion, self.order = motion, order
        self.y = [[value] for value in y]
        self.z = [[value] for value in (start or [arb(0)] * motion.unknowns)]
        if motion.unknowns:
            self._find_unknowns()
        for k in range(order):
            self._extend(k)

    def _find_unknowns(self) -> None:
        """z at the start, and how conditions and rates feel the unknowns there."""
        for _ in range(MOST):
            left = self._left(0, self._rates(0))
            self.matrix, self.direct, self.response = self._slopes()
            change = solved(self.matrix, [-value for value in left])
            for z, by in zip(self.z, change, strict=True):
                z[0] = (z[0] + by).mid()
            if all(abs(float(by)) <= FULL * (1.0 + abs(float(z[0]))) for z, by in zip(self.z, change, strict=True)):
                return
        raise ValueError("the forces that hold are not found")

    def _slopes(self) -> tuple[list[Row], list[Row], list[Row]]:
        """Of all conditions by the unknowns, of those that t z enters by this alone, and of y' by the unknowns."""
        now, still = [arb_series(c[:1], 2) for c in self.y], [arb_series(c[:1], 2) for c in self.z]
        time, zero = arb_series([0, 1], 2), arb_series([0], 2)
        before = [coefficient(h, 1) for h in self.motion.kept(time, now, still)]
        columns, direct, response = [], [], []
        for j in range(self.motion.unknowns):
            moved = [arb_series([*c[:1], int(i == j)], 2) for i, c in enumerate(self.z)]
            rates = [arb_series(rate, 2) for rate in self.motion.rates(zero, now, moved)]
            along = [coefficient(rate, 1) for rate in rates]
            turned = [arb_series([c[0], a], 2) for c, a in zip(self.y, along, strict=True)]
            felt = [coefficient(h, 1) for h in self.motion.kept(zero, turned, still)]
            larger = [arb_series([c[0] + int(i == j)], 2) for i, c in enumerate(self.z)]
            own = [coefficient(h, 1) - b for h, b in zip(self.motion.kept(time, now, larger), before, strict=True)]
            columns.append([a + b for a, b in zip(felt, own, strict=True)])
            direct.append(own)
            response.append(along)
        return transposed(columns), transposed(direct), response

    def _rates(self, k: int) -> Row:
        """y' with what is known of z, up to order k."""
        time, now = arb_series([0, 1], k + 1), [arb_series(c[: k + 1], k + 1) for c in self.y]
        return [arb_series(rate, k + 1) for rate in self.motion.rates(time, now, self._unknowns(k))]

    def _unknowns(self, k: int) -> Row:
        return [arb_series(c[: k + 1], k + 1) for c in self.z]

    def _left(self, k: int, rates: Row) -> Row:
        """What of the conditions is left at order k."""
        ahead = [
            arb_series([*c[: k + 1], coefficient(rate, k) / (k + 1)], k + 2)
            for c, rate in zip(self.y, rates, strict=True)
        ]
        unknowns = [arb_series(c[: k + 1], k + 2) for c in self.z]
        return [coefficient(h, k + 1) for h in self.motion.kept(arb_series([0, 1], k + 2), ahead, unknowns)]

    def _extend(self, k: int) -> None:
        """Coefficient k of z, and k + 1 of y."""
        if k:
            for z in self.z:
                z.append(arb(0))
        rates = self._rates(k)
        added = [coefficient(rate, k) for rate in rates]
        if k and self.z:
            change = solved(self._matrix_at(k), [-value for value in self._left(k, rates)])
            for z, value, response in zip(self.z, change, self.response, strict=True):
                z[k] = value
                added = [a + value * r for a, r in zip(added, response, strict=True)]
        for c, value in zip(self.y, added, strict=True):
            c.append((value / (k + 1)).mid())

    def _matrix_at(self, k: int) -> list[Row]:
        """Of the conditions at order k: y_{k+1} feels z_k by 1/(k+1), t z by 1."""
        return [
            [d + (m - d) / (k + 1) for m, d in zip(row, direct, strict=True)]
            for row, direct in zip(self.matrix, self.direct, strict=True)
        ]

    def length(self, error: float) -> float:
        """Of a step whose last two coefficients are as small as `error`, relative to the largest of y."""
        size, length = max(1.0, *(abs(float(c[0])) for c in self.y)), 1e9
        for c in (*self.y, *self.z):
            for order in (len(c) - 2, len(c) - 1):
                last = abs(float(c[order]))
                if last > 0:
                    length = min(length, 0.9 * (error * max(size, abs(float(c[0]))) / last) ** (1 / order))
        return length

    def at(self, time: Any) -> tuple[Row, Row]:
        return [horner(c, time).mid() for c in self.y], [horner(c, time).mid() for c in self.z]


def coefficient(value: Any, k: int) -> Any:
    """Of a series or a number."""
    if isinstance(value, arb_series):
        return value[k].mid()
    return arb(value).mid() if k == 0 else arb(0)


def coefficients(value: Any, count: int) -> Row:
    return [coefficient(value, k) for k in range(count)]


def horner(c: Row, time: Any) -> Any:
    total = c[-1]
    for value in reversed(c[:-1]):
        total = total * time + value
    return total


def first_zero(margins: Sequence[Row], length: Any, least: float) -> tuple[Any, list[int]] | None:
    """When the first of the margins (coefficients) becomes positive within a step, and which; None where none does.

    least  below which a margin counts as zero
    """

    def beyond(time: Any) -> list[int]:
        return [i for i, margin in enumerate(margins) if float(horner(margin, time)) > least]

    for probe in range(1, PROBES + 1):
        early, late = length * (probe - 1) / PROBES, length * probe / PROBES
        times: dict[int, Any] = {}
        while found := [i for i in beyond(late) if i not in times]:  # some are positive for a short time only
            times |= {i: zero_of(lambda t, c=margins[i]: horner(c, t), early, late) for i in found}
            late = min(times.values(), key=float)
        if times:
            return late, [i for i, time in times.items() if abs(float(time - late)) < least]
    return None


def zero_of(value: Callable[[Any], Any], low: Any, high: Any) -> Any:
    """Where a function that is positive at `high` and not at `low` is zero: halved, then by secants."""
    length = high - low
    for _ in range(HALVINGS):
        half = ((low + high) / 2).mid()
        low, high = (low, half) if float(value(half)) > 0 else (half, high)
    before, after = value(low), value(high)
    for _ in range(MOST):
        if after == before or abs(float((high - low) / length)) < LANDED:
            break
        step = (high - after * (high - low) / (after - before)).mid()
        low, before, high, after = high, after, step, value(step).mid()
    return high


def solved(matrix: list[Row], right: Row) -> Row:
    """The solution of a linear system, without its bounds."""
    found = arb_mat(matrix).solve(arb_mat([[value] for value in right]))
    return [found[i, 0].mid() for i in range(len(right))]


def transposed(rows: list[Row]) -> list[Row]:
    return [list(column) for column in zip(*rows, strict=True)]

"""Steps of a motion in 40 digits by Gauss's collocation, solved by iteration from values that are nearly right.

Between two switches the motion is analytic, so that a few nodes a step serve; a pass through the rates at all of them
makes the values inside a step more exact by about two digits.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol

from flint import arb, arb_mat

State = list[Any]
NODES = 20
PASSES = 40
ALIKE = 1e-27  # relative: values of two passes, of which the second is exact to two digits more
LEAST = 1e-14  # relative: the last of Legendre's polynomials. At the end of a step the error is about its square


class Motion(Protocol):
    """rates  y' in a state
    follow  numbers whose rates are functions of the others alone, `rates_of_followers`: a pass takes them at its own
            values of these, and halves how many are needed
    """

    follow: slice

    def rates(self, y: State) -> State: ...

    def rates_of_followers(self, y: State) -> State: ...


@dataclass(frozen=True)
class Nodes:
    """Of Gauss in [0, 1]: `places`, the `integrals` up to these by the values at them, `weights` of the whole, and
    what gives the part of the last of Legendre's polynomials."""

    places: list[Any]
    integrals: arb_mat
    weights: arb_mat
    last: arb_mat


@cache
def nodes(count: int = NODES) -> Nodes:
    roots = [arb.legendre_p_root(count, k).mid() for k in reversed(range(count))]

    def legendre(n: int, at: Any) -> Any:
        return at.legendre_p(n) if n >= 0 else arb(-1)  # so that P_1 - P_-1 = x + 1 is the integral of P_0 from -1

    weights = [(1 - x * x) / (count * legendre(count - 1, x)) ** 2 for x in roots]
    integrals = [
        [
            (w / 2 * sum((legendre(n + 1, x) - legendre(n - 1, x)) * legendre(n, u) for n in range(count))).mid()
            for u, w in zip(roots, weights, strict=True)
        ]
        for x in roots
    ]
    last = [((2 * count - 1) * legendre(count - 1, u) * w).mid() for u, w in zip(roots, weights, strict=True)]
    places = [((1 + x) / 2).mid() for x in roots]
    return Nodes(places, arb_mat(integrals), arb_mat([[w.mid() for w in weights]]), arb_mat([last]))


@dataclass(frozen=True)
class Step:
    """A step of length h from y: its values at the nodes, and at its end; the time that it has reached."""

    y: State
    h: Any
    inside: list[State]
    end: State
    reached: Any = None


def step(motion: Motion, y: State, h: Any, inside: list[State], sizes: list[float]) -> Step | None:
    """A step of length h from y, from values `inside` that are nearly right; None where it is too long.

    sizes  by which errors of each number count
    """
    own, before = nodes(), inside
    for _ in range(PASSES):
        slopes = arb_mat([motion.rates(value) for value in before])
        now = grown(y, h, own.integrals * slopes)
        turned = grown(y[motion.follow], h, own.integrals * arb_mat([motion.rates_of_followers(v) for v in now]))
        for value, followers in zip(now, turned, strict=True):
            value[motion.follow] = followers
        if is_small(before, now, sizes, ALIKE):
            (last,), (end,) = grown([arb(0)] * len(y), h, own.last * slopes), grown(y, h, own.weights * slopes)
            return Step(y, h, now, end) if is_small([last], [[arb(0)] * len(y)], sizes, LEAST) else None
        before = now
    return None


def grown(y: State, h: Any, integrals: arb_mat) -> list[State]:
    """y + h times each row."""
    return [[(a + h * integrals[i, j]).mid() for j, a in enumerate(y)] for i in range(integrals.nrows())]


def is_small(one: list[State], other: list[State], sizes: list[float], bound: float) -> bool:
    """Whether states are apart by less than so much of the larger ones of 1 and their numbers, per size."""
    pairs = [pair for values in zip(one, other, strict=True) for pair in zip(*values, sizes, strict=True)]
    scale = max(1.0, *(abs(float(b)) / size for _, b, size in pairs))
    return all(abs(float(a - b)) / size <= bound * scale for a, b, size in pairs)

"""Friction as a list of elements, and the one problem that a step in time solves for all of them.

An element acts on one or two rates s = G w, where w are the speeds of the vehicle: the slip of a contact, the rate of
an axle, the spin of a roller on its disk. It is rigid (s = 0, whatever force that takes), or it has a dissipation
function

    phi(s) = s . C s / 2 + bound sqrt(s . s + fade),      force = -dphi/ds.

Without fade the second part is Coulomb's friction: at s = 0 any force of the disc |force| <= bound. A contact's rows in
G are multiplied by its coefficients of friction, which makes a disc of its ellipse; then bound is its load.

A step of length h asks for the speeds w and the impulses p = h force at its end (Moreau's time stepping):

    M (w - w_free) = G^T p,       p = q - h C s,       q in -h d(bound sqrt(s . s + fade)).

This has one solution for w: M is positive where something keeps the speed, and the functions are convex. Rollers
without inertia are zeros of M; what acts on them adds to zero. The last condition is an equation, for any r > 0,

    q = projection of q - r s onto the disc of the radius h bound,

and Newton's rule on its pieces solves it. Where that does not come to rest, rounds of the method of multipliers
(Boyd et al. 2011, section 3), which converge from anywhere, give it another start.
"""

from dataclasses import dataclass

import numpy as np

ITERATIONS = 25  # of Newton's rule
ROUNDS, STARTS = 50, 9  # of the method of multipliers, twice as many for each further start of Newton's rule
CONVERGED = 1e-10  # of the largest impulse that there is
PROXIMAL = 1e-12  # of a response: forces that are not determined stay where they are


class NotSolvedError(ArithmeticError):
    """No impulses are found."""


@dataclass(frozen=True)
class Elements:
    """E elements with R rows.

    rows    (R, W) G
    of      (R,) int, the element of each row; those of one element follow each other
    damping (R,) C
    bound   (E,)
    fade    (E,)
    rigid   (E,) bool
    """

    rows: np.ndarray
    of: np.ndarray
    damping: np.ndarray
    bound: np.ndarray
    fade: np.ndarray
    rigid: np.ndarray

    def size(self, values: np.ndarray) -> np.ndarray:
        """(E,) the length of each element's part of values (R,)."""
        return np.sqrt(np.bincount(self.of, values**2, len(self.bound)))


@dataclass(frozen=True)
class Solution:
    """The speeds w (W,), q (R,), the impulses p (R,), and which elements rest, (E,) bool."""

    speeds: np.ndarray
    held: np.ndarray
    impulses: np.ndarray
    rests: np.ndarray


class Step:
    """The problem of one step.

    mass  (W, W)
    free  (W,) the speeds at the end without the elements
    h     its length
    """

    def __init__(self, mass: np.ndarray, free: np.ndarray, h: float, elements: Elements):
        self.elements, self.h, rows = elements, h, elements.rows
        self.damped = mass + h * rows.T @ (elements.damping[:, None] * rows)
        self.momentum = mass @ free
        self.radius = h * elements.bound
        inertia = np.diag(mass)
        least = np.where(inertia > 0, inertia, 0.1 * inertia[inertia > 0].min())
        responses = np.bincount(elements.of, (rows**2 / least).sum(axis=1), len(elements.bound))
        self.scale = (1 / np.where(responses > 0, responses, 1.0))[elements.of]  # r of each row
        self.same = elements.of[:, None] == elements.of
        self.smooth = (elements.fade > 0) & ~elements.rigid
        self.is_smooth, self.is_rigid = self.smooth[elements.of], elements.rigid[elements.of]

    def solved(self, start: np.ndarray) -> Solution:
        """From q (R,) of the step before."""
        q, speeds = start, None
        for start_number in range(STARTS):
            speeds, q_found = self._newton(q, speeds)
            if q_found is not None:
                slip = self.elements.rows @ speeds
                wanted = self.elements.size(q_found - self.scale * slip)
                impulses = q_found - self.h * self.elements.damping * slip
                return Solution(speeds, q_found, impulses, ~self.smooth & (wanted <= self.radius))
            q, speeds = self._multipliers(q, ROUNDS * 2**start_number)
        raise NotSolvedError("no forces of friction are found for a step")

    def _newton(self, q: np.ndarray, speeds: np.ndarray | None) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Speeds and q; None for q where Newton's rule does not come to rest."""
        rows, count = self.elements.rows, len(self.momentum)
        system = np.zeros((count + len(q), count + len(q)))
        system[:count, :count], system[:count, count:] = self.damped, -rows.T
        right = np.concatenate([self.momentum, np.zeros(len(q))])
        slip = rows @ speeds if speeds is not None else np.zeros(len(q))
        for iteration in range(ITERATIONS):
            missing, by_q, by_slip = self._condition(q, slip)
            size = np.abs(q).max(initial=0.0) + self.radius.max(initial=0.0)
            if iteration and np.abs(missing).max(initial=0.0) <= CONVERGED * size:
                return speeds, q
            system[count:, :count] = by_slip @ rows
            system[count:, count:] = by_q + PROXIMAL * np.eye(len(q))
            right[count:] = by_q @ q + PROXIMAL * q + by_slip @ slip - missing
            try:
                found = np.linalg.solve(system, right)
            except np.linalg.LinAlgError:
                break
            if not np.isfinite(found).all():
                break
            speeds, q = found[:count], found[count:]
            slip = rows @ speeds
        return None, None

    def _condition(self, q: np.ndarray, slip: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(R,) what the equations of q and s lack, and (R, R) their slopes by q and by s."""
        own, of = self.elements, self.elements.of
        wanted = q - self.scale * slip
        size = own.size(wanted)
        outside = size > self.radius
        safe = np.where(outside, size, 1.0)
        shrink = np.where(outside, self.radius / safe, 1.0)[of]
        unit = np.where(outside[of], wanted / safe[of], 0.0)
        slope = np.diag(shrink) - shrink[:, None] * np.outer(unit, unit) * self.same
        missing, by_q, by_slip = q - shrink * wanted, np.eye(len(q)) - slope, slope * self.scale
        if self.smooth.any():
            fading = np.sqrt(own.size(slip) ** 2 + np.where(self.smooth, own.fade, 1.0))[of]
            pull, unit = self.radius[of] / fading, slip / fading
            smooth = self.is_smooth
            missing = np.where(smooth, q + pull * slip, missing)
            by_q[smooth] = np.eye(len(q))[smooth]
            by_slip[smooth] = (np.diag(pull) - pull[:, None] * np.outer(unit, unit) * self.same)[smooth]
        rigid = self.is_rigid
        missing = np.where(rigid, self.scale * slip, missing)
        by_q[rigid], by_slip[rigid] = 0.0, np.diag(self.scale)[rigid]
        return missing, by_q, by_slip

    def _multipliers(self, q: np.ndarray, rounds: int) -> tuple[np.ndarray, np.ndarray]:
        """q and the speeds after some rounds of the method of multipliers."""
        rows, own = self.elements.rows, self.elements
        inverse = np.linalg.inv(self.damped + rows.T @ (self.scale[:, None] * rows))
        copy = np.zeros(len(q))
        for _ in range(rounds):
            speeds = inverse @ (self.momentum + rows.T @ (q + self.scale * copy))
            slip = rows @ speeds
            wanted = q - self.scale * slip
            found = self._projected(wanted, own.size(wanted))
            copy = slip + (found - q) / self.scale
            q = found
        return q, speeds

    def _projected(self, wanted: np.ndarray, size: np.ndarray) -> np.ndarray:
        """(R,) the q whose own law gives q - r s = wanted (R,), of this size (E,)."""
        own, of, r = self.elements, self.elements.of, self.scale
        part = np.minimum(1.0, self.radius / np.where(size > 0, size, 1.0))
        if self.smooth.any():
            scale = np.zeros(len(size))
            scale[of] = r
            slip = np.zeros(len(size))
            for _ in range(ITERATIONS):  # r slip + radius slip/sqrt(slip^2 + fade) = size; Newton from below: concave
                fading = np.sqrt(slip**2 + np.where(self.smooth, own.fade, 1.0))
                rises = scale + self.radius * np.where(self.smooth, own.fade, 1.0) / fading**3
                slip = slip + (size - scale * slip - self.radius * slip / fading) / rises
                slip = np.clip(slip, 0.0, size / scale)
            smooth = 1 - scale * slip / np.where(size > 0, size, 1.0)
            part = np.where(self.smooth, smooth, part)
        return np.where(self.is_rigid, wanted, part[of] * wanted)

"""Axles that stick: the set-valued law of Coulomb's friction in a run, a mode for each axle.

1. An axle that turns takes its sliding torque, against its rate. An axle at rest takes what keeps it at rest, up to its
   break-away torque, which is at least the sliding one.
2. A phase ends where the rate of a turning axle passes zero, and where those that stick cannot be held any longer: one
   facet of the forces that they can take (complementarity.py) is reached. Both are located.
3. At such an instant, and wherever forces or rates have jumped, all axles at rest are decided together. They all stick
   if any torques within the break-away bounds hold them. If not, it goes in rounds: the accelerations are found with
   the break-away torque as the bound of each; the axles that move have broken away, and their bound is the sliding
   torque in the next round; the last round is the one in which no further axle moves. There are at most N + 1 rounds.
4. Each round has one solution for the accelerations. Where break-away torques are above sliding ones the law itself
   may have several: an axle at rest, asked for a torque between the two, may stick or slide. Rule 3 chooses: what is at
   rest stays at rest if it can. A state without any solution there is not: in the last round each axle obeys the law.
5. On a facet itself, where sliding and break-away torque are the same, an axle that breaks away has no acceleration
   yet. It gets the direction in which the facet gives way.
6. An impact's impulses are without bound and the bearings' torques are not: they take no part in an impact.
7. Where the torques that hold are not unique, those of least norm within the bounds are reported.
"""

from collections.abc import Callable

import numpy as np

from omniroll.effects.complementarity import Facets, allowed_by, directions_allowed, least_torques, nearest_force
from omniroll.effects.guards import EPS, PASSED, Guard

AT_REST = 16  # a rate is zero within this many of its roundings
MOVES = 1e-10  # a bearing moves whose acceleration is above this part of what the forces could give it
AT_BOUND = 1e-9  # a torque is at its bound that is nearer to it than this part of it
HELD_ROUNDINGS = 64  # times an input's: of torques that hold

# From the torques (N,) of the bearings that turn and the directions (3, 3) of nu that those which stick allow: nu' (3,)
# and the generalised force (3,) that holds what sticks.
Held = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


class Axles:
    """The axles in one run.

    rows      (N, 3) their rates for each of nu
    sliding   (N,) torques in N m of axles that turn
    holding   (N,) the largest torques in N m that axles at rest take
    resting   (N,) bool: axles whose rate is zero
    modes     (N,) int: 0 sticks, +-1 is the sign of the rate

    Of a phase, once decide() has been called: the axles that stick (S,), the directions (3, 3) of nu that they allow,
    columns that are 0 where there are fewer, and the facets of what they can hold.
    """

    def __init__(self, rows: np.ndarray, sliding: np.ndarray, holding: np.ndarray):
        self.rows, self.sliding, self.holding = rows, sliding, holding
        count = len(rows)
        self.resting, self.modes = np.zeros(count, bool), np.zeros(count, int)
        self.released = np.zeros(count, int)  # signs of those that a facet has let go at this instant
        self.force_size, self.sticking = np.zeros(3), np.zeros(0, int)
        self.speed = 0.0  # the largest |nu| that a phase has begun with since the vehicle rested

    def _begin(self, mass_matrix: np.ndarray) -> None:
        """A phase begins with the present modes."""
        self.sticking = np.flatnonzero(self.modes == 0)
        stuck = self.rows[self.sticking]
        self.directions = directions_allowed(stuck, mass_matrix)
        self.facets = Facets.of(stuck, self.holding[self.sticking])

    # What the state says

    def at_rest(self, nu: np.ndarray) -> np.ndarray:
        """nu with the rates of resting axles at zero. Axles whose rates are zero within rounding rest, too."""
        self._find_resting(nu)
        found = allowed_by(self.rows[self.resting]) @ nu
        self._find_resting(found)
        if not found.any():
            self.speed = 0.0
        turning = ~self.resting
        self.modes[turning] = np.sign(self.rows[turning] @ found)
        return found

    def _find_resting(self, nu: np.ndarray) -> None:
        """A phase may end on a joint where all rates come to zero: what is left is rounding of what nu has been."""
        self.resting |= np.abs(self.rows @ nu) <= AT_REST * EPS * self._sizes(nu, self.speed)

    def _sizes(self, nu: np.ndarray, least: float = 0.0) -> np.ndarray:
        """(N,) what rates are rounded against: nu is what is left of larger numbers, each of about its length."""
        return np.linalg.norm(self.rows, axis=1) * max(np.linalg.norm(nu), least)

    def rates(self, nu: np.ndarray) -> np.ndarray:
        """(N,) rates of the wheels; those of resting axles are exactly zero."""
        return np.where(self.resting, 0.0, self.rows @ nu)

    def accelerations(self, nu_dot: np.ndarray) -> np.ndarray:
        """(N,) accelerations of the wheels; those of axles that stick are exactly zero."""
        return np.where(self.modes == 0, 0.0, self.rows @ nu_dot)

    # What has happened

    def moved(self) -> None:
        """Some time has passed."""
        self.resting = self.modes == 0
        self.released[:] = 0

    def jumped(self, before: np.ndarray, after: np.ndarray) -> None:
        """An impact has changed nu (3,)."""
        rounding = EPS * (self._sizes(before) + self._sizes(after))
        self.resting &= np.abs(self.rows @ (after - before)) <= AT_REST * rounding
        self.released[:] = 0

    def pass_guards(self, passed: np.ndarray) -> None:
        """Guards of the phase, (m,) bool, have ended it: those of turning axles, then the facets."""
        turning = np.flatnonzero(self.modes)
        self.resting[turning[passed[: len(turning)]]] = True
        facets = passed[len(turning) :]
        if facets.any():
            self._release(self.sticking, self.facets, facets)

    def _release(self, axles: np.ndarray, facets: Facets, passed: np.ndarray) -> None:
        signs = facets.directions(passed)
        self.released[axles[signs != 0]] = signs[signs != 0]

    # What follows

    def torques(self) -> np.ndarray:
        """(N,) of the bearings of turning axles; 0 where an axle sticks."""
        return -self.modes * self.sliding

    def holding_torques(self, force: np.ndarray) -> np.ndarray:
        """(N,) of the bearings of axles that stick, of least norm, where they give the generalised force (3,)."""
        torques = np.zeros(len(self.rows))
        bounds = self.holding[self.sticking]
        torques[self.sticking] = least_torques(force, self.rows[self.sticking], bounds)
        return torques

    def torque_sizes(self) -> np.ndarray:
        """(N,) what torques that hold are rounded against, several times: they are what is left of other torques."""
        return HELD_ROUNDINGS * np.linalg.norm(self.force_size) / np.linalg.norm(self.rows, axis=1)

    def rate_guards(self, nu: np.ndarray) -> list[Guard]:
        """Where the rate of a turning axle passes zero; nu (3,) is that of the phase's start."""
        sizes, self.speed = self._sizes(nu), max(self.speed, float(np.linalg.norm(nu)))
        turning = np.flatnonzero(self.modes)
        return [Guard(0.0, 0.0, -self.modes[axle] * self.rows[axle], sizes[axle]) for axle in turning]

    def decide(self, mass_matrix: np.ndarray, held: Held, size: np.ndarray) -> None:
        """Modes of the axles at rest (rule 3), and the phase that begins with them.

        mass_matrix  (3, 3)
        held         nu' and the force that holds the axles that stick
        size         (3,) sums of the sizes of the terms of the generalised force
        """
        axles = np.flatnonzero(self.resting)
        self.modes[axles] = 0
        self._begin(mass_matrix)
        self.force_size = size
        if not self.released.any() and not self._overdone(held).any():
            return
        force = -held(np.where(self.resting, 0.0, self.torques()), np.zeros((3, 3)))[1]
        for _ in range(len(axles) + 1):
            self._rounds(axles, mass_matrix, force)
            self._begin(mass_matrix)
            passed = self._overdone(held)
            if not passed.any():
                return
            self._release(self.sticking, self.facets, passed)

    def _overdone(self, held: Held) -> np.ndarray:
        """(K,) bool: facets of the axles that stick beyond which the force is that would hold them."""
        _, force = held(self.torques(), self.directions)
        return self.facets.excess(force) > PASSED * self.facet_rounding(force)

    def facet_rounding(self, force: np.ndarray) -> np.ndarray:
        """(K,) of the facets' excess."""
        return EPS * (np.abs(self.facets.normals) @ (np.abs(force) + self.force_size) + self.facets.reach)

    def _rounds(self, axles: np.ndarray, mass_matrix: np.ndarray, force: np.ndarray) -> None:
        """Modes of the axles at rest by rounds; those that a facet has released have broken away before the first."""
        rows, inverse = self.rows[axles], np.abs(np.linalg.inv(mass_matrix))

        def nearest(bounds: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            nu_dot, torques = nearest_force(mass_matrix, force, rows, bounds)
            return rows @ nu_dot, np.abs(rows) @ inverse @ (np.abs(force) + np.abs(rows.T) @ bounds), torques

        self.modes[axles] = in_rounds(self.released[axles], self.sliding[axles], self.holding[axles], nearest)


def in_rounds(
    released: np.ndarray,
    sliding: np.ndarray,
    holding: np.ndarray,
    nearest: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]],
) -> np.ndarray:
    """Modes (m,) of bearings at rest that cannot all be held (rules 3 to 5).

    released  (m,) int: signs of those that have been let go at this instant
    sliding, holding  (m,) their torques
    nearest   from the bounds (m,) of the torques: accelerations (m,), what they could be, and the torques that make
              them, all of the minimum with these bounds
    """
    broken = released != 0
    while True:
        bounds = np.where(broken, sliding, holding)
        accelerations, possible, torques = nearest(bounds)
        moves = np.abs(accelerations) > MOVES * possible
        if not (moves & ~broken).any():
            break
        broken |= moves
    at_bound = -released * torques >= bounds * (1 - AT_BOUND)
    return np.where(moves, np.sign(accelerations), np.where(at_bound, released, 0)).astype(int)

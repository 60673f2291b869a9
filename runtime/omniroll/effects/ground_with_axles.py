"""Contacts and axles that may all stick: Coulomb's friction as the set-valued law on the ground and in the bearings.

The rules of ground.py hold for each contact, those of slipping_axles.py for each axle. Beside them:

1. A wheel whose contact and whose axle stick stands: its rate is zero, and nu loses the direction in which it would
   turn. Of the force on it along the rolling direction, F, and its bearing's torque, -(q + l F) with q = Q_chi +
   theta' G, only what they do to nu is determined: with g the row of the wheel's rate, -l F g.
2. F lies in an interval: within what the ellipse of the ground leaves beside the force along the axle, which is
   determined, and where the bearing takes -(q + l F). All standing wheels together give the forces on nu that are the
   sum of these intervals: a zonotope. A phase ends where the force that holds nu leaves it through a facet, and where
   an interval becomes empty.
3. Where a facet is passed in the motion n, each standing wheel that n would turn gives way where its F is at its bound:
   its contact, if that is the ground's, or its axle, if that is the bearing's; both where they are the same.
4. At such an instant all contacts and axles at rest are decided together: their forces and torques make
   f^T D f/2 + a^T f least, D = G M^-1 G^T, which is convex and not strictly so (cones.py). The accelerations are
   unique. Static friction above the sliding one goes in rounds, as it does for each alone.
5. The forces F of least norm within their intervals are reported.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from omniroll.effects import cones
from omniroll.effects.complementarity import Facets, allowed_by, directions_allowed, least_forces
from omniroll.effects.ground import AT_EDGE, HELD_ROUNDINGS, MOVES, Grip, Ground
from omniroll.effects.ground import AT_REST as CONTACT_AT_REST
from omniroll.effects.guards import EPS, PASSED, Guard
from omniroll.effects.slipping_axles import BesideAxles, SlippingAxles
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State

LEAST_REACH = 1e-14  # of the largest: for bearings that take no torque
LEFT_OF = 1 / 16  # of the largest rounding: of what is left of larger speeds
FROM_REST = 1e6  # s: times the acceleration below which a slip does not settle, a speed that is slow
SAME_BOUND = 1e-9  # of a force: bounds that are nearer to each other are reached together

# From contacts (N,) bool and axles (N,) bool that stick, the forces (N, 2) of slipping contacts and the torques (N,) of
# turning axles: evaluates the rates at the start of a phase.
Evaluate = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray], None]


class GroundWithAxles(BesideAxles, Ground):
    """Contacts and axles in one run.

    axles   with their modes
    held    what the rates that were computed last say: ground_force and slip_dot (N, 2), rates_dot and axle_holding
            (N,), held_force (3,)
    stands  (N,) bool: wheels whose contact and axle stick in the present phase
    """

    at_edge = AT_EDGE  # what has been let go gives way within this part of its bound

    def __init__(self, kernel: Kernel, grip: Grip, axles: SlippingAxles, held: dict[str, np.ndarray]):
        super().__init__(kernel, grip)
        self._put_axles(axles, held)

    def _put_axles(self, axles: SlippingAxles, held: dict[str, np.ndarray]) -> None:
        self.axles, self.held = axles, held
        self.stands = np.zeros(self.kernel.wheels, bool)
        self.radius, self.rows = self.kernel.vehicle.wheel_radius, self.kernel.wheel_rows
        self.facets = Facets.of(self.rows[:0], np.zeros(0))
        # The largest rounding of a slip, in m/s, since all rested: then what a thousandth of a second may make.
        self.least = CONTACT_AT_REST * EPS * self.settles * FROM_REST
        self.largest = self.least

    # What the state says

    def roundings(self, nu: np.ndarray, rates: np.ndarray, axial: np.ndarray | None) -> np.ndarray:
        """(N,) in m/s: slips within these are zero. Where wheels stand, the speeds that make a slip are what is left
        of larger ones; they may all vanish with it."""
        return np.maximum(super().roundings(nu, rates, axial), LEFT_OF * self.largest)

    def at_rest(self, state: State) -> State:
        """The state with the slips and rates of what rests at zero. What is zero within rounding rests, too."""
        axial = state.contact_axial() if self.kernel.has_spins else None
        self.largest = max(self.largest, float(super().roundings(state.nu, state.rates, axial).max()))
        self.axles.least = self.largest / (CONTACT_AT_REST * EPS * self.radius)
        for _ in range(2):  # the vehicle may rest altogether where some wheels do
            state = self.axles.at_rest(super().at_rest(self.axles.at_rest(state)))
            both = self.resting & self.axles.resting
            if both.any():
                state = replace(state, nu=allowed_by(self.rows[both]) @ state.nu)
                state = self._rolling(state)
        if not (state.nu.any() or state.rates.any()):
            self.largest = self.least
        return state

    def _rolling(self, state: State) -> State:
        """The state with the speeds of rolling where contacts rest, and none where axles do."""
        rolling, _ = self.kernel.wheel_rates(state.nu, state.chi)
        rates = np.where(self.resting, rolling, state.rates)
        state = replace(state, rates=np.where(self.axles.resting, 0.0, rates))
        if not self.kernel.has_spins:
            return state
        turning = self.kernel.contact_axial(state.nu, state.chi)
        return state.with_contact_axial(np.where(self.resting, turning, state.contact_axial()))

    # What has happened

    def pass_guards(self, passed: np.ndarray) -> None:
        """Guards that have ended the phase: of turning axles, of contacts and loads, of dragged axles, of wheels that
        stand, and facets."""
        turning, dragged, standing = self._kinds()
        ends = np.cumsum([len(turning), self.guards_of_contacts, len(dragged), len(standing)])
        of_turning, of_contacts, of_dragged, of_standing, of_facets = np.split(passed, ends)
        self.axles.resting[turning[of_turning]] = True
        super().pass_guards(of_contacts)
        self._let_axles_go(dragged[of_dragged])
        self._let_axles_go(standing[of_standing])
        self.released[standing[of_standing]] = True
        if of_facets.any():
            self._release(of_facets)

    def _kinds(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Wheels whose axles turn, those that are dragged with axles that stick, and those that stand."""
        sticks = self.axles.modes == 0
        return np.flatnonzero(~sticks), np.flatnonzero(sticks & ~self.stands), np.flatnonzero(self.stands)

    def _let_axles_go(self, axles: np.ndarray) -> None:
        self.axles.released[axles] = -np.sign(self.held["axle_holding"][axles]).astype(int)

    def _release(self, facets: np.ndarray) -> None:
        """Facets, (K,) bool, have let standing wheels go: contacts or axles (rule 3)."""
        standing = np.flatnonzero(self.stands)
        of_ground, low, high = self._intervals()
        for moved in self.facets.moved[facets]:
            for k in np.flatnonzero(moved):
                wheel, up = standing[k], moved[k] > 0
                bound, most = (high[k] if up else -low[k]), of_ground[k]
                near = SAME_BOUND * (abs(bound) + most)
                self.released[wheel] |= most <= bound + near
                if bound <= most + near:
                    self.axles.released[wheel] = 1 if up else -1

    # What standing wheels can take

    def _intervals(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(S,) in N, of standing wheels: what the ground can take at most along the rolling direction, and the bounds
        that the bearings set to it."""
        stands, of_ground = self.stands, self._left_of_ground()
        asked, most = self.held["axle_holding"][stands], self.axles.holding[stands]
        return of_ground, (asked - most) / self.radius, (asked + most) / self.radius

    def _left_of_ground(self) -> np.ndarray:
        """(S,) in N, what the ground can take at most along the rolling direction."""
        stands, reach = self.stands, self.load[:, None] * self.grip.static
        if self.directions.start:
            return reach[stands, 1]
        along = self.held["ground_force"][stands, 0] / reach[stands, 0]
        return reach[stands, 1] * np.sqrt(np.maximum(1 - along**2, 0.0))

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """(S,) in N, the intervals of the forces on standing wheels along the rolling direction."""
        of_ground, low, high = self._intervals()
        return np.maximum(-of_ground, low), np.minimum(of_ground, high)

    def excess(self) -> tuple[np.ndarray, np.ndarray]:
        """(D + S + K,) how much more is asked for than there is: of dragged axles, of standing wheels by themselves,
        and beyond the facets; and the rounding of that. The rates have been computed."""
        _, dragged, standing = self._kinds()
        asked, most = np.abs(self.held["axle_holding"]), self.axles.holding
        of_ground, _, _ = self._intervals()
        low, high = self._bounds()
        alone = asked[standing] - most[standing] - self.radius * of_ground
        moved = self.facets.moved
        force, normals = self.held["held_force"], self.facets.normals
        reach = (np.maximum(moved, 0.0) @ high + np.minimum(moved, 0.0) @ low) * self.radius
        sizes = self.radius * np.abs(self.rows).T @ (self.load * self.grip.static[:, 1])
        of_facets = np.abs(normals) @ (np.abs(force) + sizes)
        values = [asked[dragged] - most[dragged], alone, -(normals @ force) - reach]
        rounded = [(asked + most)[dragged], (asked + most)[standing] + self.radius * of_ground, of_facets]
        return np.concatenate(values), HELD_ROUNDINGS * EPS * np.concatenate(rounded)

    # What follows

    def inputs(self, sticks: np.ndarray, axle_sticks: np.ndarray, torques: np.ndarray) -> dict[str, np.ndarray]:
        """What the rates take, by name, where contacts (N,) and axles (N,) stick and others have torques (N,)."""
        modes = {"sticks": sticks, "axle_sticks": axle_sticks, "bearing_torque": torques}
        return modes | directions_of_nu(self.rows[sticks & axle_sticks])

    def turning_guards(self, nu: np.ndarray, rates: np.ndarray) -> list[Guard]:
        """Where the rate of a turning axle passes zero; nu (3,) and rates (N,) are those of the phase's start."""
        return self.axles.rate_guards(nu, rates)

    def bearing_torques(self) -> np.ndarray:
        """(N,) in N m, what all bearings take where the rates have been computed; of standing wheels beside the forces
        of least norm (rule 5)."""
        holding = self.held["axle_holding"].copy()
        if self.stands.any():
            forces = least_forces(-self.held["held_force"] / self.radius, self.rows[self.stands], *self._bounds())
            holding[self.stands] -= self.radius * forces
        return self.axles.torques() + holding

    def torques_in_rows(self) -> dict[str, np.ndarray]:
        """What rows keep of the bearings (N,), by name."""
        return {"bearing_torque": self.bearing_torques()}

    def accelerations(self) -> np.ndarray:
        """(N,) of the axles, as the rates that were computed last say."""
        return self.held["rates_dot"]

    def begin(self, slip: np.ndarray, evaluate: Evaluate) -> None:
        """Modes of all contacts and axles in the phase that begins now (rules 3 and 4); slip (N, 2) in m/s."""
        slides = ~self.resting & ~self.off
        self.aim(slip, slides)
        given = np.where(slides[:, None], self.sliding_forces(self.load), 0.0)
        self.axles.modes[self.axles.resting] = 0
        self.sticks = self.resting.copy()
        if not (self.resting.any() or self.axles.resting.any()):
            self._stand()
            return
        if self.released.any() or self.axles.released.any():
            self._decide_together(given, evaluate)
        for _ in range(2 * len(slides) + 1):
            self._stand()
            evaluate(self.sticks, self.axles.modes == 0, self._pushed(given), self.axles.torques())
            if not self._overdone():
                return
            self._decide_together(given, evaluate)
        self._stand()

    def _stand(self) -> None:
        self.stands = self.sticks & (self.axles.modes == 0)
        self.facets = Facets.of(self.rows[self.stands], np.zeros(int(self.stands.sum())))

    def _pushed(self, given: np.ndarray) -> np.ndarray:
        """(N, 2) the forces of contacts that slip, also of those that have just begun to."""
        slides = ~self.sticks & ~self.off
        return np.where(slides[:, None], self.sliding_forces(self.load), given * ~self.sticks[:, None])

    def _overdone(self) -> bool:
        """Whether something that sticks is asked for more than it takes. It is let go."""
        beyond, rounding = self.used_up(self.held["ground_force"])
        contacts = self.sticks & (beyond > PASSED * rounding)
        values, rounded = self.excess()
        passed = values > PASSED * rounded
        _, dragged, standing = self._kinds()
        of_dragged, of_standing, of_facets = np.split(passed, np.cumsum([len(dragged), len(standing)]))
        self.released |= contacts
        self._let_axles_go(dragged[of_dragged])
        self._let_axles_go(standing[of_standing])
        self.released[standing[of_standing]] = True
        if of_facets.any():
            self._release(of_facets)
        return bool(contacts.any() or passed.any())

    def _decide_together(self, given: np.ndarray, evaluate: Evaluate) -> None:
        """Which of the contacts and axles at rest give way, by rounds (rule 4); `given` (N, 2) are the forces of the
        contacts that slip already."""
        contacts, axles = np.flatnonzero(self.resting), np.flatnonzero(self.axles.resting)
        matrix, without = self._problem(contacts, axles, given, evaluate)
        own, free, held = self.directions, self.released, self.axles
        broken = np.concatenate([free[contacts], held.released[axles] != 0])
        count, width = without.shape
        while True:
            slid, kept = broken[: len(contacts), None], broken[len(contacts) :]
            friction = np.where(slid, self.grip.sliding[contacts, own], self.grip.static[contacts, own])
            reach = np.ones((count, width))
            reach[: len(contacts)] = self.load[contacts, None] * friction
            reach[len(contacts) :, 0] = np.where(kept, held.sliding[axles], held.holding[axles])
            reach = np.maximum(reach, LEAST_REACH * reach.max())
            found = self._least(matrix, without, reach)
            power = (np.abs(without) * reach).sum(axis=1) + np.einsum("ia,iajb,jb->i", reach, np.abs(matrix), reach)
            slips = found.pull > MOVES * power
            if not (slips & ~broken).any():
                break
            broken = broken | slips
        self._take_modes(contacts, axles, found, reach, slips, friction, self.says_its_way(found.pull, power))

    def _least(self, matrix: np.ndarray, without: np.ndarray, reach: np.ndarray) -> cones.Decided:
        """The forces of contacts and torques of bearings at rest, by what they can take."""
        return cones.decide_semidefinite(matrix, without, reach)

    def _take_modes(
        self,
        contacts: np.ndarray,
        axles: np.ndarray,
        found: cones.Decided,
        reach: np.ndarray,
        slips: np.ndarray,
        friction: np.ndarray,
        says: np.ndarray,
    ) -> None:
        first = len(contacts)
        taken = np.linalg.norm(found.force / reach, axis=1)
        giving_way = self.released[contacts] & (taken[:first] >= 1 - self.at_edge)
        by_rate = (slips & says)[:first, None]
        begun = np.where(by_rate, found.rate[:first], -found.force[:first] / friction**2)
        going = slips[:first] | giving_way
        self.sticks = self.resting.copy()
        self.sticks[contacts[going]] = False
        if going.any():
            lengths = np.linalg.norm(begun[going], axis=1, keepdims=True)
            self.towards[contacts[going], self.directions] = begun[going] / lengths
        signs = self.axles.released[axles]
        bound = -signs * found.force[first:, 0] >= reach[first:, 0] * (1 - self.at_edge)
        turning = np.where(slips[first:], np.sign(found.rate[first:, 0]), np.where(bound, signs, 0))
        self.axles.modes[axles] = turning.astype(int)

    def _problem(
        self, contacts: np.ndarray, axles: np.ndarray, given: np.ndarray, evaluate: Evaluate
    ) -> tuple[np.ndarray, np.ndarray]:
        """D (m, c, m, c) and a (m, c) of the contacts and axles at rest; an axle has one component, beside one that
        nothing acts on."""
        own, none, turns = self.directions, np.zeros(len(self.sticks), bool), np.zeros(len(self.axles.modes), bool)
        first, width = len(contacts), 2 - self.directions.start
        count = first + len(axles)
        torques = np.where(self.axles.resting, 0.0, self.axles.torques())

        def rates(pushed: np.ndarray, turned: np.ndarray) -> np.ndarray:
            evaluate(none, turns, pushed, turned)
            found = np.zeros((count, width))
            found[:first] = self.held["slip_dot"][contacts, own]
            found[first:, 0] = self.accelerations()[axles]
            return found

        without = rates(given, torques)
        matrix = np.zeros((count, width, count, width))
        for k in range(count):
            for c in range(width if k < first else 1):
                pushed, turned = given.copy(), torques.copy()
                if k < first:
                    size = float((self.load[:, None] * self.grip.sliding).max())
                    pushed[contacts[k], own.start + c] += size
                else:
                    size = float(self.axles.holding.max()) or 1.0
                    turned[axles[k - first]] += size
                matrix[:, :, k, c] = (rates(pushed, turned) - without) / size
        matrix = (matrix + matrix.transpose(2, 3, 0, 1)) / 2
        for k in range(first, count):
            for c in range(1, width):
                matrix[k, c, k, c] = matrix[k, 0, k, 0]
        return matrix, without


def directions_of_nu(rows: np.ndarray) -> dict[str, np.ndarray]:
    """The nu which leave the rates `rows` (m, 3) nu of wheels that stand at zero, as the kernel takes them, by name."""
    columns = directions_allowed(rows, np.eye(3)) if len(rows) else np.eye(3)
    return {"directions": columns.ravel(), "absent": ~columns.any(axis=0)}

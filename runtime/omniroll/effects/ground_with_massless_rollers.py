"""Contacts, axles and massless rollers that may all stick: Coulomb's friction as the set-valued law on the ground and
in all bearings, where rollers have no inertia.

Bearing and ground are in series along the axle: one force, and speeds that add up to the speed of the wheel along its
axle. So a contact is one law of greatest dissipation, in that speed and in the slip along the rolling direction: its
force lies in the ellipse of the ground's friction, cut by the strip of what the bearing takes over rho
(maxima/effects/contact_strip.mac). The rules of ground_with_bearings.py hold. Beside them:

1. A contact is in one of four modes. Its roller and it stick: the wheel stands along its axle and rolls. Its roller
   sticks and it slips: as a rigid wheel does. Its roller turns and it sticks: the bearing says the force along the
   axle. Both move: the bearing says that force and the ellipse the other one, and the slip is along the ellipse's
   normal there.
2. Where a contact slips or its roller turns, whether its roller sticks follows from the state alone. Between the
   bearing's two torques, and between the ground's two coefficients, it stays in the mode that it is in; at the start,
   and where a roller comes into contact, it sticks if it can: one that leaves the ground stops on its disk at once.
3. What rests both ways is decided together, with what rests of other contacts and axles: one convex problem over
   ellipses that are cut.
4. Static friction may hold a contact whose roller turns where sliding friction is no more than its bearing takes. Where
   such a contact gives way, its roller stops at once, and it slips with its wheel.
"""

from dataclasses import replace

import numpy as np

from omniroll.effects import cones
from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.complementarity import allowed_by
from omniroll.effects.ground import AT_REST as CONTACT_AT_REST
from omniroll.effects.ground import HELD_ROUNDINGS, MOVES, Grip, Ground
from omniroll.effects.ground_flow import GroundFlow
from omniroll.effects.ground_with_axles import LEAST_REACH, Evaluate
from omniroll.effects.ground_with_bearings import USED, GroundWithBearings
from omniroll.effects.guards import EPS, PASSED
from omniroll.effects.slipping_bearings import SlippingBearings
from omniroll.kernels.kernel import Flow, Kernel
from omniroll.vehicles.state import State


class GroundWithMasslessRollers(GroundWithBearings):
    """Contacts, axles and massless rollers in one run.

    axles  all bearings (2 N,): of axles, then of rollers in contact
    """

    def __init__(self, kernel: Kernel, grip: Grip, bearings: SlippingBearings, held: dict[str, np.ndarray]):
        super().__init__(kernel, grip, bearings, held)
        self.directions = slice(0, 2)
        bearings.resting[bearings.contact] = True

    @property
    def turning(self) -> np.ndarray:
        """(N,) int: signs of the spins of rollers that turn, 0 of those that stick."""
        return self.axles.modes[self.axles.contact]

    # What the state says

    def pair(self, state: State) -> np.ndarray:
        """(N, 2) in m/s: speeds of the wheels along their axles, and slips along their rolling directions."""
        given = {"nu": state.nu, "chi": state.chi, "rates": state.rates} | as_if_rigid(self.kernel.wheels)
        names = (argument.name for argument in self.kernel.signatures["slip_forces"].inputs)
        return self.kernel.call("slip_forces", *(given[name] for name in names))[0]

    def at_rest(self, state: State) -> State:
        """The state with what rests at zero. What is zero within rounding rests, too."""
        bearings = self.axles
        rounding = Ground.roundings(self, state.nu, state.rates, None)
        self.largest = max(self.largest, float(rounding.max()))
        speed = self.largest / (CONTACT_AT_REST * EPS)
        bearings.least = bearings.by_kind(speed / self.radius, speed / self._reach(state.chi).min())
        state = bearings.at_rest(state)
        self._find_resting(state)
        for _ in range(2):  # the vehicle may rest altogether where some wheels do
            stands = self._standing(self.resting, bearings.resting)
            if stands.any():
                state = replace(state, nu=allowed_by(self._rows(stands)) @ state.nu)
            rolling, _ = self.kernel.wheel_rates(state.nu, state.chi)
            state = bearings.at_rest(replace(state, rates=np.where(self.resting, rolling, state.rates)))
            self._find_resting(state)
        if not (state.nu.any() or state.rates.any()):
            self.largest = self.least
        return state

    def _find_resting(self, state: State) -> None:
        """Which contacts rest, and which rollers turn where these do not rest both ways (rule 2)."""
        bearings, places = self.axles, self.axles.contact
        pair = self.pair(state)
        rounding = self.roundings(state.nu, state.rates, None)
        still = np.linalg.norm(pair, axis=1) <= rounding
        bearings.resting[places] |= still
        self.still = still
        both = (self.resting | still) & bearings.resting[places]
        self._turn(pair, state.chi, rounding, ~both & bearings.resting[places] & ~self.off)
        rolls = ~bearings.resting[places] & (np.abs(pair[:, 1]) <= rounding)
        self.resting = (self.resting | still | rolls) & ~self.off

    def _turn(self, pair: np.ndarray, chi: np.ndarray, rounding: np.ndarray, wheels: np.ndarray) -> None:
        """Rollers of `wheels` (N,) bool, which slip with (N, 2), turn if they cannot stick."""
        bearings, places = self.axles, self.axles.contact
        towards = np.where(np.linalg.norm(pair, axis=1)[:, None] > rounding[:, None], pair, self.towards)
        asked = self._reach(chi) * self.grip.sliding_forces(self.kernel, towards, self.load)[:, 0]
        size = np.abs(asked)
        beyond = size - bearings.holding[places] > PASSED * HELD_ROUNDINGS * EPS * (size + bearings.holding[places])
        turns = wheels & (beyond | (bearings.released[places] != 0))
        bearings.modes[places[turns]] = -np.sign(asked[turns]).astype(int)
        bearings.resting[places[turns]] = False

    # What has happened

    def switched(self, directions: np.ndarray) -> None:
        """Wheels have passed to their next rollers, directions (N,), which stand on their disks (rule 2)."""
        came = directions != 0
        self.axles.released[:] = 0
        self.axles.resting[self.axles.contact[came]] = True
        self.axles.modes[self.axles.contact[came]] = 0
        self.resting &= ~came
        self.released[:] = False

    # What follows

    def direction(self, slip: np.ndarray, rounding: np.ndarray) -> np.ndarray:
        """(N, 2) along the pair (N, 2), or where that is rounding, where the contact went last; where rollers turn
        along the rolling direction alone."""
        return np.where((self.turning != 0)[:, None], self.towards, super().direction(slip, rounding))

    def aim(self, slip: np.ndarray, slides: np.ndarray) -> None:
        """Where the contacts `slides` (N,) bool go, which slip with (N, 2) in m/s."""
        super().aim(slip, slides)
        turns = slides & (self.turning != 0)
        self.towards[turns] = np.stack([0 * slip[turns, 1], np.copysign(1.0, slip[turns, 1])], axis=1)

    def sliding_forces(self, loads: np.ndarray) -> np.ndarray:
        """(N, 2) in N, the forces on contacts that slip, or begin to; where rollers turn the bearing says the first."""
        forces = super().sliding_forces(loads)
        turns = self.turning != 0
        taken = self.axles.torques()[self.axles.contact]
        given = np.where(self.off, 1.0, loads)
        corner, _ = self.kernel.call("corner_forces", self.held["chi"], self.towards, given, self.grip.sliding, taken)
        forces[turns, 1] = corner[turns]
        return forces

    # What rests is decided together

    def _decide_together(self, given: np.ndarray, evaluate: Evaluate) -> None:
        """Which of what rests gives way, by rounds (rule 3); `given` (N, 2) are the forces of the contacts that slip
        already."""
        bearings, turning = self.axles, self._turned()
        discs, rolls = np.flatnonzero(self.resting & ~turning), np.flatnonzero(self.resting & turning)
        axles = np.flatnonzero(bearings.resting[: bearings.wheels])
        rollers = bearings.contact[discs]
        if not len(discs) + len(rolls) + len(axles):
            return
        matrix, without = self._problem_of(discs, rolls, axles, given, evaluate)
        first, second = len(discs), len(discs) + len(rolls)
        contacts, held = np.concatenate([discs, rolls]), np.concatenate([axles, rollers])
        slid, turned = self.released.copy(), bearings.released != 0
        while True:
            if self._stop_rollers(slid):
                return self._decide_together(np.where(self.sticks[:, None], 0.0, self._pushed(given)), evaluate)
            friction = np.where(slid[:, None], self.grip.sliding, self.grip.static)
            most = np.where(turned, bearings.sliding, bearings.holding)
            reach, strip = self._bounds_of(discs, rolls, axles, friction, most)
            found = cones.decide_semidefinite(matrix, without, reach, strip, self.from_inside)
            power = (np.abs(without) * reach).sum(axis=1) + np.einsum("ia,iajb,jb->i", reach, np.abs(matrix), reach)
            slips, yields = found.pull > MOVES * power, found.yields > MOVES * power
            begins = np.append(slips[second:], yields[:first])
            if not ((slips[:second] & ~slid[contacts]).any() or (begins & ~turned[held]).any()):
                break
            slid[contacts] |= slips[:second]
            turned[held] |= begins
        by_rate = (found.pull > MOVES * power) & self.says_its_way(found.pull, power)
        begun = np.where(by_rate[:, None], found.rate, -found.force / reach**2)
        taken = np.linalg.norm(found.force / reach, axis=1)[:second]
        slips[:second] |= self.released[contacts] & (taken >= 1 - USED)
        at_edge = np.abs(found.force[:first, 0]) >= strip[:first] * (1 - USED)
        turns = yields[:first] | ((bearings.released[rollers] != 0) & at_edge)
        bearings.modes[rollers] = np.where(turns, -np.sign(found.force[:first, 0]), 0).astype(int)
        self._take_contacts(discs, slips[:first], begun[:first], turns)
        along = np.stack([0 * begun[first:second, 0], begun[first:second, 0]], axis=1)
        self._take_contacts(rolls, slips[first:second], along, np.ones(len(rolls), bool))
        self._take_axles(axles, slips[second:], found.rate[second:, 0], found.force[second:, 0] / reach[second:, 0])

    def _stop_rollers(self, slid: np.ndarray) -> bool:
        """Whether rollers stop since their contacts, of `slid` (N,) bool, give way beside them (rule 4)."""
        bearings = self.axles
        taken = bearings.sliding[bearings.contact] / self._reach(self.held["chi"])
        stops = self.resting & self._turned() & slid & (taken >= self.load * self.grip.sliding[:, 0])
        self.towards[stops] = np.stack([self.turning[stops], 0.0 * self.turning[stops]], axis=1)
        bearings.resting[bearings.contact[stops]], bearings.modes[bearings.contact[stops]] = True, 0
        self.resting &= ~stops
        self.sticks &= ~stops
        return bool(stops.any())

    def _turned(self) -> np.ndarray:
        """(N,) bool: rollers that have turned up to now."""
        return (self.turning != 0) & ~self.axles.resting[self.axles.contact]

    def _take_contacts(self, contacts: np.ndarray, slips: np.ndarray, begun: np.ndarray, turns: np.ndarray) -> None:
        """Of `contacts` those that slip (m,) bool begin along (m, 2); with rollers that turn, along the rolling
        direction alone."""
        self.sticks[contacts] = ~slips
        own = np.where(turns[:, None], begun * [0.0, 1.0], begun)[slips]
        self.towards[contacts[slips]] = own / np.linalg.norm(own, axis=1, keepdims=True)

    def _take_axles(self, axles: np.ndarray, moves: np.ndarray, rates: np.ndarray, taken: np.ndarray) -> None:
        """Of `axles` those that move (m,) bool turn as they are accelerated, and those that have been let go where they
        take (m,) all of their torque."""
        signs = self.axles.released[axles]
        at_bound = -signs * taken >= 1 - USED
        self.axles.modes[axles] = np.where(moves, np.sign(rates), np.where(at_bound, signs, 0)).astype(int)

    def _bounds_of(
        self, discs: np.ndarray, rolls: np.ndarray, axles: np.ndarray, friction: np.ndarray, most: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(m, 2) and (m,) in N and N m: half-axes of the ellipses, and what the strips leave of them; `most` (2 N,) are
        the torques of the bearings."""
        per_torque = 1 / self._reach(self.held["chi"])
        of_ground = self.load[:, None] * friction
        taken = self._taken_along()
        left = np.sqrt(np.maximum((of_ground[:, 0] - taken) * (of_ground[:, 0] + taken), 0.0))
        first, second = len(discs), len(discs) + len(rolls)
        reach = np.ones((second + len(axles), 2))
        reach[:first] = of_ground[discs]
        reach[first:second, 0] = (left * friction[:, 1] / friction[:, 0])[rolls]
        reach[second:, 0] = most[axles]
        reach = np.maximum(reach, LEAST_REACH * reach.max())
        strip = np.full(len(reach), np.inf)
        strip[:first] = np.maximum((most[self.axles.contact] * per_torque)[discs], LEAST_REACH * reach[:first, 0])
        return reach, strip

    def _taken_along(self) -> np.ndarray:
        """(N,) in N, what the bearings of rollers that turn take along the axles of wheels that roll there."""
        return self.axles.sliding[self.axles.contact] * (1 / self._reach(self.held["chi"]))

    def _problem_of(
        self, discs: np.ndarray, rolls: np.ndarray, axles: np.ndarray, given: np.ndarray, evaluate: Evaluate
    ) -> tuple[np.ndarray, np.ndarray]:
        """D (m, 2, m, 2) and a (m, 2) of contacts that rest both ways, of those that rest along the rolling direction
        alone, and of axles at rest; the latter two have one component, beside one that nothing acts on."""
        first, second = len(discs), len(discs) + len(rolls)
        count, none = second + len(axles), np.zeros(len(self.sticks), bool)
        stuck = np.append(none, ~self._turned())
        torques = np.where(self.axles.resting, 0.0, self.axles.torques())

        def rates(pushed: np.ndarray, turned: np.ndarray) -> np.ndarray:
            evaluate(none, stuck, pushed, turned)
            found = np.zeros((count, 2))
            found[:first] = self.held["slip_dot"][discs]
            found[first:second, 0] = self.held["slip_dot"][rolls, 1]
            found[second:, 0] = self.held["rates_dot"][axles]
            return found

        without = rates(given, torques)
        matrix = np.zeros((count, 2, count, 2))
        force = float((self.load[:, None] * self.grip.sliding).max())
        torque = float(self.axles.holding.max()) or 1.0
        for k in range(count):
            for c in range(2 if k < first else 1):
                pushed, turned = given.copy(), torques.copy()
                if k < first:
                    pushed[discs[k], c] += force
                elif k < second:
                    pushed[rolls[k - first], 1] += force
                else:
                    turned[axles[k - second]] += torque
                matrix[:, :, k, c] = (rates(pushed, turned) - without) / (force if k < second else torque)
        matrix = (matrix + matrix.transpose(2, 3, 0, 1)) / 2
        for k in range(first, count):
            matrix[k, 1, k, 1] = matrix[k, 0, k, 0]
        return matrix, without


def as_if_rigid(wheels: int) -> dict[str, np.ndarray]:
    """What slip_forces takes beside the state, by name, for slips of wheels whose rollers stick."""
    none = np.zeros(wheels)
    forces = {"ground_push": np.zeros((wheels, 2)), "load_factor": np.ones(wheels), "passed_on": np.ones(wheels)}
    modes = {"contact_sticks": np.ones(wheels), "contact_bearing": none}
    return forces | modes | {"ground_yield": none, "damped_yield": none}


class StripFlow(GroundFlow):
    """The rates of a phase, of which `slip` are the speeds along the axles and the slips along the rolling directions.

    Where a roller turns, the forces of its contact follow from where it touches the ground.
    """

    def __init__(self, ground: GroundWithMasslessRollers, rates: BoundRates, plain: Flow):
        super().__init__(ground, rates, plain)
        kernel, buffers = ground.kernel, self.buffers
        for argument in kernel.signatures["corner_forces"].outputs:
            buffers.setdefault(argument.name, np.zeros(argument.shape))
        buffers["load"][:] = np.where(ground.off, 1.0, ground.load)
        aside = as_if_rigid(kernel.wheels) | {"ground_force": np.zeros_like(buffers["ground_force"])}
        self._slip = kernel.bind("slip_forces", buffers | aside)
        self.turns = ground.turning != 0
        self.turning = np.flatnonzero(self.slides & ~self.turns)
        self._ellipse, self._corner = self._slide, kernel.bind("corner_forces", buffers)
        self._slide = self._slide_or_turn

    def _slide_or_turn(self) -> None:
        self._ellipse()
        self._corner()
        both = self.slides & self.turns
        self.buffers["sliding_force"][both, 1] = self.buffers["corner_force"][both]
        self.buffers["ground_yield"][:] = np.where(both, self.buffers["corner_yield"], 0.0)

    def _push_along(self, directions: np.ndarray) -> None:
        super()._push_along(np.where(self.turns[:, None], self.ground.towards, directions))

    def headings(self, y: np.ndarray) -> np.ndarray:
        """(N,) in rad, where contacts go, as a row keeps it; where rollers turn along the rolling direction, also of
        those that stick."""
        across = np.copysign(np.pi / 2, self.ground.towards[:, 1])
        return np.where(self.turns, across, super().headings(y))

    def directed(self, time: float, y: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """y' where the forces are those of slips in these directions (m,), whatever the slips are."""
        self.y[:] = y
        return super().directed(time, y, angles)

    def _aim(self, angles: np.ndarray) -> None:
        self.buffers["slip_direction"][self.turning] = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self._slide()
        self.buffers["ground_push"][:] = np.where(self.slides[:, None], self.buffers["sliding_force"], 0.0)

    def _moved(self, time: float, y: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """Where rollers turn, forces move with the state."""
        return self.directed(time, y, angles)

"""Contacts, axles and massless rollers that may all stick in a run whose loads follow the motion, where the rollers'
bearings have viscous friction, too.

The rules of ground_with_damped_rollers.py hold for contacts and bearings, those of
loaded_ground_with_massless_rollers.py for the loads. Beside them:

1. Where a contact slips and its roller turns, the state says what the bearing would take of the speed along the axle,
   and the load how much of that is slip. So slip and both forces go with the load. Loads are found by Newton's
   rule for both (maxima/effects/contact_damped_loads.mac).
2. A step in polar form has the ways of such contacts as unknowns. On a way both forces are in proportion to the load.
3. Whether such a contact is at rest depends on the load as well. So it is decided under each of the loads that are
   found for the modes in turn: one whose roller has turned so far rests if it has come to rest, or if its slip vanishes
   under these loads.
4. What the slip along the axle changes by the load's own change is left out of its rate, which says how long a step may
   last and not where a slip comes to rest.
"""

import numpy as np

from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.ground import Dynamics, Grip
from omniroll.effects.ground_with_axles import Evaluate
from omniroll.effects.ground_with_damped_rollers import LEFT_AT_REST, DampedStripFlow, GroundWithDampedRollers
from omniroll.effects.guards import PASSED
from omniroll.effects.loaded_ground import LoadedFlow, LoadedGround
from omniroll.effects.loaded_ground_with_massless_rollers import LoadedGroundWithMasslessRollers
from omniroll.effects.loads_beside_bearings import LEAST, BesideBearings
from omniroll.effects.slipping_bearings import MasslessSlippingBearings
from omniroll.kernels.kernel import Flow, Kernel

KNOWN = 200  # states whose loads are kept: more than a step asks for before it asks for them again


class LoadedGroundWithDampedRollers(LoadedGroundWithMasslessRollers, GroundWithDampedRollers):
    """Contacts, axles and massless rollers in one run whose loads follow the motion.

    on_way       (N,) bool: contacts that go along a given way (rule 2)
    passed_gain  (N,) part of the change of the force along the axle per part of that of the load
    root_yields  (N,) in m/(s N), slips along the axle per force under the loads about which friction is linear
    passes       (N,) bool: contacts whose forces go with the load so, in the modes that are looked at
    rested       (N,) bool: contacts whose slip was zero as the present instant began
    """

    def __init__(self, kernel: Kernel, grip: Grip, bearings: MasslessSlippingBearings, rates: BoundRates):
        none = np.zeros(kernel.wheels)
        self.damping = np.asarray(kernel.constant("roller_damping"), float)
        self.passed, self.passed_gain = rates.buffers["passed_on"], none
        self.passed[:] = 1.0
        self.yields, self.root_yields = none, none
        self.on_way, self.passes, self.rested = none > 0, none > 0, none > 0
        super().__init__(kernel, grip, bearings, rates)

    # Loads of contacts whose rollers turn

    def _linear_about(self, loads: np.ndarray) -> None:
        """The forces of contacts that slip, whose rollers turn, are linear about loads (N,)."""
        corners = self.corners
        about = BesideBearings.about_of(self._corner_loads(np.ones(len(corners)))[0], corners, loads)
        found = self._gains(about) if corners.any() else [np.ones(len(about))] * 4
        gains, left, self.passed_gain, self.root_yields = found
        self.left = np.where(corners, left, 1.0)
        self.beside = BesideBearings.with_gain(gains, corners, about, loads)
        self._put(self.sticks)

    def _gains(self, about: np.ndarray) -> list[np.ndarray]:
        """(N,) load_gain, left_part, passed_gain and the slips' yields, under loads (N,)."""
        given = self._given(about)
        gain, passed, left, yields = self._called("damped_corner_loads", given)
        if self.on_way.any():
            given["slip_direction"] = self.held["slip_direction"]
            passed_there, yields_there = self._called("damped_way_loads", given)
            passed, yields = (np.where(self.on_way, *own) for own in ((passed_there, passed), (yields_there, yields)))
            gain, left = (np.where(self.on_way, 1.0, own) for own in (gain, left))
        return [gain, left, passed, yields]

    def _given(self, loads: np.ndarray) -> dict[str, np.ndarray]:
        """What functions of such contacts take under loads (N,)."""
        given = {name: self.held[name] for name in ("nu", "chi", "rates")}
        given |= {"load": loads, "friction": self.grip.sliding, "slip_direction": self._across(np.ones(len(loads)))}
        return given | {"contact_bearing": self.axles.torques()[self.axles.contact]}

    def _across(self, signs: np.ndarray) -> np.ndarray:
        """(N, 2) along the rolling directions, of these signs (N,)."""
        return np.stack([0 * signs, np.copysign(1.0, signs)], axis=1)

    def _put(self, sticks: np.ndarray) -> None:
        """What the kernels take of contacts of which (N,) bool stick in what is looked at next."""
        self.passes = self.corners & ~sticks
        self.yields = np.where(self.passes, self.root_yields, 0.0)
        self.held["damped_yield"][:] = self.yields

    def feel(self, loads: np.ndarray | None) -> None:
        super().feel(loads)
        self.passed[:] = 1.0
        if loads is not None:
            about = self.beside.about
            self.passed[:] = np.where(self.passes, 1 + self.passed_gain * (loads - about) / about, 1.0)

    def forces_per_load(self) -> np.ndarray:
        """(N, 2) those on the ellipses; where rollers turn along the rolling direction, what is left of which is said
        by factors(). Of a contact that begins along its axle, where nothing is left, that is a root of rounding, which
        loads would feel: it has none."""
        says = self.moving & self.speeds.any(axis=1)
        towards = np.where(says[:, None], self.speeds, self.towards)
        turns = self.turning != 0
        along = turns & ~says & (towards[:, 1] == 0)
        towards = np.where(turns[:, None], self._across(towards[:, 1]), towards)
        forces = self.grip.sliding_forces(self.kernel, towards, np.ones(len(towards)))
        return np.where(along[:, None], 0.0, forces)

    def _under(self, loads: np.ndarray, dynamics: Dynamics, sticks: np.ndarray, unit: np.ndarray) -> tuple:
        self._put(sticks)
        return super()._under(loads, dynamics, sticks, unit)

    def _yields(self) -> np.ndarray:
        """(N,) none: those of rollers with viscous friction are put with their forces."""
        return np.zeros(len(self.sticks))

    def _called(self, name: str, given: dict[str, np.ndarray]) -> tuple[np.ndarray, ...]:
        one = np.ones(len(self.sticks))
        return super()._called(name, {"load_factor": one, "passed_on": one} | given)

    # What the state says

    def used_up(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As without viscous friction; of a slip that comes to rest rounding is left, and the bearing feels it."""
        values, rounded = LoadedGround.used_up(self, force)
        speeds = self.roundings(self.held["nu"], self.held["rates"], None)
        of_slip = self._dampers() * speeds / (self.grip.static[:, 0] * self.grip.loads.max())
        return values, rounded + np.where(self.turning != 0, LEFT_AT_REST * of_slip / PASSED, 0.0)

    def begin(self, slip: np.ndarray, evaluate: Evaluate) -> None:
        """Modes of all contacts and bearings, and the loads, in the phase that begins now; `slip` (N, 2) in m/s has the
        speeds of the wheels along their axles."""
        self.rested, self.on_way[:] = self.resting | self.still, False
        super().begin(slip, evaluate)

    def _under_loads(self, slip: np.ndarray, rests: np.ndarray) -> np.ndarray:
        """The same; a contact whose roller turns rests where its own slip vanishes (rule 3)."""
        rests = super()._under_loads(slip, rests)
        held, rollers = self.held, self.axles.contact
        turns = (self.turning != 0) & ~self.axles.resting[rollers] & ~self.off
        size = np.linalg.norm(self._true_slips(held["nu"], held["chi"], held["rates"], turns), axis=1)
        landed = self.rested & ~self.before[1]
        rests = np.where(turns, landed | (size <= self.roundings(held["nu"], held["rates"], None)), rests)
        self.moving = ~rests
        return rests

    def _signs(self, places: np.ndarray) -> np.ndarray:
        """Rollers under contacts that slip turn as the speeds along the axles say."""
        signs = np.append(np.ones(self.axles.wheels, int), np.where(self.speeds[:, 0] < 0, -1, 1))
        return signs[places]


class LoadedDampedFlow(LoadedFlow, DampedStripFlow):
    """The rates of a phase. What follows from state and load is asked under the loads that were found in that state."""

    ground: LoadedGroundWithDampedRollers

    def __init__(self, ground: LoadedGroundWithDampedRollers, rates: BoundRates, plain: Flow):
        super().__init__(ground, rates, plain)
        kernel, axles = ground.kernel, ground.axles
        self.loads = np.where(ground.off, 1.0, ground.load)
        given = self.buffers | {"load": self.loads, "contact_bearing": axles.torques()[axles.contact]}
        self._root, self._way = kernel.bind("damped_corners", given), kernel.bind("damped_ways", given)
        self.last, self.known = 0.0, {}
        self.buffers["slip_direction"][:] = ground._across(ground.towards[:, 1])
        self.ways = ground.towards.copy()

    def slip(self, y: np.ndarray) -> np.ndarray:
        """(N, 2) in m/s, in the state y, under its loads."""
        if y.tobytes() not in self.known:
            self(self.last, y)
        return self._slip_under(self.known[y.tobytes()], y)

    def _slip_under(self, loads: np.ndarray, y: np.ndarray) -> np.ndarray:
        self.loads[:] = np.where(self.both, np.maximum(loads, LEAST), 1.0)
        return super().slip(y)

    def _rates(self, time: float, y: np.ndarray) -> np.ndarray:
        rates = super()._rates(time, y)
        self.last = time
        self.known.pop(y.tobytes(), None)
        self.known[y.tobytes()] = self.ground.pressing
        if len(self.known) > KNOWN:
            self.known.pop(next(iter(self.known)))
        self._slip_under(self.ground.pressing, y)
        return rates

    def _push(self, y: np.ndarray) -> None:
        """Signs are all that is taken of slips which go with the loads: those of the last loads say them."""
        slip = self._slip_under(self.loads, y)
        self._push_along(self.ground.direction(slip, self.rounding()))

    def _push_along(self, directions: np.ndarray) -> None:
        """The forces of slips along directions (N, 2); where rollers turn those of state and load, with that sign along
        the rolling direction."""
        self.ways, self.ground.on_way[:] = directions, False
        across = self.ground._across(directions[:, 1])
        lengths = np.linalg.norm(directions, axis=1, keepdims=True)
        own = directions / np.where(lengths > 0, lengths, 1.0)
        self.buffers["slip_direction"][:] = np.where(self.both[:, None], across, own)
        self._ellipse()
        self.buffers["ground_push"][:] = np.where(self.slides[:, None], self.buffers["sliding_force"], 0.0)

    def in_row(self, time: float, y: np.ndarray) -> None:
        self.last = time
        super().in_row(time, y)

    def _aim(self, angles: np.ndarray) -> None:
        super()._aim(angles)
        self.ground.on_way[:] = self.both

    def _by_angles(self, time: float, y: np.ndarray, angles: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """The same; the loads of the state are again those of these directions, not of turned ones."""
        own = self.known[y.tobytes()]
        by_angle = super()._by_angles(time, y, angles, rates)
        self.known[y.tobytes()] = own
        return by_angle

    def _take_state(self, y: np.ndarray) -> None:
        super()._take_state(y)
        self.loads[:] = np.where(self.both, np.maximum(self.known[y.tobytes()], LEAST), 1.0)

    def _going(self) -> np.ndarray:
        return self.ways

"""The ground in a run whose loads follow the motion: the modes of its contacts, and the rates of a phase.

Where contacts at rest may give way, their friction depends on the loads and the loads on their friction: one is found
for the other in turn (rule 3 of ground.py with these loads, then the loads in these modes) until nothing changes. That
begins with the loads where all of them stick; where there are none, since friction would lift wheels that gives way
before, with those of the last state. If this finds no loads either, the run stops; the vehicle tips if it does so
where all contacts stick, or where some give way.

The laws that are smooth have no contacts that stick; theirs carry or are off (smooth_ground.py).
"""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.ground import CLEARLY, HELD_ROUNDINGS, Dynamics, Grip, Ground
from omniroll.effects.ground_flow import GroundFlow
from omniroll.effects.ground_loads import (
    NONE,
    SEVERAL,
    UNSETTLED,
    UNSETTLED_BEARINGS,
    Carried,
    GroundFailsError,
    Loads,
    SumsOf,
)
from omniroll.effects.guards import EPS, PASSED
from omniroll.effects.rounds_with_loads import FindModes, Kept, take_rounds
from omniroll.effects.slipping_axles import SlippingAxles
from omniroll.effects.steady_ways import Turned, is_steady, next_steady, turned_by
from omniroll.kernels.kernel import Flow, Kernel

TURNS, PATIENT = 200, 40  # of friction and loads, one for the other; after which directions are looked for otherwise
SETTLED = 1e-14  # of the weight


class LoadBalance:
    """The generated balance of the loads, bound to the buffers of rates: sums (3,) of what was computed there last."""

    def __init__(self, kernel: Kernel, numbers: dict[str, np.ndarray], buffers: dict[str, np.ndarray]):
        for name in ("slip_load_balance", "coulomb_momenta", "disk_momenta"):
            if name in kernel.signatures:
                signature = kernel.signatures[name]
                for argument in (*signature.inputs, *signature.outputs):
                    buffers.setdefault(argument.name, np.zeros(argument.shape))
        for name, value in numbers.items():
            buffers[name][...] = value
        self.buffers, self.calls = buffers, []
        if "coulomb_momenta" in kernel.signatures:
            aside = {"coulomb_rates": buffers["coulomb_momenta_dot"]}
            self.calls.append(kernel.bind("coulomb_momenta", buffers | aside))
        if "disk_momenta" in kernel.signatures:
            aside = {"bearing_rates": buffers["bearing_momenta_dot"]}
            self.calls.append(kernel.bind("disk_momenta", buffers | aside))
        self.calls.append(kernel.bind("slip_load_balance", buffers))

    def __call__(self) -> np.ndarray:
        for call in self.calls:
            call()
        return self.buffers["load_sums"].copy()


@contextmanager
def telling_what_tips(at_rest: GroundFailsError | None) -> Iterator[None]:
    """Around a search for loads where contacts give way, which began because there are none where all stick: `at_rest`
    says why. Raises GroundFailsError where it fails: the reason with which the vehicle tips, if one of the two is such.
    """
    try:
        yield
    except GroundFailsError as fails:
        if at_rest and at_rest.tips and not fails.tips:
            raise at_rest from None
        raise


class LoadedGround(Ground):
    """The contacts in one run whose loads follow the motion; `load` (N,) are those of the last state.

    pressing  (N,) in N, the same where a load that has vanished goes on below zero
    """

    turns = 0  # how often modes have been looked for at an instant
    seeks_everywhere = False  # in rounds

    def __init__(self, kernel: Kernel, grip: Grip, rates: BoundRates):
        super().__init__(kernel, grip)
        self.loads = Loads(kernel.vehicle.places(), grip.loads)
        self.balance = LoadBalance(kernel, grip.balance, rates.buffers)
        self.factor = rates.buffers["load_factor"]
        self.factor[:] = 1.0
        self.pressing = grip.loads

    def moved(self) -> None:
        super().moved()
        self.loads.moved()

    @property
    def guards_of_contacts(self) -> int:
        return 2 * len(self.sticks) + 1

    def pass_guards(self, passed: np.ndarray) -> None:
        count = len(self.sticks)
        super().pass_guards(passed[:count])
        self.loads.pass_guards(passed[count : 2 * count])

    def used_up(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N,) how much more than its load a force (N, 2) asks for, per the largest load at rest; and the rounding of
        that. Just before a load vanishes a contact that sticks is asked for more than friction, and lets go: a quotient
        of the two, or a load that is cut off at zero, would hide so short a time from the polynomial of a step."""
        asked = np.linalg.norm((force / self.grip.static)[:, self.directions], axis=1)
        size = self.grip.loads.max()
        excess = np.where(self.off, -1.0, (asked - self.pressing) / size)
        return excess, HELD_ROUNDINGS * EPS * (asked + np.abs(self.pressing)) / size

    def says_its_way(self, pull: np.ndarray, power: np.ndarray) -> np.ndarray:
        """The rate of a slip that only just begins is what larger ones leave, and its direction that of the force
        against it: loads would not settle to more digits than it has."""
        return pull > CLEARLY * power

    def decide(self, slip: np.ndarray, dynamics: Dynamics) -> None:
        rests = self.resting | self.still  # also contacts that are off, which may carry from now on
        self.aim(slip, ~rests)
        unit = self.forces_per_load()
        at_rest = self._fails_at_rest(unit, rests, dynamics)
        self.resting = rests & ~self.off
        if not self.resting.any():
            return
        if not at_rest and not self.released.any():
            held, _ = self._under(self.load, dynamics, self.sticks, unit * self._slides[:, None])
            beyond, rounding = self.used_up(held)
            if not (self.sticks & (beyond > PASSED * rounding)).any():
                return
        with telling_what_tips(at_rest):
            self._settle(rests, dynamics)

    def _fails_at_rest(self, unit: np.ndarray, rests: np.ndarray, dynamics: Dynamics) -> GroundFailsError | None:
        """Why there are no loads where all `rests` (N,) bool stick: those of the last state are taken then."""
        try:
            self._carry(unit, rests, dynamics)
        except GroundFailsError as fails:
            if fails.failure != NONE:
                raise
            self.off = ~self.loads.carries | self.loads.dropped
            self.trying(~self.off)
            self.load = np.where(self.off, 0.0, self.load)
            if not ((rests & ~self.off).any() or self.may_be_elsewhere(fails)):
                raise
            return fails
        return None

    @property
    def may_turn(self) -> np.ndarray:
        """(N,) bool: contacts whose slips have directions that turn."""
        return np.ones(len(self.sticks), bool)

    @property
    def _slides(self) -> np.ndarray:
        return ~self.sticks & ~self.off

    def forces_per_load(self) -> np.ndarray:
        """(N, 2) the forces on contacts that slip, or begin to, by which factors() are multiplied."""
        return self.sliding_forces(np.ones(len(self.sticks)))

    def factors(self, loads: np.ndarray) -> np.ndarray:
        """(N,) what the kernels take as load_factor under loads (N,) in N."""
        return loads

    def _under(self, loads: np.ndarray, dynamics: Dynamics, sticks: np.ndarray, unit: np.ndarray) -> tuple:
        """The dynamics under loads (N,) and forces `unit` (N, 2) per load."""
        self.feel(loads)
        found = dynamics(sticks, unit)
        self.feel(None)
        return found

    def feel(self, loads: np.ndarray | None) -> None:
        """The kernels have forces under loads (N,); None: those that are given."""
        self.factor[:] = 1.0 if loads is None else self.factors(loads)

    @property
    def bearings(self) -> SlippingAxles | None:
        """Those that may stick beside the contacts."""
        return None

    def bearings_in_rounds(self) -> np.ndarray:
        """Which bearings are decided in rounds: those at rest."""
        return self.bearings.resting.copy()

    def may_be_elsewhere(self, fails: GroundFailsError) -> bool:
        """Whether what turns have not found, which `fails` says, is looked for elsewhere."""
        return not fails.ends

    def contacts_in_rounds(self, rests: np.ndarray) -> np.ndarray:
        """Which contacts (N,) bool are, of those whose slip is zero, `rests` (N,) bool."""
        return rests

    def carry_by_moments(self, sums: np.ndarray) -> None:
        """What carries where loads have sums (3,) is what is given."""

    def _settle(self, rests: np.ndarray, dynamics: Dynamics) -> None:
        """Friction and loads that belong together; `rests` (N,) bool, contacts whose slip is zero."""

        def find_modes(still: np.ndarray) -> np.ndarray:
            self.sticks = self.resting.copy()
            if self.resting.any():
                given = self.sliding_forces(self.load) * self._slides[:, None]
                self.give_way(np.flatnonzero(self.resting), given, dynamics)
            return still

        self.find_modes_and_loads(rests, find_modes, dynamics)

    def find_modes_and_loads(self, rests: np.ndarray, find_modes: FindModes, dynamics: Dynamics) -> None:
        """Modes for the loads and loads for the modes, in turn, or else by the rounds of rounds_with_loads.py."""
        kept, compression, none = Kept.of(self), self.pressing, None
        try:
            found = self._take_turns(rests, find_modes, dynamics)
        except GroundFailsError as fails:
            if not self.may_be_elsewhere(fails):
                raise
            none = fails if fails.ends else None
            found = Carried(compression, self.loads.start, compression, np.array(np.nan))
        if found is not None and not take_rounds(self, kept, rests, find_modes, dynamics, none is not None):
            if none:
                raise none
            contacts = (self.contacts_in_rounds(rests) & self.loads.carries).any()
            self.loads.refuse(UNSETTLED if contacts else UNSETTLED_BEARINGS, found)

    def _take_turns(self, rests: np.ndarray, find_modes: FindModes, dynamics: Dynamics) -> Carried | None:
        """None where turns come to an end; else the loads of the last one."""
        for turn in range(TURNS):
            before = self.load
            rests = find_modes(rests)
            found = self.carry_in_modes(rests, dynamics)
            if np.abs(self.load - before).max() > SETTLED * self.loads.weight:
                if turn % PATIENT == PATIENT - 1:
                    self.turn_on(rests, dynamics)
            elif not self.turns_to_steady(rests, dynamics):
                return None
        return found

    def carry_in_modes(self, rests: np.ndarray, dynamics: Dynamics) -> Carried:
        """The loads in the present modes; `rests` (N,) bool, contacts whose slip is zero."""
        found = self._carry(self.forces_per_load(), self.sticks | (rests & self.off), dynamics)
        self.resting = rests & ~self.off
        return found

    def sums_in_modes(self, dynamics: Dynamics) -> np.ndarray:
        """(3,) the sums of the loads that the motion asks for in the present modes, under the present loads."""
        return self._sums_of_pushes(dynamics)(self.load)

    def turns_to_steady(self, rests: np.ndarray, dynamics: Dynamics) -> bool:
        """Whether some of the contacts `rests` (N,) bool that let go do so in a direction that is not steady: they get
        one that is, and all loads those of it (steady_ways.py). Raises GroundFailsError where there are two."""
        for contact, turned in self._begin(rests, dynamics):
            if turned(0.0)[0] > self.settles or is_steady(turned):
                continue
            ways = [way for side in (1, -1) if (way := next_steady(turned, side)) is not None]
            grows = [way for way in ways if turned(way)[0] > self.settles]
            if len(grows) > 1:
                self.loads.refuse(SEVERAL, self._under_own_loads(dynamics))
            if grows:
                self._take_way(contact, grows[0], dynamics)
                return True
        return False

    def turn_on(self, rests: np.ndarray, dynamics: Dynamics) -> None:
        """Directions and loads find each other slowly where two solutions are near each other, and not at all where
        loads feel more of a direction than it has turned. Contacts that let go, `rests` (N,) bool, turn to the next
        steady direction on the side to which their slips are turned, if these do not fall along it: where friction
        is just used up they have no rate."""
        for contact, turned in self._begin(rests, dynamics):
            way = next_steady(turned, 1 if turned(0.0)[1] > 0 else -1)
            if way is not None and turned(way)[0] >= -self.settles:
                self._take_way(contact, way, dynamics)

    def _begin(self, rests: np.ndarray, dynamics: Dynamics) -> Iterator[tuple[int, Turned]]:
        """Contacts that begin to slip, and what they do in directions that are turned."""
        if self.directions.start:  # massless rollers do not slip along their axles: their slips do not turn
            return
        for contact in np.flatnonzero(rests & self._slides & self.may_turn):

            def turned(angle: float, contact: int = contact) -> tuple[float, float]:
                kept = self.towards[contact].copy()
                way = self.towards[contact] = turned_by(kept, angle)
                _, rates = self._under(self._under_own_loads(dynamics).loads, dynamics, self.sticks, self._pushes())
                self.towards[contact] = kept
                (x, y), (rate, other) = way.copy(), rates[contact]
                return x * rate + y * other, x * other - y * rate

            yield int(contact), turned

    def _take_way(self, contact: int, angle: float, dynamics: Dynamics) -> None:
        self.towards[contact] = turned_by(self.towards[contact], angle)
        self.press(self._under_own_loads(dynamics))

    def _pushes(self) -> np.ndarray:
        """(N, 2) the forces of contacts that slip, per load."""
        return self.forces_per_load() * self._slides[:, None]

    def _sums_of_pushes(self, dynamics: Dynamics) -> SumsOf:
        """The sums of the loads in the present modes and directions, as `carried` asks for them."""
        unit = self._pushes()

        def sums_of(loads: np.ndarray) -> np.ndarray:
            self._under(loads, dynamics, self.sticks, unit)
            return self.balance()

        return sums_of

    def _under_own_loads(self, dynamics: Dynamics) -> Carried:
        """The loads in the present modes and directions."""
        carries = self.loads.carries
        return self.loads.in_set(self.loads.springs.shares(carries), carries, self._sums_of_pushes(dynamics))

    def _carry(self, unit: np.ndarray, holds: np.ndarray, dynamics: Dynamics) -> Carried:
        """Which contacts carry, and with which loads, where those of them stick that `holds` (N,) bool; `unit` (N, 2)
        are the forces per load."""

        def sums_for(carries: np.ndarray):
            self.trying(carries)
            sticks = holds & carries

            def sums_of(loads: np.ndarray) -> np.ndarray:
                self._under(loads, dynamics, sticks, unit * (carries & ~sticks)[:, None])
                return self.balance()

            return sums_of

        found = self.loads.decide(sums_for, friction=True)
        self.trying(self.loads.carries)
        self.off = ~self.loads.carries
        self.sticks = holds & ~self.off
        self.press(found)
        return found

    def trying(self, carries: np.ndarray) -> None:
        """Contacts (N,) bool that carry in what is looked at next."""

    def press(self, found: Carried) -> None:
        """These are the loads."""
        self.pressing, self.load = found.loads, np.maximum(found.loads, 0.0)


class LoadedFlow(GroundFlow):
    """The rates of a phase; after a call `carried` are the loads of the state."""

    def __init__(self, ground: LoadedGround, rates: BoundRates, plain: Flow):
        super().__init__(ground, rates, plain)
        self.buffers["load"][:] = 1.0  # forces per load

    def _rates(self, time: float, y: np.ndarray) -> np.ndarray:
        ground = self.ground

        def sums_of(loads: np.ndarray) -> np.ndarray:
            ground.feel(loads)
            self.plain(time, y)
            return ground.balance()

        self.carried = ground.loads.solve(sums_of)
        ground.press(self.carried)
        ground.feel(self.carried.loads)
        found = self.plain(time, y)
        ground.feel(None)
        return found

    def _moved(self, time: float, y: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """As for loads that are given; the loads follow the state."""
        return self.directed(time, y, angles)

    def _by_angles(self, time: float, y: np.ndarray, angles: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """As for loads that are given; by differences, since the loads turn with the directions."""
        return self._by_turned_angles(time, y, angles, rates)


__all__ = ["GroundFailsError", "LoadedFlow", "LoadedGround"]

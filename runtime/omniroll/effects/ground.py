"""The ground under Coulomb's friction in a run: a mode for each contact.

1. A contact that slips takes coefficient times load against its slip: of the forces of its ellipse the one that takes
   the most power. A contact that does not slip takes what keeps it so, up to its static friction, which is at least the
   sliding one: it sticks.
2. A phase ends where the force that holds a contact reaches its static friction, and where a slip comes to rest. Both
   are located.
3. At such an instant, and wherever forces have jumped, all contacts at rest are decided together. They all stick if
   the forces that hold them lie within their static friction. If not, it goes in rounds: the forces and the rates of
   the slip are found with the static friction as the reach of each (cones.py); contacts that begin to slip have broken
   away, and their reach is the sliding friction in the next round; the last round is the one in which no further
   contact begins to slip.
4. A contact on which friction is just used up has no rate of slip yet. It gets the direction in which it gives way.
5. The slip of a contact has two components: the axle's and the rolling direction's. On its way to rest its direction
   turns faster and faster. Steps end before the rest that they would come to, each a fixed part of the way, so that the
   slip falls geometrically until it is rounding.
6. Massless rollers do not slip along their axles: their contacts have one component, and a sign in place of a
   direction.
7. A contact without load takes no force: it is off.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from omniroll.effects import cones
from omniroll.effects.guards import EPS, PASSED
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle

AT_REST = 1000  # a slip is zero within this many roundings of the velocities that it is the difference of
MOVES = 1e-10  # a contact begins to slip that gets more than this part of what the forces could give it
CLEARLY = 1e-2  # the same of one whose rate says with most of its digits where it goes
AT_EDGE = 1e-9  # friction is used up that is nearer to its bound than this part of it
HELD_ROUNDINGS = 64  # of a force that holds, which is what is left of other forces
SETTLES = 1e-9  # of the acceleration that friction gives the vehicle: a slip falls that falls faster
PART_OF_WAY = 0.8  # to rest, at most, in one step
PAST_REST = 100.0  # roundings: a slip that comes to rest beside others may go back by so many
STRAIGHT = 0.9  # the cosine from which on a slip against its direction counts as one that goes back


def slip_roundings(vehicle: Vehicle, nu: np.ndarray, rates: np.ndarray, axial: np.ndarray | None) -> np.ndarray:
    """(..., N) in m/s: slips within these are zero. Of nu (..., 3), the wheels' rates (..., N) and the axial speeds of
    the rollers in contact (..., N), None of massless ones."""
    turning = 2 * np.abs(nu[..., 2]) / vehicle.yaw_scale
    of_platform = vehicle.platform_radius * (np.abs(nu[..., :2]).sum(axis=-1) + turning)
    of_wheels = vehicle.wheel_radius * np.abs(rates)
    if axial is not None:
        of_wheels = of_wheels + vehicle.roller_radius * np.abs(axial)
    return AT_REST * EPS * (of_platform[..., None] + of_wheels)


def slip_says(slip: np.ndarray, towards: np.ndarray, rounding: np.ndarray) -> np.ndarray:
    """(..., N) bool: contacts whose slip (..., N, 2) says where they go; of others the unit vectors `towards`
    (..., N, 2) do, since the slip is rounding (..., N), or has just come to rest and gone back."""
    size = np.linalg.norm(slip, axis=-1)
    back = (slip * towards).sum(axis=-1) < -STRAIGHT * size
    return size > np.where(back, PAST_REST, 1.0) * rounding


# From sticks (N,) and the forces (N, 2) of slipping contacts: forces (N, 2) and rates of the slip (N, 2) of all.
Dynamics = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Grip:
    """The friction of the contacts: loads (N,) in N, and coefficients (N, 2) where they slip and where they stick.

    law      of the ground
    balance  numbers of the loads' balance by name, where the loads follow the motion; `loads` are then those at rest
    """

    loads: np.ndarray
    sliding: np.ndarray
    static: np.ndarray
    law: str = "coulomb"
    balance: Mapping[str, Any] | None = None

    def settles(self, vehicle: Vehicle) -> float:
        """In m/s^2: a slip comes to rest that falls faster."""
        return SETTLES * float((self.loads[:, None] * self.sliding).max()) / vehicle.mass

    @property
    def sticks(self) -> bool:
        """Whether contacts may stick."""
        return self.law == "coulomb"

    def factor(self, loads: np.ndarray, carries: np.ndarray) -> np.ndarray:
        """(..., N) what the kernels take as load_factor, where the loads (..., N) in N follow the motion."""
        return np.where(carries, 1.0 if self.law == "viscous" else loads, 0.0)

    def sliding_forces(self, kernel: Kernel, towards: np.ndarray, loads: np.ndarray) -> np.ndarray:
        """(..., N, 2) in N, the forces on contacts that slip along `towards` (..., N, 2) under loads (..., N)."""
        return kernel.call("sliding_forces", towards, loads, self.sliding)[0]


class Ground:
    """The contacts in one run.

    sticks    (N,) bool, of the present phase
    resting   (N,) bool: contacts whose slip is zero
    released  (N,) bool: those that have used their friction up at this instant
    still     (N,) bool: all whose slip is rounding, also those without load
    towards   (N, 2) where contacts slip that have begun to; a unit vector
    seen      (N, 2) where they have slipped last in a row; a unit vector
    going     (N, 2) the same at the start of the present step
    load      (N,) in N
    off       (N,) bool: those without load
    """

    def __init__(self, kernel: Kernel, grip: Grip):
        self.kernel, self.grip = kernel, grip
        count = kernel.wheels
        self.directions = slice(0, 2) if kernel.has_spins else slice(1, 2)  # in which contacts may slip
        self.load, self.off = grip.loads, grip.loads == 0
        self.sticks, self.resting, self.released, self.still = (np.zeros(count, bool) for _ in range(4))
        self.towards = np.tile([0.0, 1.0], (count, 1))
        self.seen, self.going = self.towards.copy(), self.towards.copy()
        vehicle = kernel.vehicle
        self.settles = grip.settles(vehicle)

    # What the state says

    def roundings(self, nu: np.ndarray, rates: np.ndarray, axial: np.ndarray | None) -> np.ndarray:
        """(N,) in m/s: slips within these are zero."""
        return slip_roundings(self.kernel.vehicle, nu, rates, axial)

    def at_rest(self, state: State) -> State:
        """The state with the slip of resting contacts at zero. Contacts whose slip is rounding rest, too."""
        axial = state.contact_axial() if self.kernel.has_spins else None
        given = {"nu": state.nu, "chi": state.chi, "rates": state.rates, "contact_omega": axial}
        given |= {"ground_push": np.zeros((self.kernel.wheels, 2)), "load_factor": np.ones(self.kernel.wheels)}
        names = (argument.name for argument in self.kernel.signatures["slip_forces"].inputs)
        slip, _ = self.kernel.call("slip_forces", *(given[name] for name in names))
        self.still = np.linalg.norm(slip, axis=1) <= self.roundings(state.nu, state.rates, axial)
        self.resting = (self.resting | self.still) & ~self.off
        if not self.resting.any():
            return state
        rolling, _ = self.kernel.wheel_rates(state.nu, state.chi)
        found = replace(state, rates=np.where(self.resting, rolling, state.rates))
        if axial is None:
            return found
        turning = self.kernel.contact_axial(state.nu, state.chi)
        return found.with_contact_axial(np.where(self.resting, turning, axial))

    # What has happened

    @property
    def guards_of_contacts(self) -> int:
        """How many guards contacts and their loads have."""
        return len(self.sticks)

    def moved(self) -> None:
        """Some time has passed."""
        self.resting = self.sticks.copy()
        self.released[:] = False

    def switched(self, directions: np.ndarray) -> None:
        """Wheels have passed to their next rollers, directions (N,), which come with the spins that they have."""
        if self.kernel.has_spins:
            self.resting &= directions == 0
        self.released[:] = False

    def pass_guards(self, passed: np.ndarray) -> None:
        """Contacts, (N,) bool, whose mode has ended: those that stick are let go, those that slip have come to rest."""
        self.released |= passed & self.sticks
        self.resting |= passed & ~self.sticks

    # What follows

    def direction(self, slip: np.ndarray, rounding: np.ndarray) -> np.ndarray:
        """(N, 2) along the slip (N, 2), or where that is rounding, where the contact went last; a unit vector."""
        if self.directions.start:
            return self.towards
        begun = np.linalg.norm(slip, axis=1) > rounding
        return np.where(begun[:, None], slip, self.going)

    def follow(self, slip: np.ndarray, rounding: np.ndarray) -> None:
        """A step begins with slips (N, 2). Those that come to rest in it have turned since the phase began."""
        size = np.linalg.norm(slip, axis=1)
        begun = size > rounding
        self.going[begun] = slip[begun] / size[begun, None]

    def keep_ways(self) -> None:
        """A phase begins: contacts go where it has been decided that they go."""
        self.seen, self.going = self.towards.copy(), self.towards.copy()

    def headings(self, slip: np.ndarray, rounding: np.ndarray) -> np.ndarray:
        """(N,) in rad, where contacts go whose slip (N, 2) is rounding (N,), or near it, and may say nothing: at a rest
        where it went last, and where a slip begins where that goes. Other contacts have the latter, too."""
        says = slip_says(slip, self.seen, rounding)
        size = np.linalg.norm(slip, axis=1)
        self.seen[says] = slip[says] / size[says, None]
        towards = np.where((size > PAST_REST * rounding)[:, None], self.towards, self.seen)
        return np.arctan2(towards[:, 1], towards[:, 0])

    def used_up(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N,) how much of its static friction a force (N, 2) takes, squared, less 1; and the rounding of that."""
        own = self.directions
        reach = self.load[:, None] * self.grip.static
        with np.errstate(divide="ignore", invalid="ignore"):
            taken = np.where(self.off, 0.0, ((force / reach)[:, own] ** 2).sum(axis=1))
        return taken - 1, HELD_ROUNDINGS * EPS * (1 + taken)

    def aim(self, slip: np.ndarray, slides: np.ndarray) -> None:
        """Where the contacts `slides` (N,) bool go, which slip with (N, 2) in m/s."""
        moves = slides & slip.any(axis=1)
        size = np.linalg.norm(slip, axis=1)
        self.towards[moves] = slip[moves] / size[moves, None]
        if self.directions.start:
            self.towards[:, 0] = 0.0
            self.towards[slides, 1] = np.sign(slip[slides, 1])

    def sliding_forces(self, loads: np.ndarray) -> np.ndarray:
        """(N, 2) in N, the forces on contacts that slip, or begin to."""
        return self.grip.sliding_forces(self.kernel, self.towards, loads)

    def decide(self, slip: np.ndarray, dynamics: Dynamics) -> None:
        """Modes of all contacts in the phase that begins now (rule 3); slip (N, 2) in m/s."""
        slides = ~self.resting & ~self.off
        self.aim(slip, slides)
        given = np.where(slides[:, None], self.sliding_forces(self.load), 0.0)
        self.sticks = self.resting.copy()
        if not self.resting.any():
            return
        if not self.released.any():
            held, _ = dynamics(self.sticks, given)
            beyond, rounding = self.used_up(held)
            if not (self.sticks & (beyond > PASSED * rounding)).any():
                return
        self.give_way(np.flatnonzero(self.resting), given, dynamics)

    def says_its_way(self, pull: np.ndarray, power: np.ndarray) -> np.ndarray:
        """(m,) bool: whether the rates of slips that begin, with these pulls of a possible power, say where they go."""
        return np.ones(len(pull), bool)

    def give_way(self, resting: np.ndarray, given: np.ndarray, dynamics: Dynamics) -> None:
        """Which of the contacts `resting` slip, and where they go; `given` (N, 2) are the forces of the others."""
        own, free = self.directions, np.zeros(len(self.sticks), bool)
        _, rates = dynamics(free, given)
        without = rates[resting, own]
        count, width = without.shape
        matrix = np.empty((count, width, count, width))
        typical = float((self.load[:, None] * self.grip.sliding)[resting].max())
        for k, contact in enumerate(resting):
            for c in range(width):
                pushed = given.copy()
                pushed[contact, own.start + c] += typical
                matrix[:, :, k, c] = (dynamics(free, pushed)[1][resting, own] - without) / typical
        matrix = (matrix + matrix.transpose(2, 3, 0, 1)) / 2
        loads = self.load[resting, None]
        broken = self.released[resting]
        for _ in range(count + 1):
            friction = np.where(broken[:, None], self.grip.sliding[resting, own], self.grip.static[resting, own])
            reach = loads * friction
            found = cones.decide(matrix, without, reach)
            power = (np.abs(without) * reach).sum(axis=1) + np.einsum("ia,iajb,jb->i", reach, np.abs(matrix), reach)
            slips = found.pull > MOVES * power
            if not (slips & ~broken).any():
                break
            broken = broken | slips
        taken = np.linalg.norm(found.force / reach, axis=1)
        giving_way = self.released[resting] & (taken >= 1 - AT_EDGE)
        by_rate = slips & self.says_its_way(found.pull, power)
        begun = np.where(by_rate[:, None], found.rate, -found.force / friction**2)[slips | giving_way]
        going = resting[slips | giving_way]
        self.sticks[going] = False
        self.towards[going, own] = begun / np.linalg.norm(begun, axis=1, keepdims=True)

"""Rollers that stick on their disks where wheels may slip: the set-valued law of Coulomb's friction, a mode for each.

There each roller has an axial speed of its own, in contact or not. Under a smooth law the ground's forces follow from
the state, so that what holds a roller depends on how others are held through one number alone, theta''.

1. A roller that spins takes its sliding torque, against its spin. One that rests on its disk takes what holds it, up to
   its break-away torque, which is at least the sliding one. Of a roller in contact that is what the ground's force asks
   for, too.
2. A phase ends where a spin passes zero, and where a roller asks for more than that. Both are located.
3. At such an instant, and wherever forces have jumped, all rollers at rest are decided together. They all stick if they
   can be held. If not, it goes in rounds, as in sticking.py, in which the bound of each that has moved is its sliding
   torque. In a round what holds each roller rises with theta'' up to its bound, and all of that slows theta'': one
   equation, piecewise linear and monotone, which has one root.
4. A switch changes no speed. The roller that comes into contact is in the mode that it was in.
"""

from collections.abc import Callable, Mapping

import numpy as np

from omniroll.effects.guards import EPS, PASSED
from omniroll.effects.sticking import AT_REST, HELD_ROUNDINGS, in_rounds
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State

# From the modes (N, n) bool of rollers that stick and the torques (N, n) of the others: evaluates the rates.
Evaluate = Callable[[np.ndarray, np.ndarray], None]


def common_acceleration(
    mass: float, per_yaw: np.ndarray, given: np.ndarray, inertia: float, bounds: np.ndarray
) -> tuple[float, np.ndarray]:
    """The change x of nu_3' by bearings at rest, and their torques (m,).

    A roller's spin has the acceleration given + torque/inertia - per_yaw x, which its torque makes zero up to its
    bound, and mass x + sum of per_yaw torque = 0.

    mass     that nu_3' meets where no roller sticks
    per_yaw  (m,) what a disk gives to a roller's axial speed per nu_3
    given    (m,) accelerations of the spins without these torques
    bounds   (m,) of the torques
    """

    def torques(x: np.ndarray) -> np.ndarray:
        return np.clip(inertia * (per_yaw * x[:, None] - given), -bounds, bounds)

    def rest(x: np.ndarray) -> np.ndarray:
        return mass * x + torques(x) @ per_yaw

    turned = per_yaw != 0
    ends = np.concatenate([given + bounds / inertia, given - bounds / inertia])[np.tile(turned, 2)]
    kinks = np.sort(ends / np.tile(per_yaw[turned], 2))
    x = np.zeros(1)
    if len(kinks):
        outside = np.concatenate([kinks[:1] - 1 - abs(kinks[0]), kinks, kinks[-1:] + 1 + abs(kinks[-1])])
        place = int(np.searchsorted(rest(kinks), 0.0))
        x[0] = (outside[place] + outside[place + 1]) / 2  # a place between the two kinks that the root is between
    wanted = inertia * (per_yaw * x[0] - given)
    free = np.abs(wanted) < bounds
    fixed = np.where(free, 0.0, np.clip(wanted, -bounds, bounds))
    holding = inertia * per_yaw[free]
    x[0] = (holding @ given[free] - per_yaw @ fixed) / (mass + holding @ per_yaw[free])
    return float(x[0]), np.where(free, inertia * (per_yaw * x[0] - given), fixed)


class SlippingRollers:
    """The rollers in one run, (N, n) by place: first that in contact, then the others in their order.

    sliding   torques in N m of rollers that spin
    holding   the largest torques in N m that rollers at rest take
    resting   bool: those whose spin is zero
    modes     int: 0 sticks, +-1 is the sign of the spin
    asked     in N m, torques that hold those that stick, as last looked at
    """

    def __init__(self, kernel: Kernel, sliding: np.ndarray, holding: np.ndarray, buffers: Mapping[str, np.ndarray]):
        shape = kernel.wheels, kernel.rollers_per_wheel
        self.kernel, self.buffers = kernel, buffers
        self.sliding, self.holding = (np.repeat(own[:, None], shape[1], axis=1) for own in (sliding, holding))
        self.reach = spin_per_speed(kernel)
        self.resting, self.modes = np.zeros(shape, bool), np.zeros(shape, int)
        self.released = np.zeros(shape, bool)  # those that have been let go at this instant
        self.asked, self.sizes = np.zeros(shape), np.zeros(shape)

    # What the state says

    def spins(self, nu: np.ndarray, chi: np.ndarray, contact: np.ndarray, free: np.ndarray) -> np.ndarray:
        """(N, n) in rad/s, relative to the disks, of the axial speeds of rollers in contact (N,) and free (N, n-1)."""
        own = self.kernel.call("slip_spins", nu, chi, contact)
        return np.concatenate([own[:, None], self.kernel.spins_from_axial(nu, chi, free)], axis=1)

    def at_rest(self, state: State) -> State:
        """The state with the spins of resting rollers at zero. Those whose spins are zero within rounding rest, too."""
        contact, free = state.contact_axial(), state.free_axial()
        spins = self.spins(state.nu, state.chi, contact, free)
        self.sizes = np.abs(spins) + self.reach * np.linalg.norm(state.nu)
        self.resting |= np.abs(spins) <= AT_REST * EPS * self.sizes
        self.modes = np.where(self.resting, 0, np.sign(spins)).astype(int)
        still = np.where(self.resting, spins, 0.0)
        return state.with_free_axial(free - still[:, 1:]).with_contact_axial(contact - still[:, 0])

    # What has happened

    def moved(self) -> None:
        """Some time has passed."""
        self.resting = self.modes == 0
        self.released[:] = False

    def switched(self, directions: np.ndarray) -> None:
        """Wheels have passed to their next rollers, directions (N,): places have changed."""
        for wheel in np.flatnonzero(directions):
            self.resting[wheel] = np.roll(self.resting[wheel], directions[wheel])
        self.released[:] = False

    def pass_guards(self, passed: np.ndarray) -> None:
        """Functions of the phase, (N n,) bool, have ended it: of each roller that of its mode."""
        ended = passed.reshape(self.modes.shape)
        stuck = self.modes == 0
        self.released |= ended & stuck
        self.resting |= ended & ~stuck

    # What follows

    def torques(self) -> np.ndarray:
        """(N, n) of the bearings of rollers that spin; 0 where one sticks."""
        return -self.modes * self.sliding

    def inputs(self, sticks: np.ndarray | None = None, torques: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """What the kernel takes, by name, where (N, n) stick and the others have torques (N, n); else in the modes."""
        if sticks is None:
            sticks, torques = self.modes == 0, self.torques()
        of_contact = {"contact_sticks": sticks[:, 0], "contact_bearing": torques[:, 0]}
        return of_contact | {"free_sticks": sticks[:, 1:], "free_bearing": torques[:, 1:]}

    def found(self, of_contact: str, of_free: str) -> np.ndarray:
        """(N, n) what the rates that were computed last say, by the names of the kernel's outputs."""
        return np.concatenate([self.buffers[of_contact][:, None], self.buffers[of_free]], axis=1)

    def torque_sizes(self) -> np.ndarray:
        """(N,) what torques of rollers in contact are rounded against, several times."""
        return HELD_ROUNDINGS * (np.abs(self.asked) + self.holding)[:, 0]

    def held(self) -> np.ndarray:
        """(N, n) what holds those that stick, as the rates that were computed last say."""
        return self.found("contact_holding", "free_holding")

    def held_in_contact(self) -> np.ndarray:
        """(N,) the same of the rollers in contact."""
        return self.held()[:, 0]

    def _beyond(self) -> tuple[np.ndarray, np.ndarray]:
        """(N, n) how much more than they take those that stick are asked for, and its rounding."""
        self.asked = self.held()
        size = np.abs(self.asked)
        return size - self.holding, HELD_ROUNDINGS * EPS * (size + self.holding)

    def excess(self, spins: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(N n,) how far each roller is beyond the end of its mode, and its rounding; the rates have been computed.

        spins  (N, n)
        """
        beyond, rounding = self._beyond()
        stuck = self.modes == 0
        value = np.where(stuck, beyond, -self.modes * spins)
        return value.ravel(), np.where(stuck, rounding, EPS * self.sizes).ravel()

    def decide(self, evaluate: Evaluate) -> None:
        """Modes of the rollers at rest (rule 3)."""
        self.modes[self.resting] = 0
        if not self.resting.any():
            return
        if not self._overdone(evaluate).any() and not self.released.any():
            return
        signs = np.where(self.released, -np.sign(self.asked), 0).astype(int)
        for _ in range(self.modes.size + 1):
            self._rounds(evaluate, signs)
            passed = self._overdone(evaluate)
            if not passed.any():
                return
            signs[passed] = -np.sign(self.asked[passed])

    def _overdone(self, evaluate: Evaluate) -> np.ndarray:
        """(N, n) bool: what the rollers that stick cannot take."""
        evaluate(self.modes == 0, self.torques())
        beyond, rounding = self._beyond()
        return (self.modes == 0) & (beyond > PASSED * rounding)

    def _rounds(self, evaluate: Evaluate, released: np.ndarray) -> None:
        """Modes of the rollers at rest by rounds; `released` (N, n) are the signs of those that have been let go."""
        rest, kernel = self.resting, self.kernel
        evaluate(np.zeros_like(rest), np.where(rest, 0.0, self.torques()))
        given, mass = self.found("contact_spin_dot", "spins_dot")[rest], float(self.buffers["yaw_mass"])
        chi, none = self.buffers["chi"], np.zeros(rest.shape)
        per_yaw = -self.spins(np.array([0.0, 0.0, 1.0]), chi, none[:, 0], none[:, 1:])[rest]
        inertia = kernel.vehicle.roller_inertia

        def nearest(bounds: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            x, torques = common_acceleration(mass, per_yaw, given, inertia, bounds)
            most = np.abs(per_yaw) @ bounds / mass
            possible = np.abs(given) + bounds / inertia + np.abs(per_yaw) * most
            return given + torques / inertia - per_yaw * x, possible, torques

        self.modes[rest] = in_rounds(released[rest], self.sliding[rest], self.holding[rest], nearest)


def spin_per_speed(kernel: Kernel) -> float:
    """The largest spin of a roller that rolls or stands in space, where |nu| is 1 and each contact in the middle."""
    _, spins = kernel.wheel_rates(np.eye(3), np.zeros(kernel.wheels))
    return max(float(np.linalg.norm(spins, axis=0).max()), 1 / kernel.vehicle.yaw_scale)

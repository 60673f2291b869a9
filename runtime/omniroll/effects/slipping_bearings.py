"""The bearings of axles and rollers in a run in which all of them may stick beside contacts that do.

They are one list (B,): the axles (N,), then the rollers (N n,), of each wheel first that in contact and then the others
in their order. What each does is said in slipping_axles.py and slipping_rollers.py; which of them stick is found with
the contacts (ground_with_bearings.py).
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from omniroll.effects.guards import EPS
from omniroll.effects.slipping_axles import rate_per_speed
from omniroll.effects.slipping_rollers import spin_per_speed
from omniroll.effects.sticking import AT_REST, HELD_ROUNDINGS
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.state import State

MOMENTS = ("bearing_cos", "bearing_sin")  # what the free rollers' bearings add to the rates of momenta, in rows
Torques = tuple[np.ndarray, np.ndarray]  # (N,) of each wheel's bearings that turn, and the largest at rest, in N m


class SlippingBearings:
    """The bearings (B,) in one run.

    sliding   torques in N m of those that turn
    holding   the largest torques in N m that they take at rest
    resting   bool: those whose rate is zero
    modes     int: 0 sticks, +-1 is the sign of the rate
    released  int: signs of those that have been let go at this instant
    may_stick bool: of axles without such friction False, which turn with the mode 1 and take no torque
    asked     in N m, torques that hold those that stick, at the start of the phase; else 0
    least     in rad/s, what rates are rounded against at least
    sizes     in rad/s, what they are rounded against
    """

    def __init__(self, kernel: Kernel, axles: Torques | None, rollers: Torques):
        self.kernel, self.wheels = kernel, kernel.wheels
        self.places = self._rollers_of_a_wheel()
        free = np.zeros(self.wheels)
        both = zip(axles or (free, free), rollers, strict=True)
        self.sliding, self.holding = (np.append(own, np.repeat(other, self.places)) for own, other in both)
        count = len(self.sliding)
        self.resting, self.released = np.zeros(count, bool), np.zeros(count, int)
        self.may_stick = np.arange(count) >= (self.wheels if axles is None else 0)
        self.modes = np.where(self.may_stick, 0, 1)
        self.reach = self.by_kind(rate_per_speed(kernel), spin_per_speed(kernel))
        self.asked, self.least, self.sizes = np.zeros(count), np.zeros(count), np.zeros(count)

    # Parts of the list

    def _rollers_of_a_wheel(self) -> int:
        """How many of a wheel's rollers may turn on their disks."""
        return self.kernel.rollers_per_wheel

    def split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (B,) as those of axles (N,), and of rollers (N, n)."""
        return values[: self.wheels], values[self.wheels :].reshape(self.wheels, self.places)

    def by_kind(self, of_axles: float, of_rollers: float) -> np.ndarray:
        """(B,) one number for axles, and one for rollers."""
        return np.repeat([of_axles, of_rollers], [self.wheels, self.wheels * self.places])

    def whole(self, of_axles: np.ndarray, of_contact: np.ndarray, of_free: np.ndarray) -> np.ndarray:
        """(B,) of values of axles (N,), rollers in contact (N,) and free rollers (N, n-1)."""
        return np.append(of_axles, np.concatenate([of_contact[:, None], of_free], axis=1))

    @property
    def contact(self) -> np.ndarray:
        """(N,) where the rollers in contact stand in the list."""
        return self.wheels + self.places * np.arange(self.wheels)

    def in_order_of_the_engine(self) -> np.ndarray:
        """Places in the list of those that may stick, as the compiled engine has them: of axles, then of all rollers in
        contact, then of free rollers."""
        rollers = self.wheels + np.arange(self.wheels * self.places).reshape(self.wheels, self.places)
        order = np.concatenate([np.arange(self.wheels), rollers[:, 0], rollers[:, 1:].ravel()])
        return order[self.may_stick[order]]

    # What the state says

    def rates(self, state: Mapping[str, np.ndarray]) -> np.ndarray:
        """(B,) in rad/s, of the wheels' `rates` (N,), and the axial speeds of rollers in contact, `contact_omega` (N,),
        and free, `axial` (N, n-1)."""
        nu, chi = state["nu"], state["chi"]
        spins = self.kernel.call("slip_spins", nu, chi, state["contact_omega"])
        return self.whole(state["rates"], spins, self.kernel.spins_from_axial(nu, chi, state["axial"]))

    def at_rest(self, state: State) -> State:
        """The state with the rates of what rests at zero. What is zero within rounding rests, too."""
        axial, free = state.contact_axial(), state.free_axial()
        speeds = {"nu": state.nu, "chi": state.chi, "rates": state.rates, "contact_omega": axial, "axial": free}
        rates = self.rates(speeds)
        self.sizes = np.maximum(np.abs(rates) + self.reach * np.linalg.norm(state.nu), self.least)
        self.resting |= np.abs(rates) <= AT_REST * EPS * self.sizes
        self.resting &= self.may_stick
        self.modes = np.where(self.resting, 0, np.where(self.may_stick, np.sign(rates), 1)).astype(int)
        of_axles, spins = self.split(np.where(self.resting, rates, 0.0))
        state = replace(state, rates=np.where(of_axles != 0, 0.0, state.rates))
        return state.with_free_axial(free - spins[:, 1:]).with_contact_axial(axial - spins[:, 0])

    # What has happened

    def moved(self) -> None:
        """Some time has passed."""
        self.resting = (self.modes == 0) & self.may_stick
        self.released[:] = 0

    def switched(self, directions: np.ndarray) -> None:
        """Wheels have passed to their next rollers, directions (N,): places have changed."""
        _, rollers = self.split(self.resting)
        for wheel in np.flatnonzero(directions):
            rollers[wheel] = np.roll(rollers[wheel], directions[wheel])
        self.released[:] = 0

    def pass_guards(self, passed: np.ndarray, asked: np.ndarray) -> None:
        """Functions of the phase, (B,) bool, have ended it: of each bearing that of its mode, asked for (B,)."""
        stuck = self.modes == 0
        self.resting |= passed & ~stuck
        self.let_go(passed & stuck, asked)

    def let_go(self, bearings: np.ndarray, asked: np.ndarray) -> None:
        """Those of `bearings` (B,) bool are let go, which are asked for (B,)."""
        self.released[bearings] = -np.sign(asked[bearings]).astype(int)

    # What follows

    def resting_on_ground(self) -> np.ndarray:
        """Places of those at rest that touch the ground: of axles, and of rollers in contact."""
        touching = np.append(np.arange(self.wheels), self.contact)
        return touching[self.resting[touching]]

    def asked_in(self, buffers: Mapping[str, np.ndarray]) -> np.ndarray:
        """(B,) what holds those that stick, as the rates that were computed last have it."""
        none = np.zeros(self.wheels)
        return self.whole(buffers.get("axle_holding", none), buffers["contact_holding"], buffers["free_holding"])

    def accelerations_in(self, buffers: Mapping[str, np.ndarray]) -> np.ndarray:
        """(B,) in rad/s^2, the same of their rates."""
        return self.whole(buffers["rates_dot"], buffers["contact_spin_dot"], buffers["spins_dot"])

    def excess(self, asked: np.ndarray, state: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """(B,) how far each is beyond the end of its mode, and its rounding: asked for (B,), in a state by name."""
        size, stuck = np.abs(asked), self.modes == 0
        beyond, rounding = size - self.holding, HELD_ROUNDINGS * EPS * (size + self.holding)
        values = np.where(stuck, beyond, -self.modes * self.rates(state))
        values[~self.may_stick] = -1.0
        return values, np.where(stuck, rounding, EPS * self.sizes)

    def torques(self) -> np.ndarray:
        """(B,) of those that turn; 0 where one sticks."""
        return -self.modes * self.sliding

    def sizes_in_rows(self) -> dict[str, np.ndarray]:
        """(N,) what torques that hold are rounded against, several times, by their names in rows: they are what is left
        of other torques."""
        of_axles, rollers = self.split(2 * HELD_ROUNDINGS * self.holding)
        of_free = rollers[:, 1:].sum(axis=1)
        return {"bearing_torque": of_axles, "contact_bearing": rollers[:, 0]} | dict.fromkeys(MOMENTS, of_free)

    def inputs(self, sticks: np.ndarray, torques: np.ndarray) -> dict[str, np.ndarray]:
        """What the kernel takes, by name, where (B,) stick and the others have torques (B,)."""
        (axles, rollers), (of_axles, of_rollers) = self.split(sticks), self.split(torques)
        found = {"axle_sticks": axles, "bearing_torque": of_axles} if self.may_stick[0] else {}
        found |= {"contact_sticks": rollers[:, 0], "contact_bearing": of_rollers[:, 0]}
        return found | {"free_sticks": rollers[:, 1:], "free_bearing": of_rollers[:, 1:]}

    def in_rows(self, torques: np.ndarray) -> dict[str, np.ndarray]:
        """(N,) what rows keep of the torques (B,) by name: of axles, of rollers in contact, and what the bearings of
        free rollers add to the rates of their wheel's momenta."""
        of_axles, rollers = self.split(torques)
        places = 2 * np.pi * np.arange(1, self.places) / self.places
        moments = [rollers[:, 1:] @ np.cos(places), rollers[:, 1:] @ np.sin(places)]
        found = {"bearing_torque": of_axles, "contact_bearing": rollers[:, 0]}
        return found | dict(zip(MOMENTS, moments, strict=True))


class MasslessSlippingBearings(SlippingBearings):
    """The bearings (2 N,) of axles and of massless rollers in contact. Those of the others stick: they stop at once."""

    def _rollers_of_a_wheel(self) -> int:
        return 1

    def rates(self, state: Mapping[str, np.ndarray]) -> np.ndarray:
        """(2 N,) in rad/s, of the wheels' `rates` (N,) and the rollers' `contact_spin` (N,)."""
        return np.append(state["rates"], state["contact_spin"])

    def at_rest(self, state: State) -> State:
        """The state with the rates of axles that rest at zero. Those that are zero within rounding rest, too."""
        own = slice(0, self.wheels)
        rates = np.append(state.rates, np.zeros(self.wheels))
        self.sizes = np.maximum(np.abs(rates) + self.reach * np.linalg.norm(state.nu), self.least)
        self.resting[own] |= np.abs(state.rates) <= AT_REST * EPS * self.sizes[own]
        self.resting &= self.may_stick
        modes = np.where(self.may_stick[own], np.sign(state.rates), 1)
        self.modes[own] = np.where(self.resting[own], 0, modes)
        self.modes[self.wheels :][self.resting[self.wheels :]] = 0
        return replace(state, rates=np.where(self.resting[own], 0.0, state.rates))

    def asked_in(self, buffers: Mapping[str, np.ndarray]) -> np.ndarray:
        """(2 N,) what holds those that stick, as the rates that were computed last have it."""
        return np.append(buffers.get("axle_holding", np.zeros(self.wheels)), buffers["contact_holding"])

    def inputs(self, sticks: np.ndarray, torques: np.ndarray) -> dict[str, np.ndarray]:
        """What the kernel takes, by name, where (2 N,) stick and the others have torques (2 N,)."""
        (axles, rollers), (of_axles, of_rollers) = np.split(sticks, 2), np.split(torques, 2)
        found = {"axle_sticks": axles, "bearing_torque": of_axles} if self.may_stick[0] else {}
        return found | {"contact_sticks": rollers, "contact_bearing": of_rollers}

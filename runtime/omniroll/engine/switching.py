"""The switching model: how the contact passes from one roller to its neighbour (section 4 of the paper).

The contract, numbered:

 1. Between switches |chi_i| <= pi/n on every wheel. Which roller is in contact is an integer, `contact`: the
    physical number, 0..n-1, fixed to the roller. An angle never grows beyond its roller.
 2. The roller j = 1..n of wheel i (j = 1 in contact, at kappa_j = 2 pi (j-1)/n from it) is the physical
    roller (contact_i + j - 1) mod n. Every run starts with contact = 0 on all wheels.
 3. A wheel switches when it stands at its joint, chi_i = +-pi/n, and moves outwards, or rests there and
    accelerates outwards. Turning back at the joint is not a switch.
 4. At +pi/n (direction +1): chi_i becomes -pi/n exactly, the roller that was j = n is the new contact roller,
    the old one becomes j = 2; contact_i falls by 1 mod n. At -pi/n (direction -1) the mirror image: chi_i
    becomes +pi/n, j = 2 becomes the contact roller, the old one becomes j = n; contact_i grows by 1 mod n.
 5. Wheels whose located times are less than tau(t, h) = 100 eps (|t| + |h|) after the first are one switch,
    of all of them together; t is the time of the first and h the length of the phase that it ends. A wheel
    that is as close to its joint when the run ends switches at the end.
 6. Pose and the absolute axial speeds of rollers that are free before and after stay. The law gives the rest:
    smooth   nu stays. The entering roller takes at once the spin that (2.1) demands.
    impact   nu is projected (kernel function `impact`): the constraints after the switch are imposed
             perfectly inelastically, those of all switching wheels jointly.
 7. The rollers that enter and leave, by roller model:
    free      the entering roller arrives with the spin that its absolute axial speed gives it; from then on its
              spin follows from (2.1). The leaving roller keeps its absolute axial speed. Under smooth it also
              keeps its spin, since theta' and its angle stay; under impact its spin changes with theta', as that of
              any free roller does.
    locked    the entering roller arrives with spin 0 relative to its disk; the leaving roller stops on its disk.
    massless  rollers have no inertia, so both laws change nothing but the bookkeeping.
 8. The energy after minus before is reported; in a joint switch it is shared equally among its wheels, so
    that the reported jumps add up. Under impact it is never positive but for rounding.
 9. After a switch the rules apply anew at the same instant: a wheel that an impact has sent back stands at
    its joint and moves outwards, and switches again. A watchdog of the engine stops a run that switches
    without progress in time.
10. Where wheels may slip, no law is asked: a switch changes no speed. The axial speed of every roller, in contact or
    not, is a state of its own, and the ground spins the entering roller up.
"""

from dataclasses import replace

import numpy as np

from omniroll import validation
from omniroll.kernels.kernel import Kernel
from omniroll.vehicles.checks import joint_angle
from omniroll.vehicles.state import State, by_roller

EPS = float(np.finfo(float).eps)


def tau(t: float, h: float) -> float:
    """100 eps (|t| + |h|), t the time, h the phase's length: switches closer than this are one switch."""
    return 100 * EPS * (abs(validation.real("t", t)) + abs(validation.real("h", h)))


def outward(chi: np.ndarray, chi_dot: np.ndarray, rollers_per_wheel: int) -> np.ndarray:
    """(N,) int: +1 or -1 for a wheel that stands at that joint and moves outwards, else 0 (rule 3)."""
    at_joint = np.abs(chi) >= joint_angle(rollers_per_wheel)
    return np.where(at_joint & (np.sign(chi) * chi_dot > 0), np.sign(chi), 0).astype(int)


class SwitchingModel:
    """Rules 4, 6 and 7 for one kernel and one law; where wheels may slip, rule 10."""

    def __init__(self, kernel: Kernel, law: str):
        self.kernel, self.law = kernel, law
        self.joint = joint_angle(kernel.rollers_per_wheel)

    def apply(self, state: State, directions: np.ndarray) -> State:
        """The state after the wheels with directions +1 or -1 (N,) have switched together; 0 is no switch."""
        switching = directions != 0
        after = replace(
            state,
            chi=np.where(switching, -directions * self.joint, state.chi),
            contact=(state.contact - directions) % self.kernel.rollers_per_wheel,
        )
        if self.kernel.roller_model == "massless" or self.kernel.slips:
            return after
        if self.kernel.roller_model == "locked":
            return replace(after, nu=self._nu_after(state, after, np.zeros(self.kernel.wheels), switching))
        return self._apply_to_free_rollers(state, after, switching)

    def _apply_to_free_rollers(self, state: State, after: State, switching: np.ndarray) -> State:
        lead, leaves, enters = state.nu.shape[:-1], state.contact[..., None], after.contact[..., None]
        places = enters.reshape((1,) * (len(lead) + 2 - enters.ndim) + enters.shape)  # as many leading axes as states
        spins = np.take_along_axis(self._spins_by_roller(state), places, axis=-1)[..., 0]
        own = self.kernel.contact_axial(state.nu, state.chi)[..., None]
        mine = (np.arange(self.kernel.rollers_per_wheel) == leaves) & switching[..., None]
        entering = np.where(switching, spins, 0.0)
        return replace(
            after, nu=self._nu_after(state, after, entering, switching), axial=np.where(mine, own, state.axial)
        )

    def _nu_after(self, state: State, after: State, entering: np.ndarray, switching: np.ndarray) -> np.ndarray:
        """nu after the switch, where `entering` are the spins with which the entering rollers come."""
        if self.law == "smooth":
            return state.nu
        _, demanded = self.kernel.wheel_rates(state.nu, after.chi)
        _, left_with = self.kernel.wheel_rates(state.nu, state.chi)
        excess = np.where(switching, entering - demanded, 0.0)
        stopped = np.where(switching, left_with, 0.0) if self.kernel.roller_model == "locked" else 0.0 * excess
        return self.kernel.impact(state.nu, after.chi, excess, stopped)

    def _spins_by_roller(self, state: State) -> np.ndarray:
        """Spins relative to the disk (N, n) of all rollers, by physical number."""
        _, contact_spin = self.kernel.wheel_rates(state.nu, state.chi)
        spins = self.kernel.spins_from_axial(state.nu, state.chi, state.free_axial())
        return by_roller(np.concatenate([contact_spin[..., None], spins], axis=-1), state.contact)

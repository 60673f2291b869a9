"""What contacts do that may slip: slip velocities, forces of the ground, and what of a state follows from them."""

from collections.abc import Callable, Mapping

import numpy as np

from omniroll.effects.ground import Grip
from omniroll.kernels.kernel import Kernel
from omniroll.results.accelerations import call_named

BEGUN = 1e-14  # m/s: a slower slip has a direction of rounding, and takes the one with which it began


class Contacts:
    """The contacts in some states (...) of a run in which wheels may slip.

    kernel  Kernel of the run
    states  what the effects integrate, by name: rates (..., N), and contact_omega (..., N) of free rollers
    grip    the friction of contacts that stick and slip; None under other laws
    given   makes what their forces ask for beside: by name, heading, axial of the free rollers (None: there are none),
            and what a trajectory's rows have of the drives and of the contacts' modes
    """

    def __init__(
        self,
        kernel: Kernel,
        states: Mapping[str, np.ndarray],
        grip: Grip | None = None,
        given: Callable[[], Mapping[str, np.ndarray]] = dict,
    ):
        self.kernel, self.states, self.rates = kernel, states, states["rates"]
        self.axial = (states["contact_omega"],) if kernel.has_spins else ()
        self.grip, self.given = grip, given

    def spins(self, nu: np.ndarray, chi: np.ndarray) -> np.ndarray:
        """(..., N) in rad/s, of the rollers in contact relative to their disks."""
        if not self.axial:
            return self.kernel.wheel_rates(nu, chi)[1]
        return self.kernel.call("slip_spins", nu, chi, *self.axial)

    def energy(self, nu: np.ndarray, chi: np.ndarray, spins: np.ndarray | None) -> np.ndarray:
        """(...) in J, the kinetic energy; `spins` are those of the free rollers."""
        free = () if spins is None else (self.kernel.axial_speeds(nu, chi, spins),)
        return self.kernel.call("slip_energy", nu, self.rates, *self.axial, *free)

    def forces(self, nu: np.ndarray, chi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Slip velocities and forces of the ground (..., N, 2), in m/s and N, along the axle and along the rolling
        direction."""
        if self.grip is None:
            return self.kernel.call("slip_forces", nu, chi, self.rates, *self.axial)
        return self._with_sticking(nu, chi)

    def _with_sticking(self, nu: np.ndarray, chi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same where contacts stick: their slip is zero, and their forces follow from the accelerations."""
        given = dict(self.given())
        sticks = given["sticks"] > 0.5
        nothing = np.zeros((*sticks.shape, 2))
        slip, _ = self.kernel.call("slip_forces", nu, chi, self.rates, *self.axial, nothing)
        slip[sticks] = 0.0
        heading = np.stack([np.cos(given["slip_heading"]), np.sin(given["slip_heading"])], axis=-1)
        towards = np.where(np.linalg.norm(slip, axis=-1, keepdims=True) > BEGUN, slip, heading)
        loads, friction = self.grip.loads, self.grip.sliding
        force, _ = self.kernel.call("sliding_forces", towards, loads, friction)
        values = given | dict(self.states) | {"nu": nu, "chi": chi}
        values["ground_push"] = np.where(sticks[..., None] | (loads == 0)[:, None], 0.0, force)
        if self.kernel.has_spins and "momenta" not in values:
            values["momenta"] = self.kernel.momenta(values["axial"])
        if "slip_roller_rates" in self.kernel.signatures:
            values["roller_drag"] = call_named(self.kernel, "slip_roller_rates", values)[1]
        return slip, call_named(self.kernel, "ground_dynamics", values)[-2]

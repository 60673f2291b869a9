"""What contacts do that may slip: slip velocities, forces of the ground, and what of a state follows from them."""

from collections.abc import Mapping

import numpy as np

from omniroll.kernels.kernel import Kernel


class Contacts:
    """The contacts in some states (...) of a run in which wheels may slip.

    kernel  Kernel of the run
    states  what the effects integrate, by name: rates (..., N), and contact_omega (..., N) of free rollers
    """

    def __init__(self, kernel: Kernel, states: Mapping[str, np.ndarray]):
        self.kernel, self.rates = kernel, states["rates"]
        self.axial = (states["contact_omega"],) if kernel.has_spins else ()

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
        return self.kernel.call("slip_forces", nu, chi, self.rates, *self.axial)

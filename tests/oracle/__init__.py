"""An independent oracle for the vehicle on omni-wheels with massive rollers.

It shares nothing with the project's derivation: no pseudo-velocity equation, no Poisson bracket, no printed
constraint. It starts from rigid bodies and Lagrange's equations with multipliers in the coordinates

    q = (x, y, theta, chi_i, phi_ij),   3 + N (n + 1) of them,

and computes in ball arithmetic (python-flint) with `PRECISION` bits.

- `vehicle`    the parameters; wheels may stand anywhere with any axle direction
- `kinematics` speed of the contact points from rigid-body kinematics; the constraints and their nullspace
- `lagrange`   accelerations, energy, the mass matrix of all coordinates
- `switch`     change of roller; the smooth law and the impact projection
- `taylor`     motion between switches in Taylor series, switches located to the working precision
- `bodies`     kinetic energy of every body in 3-D; the inertias M, I_S, J, B from masses and sizes
- `condition`  condition of a function with respect to its inputs
- `states`     random admissible vehicles and states
"""

from .balls import PRECISION, exact, working_precision
from .vehicle import OracleVehicle

__all__ = ["PRECISION", "OracleVehicle", "exact", "working_precision"]

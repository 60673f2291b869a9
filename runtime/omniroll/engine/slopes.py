"""Slopes of the rates of a run, by the state and by what a phase is given.

Generated functions give them where there are such (maxima/effects/derivatives.mac): one factorisation of M* serves all
columns. The rest come from the functions of the rates on numbers that carry tangents.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from omniroll.kernels.kernel import DERIVATIVES, Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent
from omniroll.results.accelerations import call_named
from omniroll.results.trajectory import Trajectory

DYNAMICS, KINEMATICS, OF_MOMENTA = "forward_dynamics_derivatives", "rate_derivatives", "momenta_derivatives"
NOTHING: Mapping[str, np.ndarray] = MappingProxyType({})  # sticks
BY_WHEEL = {"nu_dot_by_chi": "chi", "nu_dot_by_torque": "torque"}
BY_MOMENTA = {"nu_dot_by_momentum_cos": 0, "nu_dot_by_momentum_sin": 1}


class Slopes:
    """The slopes of the rates of what deviates.

    deviations  Deviations of the run
    trajectory  of the run; None where no generated derivatives are taken
    plain       Kernel of the run, with Python's functions
    generated   whether generated derivatives are taken where they are known
    """

    def __init__(self, deviations, trajectory: Trajectory | None, plain: Kernel, generated: bool = True):
        self.deviations, self.carrying = deviations, TangentKernel(plain)
        self.places = deviations.places
        self.width = len(deviations.state), len(deviations.state) + deviations.input_size
        known = {"nu", "chi", "pose", "momenta"}
        self.generated = None
        if generated and trajectory is not None and not deviations.sticking and set(deviations.rates) <= known:
            effects = trajectory.effects
            self.generated = effects.kernel(trajectory.vehicle, plain.roller_model, "python", also=(DERIVATIVES,))
        modes = [place for name in ("sticks",) if name in self.places for place in self.places[name]]
        self.rest = np.setdiff1d(np.arange(self.width[1]), [*self._columns(), *modes])  # modes do not deviate

    def _columns(self) -> list[int]:
        """The columns that generated functions give."""
        if self.generated is None:
            return []
        names = ["nu", "chi", "pose", "torque", "momenta"]
        return [int(place) for name in names if name in self.places for place in self.places[name].ravel()]

    def at(self, y: np.ndarray, inputs: np.ndarray, held: Mapping[str, np.ndarray] = NOTHING) -> np.ndarray:
        """(k, m, m + U) the slopes in states y (k, size) with inputs (k, U); `held`, what sticks leaves to nu."""
        found = np.zeros((len(y), *self.width))
        if self.generated is not None:
            self._generated_into(found, y, inputs)
        if len(self.rest):
            size, given = y.shape[1], inputs.shape[1]
            along = np.zeros((len(self.rest), 1, size + given))
            states = np.concatenate([self.deviations.state, size + np.arange(given)])
            along[np.arange(len(self.rest)), 0, states[self.rest]] = 1
            rates = self.deviations.rates_of(
                self.carrying, with_tangent(y, along[..., :size]), with_tangent(inputs, along[..., size:]), held
            )
            found[..., self.rest] = np.moveaxis(tangent_of(rates), 0, -1)
        return found

    def _generated_into(self, found: np.ndarray, y: np.ndarray, inputs: np.ndarray) -> None:
        known = self.deviations.known_in(y, inputs)
        nu, chi, pose = (self.places[name] for name in ("nu", "chi", "pose"))
        heading = pose[2]

        def put(rows: np.ndarray, columns: np.ndarray, values: np.ndarray) -> None:
            found[:, rows, columns] = values

        given = self._of(DYNAMICS, known)
        put(nu, nu[:, None], given["nu_dot_by_nu"])
        for output, name in BY_WHEEL.items():
            if output in given:
                put(nu, self.places[name][:, None], given[output])
        for output, part in BY_MOMENTA.items():
            if output in given:
                put(nu, self.places["momenta"][:, part, None], given[output])
        if "nu_dot_by_heading" in given:
            put(nu, heading, given["nu_dot_by_heading"])
        given = self._of(KINEMATICS, known)
        put(chi, nu[:, None], given["chi_dot_by_nu"])
        put(pose, nu[:, None], given["pose_dot_by_nu"])
        put(pose, heading, given["pose_dot_by_heading"])
        if "momenta" in self.deviations.rates:
            self._momenta_into(put, self._of(OF_MOMENTA, known))

    def _momenta_into(self, put: Callable, given: dict[str, np.ndarray]) -> None:
        momenta, chi = self.places["momenta"], self.places["chi"]
        put(momenta, self.places["nu"][2], given["momenta_dot_by_nu_3"])
        put(momenta, chi[:, None], given["momenta_dot_by_chi"])
        put(momenta, momenta, given["momenta_dot_by_momenta"])

    def _of(self, function: str, known: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        outputs = [argument.name for argument in self.generated.signatures[function].outputs]
        return dict(zip(outputs, call_named(self.generated, function, known), strict=True))

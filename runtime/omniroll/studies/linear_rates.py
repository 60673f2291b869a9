"""The rates of a vehicle that rolls, near a state: their values there, and their slopes by states and inputs."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from omniroll.effects.effect import Modal
from omniroll.effects.effect_set import EffectRun, EffectSet
from omniroll.effects.guards import Guards
from omniroll.kernels.kernel import Kernel
from omniroll.results.accelerations import call_named

HEADING = (0, 0, 1)  # the heading's place in the pose
MOST_CHANGES = 4  # of one motor's mode, until it fits the speeds


@dataclass(frozen=True)
class RatesNear:
    """The rates near a state, of S numbers, with U inputs.

    parts    the state, by name
    rates    how fast each part changes
    A, B     (S, S), (S, U) the slopes of all rates
    signals  (U,) what the drives give, by name
    modal    the law of what drives with a voltage; None where the inputs are torques
    """

    parts: dict[str, np.ndarray]
    rates: dict[str, np.ndarray]
    A: np.ndarray
    B: np.ndarray
    signals: dict[str, np.ndarray]
    modal: Modal | None

    @property
    def layout(self) -> "Layout":
        return Layout(self.parts)

    @property
    def torque_per_signal(self) -> np.ndarray:
        """(U,) how much each wheel's torque changes with its signal."""
        return torque_per_signal(self.modal, self.B.shape[1])


class Layout(dict):
    """Where each part of the state stands, {name: slice}."""

    def __init__(self, parts: Mapping[str, np.ndarray]):
        ends = accumulate(part.size for part in parts.values())
        places = zip(parts.items(), ends, strict=True)
        super().__init__((name, slice(end - part.size, end)) for (name, part), end in places)
        self.size = sum(part.size for part in parts.values())

    def joined(self, parts: Mapping[str, np.ndarray]) -> np.ndarray:
        return np.concatenate([parts[name].ravel() for name in self])

    def matrix(self, blocks: Mapping[tuple[str, str], np.ndarray]) -> np.ndarray:
        """The matrix of these blocks, zero elsewhere."""
        whole = np.zeros((self.size, self.size))
        for (row, column), block in blocks.items():
            whole[self[row], self[column]] = block
        return whole


def rolling_near(
    bound: Kernel,
    acting: EffectSet,
    start_time: float,
    nu: np.ndarray,
    chi: np.ndarray,
    pose: np.ndarray,
    axial: np.ndarray | None,
) -> RatesNear:
    """Of wheels that roll, by the generated derivatives of `bound`; axial (N, n-1), speeds of free rollers, or None."""
    run = EffectRun(acting, bound, start_time)
    y = np.zeros(run.state_vector.size)
    y[:3] = nu
    modal = settled(run, y)
    signals = {name: signal.value for name, signal in run.signals.items()}
    momenta = None if axial is None else bound.momenta(axial)
    known = signals | {"nu": nu, "chi": chi, "theta": pose[2], "heading": pose[2], "momenta": momenta}
    found = _evaluated(bound, "forward_dynamics_derivatives", known) | _evaluated(bound, "rate_derivatives", known)
    parts = {"nu": nu, "chi": chi, "pose": pose} | ({} if momenta is None else {"momenta": momenta})
    rates = {"nu": found["nu_dot"], "chi": bound.wheel_speeds(nu), "pose": bound.pose_rates(nu, pose[2])}
    blocks = {
        ("nu", "nu"): found["nu_dot_by_nu"].T,
        ("nu", "chi"): found["nu_dot_by_chi"].T,
        ("chi", "nu"): found["chi_dot_by_nu"].T,
        ("pose", "nu"): found["pose_dot_by_nu"].T,
        ("pose", "pose"): np.outer(found["pose_dot_by_heading"], HEADING),
    }
    if "nu_dot_by_heading" in found:
        blocks["nu", "pose"] = np.outer(found["nu_dot_by_heading"], HEADING)
    if momenta is not None:
        by_cos, by_sin = found["nu_dot_by_momentum_cos"], found["nu_dot_by_momentum_sin"]
        blocks["nu", "momenta"] = np.stack([by_cos, by_sin], axis=1).reshape(-1, 3).T
        rates["momenta"] = _momenta(bound, known, blocks)
    layout = Layout(parts)
    A = layout.matrix(blocks)
    B = np.zeros((len(A), bound.wheels))
    B[layout["nu"]] = found["nu_dot_by_torque"].T * torque_per_signal(modal, bound.wheels)
    return RatesNear(parts, rates, A, B, signals, modal)


def _evaluated(bound: Kernel, name: str, known: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The outputs of a generated function by name."""
    outputs = (argument.name for argument in bound.signatures[name].outputs)
    return dict(zip(outputs, call_named(bound, name, known), strict=True))


def _momenta(bound: Kernel, known: Mapping[str, np.ndarray], blocks: dict) -> np.ndarray:
    """The rates of the momenta; their blocks are put beside the others. Without friction they are constant."""
    momenta, wheels = known["momenta"], bound.wheels
    if "momenta_derivatives" not in bound.signatures:
        return np.zeros_like(momenta)
    slopes = _evaluated(bound, "momenta_derivatives", known)
    blocks["momenta", "nu"] = np.outer(slopes["momenta_dot_by_nu_3"].ravel(), (0, 0, 1))
    of_wheel = np.eye(wheels).repeat(2, axis=0)  # a wheel's two momenta depend on its own angle
    blocks["momenta", "chi"] = of_wheel * slopes["momenta_dot_by_chi"].reshape(-1, 1)
    blocks["momenta", "momenta"] = np.diag(slopes["momenta_dot_by_momenta"].ravel())
    return bound.momenta_rates(known["nu"], known["chi"], momenta, np.zeros(wheels))[0]


def settled(run: EffectRun, y: np.ndarray) -> Modal | None:
    """The law of what drives with a voltage, or None, once every motor is in the mode that the state y asks for."""
    for _ in range(MOST_CHANGES * run.kernel.wheels):
        guards = Guards(run.begin_phase(0.0), len(y))
        passed = guards.beyond(0.0, y)
        if not passed.any():
            break
        run.pass_guards(passed)
    forms = (form for process in run.processes for form in process.compiled() or ())
    return next((form for form in forms if isinstance(form, Modal)), None)


def torque_per_signal(modal: Modal | None, wheels: int) -> np.ndarray:
    """(N,) how much each wheel's torque changes with its signal, in its mode; 1 where the signals are torques."""
    return np.ones(wheels) if modal is None else modal.laws[modal.modes, np.arange(wheels), 0, 1]

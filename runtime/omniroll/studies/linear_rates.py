"""The rates of a vehicle that rolls, near a state: their values there, and their slopes by states and inputs."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from omniroll.effects.effect import Modal
from omniroll.effects.effect_set import EffectRun, EffectSet
from omniroll.effects.guards import Guards
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent
from omniroll.results.accelerations import call_named

OF_MOMENTA = "momenta_derivatives"
HEADING = np.array((0, 0, 1))  # the heading's place in the pose
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
        """(..., S, S) the matrix of these blocks, zero elsewhere."""
        leads = np.broadcast_shapes(*(block.shape[:-2] for block in blocks.values()))
        whole = np.zeros((*leads, self.size, self.size), np.result_type(*blocks.values()))
        for (row, column), block in blocks.items():
            whole[..., self[row], self[column]] = block
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
    found = _evaluated(bound, "forward_dynamics_derivatives", known)
    parts = {"nu": nu, "chi": chi, "pose": pose} | ({} if momenta is None else {"momenta": momenta})
    rates = {"nu": found["nu_dot"], "chi": bound.wheel_speeds(nu), "pose": bound.pose_rates(nu, pose[2])}
    if momenta is not None:
        rates["momenta"] = np.zeros_like(momenta)  # without friction they are constant
        if OF_MOMENTA in bound.signatures:
            rates["momenta"] = bound.momenta_rates(nu, chi, momenta, np.zeros(bound.wheels))[0]
    A, B = _slopes(bound, known, Layout(parts), torque_per_signal(modal, bound.wheels))
    return RatesNear(parts, rates, A, B, signals, modal)


def second_derivatives(carrying: TangentKernel, near: RatesNear) -> np.ndarray:
    """(S, S + U, S + U) of the rates by states and inputs: the generated derivatives on numbers with tangents."""
    layout, width = near.layout, sum(near.B.shape)
    along = np.eye(width)
    parts = {
        name: with_tangent(part, along[:, layout[name]].reshape(-1, *part.shape)) for name, part in near.parts.items()
    }
    signals: dict[str, np.ndarray] = dict(near.signals)
    signals["torque"] = with_tangent(signals["torque"], along[:, layout.size :] * near.torque_per_signal)
    heading = parts["pose"][:, 2]
    known = signals | parts | {"theta": heading, "heading": heading}
    A, B = _slopes(carrying, known, layout, near.torque_per_signal)
    return np.moveaxis(tangent_of(np.concatenate([A, B], axis=-1)), 0, -1)


def _slopes(
    bound: Kernel, known: Mapping[str, np.ndarray], layout: "Layout", per_signal: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(..., S, S), (..., S, U) of all rates, by generated functions on numbers by name, which may have leading axes."""
    found = _evaluated(bound, "forward_dynamics_derivatives", known) | _evaluated(bound, "rate_derivatives", known)
    turned = {name: np.swapaxes(value, -1, -2) for name, value in found.items() if value.ndim > 1}
    blocks = {
        ("nu", "nu"): turned["nu_dot_by_nu"],
        ("nu", "chi"): turned["nu_dot_by_chi"],
        ("chi", "nu"): turned["chi_dot_by_nu"],
        ("pose", "nu"): turned["pose_dot_by_nu"],
        ("pose", "pose"): found["pose_dot_by_heading"][..., None] * HEADING,
    }
    if "nu_dot_by_heading" in found:
        blocks["nu", "pose"] = found["nu_dot_by_heading"][..., None] * HEADING
    if "momenta" in layout:
        both = np.stack([turned["nu_dot_by_momentum_cos"], turned["nu_dot_by_momentum_sin"]], axis=-1)
        blocks["nu", "momenta"] = both.reshape(*both.shape[:-2], -1)
        if OF_MOMENTA in bound.signatures:
            blocks |= _of_momenta(bound, known)
    A = layout.matrix(blocks)
    B = np.zeros((*A.shape[:-1], bound.wheels), A.dtype)
    B[..., layout["nu"], :] = turned["nu_dot_by_torque"] * per_signal
    return A, B


def _evaluated(bound: Kernel, name: str, known: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The outputs of a generated function by name."""
    outputs = (argument.name for argument in bound.signatures[name].outputs)
    return dict(zip(outputs, call_named(bound, name, known), strict=True))


def _of_momenta(bound: Kernel, known: Mapping[str, np.ndarray]) -> dict[tuple[str, str], np.ndarray]:
    """The blocks of the rates of momenta under friction of the rollers; a wheel's two depend on its angle alone."""
    slopes = _evaluated(bound, OF_MOMENTA, known)
    by_nu_3, by_chi, by_momenta = (
        value.reshape(*value.shape[:-2], -1, 1)
        for value in (slopes[f"momenta_dot_by_{name}"] for name in ("nu_3", "chi", "momenta"))
    )
    of_wheel = np.eye(bound.wheels).repeat(2, axis=0)
    return {
        ("momenta", "nu"): by_nu_3 * (0, 0, 1),
        ("momenta", "chi"): of_wheel * by_chi,
        ("momenta", "momenta"): np.eye(2 * bound.wheels) * by_momenta,
    }


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

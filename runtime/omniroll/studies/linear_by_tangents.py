"""The rates of a vehicle near a state by functions that carry tangents, as they do for the sensitivities of runs.

For wheels that may slip, under laws of the ground that are smooth; for mecanum wheels and those with two rows.

Where wheels may slip, their rates and the axial speeds of the rollers in contact are states beside nu.
"""

import numpy as np

from omniroll.effects.effect_set import EffectRun, EffectSet
from omniroll.engine.deviations import Deviations
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent
from omniroll.studies.linear_rates import Layout, RatesNear, settled, torque_per_signal
from omniroll.vehicles.state import State

CONSTANT = ("momenta",)  # states that a run between two switches need not integrate


def near_by_tangents(
    bound: Kernel,
    acting: EffectSet,
    start_time: float,
    nu: np.ndarray,
    chi: np.ndarray,
    pose: np.ndarray,
    axial: np.ndarray | None,
) -> RatesNear:
    """Rates and slopes; axial (N, n-1), the axial speeds of free rollers that do not touch the ground, or None.

    bound  the kernel with Python's functions
    """
    run = EffectRun(acting, bound, start_time)
    y = _begun(run, nu, chi, pose, axial)
    modal = settled(run, y)
    run.begin_phase(0.0)
    signals = {name: signal.value for name, signal in run.signals.items()}
    deviations, vector = Deviations(acting, bound), run.state_vector
    given = signals if axial is None else signals | {"momenta": bound.momenta(axial)}
    inputs = deviations.joined(given)
    rates = deviations.rates_of(bound, y, inputs)
    slopes = _slopes(deviations, bound, y, inputs)
    parts = {name: vector.view(y, name).copy() for name in deviations.rates}
    parts |= {name: given[name] for name in CONSTANT if name in deviations.inputs}
    layout, places = Layout(parts), deviations.places
    of_states = np.concatenate([places[name].ravel() for name in parts])
    A, B = np.zeros((layout.size, layout.size)), np.zeros((layout.size, bound.wheels))
    A[: len(rates)] = slopes[:, of_states]
    B[: len(rates)] = slopes[:, places["torque"]] * torque_per_signal(modal, bound.wheels)
    of_parts = np.append(rates, np.zeros(layout.size - len(rates)))
    found = {name: of_parts[place].reshape(parts[name].shape) for name, place in layout.items()}
    return RatesNear(parts, found, A, B, signals, modal)


def _slopes(deviations: Deviations, bound: Kernel, y: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """(m, m + U) the slopes of the rates by what deviates and by what a phase is given."""
    size = len(y)
    places = np.append(deviations.state, size + np.arange(len(inputs)))
    along = np.eye(size + len(inputs))[places]
    moving = with_tangent(y, along[:, :size]), with_tangent(inputs, along[:, size:])
    return tangent_of(deviations.rates_of(TangentKernel(bound), *moving)).T


def _begun(run: EffectRun, nu: np.ndarray, chi: np.ndarray, pose: np.ndarray, axial: np.ndarray | None) -> np.ndarray:
    """(size,) the state of a run that starts here: with the wheels' rates that its effects give, or with rolling."""
    bound, found = run.kernel, np.zeros(run.state_vector.size)
    of_rollers = None if axial is None else np.concatenate([np.zeros((bound.wheels, 1)), axial], axis=1)
    state = run.effects.begin(bound, State(nu, chi, pose, np.zeros(bound.wheels, int), of_rollers))
    run.state_vector.put(found, {"nu": nu, "chi": chi, "pose": pose} | run.effects.initial(bound, state))
    return found

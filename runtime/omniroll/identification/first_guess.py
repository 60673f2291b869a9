"""Numbers to begin a fit with: the equations of motion are linear in masses, inertias and friction.

A log of wheel rates (or angles) gives nu and nu'. In them the generated inverse dynamics says what force is missing,
M* nu' - f, which is 0 in the true motion (3.4). Where that is affine in a number, linear least squares gives the
number. It is a first guess only: the noise of nu' is on both sides, which makes inertias too small.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import savgol_filter

from omniroll.effects.effect_set import EffectSet
from omniroll.errors import InvalidValueError, SimulationStopped
from omniroll.identification.log import Log
from omniroll.identification.model import OF_INSTRUMENT, START, Free, Model
from omniroll.identification.prediction import run_of
from omniroll.results.accelerations import call_named

WINDOW, ORDER = 0.2, 3  # s, and degree of the polynomials that smooth the rates
LEAST_ROWS = 7
CHANGE = 0.25  # of a number, to see what the force does with it
AFFINE = 1e-6  # how far a second change may be from twice the first
USUAL = 0.5  # relative change of a number that needs no evidence: what noise alone determines stays as it is
LARGEST = 3.0  # times: a number that would become larger or smaller stays; the noise of nu' makes inertias vanish
ALIKE = 20  # forces one after the other that have the same error, as the rates are smoothed


def first_guess(model: Model, numbers: Sequence[Free], logs: Sequence[Log]) -> dict[str, float]:
    """Values by name of the numbers that linear least squares finds; none where no log has the wheels' rates."""
    motions = [motion for log in logs if (motion := _motion(model, log)) is not None]
    names = [n.name for n in numbers if not (OF_INSTRUMENT.fullmatch(n.name) or START.fullmatch(n.name))]
    columns, sizes = {}, {}
    if not motions:
        return {}
    try:
        missing = _missing(model, motions)
        for name in names:
            size = CHANGE * (model.value(name) or 1.0)
            once, twice = (
                _missing(model.with_values({name: model.value(name) + k * size}), motions) - missing for k in (1, 2)
            )
            if once.any() and np.abs(twice - 2 * once).max() <= AFFINE * np.abs(twice).max():
                columns[name], sizes[name] = once, size
    except (InvalidValueError, SimulationStopped):
        return {}
    if not columns or not np.isfinite([missing, *columns.values()]).all():
        return {}
    changes = _held(np.stack(list(columns.values()), axis=1), -missing)
    bounds = {number.name: (number.least, number.most) for number in numbers}
    found = {
        name: model.value(name) + x * size for (name, size), x in zip(sizes.items(), changes.tolist(), strict=True)
    }
    return {
        name: value
        for name, value in found.items()
        if bounds[name][0] < value < bounds[name][1] and _is_near(value, model.value(name))
    }


def _is_near(value: float, before: float) -> bool:
    """Whether a number has kept its sign and its size; one that was 0 may become any."""
    return before == 0 or 1 / LARGEST < value / before < LARGEST


def _held(columns: np.ndarray, missing: np.ndarray) -> np.ndarray:
    """The changes x of numbers, in CHANGE of them, with columns @ x = missing, as far as it stands out of the noise.

    The noise is what least squares leave over; where it would change numbers more than is usual, they hardly change.
    """
    changes, *_ = np.linalg.lstsq(columns, missing)
    noise = np.sqrt(np.mean((missing - columns @ changes) ** 2) * ALIKE)
    held = noise * CHANGE / USUAL * np.eye(len(changes))
    changes, *_ = np.linalg.lstsq(np.concatenate([columns, held]), np.append(missing, np.zeros(len(changes))))
    return changes


def _motion(model: Model, log: Log) -> tuple[Log, dict[str, np.ndarray]] | None:
    """nu, nu' and chi at the log's times."""
    rates = _rates(log)
    bound = EffectSet.checked(model.effects, model.vehicle).kernel(model.vehicle, _roller_model(model), "python")
    if rates is None or np.linalg.matrix_rank(bound.wheel_rows) < 3:
        return None
    step = float(np.mean(np.diff(log.t)))
    window = max(LEAST_ROWS, 2 * int(WINDOW / step / 2) + 1)
    if window > len(log.t):
        return None
    smooth, slope = (savgol_filter(rates, window, ORDER, deriv=k, delta=step, axis=0) for k in (0, 1))
    nu = bound.nu_from_wheels(smooth)
    turned = np.concatenate([np.zeros((1, rates.shape[1])), np.cumsum((smooth[1:] + smooth[:-1]) / 2 * step, axis=0)])
    joint = np.pi / model.vehicle.rollers_per_wheel
    chi = (turned + np.asarray(model.options.get("chi", 0.0)) + joint) % (2 * joint) - joint
    return log, {"nu": nu, "nu_dot": bound.nu_from_wheels(slope), "chi": chi}


def _rates(log: Log) -> np.ndarray | None:
    """(T, N) rates of the wheels, on even times."""
    if "wheel_rate" not in log.fitted:
        return np.gradient(log.data["wheel_angle"], log.t, axis=0) if "wheel_angle" in log.fitted else None
    even = np.linspace(log.t[0], log.t[-1], len(log.t))
    return np.stack([np.interp(even, log.t, column) for column in log.data["wheel_rate"].T], axis=1)


def _missing(model: Model, motions: Sequence[tuple[Log, dict[str, np.ndarray]]]) -> np.ndarray:
    """The force that is missing in the motions, all components in a row. Free rollers are taken not to spin."""
    bound = EffectSet.checked(model.effects, model.vehicle).kernel(model.vehicle, _roller_model(model), "python")
    found = []
    for log, values in motions:
        run = run_of(model, log)
        rows = np.searchsorted(run.t, log.t, side="right") - 1
        given = {name: np.zeros((len(log.t), *argument.shape)) for name, argument in _others(bound).items()}
        given |= run.drives_at(log.t)
        given["heading"] = run.pose[rows, 2]
        found.append(call_named(bound, "inverse_dynamics", given | values).ravel())
    return np.concatenate(found)


def _others(bound) -> dict:
    return {argument.name: argument for argument in bound.signatures["inverse_dynamics"].inputs}


def _roller_model(model: Model) -> str:
    return model.options.get("roller_model", "free")

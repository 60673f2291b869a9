"""How the readings of a log depend on a model's numbers, by the sensitivities of the model's run."""

from collections.abc import Mapping, Sequence

import numpy as np

from omniroll.effects.effect_set import BEARINGS
from omniroll.engine.columns import columns_of
from omniroll.engine.drive_deviations import refuse_what_is_not_followed
from omniroll.engine.sensitivities import with_sensitivities
from omniroll.errors import InvalidValueError, NoDerivativeError
from omniroll.identification.late import by_delay, read_times
from omniroll.identification.log import Log
from omniroll.identification.model import OF_INSTRUMENT, Model
from omniroll.identification.reading_slopes import reading_slopes
from omniroll.results.trajectory import Trajectory

UNUSED = ("pose[0]",)  # stands for no number where only delays are asked for
OF_HELD = {"net_torque", "accelerometer"}  # readings that depend on the torques which hold bearings at rest
Readings = dict[str, np.ndarray]


def exact_slopes(model: Model, log: Log, run: Trajectory, true: Readings, names: Sequence[str]) -> dict[str, Readings]:
    """The derivatives (T, ...) of readings, by reading, for those of the numbers of these names by which there are any.

    run   of the model over the time of the log
    true  what instruments without scale and bias read, by name
    """
    corrected = [name for name in names if OF_INSTRUMENT.fullmatch(name) and not name.endswith("_delay")]
    found = {name: _by_correction(name, true) for name in corrected}
    moving = {name: model.sensitivities(name) for name in names if name not in found}
    known = _known(run, log, {own for of_number in moving.values() for own in of_number})
    if known is None:
        return found
    moving = {name: of_number for name, of_number in moving.items() if known.issuperset(of_number)}
    if moving and _follow(run, sorted(known) or UNUSED):
        found |= _by_motion(model, log, run, moving)
    return found


def _by_correction(number: str, true: Readings) -> Readings:
    """The derivatives by the scale or the bias of an instrument, which reads scale * true + bias."""
    reading, _, kind = number.rpartition("_")
    found = {name: np.zeros_like(value) for name, value in true.items()}
    if reading in true:
        found[reading] = true[reading] if kind == "scale" else np.ones_like(true[reading])
    return found


def _known(run: Trajectory, log: Log, wanted: set[str]) -> set[str] | None:
    """The names, of those that are wanted, by which the run has sensitivities; None where it has none at all.

    Runs of mecanum wheels, two rows, profiles and wheels of several kinds have none. Where bearings may be at rest and
    the log has readings that depend on what holds them there are none either: between rows these torques are known, not
    their derivatives.
    """
    if run.vehicle.rows > 1 or run.vehicle.rows_move or run.vehicle.has_kinds:
        return None
    plain, effects = run.effects.kernel(run.vehicle, run.roller_model, "python"), run.effects.effects
    if not {*BEARINGS}.isdisjoint(run.effects.drives()) and OF_HELD.intersection(log.fitted):
        return None
    try:
        refuse_what_is_not_followed(effects, plain)
    except InvalidValueError:
        return None
    return {name for name in wanted if _is_known(name, plain, effects)}


def _is_known(name: str, plain, effects) -> bool:
    try:
        return bool(columns_of((name,), plain, effects))
    except InvalidValueError:
        return False


def _follow(run: Trajectory, names: Sequence[str]) -> bool:
    """Whether the run has derivatives by these numbers, which it then keeps."""
    try:
        with_sensitivities(run, names)
    except NoDerivativeError:
        return False
    return True


def _by_motion(model: Model, log: Log, run: Trajectory, moving: Mapping[str, Sequence[str]]) -> dict[str, Readings]:
    """The derivatives by numbers that move the run, and by delays; each with its names as the run knows it."""
    found: dict[str, Readings] = {name: {} for name in moving}
    column = {name: 1 + k for k, name in enumerate(run.followed.names)}  # the first is that of the time
    late = by_delay(model, log)
    times = np.unique(np.concatenate([read_times(log, delay, run) for delay in late.values()]))
    slopes_at = reading_slopes(run, times, model.instruments, log.fitted)
    for readings, delay in late.items():
        back = np.searchsorted(times, read_times(log, delay, run))
        inside = (log.t - delay >= run.t[0]) & (log.t - delay <= run.t[-1])
        for reading in readings:
            slopes = model.correction(reading, "scale") * slopes_at[reading][:, back]
            later = slopes[0] * inside.reshape(-1, *(1,) * (slopes.ndim - 2))
            for name, of_number in moving.items():
                if of_number:
                    found[name][reading] = sum(slopes[column[own]] for own in of_number)
                else:
                    found[name][reading] = -later if name == f"{reading}_delay" else np.zeros_like(later)
    return {name: {reading: own[reading] for reading in log.fitted} for name, own in found.items()}

"""Which drive would tell most about the numbers of a fit: the one that makes the information largest."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from omniroll import validation
from omniroll.effects.effect import Effect
from omniroll.effects.motor import Motor
from omniroll.effects.torque import Drive, Torque, TorqueTable
from omniroll.errors import InvalidValueError
from omniroll.identification.determination import LOOSE, undetermined
from omniroll.identification.log import Log
from omniroll.identification.prediction import Prediction
from omniroll.kernels.kernel import kernel

UP_AND_DOWN = np.array([0, 1, 1, -1, -1, 1, -1, 0.5, -0.5, 0.25, 0])  # over the time of an experiment, as its knots
BESIDE = np.array([0, 0.5, -1, -1, 1, 0.5, 1, -1, -0.5, 1, 0])
MOST_READINGS = 10**6


@dataclass(frozen=True)
class Experiment:
    """A drive that would tell something.

    name        of the drive
    effects     what acts: the fit's effects with this drive
    gain        by how much the logarithm of the determinant of the information would grow
    deviations  of the numbers, by name, in their units: what a fit to all logs and this one would reach
    undetermined  what all of them together would not determine, in words
    """

    name: str
    effects: tuple[Effect, ...]
    gain: float
    deviations: Mapping[str, float]
    undetermined: tuple[str, ...]

    def __str__(self) -> str:
        reached = (f"{name} to {2 * deviation:.2g}" for name, deviation in self.deviations.items())
        return "\n".join([f"{self.name} would tell {', '.join(reached)}", *self.undetermined])


def experiments(
    fit: Any, candidates: Mapping[str, Sequence[Effect]] | None, duration: float, step: float
) -> list[Experiment]:
    """What Fit.experiments says of a Fit, which imports this module."""
    duration, step = validation.positive("duration", duration), validation.positive("step", step)
    if not step <= duration <= MOST_READINGS * step:
        raise InvalidValueError("duration", duration, f"must be 1 to {MOST_READINGS} steps of {step:g} s")
    if candidates is not None:
        candidates = {
            name: validation.sequence(f"candidates[{name!r}]", effects, "must be effects, a list or tuple of them")
            for name, effects in validation.mapping("candidates", candidates).items()
        }
    own = fit.jacobian.T @ fit.jacobian + np.eye(len(fit.names)) / LOOSE**2
    found = []
    for name, effects in (candidates or usual_drives(fit, duration)).items():
        model = replace(fit.model, options=fit.model.options | {"effects": tuple(effects)})
        start = model.options.get("start_time", 0.0)
        times = start + step * np.arange(1, int(duration / step) + 1)
        first = fit.logs[0]
        empty = {name: np.zeros((len(times), *first.data[name].shape[1:])) for name in first.fitted}
        predicted = Prediction(model, [Log({"t": times} | empty)]).slopes(fit.names, fit.sizes.tolist())
        (columns,) = zip(*predicted.by_number, strict=True)
        weighted = [np.concatenate([(c[n] / fit.noise[0][n]).ravel() for n in first.fitted]) for c in columns]
        jacobian = np.stack(weighted, axis=1) * fit.sizes
        together = own + jacobian.T @ jacobian
        vague = undetermined(np.concatenate([fit.jacobian, jacobian]), fit.names, fit.sizes)
        gain = np.linalg.slogdet(together)[1] - np.linalg.slogdet(own)[1]
        deviations = np.sqrt(np.diag(np.linalg.inv(together))) * fit.sizes
        reached = dict(zip(fit.names, deviations.tolist(), strict=True))
        found.append(Experiment(name, tuple(effects), float(gain), reached, vague))
    return sorted(found, key=lambda experiment: -experiment.gain)


def usual_drives(fit: Any, duration: float) -> dict[str, tuple[Effect, ...]]:
    """Drives by name whose largest torque or voltage is that of the fit's own drive."""
    drives = [effect for effect in fit.effects if isinstance(effect, (Motor, Torque, TorqueTable))]
    if len(drives) != 1:
        raise InvalidValueError("candidates", None, "must be given where not one Motor, Torque or TorqueTable drives")
    (drive,) = drives
    own = drive.voltage if isinstance(drive, Motor) else drive.torque
    log = fit.logs[0]
    largest = float(np.abs(log.data[log.drive] if log.drive == "motor_voltage" else np.asarray(own)).max())
    if not largest:
        bound = "must be given where the drive itself is 0, as beside a controller: usual drives are as large as it is"
        raise InvalidValueError("candidates", None, bound)
    rows = kernel(fit.vehicle, "massless", "python").wheel_rows
    ahead, aside, turn = (row / np.abs(row).max() for row in rows.T)
    times = fit.model.options.get("start_time", 0.0) + duration * np.linspace(0, 1, len(UP_AND_DOWN))
    shapes = {
        "straight": np.outer(UP_AND_DOWN, ahead),
        "sideways": np.outer(UP_AND_DOWN, aside),
        "on the spot": np.outer(UP_AND_DOWN, turn),
        "turning while driving": (np.outer(UP_AND_DOWN, ahead) + np.outer(BESIDE, turn)) / 2,
    }
    return {name: tuple(_driven(fit.effects, drive, times, largest * rows)) for name, rows in shapes.items()}


def _driven(effects: Sequence[Effect], drive: Drive, times: np.ndarray, rows: np.ndarray) -> list[Effect]:
    table = (
        replace(drive, times=times, voltage=rows, interpolation="linear")
        if isinstance(drive, Motor)
        else TorqueTable(times, rows)
    )
    return [table if effect is drive else effect for effect in effects]

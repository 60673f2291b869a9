"""fit(): the numbers of a model from what a robot has recorded."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from omniroll import validation
from omniroll.errors import InvalidValueError, LogError, SimulationStopped
from omniroll.identification.answer import Fit
from omniroll.identification.determination import LOOSE
from omniroll.identification.first_guess import first_guess
from omniroll.identification.log import ENTRIES, Log, suspected_unit
from omniroll.identification.model import NEUTRAL, OF_INSTRUMENT, START, Free, Model, Number, checked_numbers
from omniroll.identification.prediction import Readings, slopes, sweep
from omniroll.results.measurements import Instruments
from omniroll.scenes.loading import Scene
from omniroll.vehicles.vehicle import Vehicle

LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")  # of scipy.optimize.least_squares
HALF_STEP = 12**-0.5  # standard deviation of what rounding to whole steps leaves out, in steps
ROUNDS = 3  # of fits, each with the noise that the one before it has left over
NEAR = 1e-3  # relative change of the sum of squares after which full steps go on
CONVERGED = 1e-6  # the same of a robust loss, where nothing goes on
MOST_STEPS = 4
SETTLED = 0.3  # length of a step in deviations; the jumps make the last ones some 0.2 long
REFUSED = 1e8  # residual of numbers that no vehicle can have


def fit(
    what: Scene | Vehicle,
    logs: Log | Sequence[Log],
    free: Sequence[str | Number],
    *,
    loss: str = "linear",
    instruments: Instruments | None = None,
    **options: Any,
) -> Fit:
    """Fit numbers of a model to logs, by output error: what a run of the model reads less what was read.

    what         Scene, or a Vehicle
    logs         Log, or several of them
    free         names of the numbers that are sought, or a Number of each, with bounds and a prior. Names are those of
                 the vehicle and of its effects; "nu[0]", "chi[1]", "pose[2]" of the start; "gyro_bias",
                 "wheel_rate_scale", "accelerometer_delay" of an instrument, whose reading is scale * (what is, delay
                 ago) + bias, within 0.2 s
    loss         "linear", or for logs with outliers one of "soft_l1", "huber", "cauchy", "arctan"
    instruments  Instruments, for their places, counts and noise; those of the scene where they are not given
    options      arguments of omniroll.simulate in the place of the scene's; of a Vehicle, nu and what else it needs

    A first guess by linear least squares over the equations of motion is taken where it reads better than the
    model as it is. Then scipy.optimize.least_squares makes the weighted residuals small, with the derivatives of runs.
    Where neither a log nor the instruments say how large the noise of a reading is, it is what the fit leaves over.
    What the logs do not determine stays near where it was, and the answer says what that is.

    Returns a Fit. Raises InvalidValueError for names and values that do not fit, LogError for a log whose columns or
    units do not, SimulationStopped where the model as it is cannot be run.
    """
    validation.choice("loss", loss, LOSSES)
    model = _model(what, instruments, options)
    logs = _checked_logs(logs)
    numbers = checked_numbers(free, model)
    neutral = {n.name: NEUTRAL[n.name.rpartition("_")[2]] for n in numbers if OF_INSTRUMENT.fullmatch(n.name)}
    model = Model(model.vehicle, model.options, model.instruments, neutral)
    model = model.with_values({number.name: number.start for number in numbers})
    _check_starts(numbers, logs)
    read = _first_readings(model, logs)
    noise = [_known_noise(log, model.instruments) for log in logs]
    estimated = [name for log, known in zip(logs, noise, strict=True) for name in log.fitted if name not in known]
    noise = [
        {name: known.get(name) or _rough(log.data[name] - values[name]) for name in log.fitted}
        for log, known, values in zip(logs, noise, read, strict=True)
    ]
    model = _better(model, numbers, logs, noise)
    for _ in range(ROUNDS if estimated else 1):
        problem = _Problem(model, numbers, logs, noise)
        model = problem.solved(loss)
        for log, sizes, read in zip(logs, noise, sweep([model], logs)[0], strict=True):
            for name in set(estimated) & set(log.fitted):
                sizes[name] = _rough(log.data[name] - read.values[name])
    problem = _Problem(model, numbers, logs, noise)
    jacobian, read = problem.linear()
    left = [{k: log.data[k] - value for k, value in of_log.items()} for log, of_log in zip(logs, read, strict=True)]
    values, names = problem.values, tuple(problem.names)
    noise, estimated = tuple(map(dict, noise)), tuple(dict.fromkeys(estimated))
    return Fit(what, model, names, values, problem.sizes, jacobian, logs, tuple(left), noise, estimated)


def _model(what: Scene | Vehicle, instruments: Instruments | None, options: Mapping[str, Any]) -> Model:
    is_scene = isinstance(what, Scene)
    if not is_scene and not isinstance(what, Vehicle):
        raise InvalidValueError("what", what, "must be a Scene or a Vehicle")
    if instruments is not None and not isinstance(instruments, Instruments):
        raise InvalidValueError("instruments", instruments, "must be omniroll.Instruments")
    own = instruments or (what.instruments() if is_scene else None) or Instruments()
    options = (dict(what.options) if is_scene else {"nu": (0, 0, 0)}) | options
    validation.real("start_time", options.get("start_time", 0.0))
    return Model(what.vehicle if is_scene else what, options, own)


def _checked_logs(logs: Log | Sequence[Log]) -> tuple[Log, ...]:
    found = (logs,) if isinstance(logs, Log) else tuple(logs) if isinstance(logs, Sequence) else ()
    if not found or not all(isinstance(log, Log) for log in found):
        raise InvalidValueError("logs", logs, "must be an omniroll.Log, or a sequence of them")
    return found


def _check_starts(numbers: Sequence[Free], logs: Sequence[Log]) -> None:
    """A free number of the start belongs to one log, which does not give it."""
    for number in numbers:
        match = START.fullmatch(number.name)
        if match and (len(logs) > 1 or match[1] in logs[0].start):
            bound = "of the start can be free with one log, where its start does not give it"
            raise InvalidValueError("free", number.name, bound)


def _first_readings(model: Model, logs: Sequence[Log]) -> list[Readings]:
    """What the model as it is reads; columns and units of the logs are compared with it."""
    start = model.options.get("start_time", 0.0)
    for log in logs:
        if log.t[0] < log.start.get("start_time", start):
            raise LogError(
                log.name, log.line(0), "t", float(log.t[0]), f"lies before the start of the run, {start:g} s"
            )
    (found,) = sweep([model], logs)
    read = [of_log.values for of_log in found]
    for log, values in zip(logs, read, strict=True):
        for name, wanted in values.items():
            _compare(log, name, wanted)
    return read


def _compare(log: Log, name: str, wanted: np.ndarray) -> None:
    given = log.data[name]
    if given.shape != wanted.shape:
        raise LogError(log.name, log.line(-1), name, given.shape[1:], f"must have {wanted.shape[1:]} columns")
    alike = float((given * wanted).sum() / max((wanted**2).sum(), np.finfo(float).tiny))
    unit = suspected_unit(ENTRIES[name].unit, alike)
    if unit is not None:
        bound = f"reads {alike:.3g} times what the model does: {unit} in the place of {ENTRIES[name].unit}?"
        raise LogError(log.name, log.line(-1), name, None, bound)


def _known_noise(log: Log, instruments: Instruments) -> dict[str, float]:
    """Standard deviations by name, as the log and the instruments say them."""
    rounding = {name: step * HALF_STEP for name, step in instruments.resolution.items() if step}
    own = {name: value for name, value in instruments.noise.items() if value}
    found = {name: float(np.hypot(own.get(name, 0.0), rounding.get(name, 0.0))) for name in {*own, *rounding}}
    return {"encoder_count": HALF_STEP} | found | dict(log.noise)


def _rough(left: np.ndarray) -> float:
    """The size of residuals; not 0."""
    return float(np.sqrt(np.mean(left**2))) or 1.0


def _better(model: Model, numbers: Sequence[Free], logs: Sequence[Log], noise: Sequence[dict]) -> Model:
    """The model with the first guess, where that reads better."""
    guess = first_guess(model, numbers, logs)
    if not guess:
        return model
    try:
        guessed = model.with_values(guess)
        costs = [
            np.sum(_Problem(m, numbers, logs, noise).residuals(np.zeros(len(numbers))) ** 2) for m in (model, guessed)
        ]
    except InvalidValueError:
        return model
    return guessed if costs[1] < costs[0] else model


class _Problem:
    """Weighted residuals of numbers z, which count from the model's in their sizes."""

    def __init__(self, model: Model, numbers: Sequence[Free], logs: Sequence[Log], noise: Sequence[Mapping]):
        self.model, self.numbers, self.logs, self.noise = model, numbers, logs, noise
        self.names = [number.name for number in numbers]
        self.sizes = np.array([number.size_in(model) for number in numbers])
        self.values = np.array([model.value(name) for name in self.names])
        self.least, self.most = (
            (np.array([getattr(number, side) for number in numbers]) - self.values) / self.sizes
            for side in ("least", "most")
        )

    def at(self, z: np.ndarray) -> Model:
        return self.model.with_values(dict(zip(self.names, self.values + z * self.sizes, strict=True)))

    def residuals(self, z: np.ndarray) -> np.ndarray:
        """Of all readings, then of the priors."""
        try:
            (found,) = sweep([self.at(z)], self.logs)
        except (InvalidValueError, SimulationStopped):
            return np.full(self._rows(), REFUSED)
        return np.concatenate([self._of_logs([read.values for read in found]), self._of_priors(z)])

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        found = slopes(self.at(z), self.names, self.sizes, self.logs)
        columns = [self._weighted(of_number) * size for of_number, size in zip(found, self.sizes, strict=True)]
        return np.concatenate([np.stack(columns, axis=1), self._of_priors_by_z()])

    def solved(self, loss: str) -> Model:
        """The model whose residuals are small."""
        start = np.clip(np.zeros(len(self.names)), self.least, self.most)
        found = least_squares(
            lambda z: np.concatenate([self.residuals(z), z / LOOSE]),
            start,
            lambda z: np.concatenate([self.jacobian(z), np.eye(len(z)) / LOOSE]),
            (self.least, self.most),
            loss=loss,
            ftol=NEAR if loss == "linear" else CONVERGED,
        )
        return self.at(self._settled(found.x) if loss == "linear" else found.x)

    def _settled(self, z: np.ndarray) -> np.ndarray:
        """Where the residuals no longer go with the derivatives, by Gauss's and Newton's full steps.

        Under impact the motion jumps where two wheels change the order of their switches, or where one turns back at
        its joint. The jumps are small beside the noise and hardly go with the derivatives, but the sum of squares has
        many small minima between them, in any of which a search that only descends may end.
        """
        for _ in range(MOST_STEPS):
            jacobian = np.concatenate([self.jacobian(z), np.eye(len(z)) / LOOSE])
            if not np.isfinite(jacobian).all():
                break
            step = np.linalg.lstsq(jacobian, -np.concatenate([self.residuals(z), z / LOOSE]))[0]
            z = np.clip(z + step, self.least, self.most)
            if np.linalg.norm(jacobian @ step) < SETTLED:
                break
        return z

    def linear(self) -> tuple[np.ndarray, list[Readings]]:
        """The Jacobian at the model's numbers, in their sizes, with the priors' rows; and the readings."""
        zero = np.zeros(len(self.names))
        return self.jacobian(zero), [read.values for read in sweep([self.model], self.logs)[0]]

    def _rows(self) -> int:
        readings = sum(log.data[name].size for log in self.logs for name in log.fitted)
        return readings + sum(number.prior is not None for number in self.numbers)

    def _of_logs(self, read: Sequence[Readings]) -> np.ndarray:
        return self._weighted([
            {name: value - log.data[name] for name, value in of_log.items()}
            for log, of_log in zip(self.logs, read, strict=True)
        ])  # fmt: skip

    def _weighted(self, values: Sequence[Readings]) -> np.ndarray:
        """All values over the noise of their readings, in a row."""
        return np.concatenate([
            (value / noise[name]).ravel()
            for of_log, noise in zip(values, self.noise, strict=True)
            for name, value in of_log.items()
        ])  # fmt: skip

    def _of_priors(self, z: np.ndarray) -> np.ndarray:
        values = self.values + z * self.sizes
        known = [(n.prior, value) for n, value in zip(self.numbers, values, strict=True) if n.prior is not None]
        return np.array([(value - mean) / deviation for (mean, deviation), value in known])

    def _of_priors_by_z(self) -> np.ndarray:
        rows = [k for k, number in enumerate(self.numbers) if number.prior is not None]
        found = np.zeros((len(rows), len(self.numbers)))
        for row, k in enumerate(rows):
            found[row, k] = self.sizes[k] / self.numbers[k].prior[1]
        return found

"""fit(): the numbers of a model from what a robot has recorded."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from omniroll import validation
from omniroll.conventions import units
from omniroll.effects.effect_set import EffectSet
from omniroll.errors import InvalidValueError, LogError, SimulationStopped
from omniroll.identification.answer import Fit
from omniroll.identification.determination import LOOSE
from omniroll.identification.first_guess import first_guess
from omniroll.identification.log import ENTRIES, Log
from omniroll.identification.model import NEUTRAL, OF_INSTRUMENT, START, Free, Model, Number, checked_numbers
from omniroll.identification.prediction import Prediction, Readings
from omniroll.identification.watching import Ended, Watch
from omniroll.results.measurements import ANGLE_OF, Instruments
from omniroll.scenes.loading import Scene
from omniroll.vehicles.vehicle import Vehicle

ARGUMENTS = ("nu", "chi", "spins", "pose", "start_time", "roller_model", "switching", "engine", "memory", "effects")
LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")  # of scipy.optimize.least_squares
HALF_STEP = 12**-0.5  # standard deviation of what rounding to whole steps leaves out, in steps
ROUNDS = 3  # of fits, each with the noise that the one before it has left over
NEAR = 1e-3  # relative change of the sum of squares after which full steps go on
CONVERGED = 1e-6  # the same of a robust loss, where nothing goes on
MOST_STEPS = 20
PARTS = (1 / 16, 1 / 4)  # of the logs' time, to which numbers are fitted before all of it
LEAST_ROWS = 50  # of such a part
HELD = 1.0  # sizes of a number that it may leave its start for nothing there
SETTLED = 0.3  # length of a step in deviations; the jumps make the last ones some 0.2 long
NO_PART = {  # numbers of motors that do not matter to what drives a log
    "motor_current": ("resistance", "back_emf"),
    "torque": ("resistance", "back_emf", "torque_constant"),
}
REFUSED = 1e8  # residual of numbers that no vehicle can have


def fit(
    what: Scene | Vehicle,
    logs: Log | Sequence[Log],
    free: Sequence[str | Number],
    *,
    loss: str = "linear",
    instruments: Instruments | None = None,
    report: Callable[[str], Any] | None = None,
    interrupted: Callable[[], Any] | None = None,
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
    report       called with a sentence at the start, and then not more than once a second
    interrupted  called after each prediction; where it gives true, the fit ends with the best so far, and says so
    options      arguments of omniroll.simulate in the place of the scene's: start, roller_model, switching, effects,
                 engine, memory

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
    if report is not None:
        rows = ", ".join(f"{log.name} of {len(log.t)} rows" for log in logs)
        report(f"{len(numbers)} numbers from {rows}")
    start = model
    _check_starts(numbers, logs)
    _check_drives(numbers, logs)
    found = _compared(model, logs)
    noise = [_known_noise(log, model.instruments) for log in logs]
    estimated = [name for log, known in zip(logs, noise, strict=True) for name in log.fitted if name not in known]
    noise = [
        {name: known.get(name) or _rough(log.data[name] - values[name]) for name in log.fitted}
        for log, known, values in zip(logs, noise, found.readings, strict=True)
    ]
    watch = Watch(report, interrupted)
    try:
        found = _in_parts(_better(found, numbers, noise), numbers, noise, loss, watch)
        for _ in range(ROUNDS if estimated else 1):
            watch.begin()
            found = _Problem(found, numbers, noise, watch).solved(loss)
            _estimate(noise, estimated, found)
        is_ended = False
    except Ended:
        found, is_ended = watch.best or found, True
        _estimate(noise, estimated, found)
    problem = _Problem(found, numbers, noise)
    jacobian = problem.jacobian(np.zeros(len(numbers)))
    left = [
        {name: log.data[name] - value for name, value in read.items()}
        for log, read in zip(logs, found.readings, strict=True)
    ]
    bounds = np.array([(number.least, number.most) for number in numbers])
    return Fit(
        what, found.model, tuple(problem.names), problem.values, problem.sizes, bounds, jacobian, logs, tuple(left),
        tuple(map(dict, noise)), tuple(dict.fromkeys(estimated)), problem.differenced, is_ended, start,
    )  # fmt: skip


def _model(what: Scene | Vehicle, instruments: Instruments | None, options: Mapping[str, Any]) -> Model:
    is_scene = isinstance(what, Scene)
    if not is_scene and not isinstance(what, Vehicle):
        raise InvalidValueError("what", what, "must be a Scene or a Vehicle")
    if instruments is not None and not isinstance(instruments, Instruments):
        raise InvalidValueError("instruments", instruments, "must be omniroll.Instruments")
    validation.known(options, ARGUMENTS, "a fit")
    own = instruments or (what.instruments() if is_scene else None) or Instruments()
    options = (dict(what.options) if is_scene else {"nu": (0, 0, 0)}) | options
    validation.real("start_time", options.get("start_time", 0.0))
    vehicle = what.vehicle if is_scene else what
    EffectSet.checked(options.get("effects", ()), vehicle)
    return Model(vehicle, options, own)


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


def _check_drives(numbers: Sequence[Free], logs: Sequence[Log]) -> None:
    """Numbers of motors that have no part in what drives a log."""
    for number in numbers:
        for log in logs:
            if number.name in NO_PART.get(log.drive or "", ()):
                raise InvalidValueError("free", number.name, f"has no part in a motion that {log.drive} drives")


def _compared(model: Model, logs: Sequence[Log]) -> Prediction:
    """What the model as it is reads; columns and units of the logs are compared with it."""
    start = model.options.get("start_time", 0.0)
    for log in logs:
        if log.t[0] < log.start.get("start_time", start):
            raise LogError(
                log.name, log.line(0), "t", float(log.t[0]), f"lies before the start of the run, {start:g} s"
            )
    found = Prediction(model, logs)
    for log, values in zip(logs, found.readings, strict=True):
        for name, wanted in values.items():
            _compare(log, name, wanted)
    return found


def _compare(log: Log, name: str, wanted: np.ndarray) -> None:
    given = log.data[name]
    if given.shape != wanted.shape:
        raise LogError(log.name, log.line(-1), name, given.shape[1:], f"must have {wanted.shape[1:]} columns")
    alike = float((given * wanted).sum() / max((wanted**2).sum(), np.finfo(float).tiny))
    unit = units.suspected(ENTRIES[name].unit, alike)
    if unit is not None:
        bound = f"reads {alike:.3g} times what the model does: {unit} in the place of {ENTRIES[name].unit}?"
        raise LogError(log.name, log.line(-1), name, None, bound)


def _known_noise(log: Log, instruments: Instruments) -> dict[str, float]:
    """Standard deviations by name, as the log and the instruments say them."""
    rounding = {name: step * HALF_STEP for name, step in instruments.resolution.items() if step}
    own = {name: value for name, value in instruments.noise.items() if value}
    found = {name: float(np.hypot(own.get(name, 0.0), rounding.get(name, 0.0))) for name in {*own, *rounding}}
    return dict.fromkeys(ANGLE_OF, HALF_STEP) | found | dict(log.noise)


def _estimate(noise: Sequence[dict[str, float]], estimated: Sequence[str], found: Prediction) -> None:
    """Take what a prediction leaves over for the noise that nobody knows."""
    for log, sizes, read in zip(found.logs, noise, found.readings, strict=True):
        for name in set(estimated) & set(log.fitted):
            sizes[name] = _rough(log.data[name] - read[name])


def _rough(left: np.ndarray) -> float:
    """The size of residuals; not 0."""
    return float(np.sqrt(np.mean(left**2))) or 1.0


def _better(found: Prediction, numbers: Sequence[Free], noise: Sequence[dict]) -> Prediction:
    """The prediction with the first guess, where that reads better."""
    guess = first_guess(found.model, numbers, found.logs)
    if not guess:
        return found
    try:
        guessed = Prediction(found.model.with_values(guess), found.logs)
    except InvalidValueError:
        return found
    return _best((found, guessed), numbers, noise)


def _best(predictions: Sequence[Prediction], numbers: Sequence[Free], noise: Sequence[dict]) -> Prediction:
    """The one whose residuals are smallest."""
    zero = np.zeros(len(numbers))
    costs = [np.sum(_Problem(prediction, numbers, noise).residuals(zero) ** 2) for prediction in predictions]
    return predictions[int(np.argmin(costs))]


def _in_parts(found: Prediction, numbers: Sequence[Free], noise: Sequence[dict], loss: str, watch: Watch) -> Prediction:
    """The prediction with numbers that were fitted to the beginnings of the logs, where those read better.

    A small error of a number grows along a motion: over a short time readings change nearly linearly with the numbers.
    """
    model = found.model
    for part in PARTS:
        logs = [log.beginning(max(LEAST_ROWS, int(part * len(log.t)))) for log in found.logs]
        if all(len(short.t) < len(log.t) for short, log in zip(logs, found.logs, strict=True)):
            model = _Problem(Prediction(model, logs), numbers, noise, watch, False).solved(loss, HELD).model
    return found if model is found.model else _best((found, Prediction(model, found.logs)), numbers, noise)


class _Problem:
    """Weighted residuals of numbers z, which count from the model's in their sizes.

    start        Prediction of the model
    last, place  Prediction that was used last, and its z: residuals and derivatives are asked for at the same places
    differenced  the numbers by which the last derivatives were differences of runs
    watch        sees each prediction; is_whole says whether the logs are whole
    """

    def __init__(
        self,
        start: Prediction,
        numbers: Sequence[Free],
        noise: Sequence[Mapping],
        watch: Watch | None = None,
        is_whole: bool = True,
    ):
        self.watch, self.is_whole = watch, is_whole
        self.model, self.logs, self.numbers, self.noise = start.model, start.logs, numbers, noise
        self.last, self.place = start, np.zeros(len(numbers))
        self.differenced: tuple[str, ...] = ()
        self.names = [number.name for number in numbers]
        self.sizes = np.array([number.size_in(self.model) for number in numbers])
        self.values = np.array([self.model.value(name) for name in self.names])
        self.least, self.most = (
            (np.array([getattr(number, side) for number in numbers]) - self.values) / self.sizes
            for side in ("least", "most")
        )

    def at(self, z: np.ndarray) -> Model:
        return self.model.with_values(dict(zip(self.names, self.values + z * self.sizes, strict=True)))

    def prediction(self, z: np.ndarray) -> Prediction:
        if not np.array_equal(z, self.place):
            self.last, self.place = Prediction(self.at(z), self.logs), z.copy()
        return self.last

    def residuals(self, z: np.ndarray) -> np.ndarray:
        """Of all readings, then of the priors."""
        try:
            found = self.prediction(z).readings
        except (InvalidValueError, SimulationStopped):
            return np.full(self._rows(), REFUSED)
        left = np.concatenate([self._of_logs(found), self._of_priors(z)])
        if self.watch is not None:
            self.watch.note(self.last, left, self.is_whole)
        return left

    def jacobian(self, z: np.ndarray) -> np.ndarray:
        found = self.prediction(z).slopes(self.names, self.sizes)
        self.differenced = found.differenced
        columns = [self._weighted(own) * size for own, size in zip(found.by_number, self.sizes, strict=True)]
        return np.concatenate([np.stack(columns, axis=1), self._of_priors_by_z()])

    def solved(self, loss: str, loose: float = LOOSE) -> Prediction:
        """What the model reads whose residuals are small.

        loose  sizes of a number that it may leave its start for nothing
        """
        start = np.clip(np.zeros(len(self.names)), self.least, self.most)
        found = least_squares(
            lambda z: self._regular(self.residuals(z), z, loose),
            start,
            lambda z: self._regular(self.jacobian(z), np.eye(len(z)), loose),
            (self.least, self.most),
            loss=loss,
            ftol=NEAR if loss == "linear" else CONVERGED,
        )
        return self.prediction(self._settled(found.x, found.jac, loose) if loss == "linear" else found.x)

    def _settled(self, z: np.ndarray, jacobian: np.ndarray, loose: float) -> np.ndarray:
        """Where the residuals no longer go with the derivatives, by Gauss's and Newton's full steps.

        Under impact the motion jumps where two wheels change the order of their switches, or where one turns back at
        its joint. The jumps are small beside the noise and hardly go with the derivatives, but the sum of squares has
        many small minima between them, in any of which a search that only descends may end. Over a step the motion
        changes by the jumps, too: Broyden's update takes what each step has done into the derivatives.
        """
        left = self._regular(self.residuals(z), z, loose)
        best, least = z, left @ left
        for _ in range(MOST_STEPS):
            if not np.isfinite(jacobian).all():
                break
            step = np.clip(z + np.linalg.lstsq(jacobian, -left)[0], self.least, self.most) - z
            length = np.linalg.norm(jacobian @ step)
            z, before = z + step, left
            left = self._regular(self.residuals(z), z, loose)
            if left[0] == REFUSED:
                break
            if length < SETTLED:
                return z
            jacobian = jacobian + np.outer(left - before - jacobian @ step, step) / (step @ step)
            if left @ left < least:
                best, least = z, left @ left
        return best

    @staticmethod
    def _regular(rows: np.ndarray, z: np.ndarray, loose: float) -> np.ndarray:
        """Rows with those that hold numbers back which no log determines."""
        return np.concatenate([rows, z / loose])

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

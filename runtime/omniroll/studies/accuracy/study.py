"""The study of one motion: reference, errors and times of every integrator, the ladder of models, advice."""

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from omniroll.engine.runs import Task
from omniroll.engine.simulate import checked_task
from omniroll.errors import SimulationStopped
from omniroll.progress import Report, reporting
from omniroll.scenes import Scene
from omniroll.scenes.allowance import Allowance, working_clock
from omniroll.scenes.result_folder import as_json
from omniroll.studies.accuracy.deviation import deviation
from omniroll.studies.accuracy.heyoka_peer import heyoka_peer
from omniroll.studies.accuracy.models import ladder
from omniroll.studies.accuracy.peers import PEERS, Peer, quietly
from omniroll.studies.accuracy.reference import FINER, Reference, Taylor, confirmed, digits, follow

SAMPLES = 41  # times at which motions are compared
ENOUGH = 0.2  # s: a setting is timed again until this is used up, at most REPEATS times
REPEATS = 5
INTEGRATORS = (*PEERS, *heyoka_peer())


@dataclass(frozen=True)
class Point:
    """One integrator (or model) at one setting.

    setting, unit  what was asked: a tolerance, or steps a sample
    microseconds  per simulated second, the least of some repeats
    end, trajectory  errors in the norm of `accuracy`, at the end and at all samples; nan where the motion blew up
    switch_times  s, nan where the switches are others than the reference's; energy relative
    """

    series: str
    setting: float
    microseconds: float
    evaluations: int
    end: float
    trajectory: float
    switch_times: float
    energy: float
    unit: str = "tolerance"


@dataclass
class Study:
    """All that `omniroll accuracy` shows. `laws` are {integrator: (C, E)} of error = C tol^E.

    confirmed  how far the second reference solution is from the first; models_confirmed of the fullest model's
    floor      smaller errors are shown as this; models_floor likewise
    effects    of the scene
    left_out   integrators that do not run scenes with effects
    stopped    why a run could not go on, or None
    """

    scene: str
    duration: float
    model: str
    law: str
    confirmed: float
    floor: float
    points: list[Point] = field(default_factory=list)
    failed: list[str] = field(default_factory=list)
    laws: dict[str, tuple[float, float]] = field(default_factory=dict)
    models: list[Point] = field(default_factory=list)
    advice: dict[str, Any] | None = None
    effects: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    models_confirmed: float = math.inf
    stopped: str | None = None

    @property
    def models_floor(self) -> float:
        return FINER * self.models_confirmed

    def as_json(self) -> str:
        return as_json(asdict(self))

    def as_csv(self) -> str:
        names = list(Point.__dataclass_fields__)
        lines = [",".join(["part", *names])]
        for part, points in (("integrator", self.points), ("model", self.models)):
            lines += [",".join([part, *(_cell(getattr(point, name)) for name in names)]) for point in points]
        return "\n".join(lines) + "\n"


def _cell(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)


def study(
    scene: Scene, duration: float, *, wanted: float | None = None, peers: tuple[Peer, ...] = INTEGRATORS,
    report: Callable[[str], Any] = lambda line: None, progress: bool | Report | None = False, within: float = math.inf,
) -> Study:  # fmt: skip
    """Measure everything for the first `duration` seconds of a scene.

    report    is told in words what comes next
    progress  of the reference solution, as progress.reporting takes it
    within    s after which no further setting is measured; what is left out for that is among those not done

    A run that stops is noted, and the others go on. Raises SimulationStopped where the reference solution stops.
    """
    options = _options(scene)
    task = checked_task(scene.vehicle, **options, duration=duration)
    times = np.linspace(0.0, duration, SAMPLES)
    allowance = Allowance(within, working_clock())
    report("reference: Taylor series in 28 digits, confirmed by extrapolation in long double")
    with reporting(progress, duration, "s", keeps=False) as show:
        reference = confirmed(replace(task, progress=show), times)
    result = Study(
        scene.name, duration, task.kernel.roller_model, task.switching, reference.confirmed, reference.floor,
        effects=[type(effect).__name__ for effect in options.get("effects", ())],
    )  # fmt: skip
    result.left_out += [peer.name for peer in peers if not peer.takes(task)]
    taken = [peer for peer in peers if peer.takes(task)]

    def measure(some: list[Peer]) -> None:
        for peer in some:
            report(peer.name)
            _measure_all(result, peer, task, reference, allowance)

    measure(taken[:1])
    if allowance.has_time("models"):  # before what takes longest
        report("models")
        _measure_models(result, scene, options, times, reference)
    measure(taken[1:])
    result.failed += [f"{left}: not begun within {within:g} s" for left in allowance.left_out]
    if wanted is not None:
        result.advice = advice(result, wanted)
    return result


class _EnoughError(Exception):
    """The time that was given is over."""


def affordable(scene: Scene, duration: float, seconds: float) -> float:
    """How much of the first `duration` seconds of a scene the reference solution can follow in some seconds of work, to
    two digits."""
    clock, reached = working_clock(), [0.0]

    def watch(done: float, total: float) -> None:
        reached.append(done)
        if clock() > seconds:
            raise _EnoughError

    task = replace(checked_task(scene.vehicle, **_options(scene), duration=duration), progress=watch)
    try:
        with digits():
            follow(Taylor(task), task, np.array([0.0]))
    except _EnoughError:
        return _rounded_down(reached[-1])
    return duration


def _rounded_down(number: float) -> float:
    """A positive number to two digits, not above it."""
    unit = 10.0 ** (math.floor(math.log10(number)) - 1)
    return float(f"{math.floor(number / unit) * unit:.2g}")


def _options(scene: Scene) -> dict[str, Any]:
    return {name: value for name, value in scene.options.items() if name not in ("duration", "accuracy", "engine")}


def _measure_models(
    result: Study, scene: Scene, options: dict[str, Any], times: np.ndarray, reference: Reference
) -> None:
    """The ladder of models."""
    known = reference if result.model == "free" else None
    rungs = ladder(scene, options, result.duration, times, _measured, known)
    result.models, result.models_confirmed = rungs.points, rungs.confirmed
    result.failed += rungs.failed
    result.stopped = result.stopped or (str(rungs.stopped) if rungs.stopped else None)


def _measure_all(result: Study, peer: Peer, task: Task, reference: Reference, allowance: Allowance) -> None:
    """One integrator at all of its settings for which there is time, and its law."""
    own = []
    for setting in peer.settings:
        if not allowance.has_time(f"{peer.name} at {setting:g}"):
            continue
        try:
            own.append(_measured(peer, setting, task, reference))
        except (ArithmeticError, ValueError, SimulationStopped) as error:
            result.failed.append(f"{peer.name} at {setting:g}: {error}")
            if isinstance(error, SimulationStopped):
                result.stopped = result.stopped or str(error)
    result.points += own
    result.laws |= _law(peer, own, result.floor)


def _measured(peer: Peer, setting: float, task: Task, reference: Reference) -> Point:
    least, spent, outcome = math.inf, 0.0, None
    peer.prepare(task, setting)
    for _ in range(REPEATS):
        start = time.perf_counter()
        outcome = quietly(peer, task, reference.times, setting)
        took = time.perf_counter() - start
        least, spent = min(least, took), spent + took
        if spent > ENOUGH:
            break
    errors = deviation(outcome, reference, task)
    shown = {name: max(value, reference.floor) for name, value in errors.items()}
    return Point(peer.name, setting, 1e6 * least / task.duration, outcome.evaluations, **shown, unit=peer.setting)


def _law(peer: Peer, points: list[Point], floor: float) -> dict[str, tuple[float, float]]:
    """error = C tol^E by least squares of logarithms; E = 1 keeps what is asked.

    Errors within ten times the smallest are left out: there rounding may play a part. No law where the rest are fewer
    than three, or do not fall by a digit.
    """
    if peer.setting != "tolerance" or not points:
        return {}
    lower = 10 * max(floor, min(p.trajectory for p in points))
    kept = [p for p in points if p.trajectory > lower]
    if len(kept) < 3 or kept[0].trajectory < 10 * kept[-1].trajectory:
        return {}
    slope, height = np.polyfit([math.log(p.setting) for p in kept], [math.log(p.trajectory) for p in kept], 1)
    return {peer.name: (math.exp(height), float(slope))}


def advice(result: Study, wanted: float) -> dict[str, Any]:
    """The cheapest setting whose error over the trajectory, the model's included, is at most `wanted`.

    next_digit  the cheapest for a digit more, and `times` the time that it takes; finest  the smallest error measured.
    Each is None where there is none.
    """
    offers = _offers(result)

    def cheapest(limit: float) -> dict[str, Any] | None:
        enough = [offer for offer in offers if offer["error"] <= limit]
        return min(enough, key=lambda offer: offer["microseconds"], default=None)

    now, then = cheapest(wanted), cheapest(wanted / 10)
    return {
        "wanted": wanted,
        "cheapest": now,
        "next_digit": then,
        "times": then["microseconds"] / now["microseconds"] if now and then else None,
        "finest": min(offers, key=lambda offer: offer["error"], default=None),
    }


def _offers(result: Study) -> list[dict[str, Any]]:
    """What was measured, as (model, integrator, setting) with error and time; errors of models and numbers add up."""
    offers = [(point, point.series, "compiled", 0.0) for point in result.models]
    finest = [point.trajectory for point in result.models if point.series == result.model][-1:]
    if finest:
        model_error = 0.0 if result.model == "free" else finest[0]
        offers += [(point, result.model, point.series, model_error) for point in result.points]
    return [
        {"model": model, "integrator": integrator, "setting": point.setting, "unit": point.unit,
         "error": point.trajectory + more, "microseconds": point.microseconds}
        for point, model, integrator, more in offers
        if math.isfinite(point.trajectory)
    ]  # fmt: skip

"""The study of one motion: reference, errors and times of every integrator, the ladder of models, advice."""

import json
import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from omniroll.accuracy.heyoka_peer import heyoka_peer
from omniroll.accuracy.models import ladder
from omniroll.accuracy.peers import PEERS, Outcome, Peer, quietly
from omniroll.accuracy.reference import Extrapolated, Reference, Taylor, digits, distance, follow
from omniroll.runs import Task
from omniroll.scene import Scene
from omniroll.simulate import checked_task

SAMPLES = 41  # times at which motions are compared
FINER = 100.0  # the reference is so much finer than any error shown
ENOUGH = 0.2  # s that a setting is repeated for, at most REPEATS times
REPEATS = 5
INTEGRATORS = (*PEERS, *heyoka_peer())


@dataclass(frozen=True)
class Point:
    """One integrator (or model) at one setting.

    microseconds  per simulated second, the least of some repeats
    end, trajectory  errors in the norm of `accuracy`, at the end and at all samples
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


@dataclass
class Study:
    """All that `omniroll accuracy` shows. `laws` are {integrator: (C, E)} of error = C tol^E.

    effects  of the scene; the integrators are compared without them, the models with them
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

    def as_json(self) -> str:
        def plain(value: Any) -> Any:
            if isinstance(value, float) and not math.isfinite(value):
                return None
            if isinstance(value, dict):
                return {key: plain(item) for key, item in value.items()}
            return [plain(item) for item in value] if isinstance(value, (list, tuple)) else value

        return json.dumps(plain(asdict(self)), indent=1, allow_nan=False)

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
    report: Callable[[str], Any] = lambda line: None,
) -> Study:  # fmt: skip
    """Measure everything for the first `duration` seconds of a scene."""
    options = {k: v for k, v in scene.options.items() if k not in ("duration", "accuracy", "engine")}
    plain = {k: v for k, v in options.items() if k != "effects"}
    task = checked_task(scene.vehicle, **plain, duration=duration)
    times = np.linspace(0.0, duration, SAMPLES)
    report("reference: Taylor series in 28 digits")
    with digits():
        reference = follow(Taylor(task), task, times)
    report("reference: confirmed by extrapolation in long double")
    second = follow(Extrapolated(task), task, times[-1:])
    scales = scene.vehicle.platform_radius, _speed(task)
    with digits():
        confirmed = distance(reference, second, *scales)
    if [s[1:] for s in second.switches] != [s[1:] for s in reference.switches]:
        confirmed = math.inf
    result = Study(
        scene.name, duration, task.kernel.roller_model, task.switching, confirmed, FINER * max(confirmed, 1e-18),
        effects=[type(effect).__name__ for effect in options.get("effects", ())],
    )  # fmt: skip
    for peer in peers:
        report(peer.name)
        for setting in peer.settings:
            try:
                result.points.append(_measured(peer, setting, task, reference, result.floor))
            except (ArithmeticError, ValueError) as error:
                result.failed.append(f"{peer.name} at {setting:g}: {error}")
        result.laws |= _law(peer, [p for p in result.points if p.series == peer.name], result.floor)
    report("models")
    result.models, refused = ladder(scene, options, duration, times, _measured)
    result.failed += refused
    if wanted is not None:
        result.advice = advice(result, wanted)
    return result


def _speed(task: Task) -> float:
    return float(np.linalg.norm(task.state.nu)) or 1.0


def _measured(peer: Peer, setting: float, task: Task, reference: Reference, floor: float) -> Point:
    least, spent, outcome = math.inf, 0.0, None
    peer.prepare(task, setting)
    for _ in range(REPEATS):
        start = time.perf_counter()
        outcome = quietly(peer, task, reference.times, setting)
        took = time.perf_counter() - start
        least, spent = min(least, took), spent + took
        if spent > ENOUGH:
            break
    errors = _errors(outcome, reference, task)
    shown = {name: max(value, floor) for name, value in errors.items()}
    return Point(peer.name, setting, 1e6 * least / task.duration, outcome.evaluations, **shown)


def _errors(outcome: Outcome, reference: Reference, task: Task) -> dict[str, float]:
    radius, speed = task.kernel.vehicle.platform_radius, _speed(task)
    pose = np.abs(outcome.y[:, -3:] - reference.y[:, -3:]) / [radius, radius, 1.0]
    nu = np.abs(outcome.y[:, :3] - reference.y[:, :3]) / speed
    same = (outcome.contact == reference.contact).all(axis=1)
    nu = np.where(same[:, None], nu, 0.0)
    each = np.maximum(pose.max(axis=1), nu.max(axis=1))
    scale = max(abs(reference.energy).max(), np.finfo(float).tiny)
    return {
        "end": float(each[-1]),
        "trajectory": float(each.max()),
        "switch_times": _switch_times(outcome.switches, reference.switches),
        "energy": float(np.abs(outcome.energy - reference.energy)[same].max(initial=0.0) / scale),
    }


def _switch_times(found: list, wanted: list) -> float:
    """The largest error of a switch's time, wheel by wheel; nan where the switches are not the same."""
    worst = 0.0
    for wheel in {wheel for _, wheel, _ in wanted} | {wheel for _, wheel, _ in found}:
        one = [(t, d) for t, i, d in found if i == wheel]
        other = [(t, d) for t, i, d in wanted if i == wheel]
        if [d for _, d in one] != [d for _, d in other]:
            return math.nan
        worst = max([worst, *(abs(a - b) for (a, _), (b, _) in zip(one, other, strict=True))])
    return worst


def _law(peer: Peer, points: list[Point], floor: float) -> dict[str, tuple[float, float]]:
    """error = C tol^E by least squares of logarithms, where rounding plays no part; E = 1 keeps what is asked."""
    if peer.setting != "tolerance":
        return {}
    lower = max(1e-13, 10 * floor)
    kept = [p for p in points if p.trajectory > lower]
    if len(kept) < 3:
        return {}
    slope, height = np.polyfit([math.log(p.setting) for p in kept], [math.log(p.trajectory) for p in kept], 1)
    return {peer.name: (math.exp(height), float(slope))}


def advice(result: Study, wanted: float) -> dict[str, Any]:
    """The cheapest setting whose error over the trajectory, the model's included, is at most `wanted`.

    And the cheapest for a digit more.
    """
    model_error = min((p.trajectory for p in result.models if p.series == result.model), default=math.inf)
    offers = [
        {"model": p.series, "integrator": "compiled kernel" if result.effects else "compiled", "setting": p.setting, "error": p.trajectory,
         "microseconds": p.microseconds}
        for p in result.models
    ] + [
        {"model": result.model, "integrator": p.series, "setting": p.setting,
         "error": p.trajectory + (0.0 if result.model == "free" else model_error), "microseconds": p.microseconds}
        for p in ([] if result.effects else result.points)  # they were compared without the effects
    ]  # fmt: skip

    def cheapest(limit: float) -> dict[str, Any] | None:
        enough = [offer for offer in offers if offer["error"] <= limit]
        return min(enough, key=lambda offer: offer["microseconds"], default=None)

    return {"wanted": wanted, "cheapest": cheapest(wanted), "next_digit": cheapest(wanted / 10)}

"""Times known beforehand: thousands of knots, tables that jump by decades, samples that are very short or very long."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np

from hard import on_the_spot, true_flow
from hard.case import Cases, Measurement, Scale
from hard.on_the_spot import equal
from hard.setting import ENGINES, MODELS, Setting, random_start
from omniroll import Controller, TorqueTable, Trajectory
from omniroll.effects.effect import Effect

CASES = Cases("Effects")
ACCURACY = 1e-14
DECADES = 1e12


def pieces_of(times: np.ndarray, torques: np.ndarray, duration: float, hold: bool = False) -> list[tuple]:
    """(length, first, last torque) of a table whose first time is 0, exactly."""
    ends, exact = [mpmath.mpf(float(t)) for t in (*times, duration)], [mpmath.mpf(float(u)) for u in torques]
    after = exact if hold else [*exact[1:], exact[-1]]
    return [(b - a, u, v) for a, b, u, v in zip(ends, ends[1:], exact, after, strict=False)]


@dataclass(frozen=True)
class Driven:
    """A start on the spot with a table of equal torques, and its true end."""

    nu_3: float
    table: TorqueTable
    duration: float

    @property
    def start(self) -> dict[str, Any]:
        return {"nu": (0, 0, self.nu_3), "duration": self.duration}

    def missed(self, run: Trajectory) -> float:
        """How far the end of a run is from the closed form, in eps."""
        with on_the_spot.digits():
            torques, q = np.array(self.table.torque)[:, 0], on_the_spot.rate(self.nu_3)
            pieces = pieces_of(np.array(self.table.times), torques, self.duration, self.table.interpolation == "hold")
            fastest = max(abs(float(q)), *(abs(float(on_the_spot.driven(q, pieces[:k])[0])) for k in (1, -1)))
            return on_the_spot.missed(run, on_the_spot.driven(q, pieces), fastest)

    def run(self, setting: Setting) -> Trajectory:
        return setting.run(**self.start, effects=(self.table,), accuracy=ACCURACY)


@CASES.case(
    "thousands-of-knots",
    "Thousands of knots: 20 000 (Python engine: 2000) in some seconds",
    naive="does not know of the knots, and gives up after 200 000 evaluations between two switches",
    promise="errors are at most those of a rounding for each knot, and a knot costs a step",
)
def many_knots(scale: Scale) -> Iterator[Measurement]:
    for engine, knots in {"compiled": scale.of(2000, 20_000), "python": scale.of(200, 2000)}.items():
        (setting,) = on_the_spot.settings(engine)
        random = np.random.default_rng(61)
        times = np.concatenate([[0.0], np.cumsum(random.uniform(1e-6, 2e-3, knots - 1))])
        table = TorqueTable(times, equal(random.normal(size=knots) * 0.02))
        driven = Driven(20.0, table, float(times[-1]) + 1e-3)
        run = driven.run(setting)
        passed = knots + len(np.unique(run.switches.t))
        yield setting.measurement("error of nu_3 and heading, in eps for each knot", driven.missed(run) / knots, 1)
        yield setting.measurement("steps for each knot and switch", run.stats["steps"] / passed, 2)


def pulses(random: np.random.Generator, interpolation: str) -> TorqueTable:
    """Torques of about 1e-6 N m, and between them some of 1e6 for so short a time that they turn little."""
    starts, length = np.sort(random.uniform(0.05, 0.95, 4)), 1e-9
    times, torques = [0.0], [1e-6]
    for start, sign in zip(starts, (1, -1, -1, 1), strict=True):
        large = sign * 1e6 * random.uniform(0.5, 1)
        if interpolation == "hold":
            times += [start, start + length]
            torques += [large, 1e-6 * random.normal()]
        else:
            small = 1e-6 * random.normal()
            times += [start, start + length, start + 2 * length]
            torques += [small, large, small]
    return TorqueTable(np.array(times), equal(np.array(torques)), interpolation)


@CASES.case(
    "twelve-decades",
    "Torque tables with jumps of 12 decades: 1e-6 N m, and 1e6 for 1e-9 s",
    naive="steps over the pulses",
    promise="the motion is the closed form",
)
def decades(scale: Scale) -> Iterator[Measurement]:
    for setting in on_the_spot.settings(*ENGINES):
        random, worst = np.random.default_rng(62), 0.0
        for _ in range(scale.of(1, 10)):
            for interpolation in ("hold", "linear"):
                driven = Driven(0.3, pulses(random, interpolation), 1.0)
                jumps = np.abs(np.array(driven.table.torque)[:, 0])
                assert jumps.max() / jumps.min() > DECADES / 100
                worst = max(worst, driven.missed(driven.run(setting)))
        yield setting.measurement("error of nu_3 and heading, in eps", worst, 64)


def sampled(q: mpmath.mpf, target: float, gain: float, sample_time: float, duration: float) -> tuple:
    """q and the angle at the end, with samples at multiples of the sample time as doubles have them."""
    wanted, proportional = on_the_spot.rate(target), mpmath.mpf(gain)
    times = [k * sample_time for k in range(int(duration / sample_time) + 2)]
    ends = [mpmath.mpf(min(t, duration)) for t in times if t < duration] + [mpmath.mpf(duration)]
    angle = mpmath.mpf(0)
    for early, late in zip(ends, ends[1:], strict=False):
        torque = proportional * (wanted - q)
        q, more = on_the_spot.driven(q, [(late - early, torque, torque)])
        angle += more
    return q, angle


@CASES.case(
    "sample-times",
    "Sample times of 1e-6 s and of 1e6 s, at t = 0 and at 1.7e9 s",
    naive="adds the samples to the large time and loses their digits",
    promise="the motion is the closed form",
)
def samples(scale: Scale) -> Iterator[Measurement]:
    """1e-6 s and 1e6 s, on a clock that starts at 0 and at a time of today."""
    amount = {"compiled": scale.of(2000, 50_000), "python": scale.of(100, 1000)}
    for setting in on_the_spot.settings(*ENGINES):
        for sample_time, speed, count in ((1e-6, 1.0, amount[setting.engine]), (1e6, 1e-6, 3)):
            missed = max(sampling(setting, sample_time, speed, count, start_time) for start_time in (0.0, 1.7e9))
            what = f"samples of {sample_time:g} s: error in eps for each sample"
            yield setting.measurement(what, missed / count, 1)


def sampling(setting: Setting, sample_time: float, speed: float, count: int, start_time: float) -> float:
    """How far the end of a run with so many samples is from the closed form, in eps."""
    duration = (count + 0.5) * sample_time
    with on_the_spot.digits():
        gain = 0.3 / (float(on_the_spot.gain()) * sample_time) if sample_time > 1 else 5.0
        end = sampled(on_the_spot.rate(-0.4 * speed), speed, gain, sample_time, duration)
        fastest = float(on_the_spot.ratio()) * speed
    start = {"nu": (0, 0, -0.4 * speed), "duration": duration, "start_time": start_time}
    start["effects"] = (Controller((0, 0, speed), gain, sample_time),)
    return on_the_spot.missed(setting.run(**start, accuracy=ACCURACY), end, fastest)


def coincident(random: np.random.Generator, setting: Setting) -> tuple[dict[str, Any], Any]:
    """A start that nothing acts on up to its first switch, and the time of that switch in 28 digits."""
    while True:
        start = random_start(random, duration=0.3)
        try:
            return start, true_flow.first_switch(setting.task(**start))[0]
        except ValueError:
            continue


def all_known_at(start: dict[str, Any], time: float) -> tuple[Effect, ...]:
    """A controller with a sample, and a table with a knot, at a time; nothing acts before it."""
    controller = Controller(start["nu"], 0.01, time)
    table = TorqueTable((0.0, time), ((0, 0, 0), (0.02, -0.03, 0.01)), "hold")
    return controller, table


@CASES.case(
    "sample-knot-and-switch",
    "A controller's sample, a knot of a table and a switch at one instant, up to 10 ulp apart",
    naive="takes the sample before the switch, or loses the wheel",
    promise="the switch comes first, and the sample sees the speeds after it; each comes once",
)
def one_instant(scale: Scale) -> Iterator[Measurement]:
    """A sample and a knot 10 ulp before a switch, ... , 10 ulp after it, against the true motion with both after it.

    Under impact the sample sees other speeds after the switch than before it.
    """
    ulps = scale.of((-1, 0, 1), (-10, -1, 0, 1, 10))
    for model in scale.of(("locked",), MODELS):
        random, judged = np.random.default_rng([63, MODELS.index(model)]), Setting(model, "impact", "python")
        worst = dict.fromkeys(ENGINES, 0.0)
        for _ in range(scale.of(1, 4)):
            start, switch = coincident(random, judged)
            start["duration"] = 1.2 * float(switch)
            after = float(switch) + 20 * float(np.spacing(float(switch)))
            truth = true_flow.motion(judged.task(**start, effects=all_known_at(start, after)))
            for ulp in ulps:
                effects = all_known_at(start, float(switch) + ulp * float(np.spacing(float(switch))))
                for engine in ENGINES:
                    run = Setting(model, "impact", engine).run(**start, effects=effects, accuracy=ACCURACY)
                    worst[engine] = max(worst[engine], true_flow.missed(run, truth))
        for engine in ENGINES:
            setting = Setting(model, "impact", engine)
            yield setting.measurement("distance from the true motion", worst[engine], 1e-12)

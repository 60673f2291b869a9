"""Speeds over the whole range of numbers, subnormal ones, late clocks and short times."""

import math
from collections.abc import Iterator

import numpy as np

from hard.case import Cases, Measurement, Scale
from hard.flushing import CAN_FLUSH, subnormals_are_zero
from hard.setting import PAPER, settings
from omniroll import InvalidValueError, Trajectory, validation

CASES = Cases("Magnitudes and time")
START = {"nu": np.array([1.0, 0.5, 1.0]), "chi": (0.1, -0.2, 0.3), "spins": np.full((3, 4), 0.25), "duration": 3.0}
POWERS = (-450, 450, 30, -7, -100, 100, -301, 301)  # beyond 450 squares of errors leave the number range
LATE = 1e9  # s


def scaled(factor: float) -> dict:
    moved = {key: START[key] * factor for key in ("nu", "spins")}
    return START | moved | {"duration": START["duration"] / factor}


@CASES.case(
    "powers-of-two",
    "Speeds from 2^-450 to 2^450 times ordinary ones",
    naive="has absolute tolerances, and so makes another run at every magnitude",
    promise="the same run to the bit, scaled",
)
def powers_of_two(scale: Scale) -> Iterator[Measurement]:
    """How many numbers of a run differ from those of the run at ordinary speeds, after scaling."""
    for setting in settings():
        base = setting.run(**START)
        powers = scale.of(POWERS[:3], POWERS)
        differing = sum(_differing(base, setting.run(**scaled(2.0**power)), 2.0**power) for power in powers)
        yield setting.measurement("numbers that are not the same to the bit", differing, 0)


def _differing(base: Trajectory, other: Trajectory, factor: float) -> int:
    if len(other) != len(base):
        return max(len(other), len(base))
    pairs = [
        (base.nu * factor, other.nu), (base.chi, other.chi), (base.pose, other.pose),
        (base.contact, other.contact), (base.elapsed / factor, other.elapsed),
        (base.contact_spin * factor, other.contact_spin),
    ]  # fmt: skip
    if base.spins is not None:
        pairs.append((base.spins * factor, other.spins))
    return sum(int((a != b).sum()) for a, b in pairs)


@CASES.case(
    "subnormal",
    "Subnormal numbers, and flush-to-zero on",
    promise="the run is the one with zeros in their place",
)
def subnormal(scale: Scale) -> Iterator[Measurement]:
    """Subnormal components among ordinary ones: speeds, angles, spins; then with subnormals counted as zero."""
    tiny = 5e-324
    clean = {"nu": (1.0, 0.0, 0.5), "chi": (0.0, 0.0, 0.3), "spins": np.eye(3, 4), "duration": 3.0}
    start = clean | {
        "nu": (1.0, tiny, 0.5),
        "chi": (tiny, -tiny, 0.3),
        "spins": np.eye(3, 4) + tiny * (np.eye(3, 4) == 0),
    }
    for setting in settings():
        wanted = setting.run(**clean)
        apart = _distance(setting.run(**start), wanted)
        yield setting.measurement("distance from the run with zeros", apart, 1e-13)
        if CAN_FLUSH:
            with subnormals_are_zero():
                flushed = setting.run(**start)
            yield setting.measurement("the same, flush-to-zero on", _distance(flushed, wanted), 1e-13)


def _distance(run: Trajectory, other: Trajectory) -> float:
    if run.switches.wheel.tolist() != other.switches.wheel.tolist():
        return math.inf
    return float(max(np.abs(run.nu[-1] - other.nu[-1]).max(), np.abs(run.pose[-1] - other.pose[-1]).max()))


@CASES.case(
    "edges-of-the-range",
    "The smallest and the largest speeds, and beyond",
    promise="the run is finite, or nu is refused before it starts",
)
def edges_of_the_range(scale: Scale) -> Iterator[Measurement]:
    """Speeds up to and just beyond the allowed ones: a run that scales, or a refusal that names nu."""
    for setting in settings():
        wrong = 0
        for size in (validation.SMALLEST, validation.LARGEST / 1e3, validation.SMALLEST / 2, validation.LARGEST * 2):
            nu = np.array([1.0, 0.5, 1.0]) * size
            try:
                run = setting.run(nu=nu, duration=1 / size)
                wrong += not (np.isfinite(run.nu).all() and np.isfinite(run.energy).all() and len(run.switches) > 0)
            except InvalidValueError as refused:
                wrong += refused.field != "nu"
        yield setting.measurement("neither a finite run nor a refusal that names nu", wrong, 0)


@CASES.case(
    "late-clock",
    "Start at t = 1e9 s, and a duration shorter than one ulp of it",
    naive="adds its steps to the large time and loses their digits",
    promise="the motion is the one that starts at t = 0; only its times are rounded",
)
def late_clock(scale: Scale) -> Iterator[Measurement]:
    """A start at t = 1e9 s, where an ulp is 1.2e-7 s: the motion is the early one's."""
    for setting in settings():
        early, late = setting.run(**START), setting.run(**START, start_time=LATE)
        yield setting.measurement("distance of the ends", _distance(late, early), 1e-12)
        off = float(np.abs(late.switches.t - LATE - early.switches.t).max()) / np.spacing(LATE)
        yield setting.measurement("times of switches, in ulp of t", off, 0.5)
        short = setting.run(**START | {"duration": 1e-9}, start_time=LATE)
        way = short.pose[-1, 0] / (PAPER.platform_radius * START["nu"][0] * 1e-9)
        wrong = abs(way - 1) + (short.t[0] != LATE) + (short.elapsed[-1] != 1e-9) + len(short.switches)
        yield setting.measurement("way in 1e-9 s, far less than an ulp, relative error", float(wrong), 1e-8)

"""Runs of a million switches, and the straight run, which is unstable."""

import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import omniroll
from hard.case import Cases, Measurement, Scale
from hard.setting import EPS, PAPER, Setting, settings, speeds_of_wheels
from omniroll import AccuracyWarning
from omniroll.studies.accuracy.reference import Mechanics, digits, flint_module

CASES = Cases("Magnitudes and time")
SWITCHES_A_PIECE = 100_000
MOVED = 1e-9  # relative, of the start whose motion shows the sensitivity
ACCOUNT = "energy less its jumps / (eps switches)"
MIRRORED = PAPER.replace(wheel_angles=(0.0, 2 * np.pi / 3, -2 * np.pi / 3))
START = {"nu": np.array([1.0, 0.3, 1.0]), "chi": np.array([0.1, -0.2, 0.3]), "pose": np.zeros(3)}


@dataclass
class Long:
    """A run in pieces, each from the end of the one before: the end, and sums over all."""

    nu: np.ndarray
    chi: np.ndarray
    pose: np.ndarray
    duration: float
    switches: int
    energy: tuple[float, float]  # at the start and at the end
    jumps: float  # of energy at switches, as reported


def pieces_of(setting: Setting, switches: int, start: dict = START) -> tuple[int, float]:
    """How many pieces, and the duration of each, make about so many switches of the paper's vehicle."""
    kernel = setting.task(PAPER, nu=start["nu"], duration=0).kernel
    rate = np.abs(start["nu"] @ speeds_of_wheels(kernel)).sum() / (2 * np.pi / PAPER.rollers_per_wheel)
    pieces = max(1, round(switches / SWITCHES_A_PIECE))
    return pieces, 2.0 ** round(math.log2(switches / pieces / rate))  # so that their sum is exact


def long_run(setting: Setting, switches: int, *, accuracy: float = 1e-13, start: dict = START) -> Long:
    """About so many switches of the paper's vehicle."""
    pieces, piece = pieces_of(setting, switches, start)
    state, found, count, jumps, first = dict(start), None, 0, 0.0, None
    for _ in range(pieces):
        found = setting.run(PAPER, **state, duration=piece, accuracy=accuracy)
        first = found.energy[0] if first is None else first
        count, jumps = count + len(found.switches), jumps + float(found.switches.energy_jump.sum())
        state = {name: getattr(found, name)[-1] for name in ("nu", "chi", "pose")}
        if found.spins is not None:
            state["spins"] = found.spins[-1]
    end = (state["nu"], state["chi"], state["pose"])
    return Long(*end, pieces * piece, count, (float(first), float(found.energy[-1])), jumps)


def circle(start: dict, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """nu and pose of a massless vehicle in closed form: nu_1 + i nu_2 and the heading turn uniformly (60 digits)."""
    flint, setting = flint_module(), Setting("massless", "smooth", "python")
    with digits():
        flint.ctx.dps = 60
        m = Mechanics(setting.task(PAPER, nu=start["nu"], duration=0), flint.arb)
        nu, radius = [flint.arb(float(v)) for v in start["nu"]], flint.arb(PAPER.platform_radius)
        unit = m.module.forward_dynamics(m.model, [flint.arb(1), flint.arb(0), nu[2]], [flint.arb(0)] * 3)
        turn, time = unit[1], flint.arb(duration)  # nu_1 + i nu_2 turns at this rate, the heading at the next
        yaw = nu[2] / flint.arb(PAPER.yaw_scale)
        velocity = flint.acb(nu[0], nu[1])
        both = flint.acb(0, turn + yaw)
        place = radius * velocity * ((both * time).exp() - 1) / both
        now = velocity * flint.acb(0, turn * time).exp()
        return np.array([float(now.real), float(now.imag), float(nu[2])]), np.array(
            [float(place.real), float(place.imag), float(yaw * time)]
        )


@CASES.case(
    "million-massless",
    "10^6 switches of a massless vehicle (Python engine: 3000), against the closed form",
    naive="drifts as its tolerance allows; the heading, which is linear in time, is good",
    promise="errors grow as an error of eps in the start would: in proportion to the angle turned",
)
def massless(scale: Scale) -> Iterator[Measurement]:
    amounts = {"compiled": scale.of(3_000, 1_000_000), "python": scale.of(100, 3_000)}
    for engine, switches in amounts.items():
        setting = Setting("massless", "impact", engine)
        drifts, bounds = _drifts(long_run(setting, switches)), (1, 1, 10, 10, 100)
        for what, bound in zip(drifts, bounds, strict=True):
            yield setting.measurement(what, drifts[what], bound)


def _drifts(run: Long) -> dict[str, float]:
    """An error of eps in the speeds makes eps times the angle turned of nu and heading."""
    nu, pose = circle(START, run.duration)
    unit, radius = EPS * max(run.duration / PAPER.yaw_scale, 1), PAPER.platform_radius
    return {
        "energy: drift / (eps switches)": abs(run.energy[1] / run.energy[0] - 1) / (EPS * run.switches),
        "nu_3, a first integral: drift / eps": float(abs(run.nu[2] - 1) / EPS),
        "nu: error / (eps angle turned)": float(np.abs(run.nu - nu).max() / unit),
        "heading: error / (eps angle turned)": float(abs(run.pose[2] - pose[2]) / unit),
        "x, y: error / (R eps angle turned)": float(np.abs(run.pose[:2] - pose[:2]).max() / (radius * unit)),
    }


def _account(run: Long) -> float:
    """Energy less its jumps, in eps for each switch."""
    return abs(run.energy[1] - run.energy[0] - run.jumps) / (max(run.energy) * EPS * run.switches)


@CASES.case(
    "million-massive",
    "10^6 switches of massive rollers (Python engine: 1000; distances of runs: 30 000)",
    naive="drifts as its tolerance allows",
    promise="only switches change the energy; errors grow as eps times the sensitivity times sqrt(switches)",
)
def massive(scale: Scale) -> Iterator[Measurement]:
    """Smooth switches: the account of energy, and the end against a run of another accuracy, by the sensitivity."""
    amounts = {"compiled": scale.of(3_000, 1_000_000), "python": scale.of(60, 1_000)}
    for model in ("locked", "free"):
        compiled = Setting(model, "smooth", "compiled")
        for engine, switches in amounts.items():
            setting = Setting(model, "smooth", engine)
            account = _account(long_run(setting, switches))
            yield setting.measurement(ACCOUNT, account, 1)
        for switches in scale.of((3_000,), (3_000, 30_000)):
            error = _error(compiled, switches, long_run(compiled, switches))
            yield compiled.measurement("pose, nu: error / (eps sensitivity sqrt(switches))", error, 10)


@CASES.case(
    "million-impacts",
    "10^6 impacts of a vehicle that is driven (compiled: by exact scaling; Python engine: by torques, 60 s)",
    naive="the energy drifts between the impacts",
    promise="no impact raises the energy by more than rounding, 16 eps; the jumps that are reported add up to the loss",
)
def impacts(scale: Scale) -> Iterator[Measurement]:
    """An impact slows the vehicle. It is driven: exactly, by powers of two at the ends of pieces, and by torques."""
    for model in ("locked", "free"):
        setting = Setting(model, "impact", "compiled")
        state, count, off, most = dict(START), 0, 0.0, -np.inf
        while count < scale.of(3_000, 1_000_000):
            run = setting.run(PAPER, **state, duration=64.0, accuracy=1e-13)
            jumps = run.switches.energy_jump / run.energy[0]
            count, most = count + len(jumps), max(most, float(jumps.max(initial=-np.inf)))
            off += (run.energy[-1] / run.energy[0] - 1) - float(jumps.sum())
            state = _scaled_to_one(run)
        yield setting.measurement(ACCOUNT, abs(off) / (EPS * count), 1)
        yield setting.measurement("largest rise of energy at a switch / eps", most / EPS, 16)
        yield _driven(Setting(model, "impact", "python"), scale.of(2.0, 60.0))


def _scaled_to_one(run: omniroll.Trajectory) -> dict[str, np.ndarray]:
    """The end of a run, its speeds times a power of two: the same motion, faster."""
    power = 2.0 ** -round(math.log2(np.abs(run.nu[-1]).max()))
    spins = {} if run.spins is None else {"spins": run.spins[-1] * power}
    return {"nu": run.nu[-1] * power, "chi": run.chi[-1], "pose": run.pose[-1]} | spins


def _driven(setting: Setting, duration: float) -> Measurement:
    """Torques and friction of the axles: the ledger closes."""
    acting = [omniroll.Torque(0.02), omniroll.Bearings(wheel_viscous=0.01)]
    run = setting.run(PAPER, **START, duration=duration, effects=acting, accuracy=1e-12)
    rest = abs(run.ledger.residual) / run.ledger.scale
    return setting.measurement("driven by torques: rest of the ledger / accuracy", rest / 1e-12, 10)


def _error(setting: Setting, switches: int, run: Long) -> float:
    """The distance of a run from one with other steps, in units of eps, sensitivity and sqrt(switches)."""
    fine = long_run(setting, switches, accuracy=1e-15)
    moved = long_run(setting, switches, accuracy=1e-15, start=START | {"nu": START["nu"] * (1 + MOVED)})
    sensitivity = max(1.0, _apart(fine, moved) / MOVED)
    return _apart(fine, run) / (EPS * sensitivity * math.sqrt(run.switches))


def _apart(one: Long, other: Long) -> float:
    places = np.abs(one.pose - other.pose) / [PAPER.platform_radius, PAPER.platform_radius, 1.0]
    return float(max(places.max(), np.abs(one.nu - other.nu).max() / np.linalg.norm(START["nu"])))


@CASES.case(
    "straight-run",
    "The straight run, exponentially unstable in heading",
    naive="its rounding errors grow as fast as the instability allows",
    promise="the heading grows no faster than eps times the sensitivity, and not at all with mirrored wheels "
    "(massless, locked)",
)
def straight_run(scale: Scale) -> Iterator[Measurement]:
    """nu = (1, 0, 0) of a vehicle with a wheel across: any disturbance of the heading grows."""
    for setting in settings():
        task = {"nu": (1, 0, 0), "duration": scale.of(5.0, 20.0 if setting.engine == "compiled" else 5.0)}
        run = setting.run(MIRRORED, **task)
        if setting.model != "free":
            yield setting.measurement("mirrored: largest heading, rad", float(np.abs(run.pose[:, 2]).max()), 0)
        uneven = setting.run(PAPER, **task)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyWarning)
            checked = omniroll.simulate(PAPER, **setting.options(**task) | {"engine": "compiled"}, accuracy=1e-9)
        noise = float(np.abs(uneven.pose[:, 2]).max()) / (EPS * checked.stats["sensitivity"])
        yield setting.measurement("heading / (eps sensitivity)", noise, 10)

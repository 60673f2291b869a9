"""Runs of a million switches, and the straight run, which is unstable."""

import math
from dataclasses import dataclass

import numpy as np

from hard import naive
from hard.case import Case, Measurement, Scale
from hard.setting import EPS, PAPER, Setting, settings, speeds_of_wheels
from omniroll import Vehicle
from omniroll.accuracy.reference import Mechanics, digits, flint_module

SECTION = "Magnitudes and time"
SWITCHES_A_PIECE = 3000
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


def long_run(setting: Setting, switches: int, *, accuracy: float = 1e-13, start: dict = START) -> Long:
    """About so many switches of the paper's vehicle."""
    kernel = setting.task(PAPER, nu=start["nu"], duration=0).kernel
    rate = np.abs(start["nu"] @ speeds_of_wheels(kernel)).sum() / (2 * np.pi / PAPER.rollers_per_wheel)
    pieces = max(1, round(switches / SWITCHES_A_PIECE))
    piece = 2.0 ** round(math.log2(switches / pieces / rate))  # so that their sum is exact
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
        unit = m.module.reduced(m.model, [flint.arb(1), flint.arb(0), nu[2]], [flint.arb(0)] * 3)
        turn, time = unit[1], flint.arb(duration)  # nu_1 + i nu_2 turns at this rate, the heading at the next
        yaw = nu[2] / flint.arb(PAPER.yaw_scale)
        velocity = flint.acb(nu[0], nu[1])
        both = flint.acb(0, turn + yaw)
        place = radius * velocity * ((both * time).exp() - 1) / both
        now = velocity * flint.acb(0, turn * time).exp()
        return np.array([float(now.real), float(now.imag), float(nu[2])]), np.array(
            [float(place.real), float(place.imag), float(yaw * time)]
        )


def million_massless(scale: Scale) -> list[Measurement]:
    """Against the closed form; the motion's own growth of an error of eps is eps times the angle turned."""
    amounts = {"compiled": scale.of(3_000, 1_000_000), "python": scale.of(300, 3_000)}
    found = []
    for engine, switches in amounts.items():
        setting = Setting("massless", "impact", engine)
        run = long_run(setting, switches)
        nu, pose = circle(START, run.duration)
        turned = run.duration / PAPER.yaw_scale
        found += [
            setting.measurement(
                "drift of the energy / (eps switches)", _drift(run) / (EPS * run.switches), 1
            ),
            setting.measurement("nu_3, first integral: drift / (eps switches)", abs(run.nu[2] - 1) / (EPS * run.switches), 1),
            setting.measurement("nu: error / (eps angle turned)", np.abs(run.nu - nu).max() / (EPS * turned), 10),
            setting.measurement("heading: error / (eps angle turned)", abs(run.pose[2] - pose[2]) / (EPS * turned), 10),
            setting.measurement("x, y: error / (R eps angle turned)", _place_error(run, pose) / (EPS * turned), 10),
        ]
    return found


def _drift(run: Long) -> float:
    return abs(run.energy[1] / run.energy[0] - 1)


def _place_error(run: Long, pose: np.ndarray) -> float:
    return float(np.abs(run.pose[:2] - pose[:2]).max()) / PAPER.platform_radius


CASES = []

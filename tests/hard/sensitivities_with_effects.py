"""Derivatives of runs over 1000 switches with each effect and with all of them, and of sessions, beside 40 digits."""

from dataclasses import dataclass

import numpy as np

import omniroll
from hard import true_sensitivities
from hard.case import Case, Measurement, Scale
from hard.sensitivities import FREE, LOCKED, MASSLESS, SECTION, SPINS
from hard.setting import DOUBLE, PAPER, Setting
from omniroll import Bearings, Controller, Motor, Slope, Torque
from omniroll.effects.effect import Effect

# Its rollers are three quarters as thick at their tips as in the middle: fewer nodes in 40 digits serve.
BLUNT = PAPER.replace(roller_axis_radius=0.3 * PAPER.wheel_radius)
START = {"nu": (1.0, 0.3, 0.8), "chi": (0.1, -0.2, 0.15), "spins": SPINS}
PIECES = 20  # steps of a session
ACCURACY, BOUND = 1e-13, 1e-9

VISCOUS = Bearings(wheel_viscous=1e-6, roller_viscous=1e-9)
FADING = Bearings(wheel_coulomb=1e-5, wheel_speed=0.5)
FADING_ROLLERS = Bearings(roller_coulomb=1e-8, roller_speed=20.0)
RUBBING = Bearings(
    wheel_viscous=1e-6, wheel_coulomb=1e-5, wheel_speed=0.5, roller_viscous=1e-9, roller_coulomb=1e-8, roller_speed=20.0
)
RUBBING_WHEELS = Bearings(wheel_viscous=1e-6, wheel_coulomb=1e-5, wheel_speed=0.5)
MOTORS = Motor(voltage=(0.02, 0.05, -0.03), torque_constant=0.02, resistance=1.5)
PUSH = Torque((2e-5, -1e-5, 1e-5))
LOOP = Controller(target=(0.9, 0.2, 0.7), proportional=1e-3, integral=1e-4, sample_time=0.5)
HILL = Slope(1e-4)


@dataclass(frozen=True)
class Run:
    """A run with so many switches in the tests, and 1000 in full; of its numbers the tests take the first."""

    model: str
    law: str
    effects: tuple[Effect, ...]
    numbers: tuple[str, ...]
    switches: int

    @property
    def acting(self) -> str:
        return ", ".join(type(effect).__name__ for effect in self.effects) or "no effect"


WITH_EACH = (
    Run(FREE, "impact", (), ("nu[0]", "roller_inertia"), 100),
    Run(FREE, "impact", (VISCOUS,), ("roller_viscous", "nu[1]"), 50),
    Run(LOCKED, "impact", (FADING, PUSH), ("wheel_coulomb", "wheel_speed"), 50),
    Run(FREE, "impact", (FADING_ROLLERS,), ("roller_coulomb", "mass"), 20),
    Run(FREE, "smooth", (MOTORS,), ("voltage[0]", "mass"), 50),
    Run(LOCKED, "smooth", (PUSH,), ("torque[1]", "wheel_radius"), 50),
    Run(LOCKED, "impact", (LOOP,), ("mass", "chi[1]"), 50),
    Run(MASSLESS, "smooth", (HILL,), ("angle", "wheel_angles[1]", "nu[0]"), 1000),
)
WITH_ALL = (
    Run(MASSLESS, "smooth", (RUBBING_WHEELS, MOTORS, HILL, PUSH), ("wheel_viscous", "mass", "nu[0]"), 1000),
    Run(FREE, "impact", (RUBBING, MOTORS, HILL, PUSH), ("roller_viscous", "mass", "nu[0]"), 20),
)


def with_each(scale: Scale) -> list[Measurement]:
    return [m for run in WITH_EACH for m in beside_true_run(run, scale)]


def with_all(scale: Scale) -> list[Measurement]:
    return [m for run in WITH_ALL for m in beside_true_run(run, scale)]


def beside_true_run(case: Run, scale: Scale) -> list[Measurement]:
    """The errors of the derivatives at the end of a run, and of a session that goes there in steps."""
    setting, numbers = Setting(case.model, case.law, "compiled"), scale.of(case.numbers[:1], case.numbers)
    start = START | {"effects": case.effects}
    start["duration"] = duration = duration_of(setting, start, scale.of(case.switches, 1000))
    options = setting.options(**start) | {"accuracy": ACCURACY, "sensitivities": numbers}
    run = omniroll.simulate(BLUNT, **options, control=False)
    for given in ("engine", "duration"):
        options.pop(given)
    session = omniroll.Session(BLUNT, **options)
    for _ in range(PIECES):
        session.step(duration / PIECES)
    found = []
    true_ones = true_sensitivities.derivatives(setting.task(BLUNT, **start), run, numbers)
    for name, true in zip(numbers, true_ones, strict=True):
        growth = np.abs(true).max()
        by = f"{setting.name}, {case.acting}, by {name}, {len(run.switches)} switches, growth {growth:.1e}"
        for on, own in (("compiled", run.sensitivity(name, duration)), ("session", session.sensitivity(name))):
            error = float(np.abs(row(own) - true).max() / growth)
            found.append(Measurement("error over the largest derivative", on, DOUBLE, by, error, BOUND))
    return found


def row(own: omniroll.Sensitivity) -> np.ndarray:
    parts = (getattr(own, name) for name in ("nu", "chi", "pose", "spins"))
    return np.concatenate([part.ravel() for part in parts if part is not None])


def duration_of(setting: Setting, start: dict, switches: int) -> float:
    """How long a run takes that has so many switches."""
    duration = 1.0
    while len(times := setting.run(BLUNT, **start, duration=duration).switches.t) <= switches:
        duration *= 2
    return float(times[switches - 1] + times[switches]) / 2


CASES = [
    Case(
        name="derivatives-with-each-effect",
        section=SECTION,
        title="Derivatives of runs with an effect over 1000 switches, beside 40 digits",
        naive="leaves out that an effect's forces jump at a switch, and that the switch comes at another time",
        promise="1e-9 of the largest derivative, also in the steps of a session",
        run=with_each,
    ),
    Case(
        name="derivatives-with-all-effects",
        section=SECTION,
        title="Derivatives of runs with all effects at once over 1000 switches, beside 40 digits",
        naive="leaves out that forces jump at a switch, and that the switch comes at another time",
        promise="1e-9 of the largest derivative, also in the steps of a session",
        run=with_all,
    ),
]

"""A motion in steps, as a session makes it: pauses 1 ulp before, at and after each event."""

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any

import numpy as np

from hard.case import Cases, Measurement, Scale
from hard.setting import LAWS, MODELS, PAPER, Setting, random_start, settings
from omniroll import Bearings, Controller, Motor, Session, Torque, TorqueTable, Trajectory
from omniroll.engine.switching import tau

CASES = Cases("Switches")
ACCURACY = 1e-13
BOUND = 1e-10
DRIVEN = (
    Motor(((4, -3, -2), (-4, 2, 3), (1, 1, 0)), 0.02, 1.5, gear_ratio=3, current_limit=0.7, times=(0.2, 0.7, 1.1)),
    Controller(((0.5, 0, 0.5), (0, 1, 0)), 1.0, 0.07, 0.5, "voltage", times=(0.3, 1.2)),
    TorqueTable((0.4, 0.9), ((0.01, 0, 0), (0, -0.01, 0)), "hold"),
    Torque(0.0),
)
STICKING = (*DRIVEN, Bearings(wheel_coulomb=0.02, wheel_break_away=0.025))


def distance(run: Trajectory, session: Session) -> float:
    return float(max(np.abs(run.nu[-1] - session.nu).max(), np.abs(run.pose[-1] - session.pose).max()))


def stepped(setting: Setting, start: dict[str, Any], pauses: Iterable[float], duration: float) -> Session:
    """The motion in steps that end at the pauses."""
    options = setting.options(**start)
    options.pop("engine")
    session = Session(PAPER, **options, accuracy=ACCURACY)
    for pause in [*pauses, duration]:
        session.step(max(0.0, float(pause - session.elapsed)))
    return session


def around(events: np.ndarray) -> np.ndarray:
    """1 ulp before each event, at it, and 1 ulp after it."""
    return np.unique([np.nextafter(events, -np.inf), events, np.nextafter(events, np.inf)])


def around_every_event(scale: Scale) -> Iterator[Measurement]:
    """Motors that reach their limits, a controller, tables: switches, limits, samples and knots; axles that stick."""
    duration = 1.5
    models, laws = scale.of((("locked",), ("impact",)), (MODELS, LAWS))
    cases = [("all events", DRIVEN, setting) for setting in settings(engines=("compiled",))]
    cases += [("axles stick", STICKING, setting) for setting in settings(models, laws, ("compiled",))]
    for name, effects, setting in cases:
        worst, random = 0.0, np.random.default_rng(11)
        for _ in range(scale.of(1, 10)):
            start = random_start(random, 0.6, effects=effects)
            run = setting.run(**start, duration=duration, accuracy=ACCURACY)
            events = np.unique(run.elapsed[1:][np.diff(run.elapsed) == 0])
            session = stepped(setting, start, around(events[(events > 0) & (events < duration)]), duration)
            worst = max(worst, distance(run, session))
        yield setting.measurement(f"{name}: distance from one run", worst, BOUND)


def before_two_switches(scale: Scale) -> Iterator[Measurement]:
    """Two wheels 0.95 tau apart switch together in one run; a step ends 1 ulp, ... , 0.9 tau before the first."""
    duration = 1.0
    for setting in settings(models=("locked", "free"), laws=("impact",), engines=("compiled",)):
        start = {"nu": (1.0, 0.0, 0.0), "chi": np.array([0.0, 0.1, -0.1]), "effects": (Torque(0.0),)}
        first = setting.run(**start, duration=duration, accuracy=ACCURACY)
        time, late = first.switches.t[0], first.switches.wheel[1]
        together, row = tau(time, time), np.searchsorted(first.t, time)
        rate = first.kernel.wheel_speeds(first.nu[row])[late]
        start["chi"][late] -= 0.95 * together * rate
        run = setting.run(**start, duration=duration, accuracy=ACCURACY)
        worst = 0.0
        for before in np.linspace(np.spacing(time), 0.9 * together, scale.of(4, 40)):
            worst = max(worst, distance(run, stepped(setting, start, [time - before], duration)))
        yield setting.measurement("two wheels in tau: distance from one run", worst, BOUND)


@CASES.case(
    "session-steps",
    "Steps of a session that end 1 ulp before, at and after switches, limits, samples and knots",
    naive="makes a run of its own of each step: wheels closer than tau switch at its end, where tau begins anew",
    promise="the motion is that of one run",
)
def session_steps(scale: Scale) -> Iterator[Measurement]:
    return chain(around_every_event(scale), before_two_switches(scale))

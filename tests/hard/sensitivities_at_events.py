"""Derivatives of runs with every kind of event, and of sessions, beside runs in 40 digits: free rollers that stick on
their disks, wheels that slip, contacts that come to rest, stick and let go."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

import omniroll
from hard import true_sensitivities
from hard.case import Cases, Measurement, Scale
from hard.sensitivities import FREE, MASSLESS, SPINS
from hard.setting import DOUBLE, PAPER, Setting
from omniroll import Bearings, Contact, TorqueTable

CASES = Cases("Switches")
START = {"nu": (1.0, 0.3, 0.8), "chi": (0.1, -0.2, 0.15)}
STANDS = {"nu": (0.0, 0.0, 0.0)}
RUBBING, HELD_LONGER = Bearings(roller_coulomb=2e-5), Bearings(roller_coulomb=5e-7, roller_break_away=7e-7)
COULOMB = {"law": "coulomb", "friction": (0.3, 0.4)}
SKID = Contact(**COULOMB, wheel_rates=(3.0, -2.0, 1.0))
STANDING = Contact(**COULOMB, wheel_rates=0.0)
LETS_GO = Contact(law="coulomb", friction=(0.3, 0.35), static_friction=(0.4, 0.45))
RISING = TorqueTable((0.0, 1.0), ((0, 0, 0), (1.0, -0.6, 0.4)))
TO_AND_FRO = TorqueTable((0.0, 0.2, 0.4, 1.0), ((1.0, -0.5, 0.6), (-1.0, 0.5, -0.6), (1.0, -0.6, 0.4), (1, 1, 1)))
REGULARISED = {"law": "regularised", "friction": (0.3, 0.4), "speed": 0.05}
STEPS = (0.1, 0.003, 0.4, 0.297, 0.2)  # of a session, parts of the duration
ACCURACY = 1e-13  # derivatives follow the run as it is: what it misses by, they miss
BOUND = 1e-9


@dataclass(frozen=True)
class Run:
    """A run and the numbers by which there are derivatives; the first one and the shorter duration in the tests."""

    model: str
    effects: tuple
    numbers: tuple[str, ...]
    durations: tuple[float, float]
    start: dict = field(default_factory=dict)
    law: str = "impact"


RUNS = (
    Run(FREE, (RUBBING,), ("mass", "roller_coulomb", "spins[1][2]"), (0.05, 0.4)),
    Run(FREE, (RUBBING,), ("roller_inertia",), (0.02, 0.6), law="smooth"),
    Run(FREE, (HELD_LONGER,), ("roller_break_away", "mass"), (0.1, 0.45), {"spins": 0.0}),
    Run(MASSLESS, (Contact(40.0),), ("coefficient", "mass"), (0.7, 2.0)),
    Run(FREE, (Contact(2.0),), ("coefficient[0]",), (0.05, 0.5)),
    Run(MASSLESS, (Contact(**REGULARISED),), ("speed", "friction[1]"), (0.7, 2.0)),
    Run(FREE, (Contact(**REGULARISED | {"speed": 0.5}),), ("speed",), (0.05, 0.5)),
    Run(MASSLESS, (SKID,), ("mass", "nu[0]", "friction[1]", "wheel_radius"), (1.0, 3.0)),
    Run(FREE, (STANDING,), ("mass",), (0.02, 0.4)),
    Run(MASSLESS, (LETS_GO, RISING), ("static_friction", "mass"), (0.5, 0.6), STANDS),
    Run(FREE, (LETS_GO, RISING), ("static_friction", "mass"), (0.33, 0.45), STANDS),
    Run(MASSLESS, (Contact(law="coulomb", friction=0.1), TO_AND_FRO), ("friction", "nu[1]"), (0.5, 0.8)),
)  # fmt: skip


@CASES.case(
    "derivatives-at-events",
    "Derivatives of runs whose rollers and contacts come to rest, stick and let go, beside 40 digits",
    naive="smooths friction until it can be differentiated, which makes another motion; or stops at the event",
    promise="1e-9 of the largest derivative, also in the steps of a session",
)
def beside_true_runs(scale: Scale) -> list[Measurement]:
    runs = scale.of(RUNS[1::2], RUNS)  # tests/sensitivities has its own of each kind
    return [m for run in runs for m in beside_true_run(run, scale.of(run.numbers[:1], run.numbers), scale)]


def beside_true_run(case: Run, numbers: tuple[str, ...], scale: Scale) -> Iterator[Measurement]:
    """The errors of the derivatives at the end of a run, and of a session that goes there in steps."""
    setting, duration = Setting(case.model, case.law, "compiled"), scale.of(*case.durations)
    start = START | {"spins": SPINS, "effects": case.effects} | case.start
    task = setting.task(**start, duration=duration)
    options = setting.options(**start) | {"accuracy": ACCURACY, "sensitivities": numbers}
    run = omniroll.simulate(PAPER, **options, duration=duration, control=False)
    options.pop("engine")
    session = omniroll.Session(PAPER, **options)
    for step in STEPS:
        session.step(step * duration)
    for name in numbers:
        true, log = true_sensitivities.derivative_over_events(task, name)
        growth = np.abs(true).max()
        by = f"{setting.name}, {acting(case)}, by {name}: {happened(log)}; growth {growth:.1e}"
        for on, own in (("compiled", run.sensitivity(name, duration)), ("session", session.sensitivity(name))):
            error = float(np.abs(row(own) - true).max() / growth)
            yield Measurement("error over the largest derivative", on, DOUBLE, by, error, BOUND)


def row(own) -> np.ndarray:
    parts = (getattr(own, name) for name in ("nu", "chi", "pose", "spins"))
    return np.concatenate([part.ravel() for part in parts if part is not None])


def acting(case: Run) -> str:
    ground = next((effect for effect in case.effects if isinstance(effect, Contact)), None)
    return "rollers that stick" if ground is None else ground.law


def happened(log: list[tuple]) -> str:
    """How many times each thing has happened."""
    counts = Counter(what[-1] for what in log)
    return ", ".join(f"{count} {SAID[kind]}" for kind, count in sorted(counts.items())) or "no event"


SAID = {"switch": "switches", "sticks": "come to rest", "slips": "let go"}

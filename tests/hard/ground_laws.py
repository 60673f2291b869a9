"""The laws of friction in each row, whoever drives: random scenes of ground_anywhere.py under every kind of
controller, as one run, as a session with random steps, and in a sweep.

A scene follows from its number alone: `controlled(number)`.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from contact import laws

from hard.case import Cases, Measurement, Scale, counted
from hard.ground_anywhere import ACCURACY, MISSES, SEED, rollers_stick, rollers_stick_on_coulomb, scene, unbalanced
from omniroll import (
    Bearings,
    Contact,
    Controller,
    FunctionController,
    Motor,
    Session,
    SimulationStopped,
    Slope,
    Torque,
    TorqueTable,
    Vehicle,
    simulate,
    simulate_many,
)

CASES = Cases("Effects")
SAMPLES = (0.003, 0.01, 0.02)  # s
DRAWN = (scene, rollers_stick, rollers_stick_on_coulomb)
MOST_EVALUATIONS = 2e7  # of a run: some ten seconds
COST = "evaluations of the costliest run"
STOPS = ("runs that stop", "sessions that stop", "runs of sweeps that stop")


def driven_by(random: np.random.Generator, wheels: int) -> tuple[Any, ...]:
    """What drives: nothing, torques, a table, motors, a controller of torques or of voltages, a function."""
    target, sample = tuple(random.normal(size=3)), float(random.choice(SAMPLES))
    held = 0.3 * random.normal(size=wheels)
    motor = Motor(tuple(random.normal(scale=4, size=wheels)), 0.02, 1.5, gear_ratio=4, current_limit=1.0)
    return (
        (),
        (Torque(tuple(held)),),
        (TorqueTable((0.0, 0.02, 0.05), 0.3 * random.normal(size=(3, wheels))),),
        (motor,),
        (Controller(target, 0.1, sample, limit=0.3),),
        (Controller(target, 1.0, sample, output="voltage"), motor),
        (FunctionController(lambda t, state: held * np.cos(40 * t) - 0.02 * state.wheel_speeds, sample),),
    )[int(random.integers(7))]


def controlled(number: int) -> tuple[Vehicle, dict[str, Any]]:
    """A scene of one of three kinds under another drive."""
    vehicle, task = DRAWN[number % len(DRAWN)](number)
    random = np.random.default_rng([SEED, 3, number])
    kept = [effect for effect in task["effects"] if isinstance(effect, Contact | Bearings | Slope)]
    return vehicle, task | {"effects": (*kept, *driven_by(random, vehicle.wheels))}


def stepped(vehicle: Vehicle, task: dict[str, Any], random: np.random.Generator) -> np.ndarray:
    """nu at the end of a session that goes there in steps of random lengths."""
    options = {name: value for name, value in task.items() if name not in ("duration", "control")}
    session = Session(vehicle, driven=False, **options)
    times = np.sort(random.uniform(0, task["duration"], 7)).tolist()
    for length in np.diff([0.0, *times, task["duration"]]):
        session.step(float(length))
    return session.nu


def measured(number: int) -> dict[str, float]:
    """What is measured of a scene: numbers that should be small, and 1 for each of the three ways that stops."""
    vehicle, task = controlled(number)
    found = {}
    try:
        run = simulate(vehicle, **task)
    except SimulationStopped:
        return {"runs that stop": 1.0}
    found["law of friction in a row, relative"] = max(
        (float(residual.max()) for residual in laws.judged(run).values()), default=0.0
    )
    found["energy that the ledger does not account for, relative"] = unbalanced(run)
    found[COST] = run.stats["evaluations"]
    size = np.abs(run.nu).max() or 1.0

    def off(nu: np.ndarray) -> float:
        return float(np.abs(nu - run.nu[-1]).max() / size)

    many = simulate_many(vehicle, **{"nu": 0.0} | task)
    if many.stopped.any():
        found["runs of sweeps that stop"] = 1.0
    else:
        found["nu at the end of a run of a sweep, relative"] = off(many.end.nu)
    try:
        session = stepped(vehicle, task, np.random.default_rng([SEED, 4, number]))
        found["nu at the end of a session, relative"] = off(session)
    except SimulationStopped:
        found["sessions that stop"] = 1.0
    return found


@CASES.case(
    "ground-laws",
    "10^4 random vehicles on any ground under every kind of drive: runs, sessions with random steps, sweeps",
    naive="decides what sticks before a controller has been asked for its first sample",
    promise="all end, laws of friction hold in each row, the ledger closes, sessions and sweeps end where runs do",
)
def everywhere(scale: Scale) -> Iterator[Measurement]:
    found = {number: measured(number) for number in range(scale.of(6, 10_000))}
    for what in STOPS:
        yield counted(what, [number for number, of_scene in found.items() if what in of_scene], len(found))
    for what in sorted({what for of_scene in found.values() for what in of_scene} - {*STOPS}):
        value, number = max((of_scene[what], number) for number, of_scene in found.items() if what in of_scene)
        bound = MOST_EVALUATIONS if what == COST else MISSES * ACCURACY
        yield Measurement(what, "compiled", "double", f"scene {number}", value, bound)

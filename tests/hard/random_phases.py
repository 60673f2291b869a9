"""Many phases from random starts: no switch is missed, none is made up."""

from collections.abc import Iterator

import numpy as np

from hard.case import Cases, Measurement, Scale
from hard.setting import PAPER, Setting, settings, speeds_of_wheels
from omniroll import SimulationStopped, Trajectory, Vehicle

CASES = Cases("Switches")
PROBES = np.linspace(0, 1, 25)  # of a step, where its polynomials are looked at
PHASES_A_RUN = {"compiled": 300, "python": 20}


def random_vehicle(random: np.random.Generator) -> Vehicle:
    """One to six wheels at uneven angles, three to twelve rollers, light to heavy."""
    wheels, rollers = int(random.integers(1, 7)), int(random.integers(3, 13))
    limit = PAPER.wheel_radius * np.cos(np.pi / rollers)
    return PAPER.replace(
        wheels=wheels,
        rollers_per_wheel=rollers,
        wheel_angles=2 * np.pi * np.arange(wheels) / wheels + random.uniform(-0.3, 0.3, wheels),
        roller_axis_radius=random.uniform(0.5, 0.97) * limit,
        roller_inertia=PAPER.roller_inertia * 10 ** random.uniform(-3, 0.5),
    )


def random_task(random: np.random.Generator, vehicle: Vehicle, phases: int) -> dict:
    """A start, and a duration after which there have been about so many phases."""
    joint = np.pi / vehicle.rollers_per_wheel
    nu = random.normal(size=3) * 2.0 ** random.integers(-3, 4)
    kernel = Setting("massless", "smooth", "python").task(vehicle, nu=nu, duration=0).kernel
    rates = np.abs(nu @ speeds_of_wheels(kernel)).sum() + 0.1 * np.linalg.norm(nu)
    return {
        "nu": nu,
        "chi": random.uniform(-joint, joint, vehicle.wheels),
        "spins": random.normal(size=(vehicle.wheels, vehicle.rollers_per_wheel - 1)),
        "duration": float(phases * 2 * joint / rates),
    }


def faults(run: Trajectory) -> int:
    """Steps whose wheels are elsewhere than on their rollers, and switches without a reason."""
    return _steps_at_fault(run) + switches_at_fault(run)


def _steps_at_fault(run: Trajectory) -> int:
    """A wheel beyond its joint inside a step; or turned by more or less than the speeds nu make it turn."""
    if run.dense is None:
        return 0
    wheels, joint = slice(3, 3 + run.vehicle.wheels), np.pi / run.vehicle.rollers_per_wheel
    slack = 10 * max(run.accuracy, 1e-12)
    degree = run.dense.shape[1] - 1
    beyond = np.abs(run.dense[:, :, wheels]).max(axis=1) > joint * (1 + slack)  # of the hull
    for step, wheel in zip(*np.nonzero(beyond), strict=True):
        inside = _bernstein(degree) @ run.dense[step, :, 3 + wheel]
        beyond[step, wheel] = np.abs(inside).max() > joint * (1 + slack)
    h = np.diff(run.elapsed)[run.step_rows]
    made = run.dense[:, :, :3].mean(axis=1) @ speeds_of_wheels(run.kernel) * h[:, None]
    turned = run.chi[run.step_rows + 1] - run.chi[run.step_rows]
    wrong = np.abs(turned - made) > joint * slack
    return int((beyond | wrong).any(axis=1).sum())


def _bernstein(degree: int) -> np.ndarray:
    """(probes, degree + 1) values of the Bernstein polynomials."""
    k = np.arange(degree + 1)
    binomial = np.cumprod(np.append(1.0, (degree - k[:-1]) / (k[:-1] + 1)))
    return binomial * PROBES[:, None] ** k * (1 - PROBES[:, None]) ** (degree - k)


def switches_at_fault(run: Trajectory) -> int:
    """A switch of a wheel that is not at its joint, or does not move outwards; and contacts that change without one."""
    joint, rollers = np.pi / run.vehicle.rollers_per_wheel, run.vehicle.rollers_per_wheel
    same_time = np.flatnonzero(np.diff(run.contact, axis=0).any(axis=1))
    moved = (run.contact[same_time] - run.contact[same_time + 1]) % rollers
    direction = np.where(moved > rollers // 2, moved - rollers, moved)
    rates = run.nu[same_time] @ speeds_of_wheels(run.kernel)
    switching = direction != 0
    right = (
        (np.abs(direction) <= 1)
        & (direction * run.chi[same_time] >= joint * (1 - 1e-9))
        & (direction * run.chi[same_time + 1] == -joint)
        & (direction * rates >= 0)
    )
    named = int(switching.sum()) == len(run.switches) and (run.switches.wheel == np.nonzero(switching)[1]).all()
    return int((switching & ~right).any(axis=1).sum()) + (not named)


@CASES.case(
    "random-phases",
    "No switch missed or doubled in 10^6 random phases (Python engine: 10^3)",
    promise="in every step every wheel stays on its roller; "
    "every switch is of a wheel that moves outwards at its joint",
)
def random_phases(scale: Scale) -> Iterator[Measurement]:
    amounts = {"compiled": scale.of(6_000, 1_000_000), "python": scale.of(120, 1_200)}
    for setting in settings():
        random = np.random.default_rng(21)
        wanted, phases, wrong = amounts[setting.engine] // 6, 0, 0
        while phases < wanted:
            vehicle = random_vehicle(random)
            task = random_task(random, vehicle, PHASES_A_RUN[setting.engine])
            try:
                run = setting.run(vehicle, **task, accuracy=10 ** random.uniform(-12, -3))
            except SimulationStopped as stopped:
                run, wrong = stopped.trajectory, wrong + 1
            phases += 1 + len(np.unique(run.switches.t))
            wrong += faults(run)
        yield setting.measurement("phases at fault", wrong, 0)

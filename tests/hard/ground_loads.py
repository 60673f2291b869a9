"""Loads that follow the motion: contacts that go off and come back, vehicles that tip, any vehicle on any ground.

A vehicle with four wheels on a cross, two of which spin and push it along x with F = mu N each: M a = 2 F, and the load
M (h - l) a goes from the wheel ahead to the one behind, which are R ahead and behind.
"""

from typing import Any

import numpy as np

from hard.case import Case, Measurement, Scale
from omniroll import Contact, SimulationStopped, TorqueTable, Vehicle, simulate

SECTION = "Effects"
GRAVITY = 9.80665
CROSS = Vehicle.paper(4, 5).replace(wheel_angles=tuple(np.pi / 2 * np.arange(4)))
LONG, WIDE, HEIGHT = 0.2, 0.15, 0.12
TRICYCLE = Vehicle.paper(3, 5).replace(
    wheel_places=((LONG, 0.0), (-LONG / 2, WIDE), (-LONG / 2, -WIDE)), wheel_angles=(0.0, np.pi / 2, np.pi / 2)
)
STEP = 1e-3  # s: a naive implementation looks at the loads so often


def measured(what: str, value: float, bound: float, naive: float | None = None, model: str = "massless") -> Measurement:
    return Measurement(what, "python", "double", model, value, bound, naive)


def off_and_back(scale: Scale) -> list[Measurement]:
    """Beyond k = mu (h - l)/R = 1 the wheel ahead is off until the spinning wheels' slip comes to rest."""
    wrong, late, theirs = 0.0, 0.0, 0.0
    weight, arm, radius = CROSS.mass * GRAVITY, CROSS.platform_radius, CROSS.wheel_radius
    for ratio, rate in scale.of(((1.25, 30.0),), ((1.0001, 30.0), (1.25, 30.0), (1.25, -30.0), (4.0, 50.0))):
        friction = 1.3
        force = friction * weight / (2 * (1 + ratio))
        rests = radius * abs(rate) / (force * (radius**2 / CROSS.wheel_inertia + 2 / CROSS.mass))
        ground = Contact(law="coulomb", friction=friction, loads="dynamic", height=radius + ratio * arm / friction,
                         wheel_rates=(0, rate, 0, -rate))  # fmt: skip
        run = simulate(CROSS, nu=(0, 0, 0), duration=1.5 * rests, effects=[ground], roller_model="massless",
                       control=False)  # fmt: skip
        loads, ahead = run.ground_load, 0 if run.ground_force[0, 3, 1] > 0 else 2
        carried = np.full(4, weight / (2 * (1 + ratio)))
        carried[[ahead, 2 - ahead]] = 0, weight * ratio / (1 + ratio)
        wrong = max(wrong, np.abs(loads[0] - carried).max() / weight, np.abs(loads[-1] / weight - 0.25).max())
        back = run.t[1:][(loads[1:, ahead] > 0) & (loads[:-1, ahead] == 0)]
        late = max(late, abs(back[0] / rests - 1) if len(back) == 1 else np.inf)
        theirs = max(theirs, abs(2 / (1 + ratio) - 1))  # with the loads at rest F is mu W/4
    return [
        measured("error of the loads / weight", wrong, 1e-10),
        measured("error of the instant at which it comes back, relative", late, 1e-10, theirs),
    ]


def tipping(scale: Scale) -> list[Measurement]:
    """Torques that grow lift the front wheel of a tricycle at an acceleration in closed form."""
    mass, radius, inertia = TRICYCLE.mass, TRICYCLE.wheel_radius, TRICYCLE.wheel_inertia
    acceleration = mass * GRAVITY * LONG / 2 / (mass * HEIGHT + 2 * inertia / radius)
    late, unnamed, theirs = 0.0, 0, 0.0
    for growth in scale.of((10.0,), (1.0, 10.0, 300.0)):
        instant = acceleration * (mass + 2 * inertia / radius**2) * radius / (2 * growth)
        ramp = TorqueTable((0.0, 2 * instant), ((0, 0, 0), (0, 2 * growth * instant, 2 * growth * instant)))
        ground = Contact(law="coulomb", friction=20.0, loads="dynamic", height=HEIGHT)
        stopped: Any = None
        try:
            simulate(TRICYCLE, nu=(0, 0, 0), duration=2 * instant, effects=[ground, ramp], roller_model="massless",
                     control=False)  # fmt: skip
        except SimulationStopped as error:
            stopped = error
        late = max(late, np.inf if stopped is None else abs(stopped.t / instant - 1))
        unnamed += stopped is None or "wheels 1 and 2" not in str(stopped)
        theirs = max(theirs, abs(np.ceil(instant / STEP) * STEP / instant - 1))
    return [
        measured("error of the instant, relative", late, 1e-10, theirs),
        measured("runs that do not stop there, or do not name the edge", unnamed, 0),
    ]


CASES = [
    Case(
        name="ground-load-off-and-back",
        section=SECTION,
        title="A wheel that loses its load and gets it back",
        naive="keeps the loads at rest",
        promise="loads and the instant are those of the closed form",
        run=off_and_back,
    ),
    Case(
        name="ground-tipping",
        section=SECTION,
        title="A vehicle that drives until it tips",
        naive="looks at the loads at the ends of steps",
        promise="the run stops at the instant of the closed form and names the edge",
        run=tipping,
    ),
]

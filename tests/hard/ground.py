"""The ground under Coulomb's friction: at the edge of the cone, all contacts at once, slip that reverses, on a joint.

Two wheels that face each other, driven along: with the torque T on each and the force F of the ground, M v' = 2 F and
J w' = T - l F, so that the slip s = l w - v obeys s' = l T/J - F (l^2/J + 2/M).
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from hard.case import Cases, Measurement, Scale
from hard.setting import EPS, JOINT, PAPER, end_of
from omniroll import Contact, Slope, Torque, TorqueTable, Trajectory, Vehicle, simulate

CASES = Cases("Effects")
PAIR = Vehicle.paper(2, 5).replace(wheel_angles=(0.0, np.pi))
LOAD, FRICTION = 10.0, 0.4
RADIUS, INERTIA, MASS = PAIR.wheel_radius, PAIR.wheel_inertia, PAIR.mass
YIELDS = RADIUS**2 / INERTIA + 2 / MASS  # rate of the slip per force
ASKS = RADIUS / INERTIA / YIELDS  # force that holds, per torque
USED_UP = FRICTION * LOAD / ASKS  # the torque that uses friction up
GROUND = {"law": "coulomb", "friction": FRICTION, "load": LOAD}
ROUNDINGS = 256


def pair(effects: tuple, duration: float, nu_2: float = 0.0, model: str = "massless", **ground: Any) -> Trajectory:
    effects = (Contact(**GROUND | ground), *effects)
    return simulate(PAIR, nu=(0, nu_2, 0), duration=duration, effects=effects, roller_model=model, control=False)


def measured(what: str, model: str, value: float, bound: float) -> Measurement:
    return Measurement(what, "compiled", "double", model, value, bound)


@CASES.case(
    "ground-at-the-cone",
    "Wheels at rest that ask for almost all of the ground's friction",
    naive="lets friction fade in a band of slow slips, so that what should stick creeps",
    promise="below the cone nothing moves; beyond it the slip is that of the closed form",
)
def at_the_cone(scale: Scale) -> Iterator[Measurement]:
    """At rest, with torques that ask for a little less than the friction, for all of it, and for a little more."""
    for model in scale.of(("massless",), ("massless", "free")):
        wrong, creep, off, parts = 0, 0.0, 0.0, (0.5, 1 - 1e-6, 1 - 1e-12, 1 + 1e-12, 1 + 1e-6, 2.0)
        for part in parts:
            torque = part * USED_UP
            run = pair((Torque((torque, -torque)),), 0.01, model=model)
            wrong += bool((run.sticks != (part < 1)).any())
            slip = float(np.abs(run.slip[-1, :, 1]).max())
            creep = max(creep, slip if part < 1 else 0.0)
            wanted = max(part - 1, 0.0) * FRICTION * LOAD * YIELDS * 0.01
            off = max(off, abs(slip - wanted) / (FRICTION * LOAD * YIELDS * 0.01))
        yield measured("modes judged wrongly", model, wrong, 0)
        yield measured("slip in m/s that should be none", model, creep, 0)
        yield measured("error of the slip / that which friction alone would make", model, off, 1e-11)


@CASES.case(
    "ground-all-at-once",
    "Contacts with the ground that give way at one instant",
    naive="finds one after the other, at the ends of its steps",
    promise="one instant for both, to rounding",
)
def let_go_at_once(scale: Scale) -> list[Measurement]:
    """Torques that grow: both contacts give way at one instant."""
    late, apart = 0.0, 0.0
    for growth in scale.of((2.0,), (0.05, 2.0, 80.0)):
        expected = USED_UP / growth
        run = pair((TorqueTable((0.0, 2 * expected), ((0, 0), (2 * USED_UP, -2 * USED_UP))),), 1.5 * expected)
        begin = [run.t[1:][run.sticks[:-1, wheel] & ~run.sticks[1:, wheel]] for wheel in (0, 1)]
        fine = [len(instants) == 1 for instants in begin]
        late = max(late, max(abs(t[0] / expected - 1) for t in begin) / EPS if all(fine) else np.inf)
        apart = max(apart, abs(begin[0][0] - begin[1][0]) if all(fine) else np.inf)
    return [
        measured("error of the instant, in eps", "massless", late, ROUNDINGS),
        measured("time in s between the two", "massless", apart, 0),
    ]


@CASES.case(
    "ground-slip-reverses",
    "A slip on the ground that passes zero and goes on the other way",
    naive="chatters about zero",
    promise="zero is passed at the instant of the closed form, once",
)
def reversing(scale: Scale) -> list[Measurement]:
    """A torque beyond the friction turns the slip of a skidding vehicle round: it passes zero and goes on."""
    speed, part, late, off = 6.0, 3.0, 0.0, 0.0
    start = -PAIR.platform_radius * speed  # l w - v, where v is along the wheels' way
    brake = FRICTION * LOAD * YIELDS
    zero = -start / (brake * (part + 1))
    duration = 3 * zero
    for model in scale.of(("massless",), ("massless", "free")):
        drive = Torque((-part * USED_UP, part * USED_UP))
        run = pair((drive,), duration, nu_2=speed, model=model, wheel_rates=0)
        turned = run.t[1:][np.diff(np.sign(run.ground_force[:, 0, 1])) != 0]
        late = max(late, abs(turned[0] / zero - 1) if len(turned) == 1 else np.inf)
        wanted = brake * (part - 1) * (duration - zero)
        off = max(off, abs(abs(run.slip[-1, 0, 1]) / wanted - 1))
    return [
        measured("error of the instant of slip zero, relative", "all", late, 1e-10),
        measured("error of the slip afterwards, relative", "all", off, 1e-10),
    ]


@CASES.case(
    "ground-joint-while-sticking",
    "Contacts that stick while their wheels stand on joints and pass them",
    naive="lets them slip at each joint",
    promise="the motion is that of rolling",
)
def on_a_joint(scale: Scale) -> Iterator[Measurement]:
    """Contacts that stick stand on joints, go over them and back: the motion is that of rolling."""
    start = {"nu": (0.3, -0.2, 0.4), "chi": (JOINT, -JOINT, JOINT), "roller_model": "massless", "accuracy": 1e-12}
    for duration in scale.of((0.5,), (0.5, 3.0)):
        back = TorqueTable((0.0, duration), ((0.02, 0.02, 0.0), (-0.03, 0.0, 0.02)))
        ground = Contact(law="coulomb", friction=5.0, normal_gravity=9.757)
        rolls, sticks = (
            simulate(PAPER, **start, duration=duration, effects=(*own, Slope(0.1, 0.3), back), control=False)
            for own in ((), (ground,))
        )
        slips = float(not sticks.sticks.all()) + abs(len(rolls.switches) - len(sticks.switches))
        apart = float(np.abs(end_of(rolls) - end_of(sticks)).max())
        balance = abs(sticks.ledger.residual) / sum(map(abs, sticks.ledger.contributions.values()))
        setting = f"massless, {duration} s"
        yield measured("contacts that slip, and switches too many or too few", setting, slips, 0)
        yield measured("distance from rolling", setting, apart, 1e-10)
        yield measured("energy of rolling down, relative", setting, balance, 1e-10)

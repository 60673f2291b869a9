"""Effects check themselves, are immutable, and act together by what they say of themselves."""

import dataclasses
from dataclasses import dataclass

import numpy as np
import pytest

from omniroll import (
    Bearings,
    Controller,
    FunctionController,
    InvalidValueError,
    Motor,
    Slope,
    Torque,
    TorqueTable,
    Vehicle,
    register_controller,
    simulate,
)
from omniroll.effects import KINDS
from omniroll.effects.effect import Influence, Process, Signal
from omniroll.effects.numbers import Curve
from omniroll.effects.torque import Drive

PAPER = Vehicle.paper()


@register_controller("tests: nothing")
def nothing(time, state):
    return 0.0


MOTOR = {"voltage": 1.0, "torque_constant": 0.01, "resistance": 2.0}
EXAMPLES = (
    Torque(0.01),
    TorqueTable((0, 1), ((0, 0, 0), (1, 2, 3))),
    Motor(**MOTOR, current_limit=3),
    Controller((1, 0, 0), 0.1, 0.01),
    Bearings(wheel_viscous=(1e-3, 0, 2e-3), roller_coulomb=1e-4, roller_speed=0.1),
    Slope(0.1),
    FunctionController("tests: nothing", 0.1, "voltage"),
)


@pytest.mark.parametrize("field, make", [
    ("torque", lambda: Torque(np.nan)),
    ("torque", lambda: Torque("fast")),
    ("torque", lambda: Torque([[1.0, 2.0, 3.0]])),
    ("times", lambda: TorqueTable([1.0, 1.0], [[0, 0, 0], [0, 0, 0]])),
    ("times", lambda: TorqueTable([], [])),
    ("torque", lambda: TorqueTable([0.0, 1.0], [[0, 0, 0]])),
    ("interpolation", lambda: TorqueTable([0.0, 1.0], [[0, 0, 0]] * 2, interpolation="cubic")),
    ("torque_constant", lambda: Motor(**MOTOR | {"torque_constant": 0})),
    ("resistance", lambda: Motor(**MOTOR | {"resistance": -1})),
    ("gear_ratio", lambda: Motor(**MOTOR, gear_ratio=0)),
    ("back_emf", lambda: Motor(**MOTOR, back_emf=-1)),
    ("current_limit", lambda: Motor(**MOTOR, current_limit=0)),
    ("rotor_inertia", lambda: Motor(**MOTOR, rotor_inertia=-1e-6)),
    ("voltage", lambda: Motor(**MOTOR, times=[0, 1])),
    ("target", lambda: Controller((1, 0), 0.1, 0.01)),
    ("target", lambda: Controller([(1, 0), (2, 0)], 0.1, 0.01, times=(0, 1))),
    ("proportional", lambda: Controller((1, 0, 0), -0.1, 0.01)),
    ("sample_time", lambda: Controller((1, 0, 0), 0.1, 0)),
    ("output", lambda: Controller((1, 0, 0), 0.1, 0.01, output="current")),
    ("limit", lambda: Controller((1, 0, 0), 0.1, 0.01, limit=-1)),
    ("function", lambda: FunctionController("nobody", 0.1)),
    ("function", lambda: FunctionController("", 0.1)),
    ("function", lambda: FunctionController(3, 0.1)),
    ("sample_time", lambda: FunctionController(nothing, 0)),
    ("output", lambda: FunctionController(nothing, 0.1, "current")),
    ("name", lambda: register_controller("")),
    ("name", lambda: register_controller("tests: nothing")(lambda time, state: 1.0)),
    ("wheel_viscous", lambda: Bearings()),
    ("wheel_viscous", lambda: Bearings(wheel_viscous=-1)),
    ("wheel_speed", lambda: Bearings(wheel_speed=1)),
    ("roller_speed", lambda: Bearings(wheel_viscous=1, roller_speed=1)),
    ("roller_speed", lambda: Bearings(roller_coulomb=1, roller_speed=0)),
    ("wheel_break_away", lambda: Bearings(wheel_break_away=1.0)),
    ("wheel_break_away", lambda: Bearings(wheel_coulomb=1.0, wheel_speed=0.1, wheel_break_away=1.0)),
    ("wheel_break_away", lambda: Bearings(wheel_coulomb=1.0, wheel_break_away=-1.0)),
    ("wheel_speed", lambda: Bearings(wheel_viscous=1.0, wheel_speed=0.1)),
    ("roller_break_away", lambda: Bearings(roller_break_away=1.0)),
    ("roller_speed", lambda: Bearings(roller_viscous=1.0, roller_speed=0.1)),
    ("angle", lambda: Slope(np.pi / 2)),
    ("angle", lambda: Slope(-0.1)),
    ("gravity", lambda: Slope(0.1, gravity=-9.8)),
    ("direction", lambda: Slope(0.1, direction=np.inf)),
])  # fmt: skip
def test_wrong_numbers_are_refused(field, make):
    with pytest.raises(InvalidValueError) as refused:
        make()
    assert refused.value.field == field


@pytest.mark.parametrize("field, effects", [
    ("torque", [Torque((1.0, 2.0))]),
    ("torque", [TorqueTable([0.0], [[1.0, 2.0]])]),
    ("voltage", [Motor(**MOTOR | {"voltage": (1.0, 2.0)})]),
    ("voltage", [Motor(**MOTOR | {"voltage": [(1.0, 2.0)]}, times=[0.0])]),
    ("proportional", [Controller((1, 0, 0), (0.1, 0.2), 0.01)]),
    ("roller_viscous", [Bearings(roller_viscous=(1e-3, 1e-3))]),
    ("output", [Controller((1, 0, 0), 0.1, 0.01, output="voltage")]),
    ("output", [FunctionController(nothing, 0.1, "voltage")]),
    ("function", [FunctionController(lambda time, state: (0.0, 1.0), 0.1)]),
    ("function", [FunctionController(lambda time, state: np.nan, 0.1)]),
    ("function", [FunctionController(lambda time, state: None, 0.1)]),
    ("wheel_break_away", [Bearings(wheel_coulomb=2, wheel_break_away=1)]),
    ("roller_break_away", [Bearings(roller_coulomb=1e-4, roller_break_away=1e-5)]),
    ("effects", [Slope(0.1), Slope(0.2)]),
    ("effects", [Bearings(wheel_viscous=1), Bearings(wheel_viscous=1)]),
    ("effects", ["slope"]),
    ("effects", Slope(0.1)),
    ("effects", None),
])  # fmt: skip
def test_what_does_not_fit_the_vehicle_is_refused(field, effects):
    with pytest.raises(InvalidValueError) as refused:
        simulate(PAPER, nu=(1, 0, 0), duration=1, effects=effects)
    assert refused.value.field == field


@pytest.mark.parametrize("effect", EXAMPLES, ids=lambda effect: type(effect).__name__)
def test_effects_are_values(effect):
    again = KINDS[type(effect).__name__](**{k: v for k, v in effect.as_dict().items() if k != "kind"})
    assert again == effect and hash(again) == hash(effect) and again is not effect
    first = dataclasses.fields(effect)[0].name
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(effect, first, 0)


def test_the_order_of_the_effects_does_not_matter():
    effects = [Controller((0.5, 0, 0), 0.1, 0.1, output="voltage"), Motor(**MOTOR), Slope(0.05), Torque(0.01)]
    start = {"nu": (1, 0, 1), "duration": 1, "accuracy": 1e-9, "control": False}
    one, other = (simulate(PAPER, **start, effects=order) for order in (effects, effects[::-1]))
    np.testing.assert_allclose(one.nu[-1], other.nu[-1], rtol=1e-12)


def test_torques_add_up():
    start = {"nu": (1, 0, 1), "duration": 1, "accuracy": 1e-10, "control": False}
    parts = [Torque((0.01, 0, 0)), TorqueTable([0.0, 9.0], [[0, 0.0, 0], [0, 0.9, 0]])]
    whole = [TorqueTable([0.0, 9.0], [[0.01, 0, 0], [0.01, 0.9, 0]])]
    one, other = (simulate(PAPER, **start, effects=effects) for effects in (parts, whole))
    np.testing.assert_allclose(one.nu[-1], other.nu[-1], rtol=1e-12)


def test_without_effects_there_is_nothing_of_them():
    run = simulate(PAPER, nu=(1, 0, 1), duration=1)
    assert run.added is None and not run.effects and run.kernel.effects == ()
    assert run.dense.shape[-1] == 9 and set(run.ledger.contributions) == {"switches"}
    assert run.stats["evaluations"] % 16 == 0  # the compiled engine


@pytest.mark.parametrize("effects, names, added", [
    ([Torque(0.01)], ("drive",), 1),
    ([Motor(**MOTOR)], ("drive", "motor"), 1),
    ([Slope(0.1)], ("slope",), 0),
    ([Bearings(wheel_viscous=1e-3)], ("axle_viscous",), 1),
    ([Bearings(roller_viscous=1e-6)], ("roller_viscous",), 6 + 3 + 1),
    ([Bearings(roller_coulomb=1e-6, roller_speed=1)], ("roller_coulomb",), 12 + 1),
])  # fmt: skip
def test_only_what_is_called_for_is_in_the_kernel_and_in_the_state(effects, names, added):
    run = simulate(PAPER, nu=(1, 0, 1), duration=0.2, effects=effects, control=False)
    assert run.effects.kernel(PAPER, "free", "python").effects == names
    assert run.added.shape[1] == added and run.dense.shape[-1] == 9 + added


@dataclass(frozen=True)
class Swinging(Drive):
    """An effect of somebody else: a torque that swings, piece by piece linear."""

    size: float

    def process(self, kernel, start_time):
        return SwingingProcess(self, kernel)


class SwingingProcess(Process):
    def __init__(self, effect, kernel):
        knots = np.linspace(0, 2, 401)
        self.curve = Curve(knots, effect.size * np.sin(10 * knots)[:, None] * np.ones(kernel.wheels))
        self.time = 0.0

    def next_time(self):
        return self.time

    def pass_time(self, state):
        self.time = self.curve.next_knot(self.time)

    def influence(self, elapsed, given):
        return Influence({"torque": Signal(*self.curve.after(elapsed))})


def test_an_effect_of_somebody_else():
    run = simulate(PAPER, nu=(0, 0, 0), duration=1.5, roller_model="massless", effects=[Swinging(-0.01)], control=False)
    assert run.stats["engine"] == "compiled"
    ratio = PAPER.platform_radius / PAPER.wheel_radius
    inertia = PAPER.yaw_inertia + PAPER.wheels * PAPER.wheel_inertia * ratio**2
    expected = PAPER.wheels * 0.01 * ratio / inertia * (1 - np.cos(10 * run.t)) / 10
    np.testing.assert_allclose(run.nu[:, 2] / PAPER.yaw_scale, expected, atol=3e-4)
    assert abs(run.ledger.residual) < 1e-9

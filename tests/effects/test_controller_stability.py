"""The linear test of a controller against motions: on both sides of the gain at which errors begin to grow."""

import numpy as np
import pytest
from scipy.optimize import brentq

import omniroll
from omniroll.effects.effect_set import EffectSet

VEHICLE = omniroll.Vehicle.paper().replace(roller_inertia=1e-9)  # the test takes rollers to be massless
MOTOR = omniroll.Motor(0.0, 0.02, 1.5, gear_ratio=4.0, rotor_inertia=2e-5)
LOOPS = {  # a gain's scale -> the effects of a run
    "torque": lambda gain: [omniroll.Controller((0, 0, 0), gain, 0.02)],
    "torque, friction": lambda gain: [
        omniroll.Controller((0, 0, 0), gain, 0.02), omniroll.Bearings(wheel_viscous=0.1)
    ],
    "torque, integral": lambda gain: [omniroll.Controller((0, 0, 0), 0.1, 0.02, integral=10 * gain)],
    "voltage": lambda gain: [omniroll.Controller((0, 0, 0), 10 * gain, 0.02, output="voltage"), MOTOR],
    "voltage, one wheel stiffer": lambda gain: [
        omniroll.Controller((0, 0, 0), (10 * gain, 5 * gain, 5 * gain), 0.02, 50.0, output="voltage"), MOTOR
    ],
}  # fmt: skip


def warned(effects) -> bool:
    doubts = EffectSet.checked(effects, VEHICLE).doubts(VEHICLE)
    return any(isinstance(doubt, omniroll.UnstableControllerWarning) for doubt in doubts)


def largest(effects, samples: int) -> np.ndarray:
    """The size of nu in the two halves of a motion from a small error."""
    session = omniroll.Session(VEHICLE, nu=(1e-9, -2e-9, 3e-9), effects=effects)
    sizes = []
    for _ in range(samples):
        session.step(0.02)
        sizes.append(np.abs(session.nu).max())
    return np.array(sizes).reshape(2, -1).max(axis=1)


@pytest.mark.filterwarnings("ignore::omniroll.UnstableControllerWarning")
@pytest.mark.parametrize("name", LOOPS)
def test_errors_grow_where_the_test_says_so(name):
    gains = np.geomspace(0.05, 50, 13)
    said = [warned(LOOPS[name](gain)) for gain in gains]
    assert not said[0] and said[-1] and said == sorted(said)
    below, above = gains[said.index(True) - 1], gains[said.index(True)]
    critical = brentq(lambda gain: warned(LOOPS[name](gain)) - 0.5, below, above, xtol=1e-3 * below)
    before, after = largest(LOOPS[name](0.95 * critical), 60)
    assert after < 0.9 * before
    before, after = largest(LOOPS[name](1.05 * critical), 60)
    assert after > 1.1 * before


def test_the_rotors_inertia_counts():
    """Gains that shake the bare vehicle settle where rotors behind their gears make the wheels heavy."""
    heavy = omniroll.Motor(0.0, 0.02, 1.5, gear_ratio=20.0, rotor_inertia=2e-5)
    loop = omniroll.Controller((0, 0, 0), 1.0, 0.02)
    assert warned([loop]) and not warned([loop, heavy])

"""The linear test of a controller against motions: on both sides of the gain at which errors begin to grow."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import omniroll
from omniroll.effects.effect_set import EffectSet

VEHICLE = omniroll.Vehicle.paper().replace(roller_inertia=1e-9)  # the test takes rollers to be massless
MOTOR = omniroll.Motor(0.0, 0.02, 1.5, gear_ratio=4.0, rotor_inertia=2e-5)
PARTS = {"wheels": 4, "rollers_per_wheel": 10, "platform_radius": 0.266, "mass": 4.15, "wheel_diameter": 0.096}
AXLES = {"wheel_angles": np.radians([90, -90, 90, -90]), "roller_angle": np.radians([45, -45, -45, 45])}
KIT = omniroll.Vehicle.from_parts(**PARTS, **AXLES).replace(  # of the tutorial on mecanum robots
    wheel_places=[(0.168, 0.207), (0.168, -0.207), (-0.168, 0.207), (-0.168, -0.207)]
)
KIT_MOTOR = omniroll.Motor.from_data_sheet(0, rated_voltage=12, stall_torque=2.383, free_speed=32.67)
ICE = omniroll.Contact(law="regularised", friction=1e-12, speed=0.1)
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
    "ice, torque, integral": lambda gain: [omniroll.Controller((0, 0, 0), 0.03 * gain, 0.02, integral=gain), ICE],
    "ice, voltage": lambda gain: [omniroll.Controller((0, 0, 0), gain, 0.02, output="voltage"), MOTOR, ICE],
    "ice, mecanum wheels": lambda gain: [
        omniroll.Controller((0, 0, 0), gain, 0.02, integral=9 * gain, output="voltage"), KIT_MOTOR, ICE
    ],
}  # fmt: skip
VEHICLES = {"ice, mecanum wheels": KIT}


def told(effects, vehicle=VEHICLE) -> list[str]:
    doubts = EffectSet.checked(effects, vehicle).doubts(vehicle)
    return [str(doubt) for doubt in doubts if isinstance(doubt, omniroll.UnstableControllerWarning)]


def largest(effects, vehicle) -> np.ndarray:
    """The size of the wheels' speeds in the two halves of a motion from a small error."""
    session = omniroll.Session(vehicle, nu=(1e-9, -2e-9, 3e-9), effects=effects)
    sizes = []
    for _ in range(60):
        session.step(0.02)
        sizes.append(np.abs(session.wheel_speeds).max())
    return np.array(sizes).reshape(2, -1).max(axis=1)


@pytest.mark.filterwarnings("ignore::omniroll.UnstableControllerWarning")
@pytest.mark.parametrize("name", LOOPS)
def test_errors_grow_where_the_test_says_so(name):
    effects, vehicle = LOOPS[name], VEHICLES.get(name, VEHICLE)
    gains = np.geomspace(0.05, 50, 13)
    said = [bool(told(effects(gain), vehicle)) for gain in gains]
    assert not said[0] and said[-1] and said == sorted(said)
    below, above = gains[said.index(True) - 1], gains[said.index(True)]
    critical = brentq(lambda gain: len(told(effects(gain), vehicle)) - 0.5, below, above, xtol=1e-3 * below)
    before, after = largest(effects(0.95 * critical), vehicle)
    assert after < 0.9 * before
    before, after = largest(effects(1.05 * critical), vehicle)
    assert after > 1.1 * before


def test_the_rotors_inertia_counts():
    """Gains that shake the bare vehicle settle where rotors behind their gears make the wheels heavy."""
    heavy = omniroll.Motor(0.0, 0.02, 1.5, gear_ratio=20.0, rotor_inertia=2e-5)
    loop = omniroll.Controller((0, 0, 0), 1.0, 0.02)
    assert told([loop]) and not told([loop, heavy])


def test_a_loop_that_settles_where_wheels_roll_is_doubted_where_they_may_slip():
    """The tutorial's robot: on slippery ground it goes 0.2 m, and 0.9 m with gains that the warning suggests."""
    slippery = omniroll.Contact(law="coulomb", friction=0.3)

    def effects_of(part, motor=KIT_MOTOR):
        left, gains = (0, 0.5 / 0.266, 0), {"proportional": 0.5 * part, "integral": 5 * part}
        return [motor, omniroll.Controller(left, **gains, sample_time=0.01, output="voltage", limit=12), slippery]

    def way(effects):
        run = omniroll.simulate(KIT, nu=(0, 0, 0), duration=2, effects=effects, accuracy=1e-6, control=False)
        return run.pose[-1, 1]

    assert told(effects_of(1)[:2], KIT) == []
    (said,) = told(effects_of(1), KIT)
    assert said.startswith("where wheels slip") and f"{KIT.wheel_inertia:.3g} kg m^2" in said
    times = float(re.search(r"gains are (\S+) times", said)[1])
    assert told(effects_of(0.99 / times), KIT) == [] != told(effects_of(1.01 / times), KIT)
    heavy = replace(KIT_MOTOR, rotor_inertia=KIT.wheel_inertia)
    assert "rotor_inertia" in said and told(effects_of(1, heavy), KIT) == []
    with pytest.warns(omniroll.UnstableControllerWarning, match="where wheels slip"):
        assert way(effects_of(1)) < 0.3
    assert way(effects_of(0.9 / times)) > 0.85


@pytest.mark.parametrize("scene", sorted(Path("scenes").glob("*.toml")), ids=lambda scene: scene.stem)
def test_shipped_scenes_give_no_alarm(scene):
    assert omniroll.load_scene(scene).doubts() == ()

"""The linear test of a controller against motions: on both sides of the gain at which errors begin to grow."""

import re
from pathlib import Path

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


def largest(effects, samples: int, vehicle=VEHICLE, of: str = "nu") -> np.ndarray:
    """The size of nu, or of the wheels' speeds, in the two halves of a motion from a small error."""
    session = omniroll.Session(vehicle, nu=(1e-9, -2e-9, 3e-9), effects=effects)
    sizes = []
    for _ in range(samples):
        session.step(0.02)
        sizes.append(np.abs(getattr(session, of)).max())
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


# Wheels that slip

PARTS = {"wheels": 4, "rollers_per_wheel": 10, "platform_radius": 0.266, "mass": 4.15, "wheel_diameter": 0.096}
AXLES = {"wheel_angles": np.radians([90, -90, 90, -90]), "roller_angle": np.radians([45, -45, -45, 45])}
KIT = omniroll.Vehicle.from_parts(**PARTS, **AXLES).replace(  # of the tutorial
    wheel_places=[(0.168, 0.207), (0.168, -0.207), (-0.168, 0.207), (-0.168, -0.207)]
)
KIT_MOTOR = omniroll.Motor.from_data_sheet(0, rated_voltage=12, stall_torque=2.383, free_speed=32.67)
FRICTIONLESS = omniroll.Contact(coefficient=0)
HEAVY = VEHICLE.replace(mass=1e6 * VEHICLE.mass, yaw_inertia=1e6 * VEHICLE.yaw_inertia)  # it stands while wheels turn
DAMPED = omniroll.Contact(coefficient=(0.0, 30.0))
ALONE = {  # vehicle, and a gain's scale -> the effects of a run
    "torque": (VEHICLE, lambda gain: [omniroll.Controller((0, 0, 0), gain, 0.02), FRICTIONLESS]),
    "torque, integral": (
        VEHICLE, lambda gain: [omniroll.Controller((0, 0, 0), 0.3 * gain, 0.02, integral=50 * gain), FRICTIONLESS]
    ),
    "voltage": (
        VEHICLE,
        lambda gain: [omniroll.Controller((0, 0, 0), 10 * gain, 0.02, output="voltage"), MOTOR, FRICTIONLESS],
    ),
    "voltage, integral, mecanum wheels": (
        KIT, lambda gain: [
            omniroll.Controller((0, 0, 0), 10 * gain, 0.02, integral=99 * gain, output="voltage"),
            KIT_MOTOR, FRICTIONLESS,
        ],
    ),
    "viscous ground": (HEAVY, lambda gain: [omniroll.Controller((0, 0, 0), gain, 0.02), DAMPED]),
}  # fmt: skip


def told(effects, vehicle) -> list[str]:
    return [str(doubt) for doubt in EffectSet.checked(effects, vehicle).doubts(vehicle)]


def excess(effects, vehicle) -> float:
    """How many times too large gains are by the warning of wheels that slip; 0 where it is silent."""
    found = [re.search(r"where wheels slip.* gains are (\S+) times", text) for text in told(effects, vehicle)]
    return max((float(match[1]) for match in found if match), default=0.0)


@pytest.mark.filterwarnings("ignore::omniroll.UnstableControllerWarning")
@pytest.mark.parametrize("name", ALONE)
def test_errors_of_a_wheel_that_slips_grow_where_the_warning_says_so(name):
    """At the gain that follows from the factor that it says, 5 % to both sides."""
    vehicle, effects_of = ALONE[name]
    scale = 1e3
    critical = scale / excess(effects_of(scale), vehicle)
    assert excess(effects_of(0.99 * critical), vehicle) == 0 < excess(effects_of(1.01 * critical), vehicle)
    before, after = largest(effects_of(0.95 * critical), 60, vehicle, "wheel_speeds")
    assert after < 0.9 * before
    before, after = largest(effects_of(1.05 * critical), 60, vehicle, "wheel_speeds")
    assert after > 1.1 * before


def test_a_loop_that_settles_where_wheels_roll_is_doubted_where_they_may_slip():
    """The tutorial's robot: on slippery ground it goes 0.2 m, and 0.9 m with gains that the warning suggests."""

    def effects_of(part, *ground, rotor_inertia=0.0):
        motor = omniroll.Motor(0, KIT_MOTOR.torque_constant, KIT_MOTOR.resistance, rotor_inertia=rotor_inertia)
        left, gains = (0, 0.5 / 0.266, 0), {"proportional": 0.5 * part, "integral": 5 * part}
        return [motor, omniroll.Controller(left, **gains, sample_time=0.01, output="voltage", limit=12), *ground]

    slippery = omniroll.Contact(law="coulomb", friction=0.3)
    assert told(effects_of(1), KIT) == []
    (said,) = told(effects_of(1, slippery), KIT)
    assert f"{KIT.wheel_inertia:.3g} kg m^2" in said and "rotor_inertia" in said
    times = excess(effects_of(1, slippery), KIT)
    assert told(effects_of(0.99 / times, slippery), KIT) == []
    assert told(effects_of(1, slippery, rotor_inertia=KIT.wheel_inertia), KIT) == []  # a wheel twice as heavy
    with pytest.warns(omniroll.UnstableControllerWarning, match="where wheels slip"):
        shaken = way_to_the_left(effects_of(1, slippery))
    assert shaken < 0.3 < 0.85 < way_to_the_left(effects_of(0.9 / times, slippery))


def way_to_the_left(effects) -> float:
    return omniroll.simulate(KIT, nu=(0, 0, 0), duration=2, effects=effects, accuracy=1e-6, control=False).pose[-1, 1]


@pytest.mark.parametrize("scene", sorted(Path("scenes").glob("*.toml")), ids=lambda scene: scene.stem)
def test_shipped_scenes_give_no_alarm(scene):
    assert omniroll.load_scene(scene).doubts() == ()

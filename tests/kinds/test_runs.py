"""Runs of vehicles with wheels of several kinds: closed forms, energy, what goes with them and what does not."""

import numpy as np
import pytest

import omniroll
from omniroll import InvalidValueError, Motor, Torque, TorqueTable, Vehicle
from omniroll.cli import main
from omniroll.kernels.kernel import kernel
from omniroll.kernels.phases import Carry, kernel_in_phase

MODELS = ("massless", "locked", "free")
PAPER = Vehicle.paper(4, 9)
KINDS = {
    "drive": {},
    "small": {
        "wheel_radius": 0.6 * PAPER.wheel_radius, "rollers_per_wheel": 6, "wheel_inertia": 0.3 * PAPER.wheel_inertia,
        "roller_inertia": 0.5 * PAPER.roller_inertia,
    },
    "track": {"wheel_inertia": 0.1 * PAPER.wheel_inertia, "roller_inertia": 0.0, "driven": False},
}  # fmt: skip
TWO = PAPER.replace(kinds={name: KINDS[name] for name in ("drive", "small")}, wheel_kinds=["drive", "small"] * 2)
TRACKED = PAPER.replace(kinds={name: KINDS[name] for name in ("drive", "track")}, wheel_kinds=["drive"] * 3 + ["track"])
NU = (3.0, -2.0, 2.5)


def run(vehicle, nu=NU, duration=2.0, **options):
    return omniroll.simulate(vehicle, nu=nu, duration=duration, **{"accuracy": 1e-12, "control": False} | options)


def test_straight_driving_turns_each_wheel_by_its_radius_and_passes_rollers_by_its_number():
    vehicle = TWO.replace(wheel_angles=[np.pi / 2] * 4, wheel_places=[[x, y] for x in (0.1, -0.1) for y in (0.1, -0.1)])
    speed, duration = 0.5, 2.0
    found = run(vehicle, (speed / vehicle.platform_radius, 0, 0), duration)
    radii, counts = np.array(vehicle.by_wheel["wheel_radius"]), np.array(vehicle.rollers)
    np.testing.assert_allclose(np.abs(found.kernel.wheel_speeds(found.nu[-1])), speed / radii, rtol=1e-14)
    for wheel, frequency in enumerate(counts * (speed / radii) / (2 * np.pi)):
        times = found.switches.t[found.switches.wheel == wheel]
        expected = (np.arange(1, len(times) + 1) - 0.5) / frequency
        np.testing.assert_allclose(times, expected, rtol=1e-12)
        assert len(times) == int(duration * frequency + 0.5)
    assert found.contact[:, 1].max() == 5 and found.contact[:, 0].max() == 8


def test_a_wheel_without_a_drive_gets_no_torque():
    torque = run(TRACKED, (0, 0, 0), effects=(Torque(0.01),), duration=0.3)
    table = run(TRACKED, (0, 0, 0), effects=(TorqueTable((0, 1), np.full((2, 4), 0.01) * [1, 1, 1, 0]),), duration=0.3)
    np.testing.assert_allclose(torque.pose[-1], table.pose[-1], rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(torque.drives_at(torque.t[-1:])["torque"], [[0.01, 0.01, 0.01, 0]])
    motor = run(TRACKED, (0, 0, 0), effects=(Motor(3.0, torque_constant=0.02, resistance=1.0),), duration=0.3)
    drives = motor.drives_at(motor.t[-1:])
    assert drives["torque"][0, 3] == drives["damping"][0, 3] == 0 and drives["torque"][0, 0] > 0
    for effect in (Torque([0.01] * 4), TorqueTable((0, 1), np.full((2, 4), 0.01))):
        with pytest.raises(InvalidValueError, match="torque = .*must be 0 for wheel 4, which has no drive"):
            run(TRACKED, effects=(effect,))
    bound = kernel(TRACKED, "free", "compiled")
    asked = bound.wheel_torques([0.1, -0.2, 0.3])
    np.testing.assert_allclose(bound.wheel_rows.T @ asked, [0.1, -0.2, 0.3], rtol=1e-12)
    assert asked[3] == 0


def test_odometry_is_by_all_wheels_rates():
    bound = kernel(TWO, "massless", "compiled")
    np.testing.assert_allclose(bound.nu_from_wheels(bound.wheel_speeds(NU)), NU, rtol=1e-12)


def test_rotors_stand_behind_wheels_with_a_drive():
    geared = Motor(1.0, torque_constant=0.02, resistance=1.0, gear_ratio=10.0, rotor_inertia=1e-6).equipped(TRACKED)
    more = np.subtract(geared.by_wheel["wheel_inertia"], TRACKED.by_wheel["wheel_inertia"])
    np.testing.assert_allclose(more, [1e-4, 1e-4, 1e-4, 0], rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize("changes, words", [
    ({"wheel_kinds": ["drive"] * 3}, "wheel_kinds = .*must be 4 names"),
    ({"wheel_kinds": ["drive"] * 4}, "kinds = 'small': is the kind of no wheel"),
    ({"wheel_kinds": ["drive", "big", "small", "small"]}, "wheel_kinds = 'big'"),
    ({"kinds": {"drive": {}, "small": {"rollers_per_wheel": 12}}}, "kinds.small.rollers_per_wheel = 12.*at most"),
    ({"kinds": {"drive": {}, "small": {"wheel_radius": -1}}}, "kinds.small.wheel_radius = -1"),
    ({"kinds": {"drive": {}, "small": {"radius": 1}}}, "radius"),
    ({"kinds": (1, 2)}, r"kinds = \(1, 2\): must be numbers by name"),
    ({"kinds": {"drive": {}, "small": (1,)}}, r"kinds.small = \(1,\): must be numbers by name"),
    (
        {"kinds": {"drive": {}, "small": {"roller_axis_radius": 1.0}}},
        "kinds.small.roller_axis_radius = 1.0.*above the",
    ),
    ({"kinds": {"drive": {}, "small": {"roller_inertia": 1.0}}}, "yaw_inertia = .*too small"),
])  # fmt: skip
def test_bounds(changes, words):
    with pytest.raises(InvalidValueError, match=words):
        TWO.replace(**changes)


SCENE = """
[vehicle]
preset = "paper"
wheels = 4
rollers_per_wheel = 9
wheel_kinds = ["drive", "drive", "drive", "track"]
[vehicle.kinds.drive]
[vehicle.kinds.track]
wheel_radius = "20 mm"
rollers_per_wheel = 6
wheel_inertia = 1e-6
roller_inertia = 0
driven = false
[start]
nu = [1, 0, 0.5]
[run]
duration = 1
step = 0.1
[measurements]
counts_per_turn = 2048
[drive]
torque = 0.001
"""


def test_scenes(tmp_path):
    """A scene runs from the command line, is explained, and its instruments read each wheel by its numbers."""
    (tmp_path / "tracked.toml").write_text(SCENE)
    scene = omniroll.load_scene(tmp_path / "tracked.toml")
    assert scene.vehicle.by_wheel["wheel_radius"][3] == 0.02 and scene.vehicle.rollers == (9, 9, 9, 6)
    found = omniroll.run(scene)
    read = found.measure(np.linspace(0, 1, 11), scene.instruments())
    passed = found.switches.direction[found.switches.wheel == 3].sum()
    assert read["wheel_angle"][-1, 3] == pytest.approx(found.chi[-1, 3] + passed * 2 * np.pi / 6, rel=1e-12)
    assert "accelerometer" not in read
    file = str(tmp_path / "tracked.toml")
    for words in (["run", file, "--output", str(tmp_path / "out")], ["explain", file], ["explain", file, "--json"]):
        assert main(words) == 0
    wrong = SCENE.replace("wheel_radius", "wheel_radios").replace("driven = false", "driven = 0")
    (tmp_path / "wrong.toml").write_text(wrong)
    with pytest.raises(omniroll.SceneError, match=r"(?s)9: \[vehicle.kinds.track\] wheel_radios.*mean wheel_radius"):
        omniroll.load_scene(tmp_path / "wrong.toml")


def test_one_row_on_a_vehicle_with_two():
    """All wheels of a kind with one row: the vehicle with one; a kind that has its rows farther out: its own lever."""
    two = PAPER.replace(
        rows=2, row_offset=0.004, rollers_per_wheel=10, roller_axis_radius=0.9 * PAPER.roller_axis_radius
    )
    one = two.replace(rows=1, row_offset=0.0)
    flat = two.replace(kinds={"flat": {"rows": 1}}, wheel_kinds=["flat"] * 4)
    plain, own = (run(vehicle, duration=0.5) for vehicle in (one, flat))
    np.testing.assert_allclose(own.pose[-1], plain.pose[-1], rtol=1e-11)
    mixed = two.replace(kinds={"flat": {"rows": 1}, "wide": {"row_offset": 0.006}}, wheel_kinds=["flat", "wide"] * 2)
    found = run(mixed, accuracy=1e-13, duration=0.5)
    assert found.stats["phase_energy_drift"] < 1e-13 and found.switches.energy_jump.max() < 1e-14 * found.energy[0]
    bound, yaw = found.kernel, found.nu[0, 2] / mixed.yaw_scale
    for contact, side in ((0, 1), (1, -1)):
        carried = kernel_in_phase(bound, Carry(np.full(4, contact), np.zeros(4, int)))
        beside = carried.wheel_speeds(found.nu[0]) - bound.wheel_speeds(found.nu[0])
        expected = -side * yaw * np.array([0, 0.006, 0, 0.006]) / mixed.wheel_radius
        np.testing.assert_allclose(beside, expected, rtol=1e-11, atol=1e-14)

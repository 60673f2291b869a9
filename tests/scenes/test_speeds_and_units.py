"""Speeds as twists and wheel rates, and numbers with units, in scenes: the same scene as with nu, in SI."""

import math

import numpy as np
import pytest

import omniroll
from omniroll.conventions.twists import nu_of_twist, nu_of_wheel_rates, wheel_rows
from omniroll.scenes.lints import lints

HEAD = '[vehicle]\npreset = "paper"\n[run]\nduration = 0.5\n'
FOUR = HEAD.replace('"paper"', '"paper"\nwheels = 4')
CONTROLLER = "[start]\nnu = [0, 0, 0]\n[controller]\nproportional = 0.2\nsample_time = 0.01\n"


@pytest.fixture
def scene(tmp_path):
    def loading(text):
        (tmp_path / "scene.toml").write_text(text)
        return omniroll.load_scene(tmp_path / "scene.toml")

    return loading


def test_a_twist_in_place_of_nu(scene):
    found = scene(HEAD + "[start]\ntwist = [0.3, -0.1, 0.5]\n")
    assert found.options["nu"] == nu_of_twist(found.vehicle, [0.3, -0.1, 0.5]).tolist() and "twist" not in found.tables
    degrees = scene(HEAD + '[start]\ntwist = ["300 mm/s", -0.1, "28.6478897565411 deg/s"]\n')
    np.testing.assert_allclose(degrees.options["nu"], found.options["nu"], rtol=1e-14)


def test_twists_and_wheel_rates_in_place_of_a_target(scene):
    twists = [[0.1, 0.0, 0.2], [0.0, 0.2, 0.0]]
    times = "times = [0, 0.2]\n"
    found = scene(HEAD + CONTROLLER + f"{times}twist = {twists}\n")
    nu = nu_of_twist(found.vehicle, twists)
    (controller,) = found.options["effects"]
    assert controller.target == tuple(map(tuple, nu.tolist()))
    rates = (nu @ wheel_rows(found.vehicle).T).tolist()
    again = scene(HEAD + CONTROLLER + f"{times}wheel_rate = {rates}\n")
    np.testing.assert_allclose(again.options["effects"][0].target, nu, rtol=1e-13, atol=1e-15)
    assert again.said == ()
    (wheel,) = scene(HEAD + CONTROLLER + 'wheel_rate = ["30 rpm", 0, 0]\n').options["effects"]
    assert wheel_rows(found.vehicle) @ wheel.target == pytest.approx([math.pi, 0, 0], abs=1e-14)


def test_a_log_of_wheel_rates_is_replayed(scene, tmp_path):
    rates = np.array([[1.0, 2.0, -1.0], [0.5, 0.0, 3.0]])
    lines = ["t,wheel_rate_1,wheel_rate_2,wheel_rate_3", *(f"{k},{a},{b},{c}" for k, (a, b, c) in enumerate(rates))]
    (tmp_path / "log.csv").write_text("\n".join(lines))
    found = scene(HEAD + CONTROLLER + 'log = "log.csv"\n')
    np.testing.assert_allclose(found.options["effects"][0].target, nu_of_wheel_rates(found.vehicle, rates), rtol=1e-15)
    assert found.options["effects"][0].interpolation == "hold"


def test_rates_of_no_motion_are_said_and_refused_where_wheels_may_slip(scene):
    text = CONTROLLER + "wheel_rate = [1, 1, 1, 2]\n"
    found = scene(FOUR + text)
    assert any("0.25 rad/s off those of any motion" in str(lint) for lint in lints(found))
    with pytest.raises(omniroll.SceneError, match="must be rates of a motion of rolling wheels"):
        scene(FOUR + text + "[contact]\nlaw = 'viscous'\nfriction = 1.0\n")


def test_angles_with_units(scene):
    text = HEAD.replace('"paper"', '"paper"\nwheel_angles = ["30 deg", "150 deg", "4.71238898038469 rad"]')
    found = scene(text + '[start]\nnu = [0, 0, 0]\npose = [0.1, "-50 mm", "90 deg"]\n[slope]\nangle = "10 deg"\n')
    assert found.vehicle.wheel_angles == pytest.approx(np.radians([30, 150, 270]), rel=1e-14)
    assert found.options["pose"] == pytest.approx([0.1, -0.05, math.pi / 2], rel=1e-15)
    assert found.options["effects"][0].angle == pytest.approx(math.radians(10), rel=1e-15)


@pytest.mark.parametrize("text, words", [
    ("[start]\ntwist = [0, 0, 0]\nnu = [0, 0, 0]\n", "cannot stand beside nu"),
    ("[start]\n", "nu: is missing"),
    ('[start]\nnu = [0, 0, 0]\npose = [0, 0, "90 furlongs"]\n', "must be in rad, or in a unit of deg"),
    ('[start]\nnu = [0, 0, 0]\npose = [0, 0, "north"]\n', "must be 3 numbers|must be"),
    (CONTROLLER + "wheel_rate = [1, 2]\n", "wheel_rate"),
    ("[start]\nnu = [0, 0, 0]\npose = [0, 0, 90]\n[reactions]\nhight = 1\n", "(?s)looks like degrees.*hight"),
    ("[start]\nnu = [0, 0, 0]\nroller_angle = 0.8\n", "roller_angle and handedness in .vehicle"),
    ("[start]\nnu = [0, 0, 0]\nrows = 2\n", "rows = 2 and row_offset in .vehicle"),
    ('[start]\nnu = [0, 0, 0]\nwheel_type = "Mecanum"\n', "roller_angle and handedness in .vehicle"),
    ('[start]\nnu = [0, 0, 0]\n[wheels]\nkind = "two rows"\n', "rows = 2 and row_offset in .vehicle"),
    ('[start]\nnu = [0, 0, 0]\n[rollers]\nmodel = "mecanum"\n', "roller_angle and handedness in .vehicle"),
    (CONTROLLER + "wheel_rate = [1, 2, 3]\ntwist = [1, 2, 3]\n", "cannot stand beside"),
])  # fmt: skip
def test_what_is_refused(scene, text, words):
    with pytest.raises(omniroll.SceneError, match=words):
        scene(HEAD + text)

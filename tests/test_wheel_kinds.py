"""Vehicles with rollers at an angle or in two rows: their numbers in Python, in scenes and in files, what is refused,
and that the paper's wheels are as before."""

import json
import math

import numpy as np
import pytest

import omniroll
from omniroll import InvalidValueError, Vehicle
from omniroll.kernels.kernel import kernel
from omniroll.scenes.lints_of_wheels import lever_of_yaw, of_wheels

PAPER = Vehicle.paper(4, 10)
HANDS = (1, -1, -1, 1)
MECANUM = PAPER.replace(roller_angle=[hand * math.pi / 4 for hand in HANDS])
ROWS = PAPER.replace(rows=2, row_offset=-0.004)
SCENE = """
[vehicle]
preset = "paper"
wheels = 4
rollers_per_wheel = 10
{}
[start]
nu = [0, 0, 0]
[run]
duration = 1
"""


@pytest.fixture
def scene(tmp_path):
    def loading(keys):
        (tmp_path / "scene.toml").write_text(SCENE.format(keys))
        return omniroll.load_scene(tmp_path / "scene.toml")

    return loading


def test_wheels_of_the_paper_say_nothing_of_their_kind():
    assert not {"roller_angle", "rows", "row_offset"} & set(PAPER.as_dict())
    assert "row" not in repr(PAPER).replace("arrow", "") and "roller_angle" not in repr(PAPER)
    assert PAPER.replace(roller_angle=0, rows=1) == PAPER and PAPER.has_wheels_of_the_paper
    assert PAPER.replace(roller_angle=0.5).roller_angle == (0.5,) * 4
    assert PAPER.with_wheels_of_the_paper() is PAPER and MECANUM.with_wheels_of_the_paper() == PAPER


@pytest.mark.parametrize("vehicle", [MECANUM, ROWS])
def test_all_numbers_survive_text(vehicle):
    again = Vehicle(**json.loads(json.dumps(vehicle.as_dict())))
    assert again == vehicle and eval(repr(vehicle), {"Vehicle": Vehicle}) == vehicle and vehicle != PAPER
    assert not vehicle.has_wheels_of_the_paper and vehicle.replace(mass=9.0).as_dict() == vehicle.as_dict() | {
        "mass": 9.0
    }


@pytest.mark.parametrize("changes, words", [
    ({"roller_angle": math.pi / 2}, "roller_angle = .*must lie between -1.5708 and 1.5708"),
    ({"rows": 3, "row_offset": 0.01}, "rows = 3.*at most 2"),
    ({"rows": 2}, "row_offset = 0.0.*must be given with rows = 2"),
    ({"row_offset": 0.01}, "row_offset = 0.01.*must be 0 with one row"),
    ({"rows": 2, "row_offset": 0.01, "rollers_per_wheel": 9}, "rollers_per_wheel = 9.*even"),
])  # fmt: skip
def test_bounds(changes, words):
    with pytest.raises(InvalidValueError, match=words):
        PAPER.replace(**changes)


@pytest.mark.parametrize("model", ["massless", "locked", "free"])
def test_no_motion_is_made_up(model):
    both = ROWS.replace(roller_angle=MECANUM.roller_angle)
    for effects in ((), ("slope",)):
        with pytest.raises(InvalidValueError, match="roller_angle = .*no equations of motion with rows = 2"):
            kernel(both, model, "python", effects=effects, constants=())
    for call in (omniroll.simulate, omniroll.Session):
        arguments = {"duration": 1.0} if call is omniroll.simulate else {}
        with pytest.raises(InvalidValueError, match="roller_angle = .*no equations of motion with rows = 2"):
            call(both, nu=(0.1, 0, 0), roller_model=model, **arguments)


def test_scenes(scene):
    mecanum = scene('roller_angle = "45 deg"\nhandedness = [1, -1, -1, 1]').vehicle
    assert mecanum == MECANUM and scene(f"roller_angle = {list(mecanum.roller_angle)}").vehicle == mecanum
    assert scene("rows = 2\nrow_offset = '-4 mm'").vehicle == ROWS
    with pytest.raises(InvalidValueError, match="no equations of motion with rows = 2"):
        omniroll.run(scene("rows = 2\nrow_offset = 0.004\nroller_angle = 0.7"))


@pytest.mark.parametrize("keys, words", [
    (
        "roller_angle = 45",
        'must be a number or 4 numbers, > -1.5708, < 1.5708, in rad; degrees are written "45 deg"',
    ),
    ("roller_angle = 0.7\nhandedness = [1, -1]", "handedness = .*must be 4 numbers"),
    ("roller_angle = 0.7\nhandedness = [1, -1, 0.5, 1]", "must be 1 or -1 for each wheel"),
    ("roller_angle = -0.7\nhandedness = [1, -1, -1, 1]", "needs a roller_angle above 0"),
    ("handedness = [1, -1, -1, 1]", "needs a roller_angle above 0"),
    ("roller_angle = [0.7, 0.7, 0.7, 0.7]\nhandedness = [1, 1, 1, 1]", "cannot stand beside roller_angle by wheel"),
    ("rows = 2", "row_offset.*must be given with rows = 2"),
])  # fmt: skip
def test_what_scenes_refuse(scene, keys, words):
    with pytest.raises((omniroll.SceneError, InvalidValueError), match=words):
        scene(keys)


# Numbers that follow, beside ones that are found by another way

ANGLE = math.radians(45)


def frame(beta, psi, r):
    """Place and axis of a roller at the angle beta of its disk, whose axle is x; z is up, the ground below."""
    inward = np.array([0, -math.sin(beta), math.cos(beta)])
    rim = np.array([0, math.cos(beta), math.sin(beta)])
    return -r * inward, math.cos(psi) * rim + math.sin(psi) * np.array([1.0, 0, 0])


@pytest.mark.parametrize("psi, d", [(0.6, 0.0), (-0.6, 0.0), (0.0, 0.011), (0.3, 0.02)])
def test_inertias_of_parts_are_those_of_the_bodies(psi, d):
    """Sums over point by point tensors of a wheel with an axle along x at the place (arm, 0)."""
    rollers, arm, r, m, axial, across = 6, 0.2, 0.04, 0.03, 4e-6, 9e-6
    hub = {"hub_mass": 0.3, "hub_axial_inertia": 3e-4, "hub_transverse_inertia": 2e-4}
    sizes = {"platform_mass": 3.0, "platform_inertia": 0.05, **hub, "roller_mass": m, "roller_axial_inertia": axial}
    kind = {"roller_angle": psi} | ({"rows": 2, "row_offset": d} if d else {})
    vehicle = Vehicle.from_parts(
        wheels=3, rollers_per_wheel=rollers, platform_radius=arm, wheel_radius=0.06, roller_axis_radius=r,
        roller_transverse_inertia=across, **sizes, **kind,
    )  # fmt: skip
    about_axle, about_yaw = 3e-4, 0.3 * arm**2 + 2e-4
    for j in range(rollers):
        place, axis = frame(2 * math.pi * j / rollers + 0.1, psi, r)
        tensor = across * (np.eye(3) - np.outer(axis, axis)) + axial * np.outer(axis, axis)
        place = place + [d * (-1) ** j, 0, 0]
        about_axle += tensor[0, 0] + m * (place[1] ** 2 + place[2] ** 2)
        place = place + [arm, 0, 0]
        about_yaw += tensor[2, 2] + m * (place[0] ** 2 + place[1] ** 2)
    assert vehicle.wheel_inertia == pytest.approx(about_axle, rel=1e-14)
    assert vehicle.yaw_inertia == pytest.approx(0.05 + 3 * about_yaw, rel=1e-14)
    assert vehicle.rows == (2 if d else 1) and vehicle.roller_angle == (psi,) * 3


def test_a_mecanum_wheel_from_its_diameter_and_rollers():
    """r by the rule that rollers in their middles fill half of the way between neighbours' axes; lengths without a
    gap."""
    sheet = {"wheels": 4, "rollers_per_wheel": 16, "mass": 12.0, "platform_radius": 0.28, "wheel_diameter": 0.1525}
    vehicle = Vehicle.from_parts(**sheet, wheel_width=0.045, roller_angle=[s * ANGLE for s in HANDS])
    k = math.sin(math.pi / 16) * math.sin(ANGLE) / math.sqrt(1 - (math.cos(ANGLE) * math.sin(math.pi / 16)) ** 2)
    assert vehicle.roller_axis_radius == pytest.approx(0.07625 / (1 + k), rel=1e-14)
    origins = {origin.name: origin for origin in vehicle.origins}
    assert [origins[name].kind for name in ("roller_axis_radius", "roller_length", "hub_width")] == [
        "assumed", "assumed", "derived",
    ]  # fmt: skip
    least = distance_along(vehicle.roller_axis_radius, 0.07625, ANGLE, math.pi / 16)
    assert origins["roller_length"].value == pytest.approx(2 * least, rel=1e-12)
    whole = {"yaw_inertia": 0.6, "wheel_inertia": 2.7e-3, "roller_inertia": 1.5e-6, "wheel_radius": 0.07625}
    counts = {name: sheet[name] for name in ("wheels", "rollers_per_wheel", "mass", "platform_radius")}
    assert Vehicle(**counts, **whole, roller_angle=ANGLE).roller_axis_radius == vehicle.roller_axis_radius
    with pytest.raises(InvalidValueError, match="roller_angle.*must have one size"):
        Vehicle.from_parts(**sheet, roller_angle=[0.7, 0.7, 0.7, 0.8])


def distance_along(r, radius, psi, chi):
    """How far along its axis a roller's contact is: the ground's normal through the contact meets the axis."""
    place, axis = frame(chi, psi, r)
    ground = np.array([0, 0, -radius])
    # The contact is below the wheel's centre, at some x; it is where the normal of the ground meets the axis.
    s = -place[1] / axis[1]  # the axis above the line below the axle
    point = place + s * axis
    contact = np.array([point[0], 0, ground[2]])
    return abs((contact - place) @ axis)


def test_the_inertia_of_rollers_at_an_angle_is_part_of_the_wheels():
    least = 10 * PAPER.roller_inertia / 2
    with pytest.raises(InvalidValueError, match="wheel_inertia = .*must be above .*sin"):
        MECANUM.replace(wheel_inertia=0.99 * least)
    assert MECANUM.replace(wheel_inertia=1.01 * least) and PAPER.replace(wheel_inertia=0.99 * least)


# What looks wrong

YOUBOT = """
wheels = 4
rollers_per_wheel = 6
platform_radius = 0.2788
wheel_radius = 0.05
roller_axis_radius = {r}
mass = 30
yaw_inertia = 4.42
wheel_inertia = 5.87e-3
roller_inertia = 1e-6
roller_angle = "45 deg"
handedness = {hands}
wheel_angles = ["90 deg", "-90 deg", "90 deg", "-90 deg"]
[layout]
wheel_places = [[0.235, 0.15], [0.235, -0.15], [-0.235, 0.15], [-0.235, -0.15]]
"""


def said_of(tmp_path, r=0.0355, hands=HANDS):
    text = "[vehicle]" + YOUBOT.format(r=r, hands=list(hands)) + "[start]\nnu = [0, 0, 0]\n[run]\nduration = 1\n"
    (tmp_path / "youbot.toml").write_text(text)
    found = omniroll.load_scene(tmp_path / "youbot.toml")
    return found, list(of_wheels(found.tables["vehicle"], found.vehicle))


def test_what_looks_wrong_with_the_youbots_wheels(tmp_path):
    """Nothing as it is, an X whose rollers just fit; an O; and rollers that reach into each other."""
    found, said = said_of(tmp_path)
    assert said == [] and lever_of_yaw(found.vehicle) == pytest.approx(0.385, rel=1e-14)
    _, (lint,) = said_of(tmp_path, hands=[-hand for hand in HANDS])
    assert "0.085 m, with all signs changed it were 0.385 m" in str(lint) and "make an O" in str(lint)
    _, (lint,) = said_of(tmp_path, r=0.033)
    assert lint.key == "roller_axis_radius" and "mm thick" in lint.text

"""Vehicles with rollers at an angle or in two rows: their numbers in Python, in scenes and in files, what is refused,
and that the paper's wheels are as before."""

import json
import math

import pytest

import omniroll
from omniroll import InvalidValueError, Vehicle
from omniroll.kernels.kernel import kernel

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
    assert PAPER.with_wheels_of_the_paper() is PAPER and MECANUM.with_wheels_of_the_paper() == PAPER


@pytest.mark.parametrize("vehicle", [MECANUM, ROWS])
def test_all_numbers_survive_text(vehicle):
    again = Vehicle(**json.loads(json.dumps(vehicle.as_dict())))
    assert again == vehicle and eval(repr(vehicle), {"Vehicle": Vehicle}) == vehicle and vehicle != PAPER
    assert not vehicle.has_wheels_of_the_paper and vehicle.replace(mass=9.0).as_dict() == vehicle.as_dict() | {
        "mass": 9.0
    }


def test_one_angle_is_for_all_wheels():
    assert PAPER.replace(roller_angle=0.5).roller_angle == (0.5,) * 4


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"roller_angle": math.pi / 2}, "roller_angle = .*must lie between -1.5708 and 1.5708"),
        ({"roller_angle": [0.7, 0.7]}, "roller_angle = .*shape"),
        ({"roller_angle": math.nan}, "roller_angle = nan"),
        ({"rows": 3, "row_offset": 0.01}, "rows = 3.*at most 2"),
        ({"rows": 2}, "row_offset = 0.0.*must be given with rows = 2"),
        ({"row_offset": 0.01}, "row_offset = 0.01.*must be 0 with one row"),
        ({"rows": 2, "row_offset": 1e200}, "row_offset = 1e.200"),
        ({"rows": 2, "row_offset": 0.01, "rollers_per_wheel": 9}, "rollers_per_wheel = 9.*even"),
    ],
)
def test_bounds(changes, words):
    with pytest.raises(InvalidValueError, match=words):
        PAPER.replace(**changes)


@pytest.mark.parametrize("vehicle, name", [(MECANUM, "roller_angle"), (ROWS, "rows")])
@pytest.mark.parametrize("model", ["massless", "locked", "free"])
def test_no_motion_is_made_up(vehicle, name, model):
    for effects in ((), ("slope",)):
        with pytest.raises(InvalidValueError, match=f"{name} = .*no equations of motion yet"):
            kernel(vehicle, model, "python", effects=effects, constants=())
    for call in (omniroll.simulate, omniroll.Session):
        arguments = {"duration": 1.0} if call is omniroll.simulate else {}
        with pytest.raises(InvalidValueError, match=f"{name} = .*no equations of motion yet"):
            call(vehicle, nu=(0.1, 0, 0), roller_model=model, **arguments)


def test_scenes(scene):
    mecanum = scene('roller_angle = "45 deg"\nhandedness = [1, -1, -1, 1]').vehicle
    assert mecanum == MECANUM and scene(f"roller_angle = {list(mecanum.roller_angle)}").vehicle == mecanum
    assert scene("rows = 2\nrow_offset = '-4 mm'").vehicle == ROWS
    with pytest.raises(InvalidValueError, match="no equations of motion yet"):
        omniroll.run(scene("rows = 2\nrow_offset = 0.004"))


@pytest.mark.parametrize(
    "keys, words",
    [
        ("roller_angle = 45", "must be a number or 4 numbers, > -1.5708, < 1.5708, in rad"),
        ("roller_angle = 0.7\nhandedness = [1, -1]", "handedness = .*must be 4 numbers"),
        ("roller_angle = 0.7\nhandedness = [1, -1, 0.5, 1]", "must be 1 or -1 for each wheel"),
        ("roller_angle = -0.7\nhandedness = [1, -1, -1, 1]", "needs a roller_angle above 0"),
        ("handedness = [1, -1, -1, 1]", "needs a roller_angle above 0"),
        ("roller_angle = [0.7, 0.7, 0.7, 0.7]\nhandedness = [1, 1, 1, 1]", "cannot stand beside roller_angle by wheel"),
        ("rows = 2", "row_offset.*must be given with rows = 2"),
    ],
)
def test_what_scenes_refuse(scene, keys, words):
    with pytest.raises((omniroll.SceneError, InvalidValueError), match=words):
        scene(keys)

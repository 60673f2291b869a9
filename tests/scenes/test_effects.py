"""Effects of a scene: which tables make which, what is refused, and what runs."""

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import cli, generated_data
from omniroll.engine.simulate import checked_task
from omniroll.errors import RollingWarning
from omniroll.scenes import SceneError, load_scene
from omniroll.scenes.explanation import called_by, can_be_on, effects_on, events_of
from omniroll.vocabulary import LAWS, ROLLER_MODELS

pytestmark = [pytest.mark.long, pytest.mark.usefixtures("quick_timing")]

GOOD = "[vehicle]\npreset = 'paper'\n[start]\nnu = [1, 0, 1]\n[run]\nduration = 1\n"
MOTOR = "[drive]\nvoltage = 2.0\ntorque_constant = 0.01\nresistance = 2.0\n"


def scene_of(folder: Path, more: str) -> omniroll.Scene:
    path = folder / "scene.toml"
    path.write_text(GOOD + more)
    return load_scene(path)


@pytest.mark.parametrize(
    "more, effects",
    [
        ("", None),
        ("[drive]\ntorque = [0.1, 0, -0.1]", (omniroll.Torque((0.1, 0, -0.1)),)),
        ("[drive]\ntorque = [[0.1, 0, 0], [0, 0, 0]]\ntimes = [0, 1]\ninterpolation = 'hold'",
         (omniroll.TorqueTable((0, 1), ((0.1, 0, 0), (0, 0, 0)), "hold"),)),
        (MOTOR + "gear_ratio = 20.0\nback_emf = 0.02\ncurrent_limit = 1.0\nrotor_inertia = 1e-7",
         (omniroll.Motor(2.0, 0.01, 2.0, 20.0, 0.02, 1.0, 1e-7),)),
        ("[controller]\ntarget = [1, 0, 0]\nproportional = 0.1\nintegral = 0.2\nsample_time = 0.1\nlimit = 1.0",
         (omniroll.Controller((1, 0, 0), 0.1, 0.1, 0.2, limit=1.0),)),
        (MOTOR + "[controller]\ntarget = [[1, 0, 0], [0, 0, 0]]\ntimes = [0, 1]\nproportional = 0.1\n"
         "sample_time = 0.1\noutput = 'voltage'", (omniroll.Motor(2.0, 0.01, 2.0),
          omniroll.Controller(((1, 0, 0), (0, 0, 0)), 0.1, 0.1, output="voltage", times=(0, 1)))),
        ("[bearings]\nwheel_viscous = [1e-4, 2e-4, 0]\nroller_coulomb = 1e-5\nroller_speed = 0.1",
         (omniroll.Bearings(wheel_viscous=(1e-4, 2e-4, 0), roller_coulomb=1e-5, roller_speed=0.1),)),
        ("[slope]\nangle = 0.1\ndirection = 1\ngravity = 1.62", (omniroll.Slope(0.1, 1, 1.62),)),
    ],
)  # fmt: skip
def test_tables_make_effects(more, effects, tmp_path):
    assert scene_of(tmp_path, more).options.get("effects") == effects


def test_a_layout_makes_another_vehicle(tmp_path):
    places = [[0.1, 0.1], [-0.1, 0.1], [0.0, -0.15]]
    more = f"[layout]\nwheel_places = {places}\nwheel_angles = [0.5, 2.5, 4.7]\ncenter_of_mass = [0.01, 0]\n"
    assert scene_of(tmp_path, more).vehicle == omniroll.Vehicle.paper().replace(
        wheel_places=places, wheel_angles=(0.5, 2.5, 4.7), center_of_mass=(0.01, 0)
    )


def lines_of(folder: Path, more: str) -> list[str]:
    with pytest.raises(SceneError) as raised:
        scene_of(folder, more)
    return [str(problem) for problem in raised.value.problems]


@pytest.mark.parametrize(
    "more, said",
    [
        ("[drive]\n", ["[drive]: needs torque or voltage"]),
        ("[drive]\ntorque = 'x'\n",
         ["[drive] torque = 'x': must be a number or 3 numbers or K rows of 3 numbers, in N m"]),
        ("[drive]\ntorque = 1\nvoltage = 1\nresistance = 1\n", ["[drive] voltage = 1: cannot stand beside torque",
                                                               "[drive] resistance = 1: cannot stand beside torque"]),
        ("[drive]\nvoltage = 1\n", ["[drive] torque_constant: is missing; a motor's voltage needs it",
                                    "[drive] resistance: is missing; a motor's voltage needs it"]),
        ("[drive]\ntorque = 1\ninterpolation = 'hold'\n", ["[drive] interpolation = 'hold': needs times"]),
        ("[bearings]\nwheel_viscous = 1\nwheel_speed = 1\n",
         ["[bearings] wheel_speed = 1.0: must not be given without wheel_coulomb"]),
        ("[bearings]\nwheel_coulomb = 2\nwheel_break_away = [3, 2, 1]\n",
         ["[bearings] wheel_break_away = (3.0, 2.0, 1.0): must be at least wheel_coulomb, 2.0"]),
        ("[bearings]\n", ["[bearings] wheel_viscous: Bearings needs at least one coefficient"]),
        ("[slope]\nangle = 2\n[bearings]\nwheel_viscous = -1\n",
         ["[slope] angle = 2: must be a number, >= 0, < 1.5708, in rad",
          "[bearings] wheel_viscous = -1: must be a number or 3 numbers, >= 0, in N m s"]),
        ("[controller]\noutput = 'voltage'\ntarget = [0, 0, 0]\nproportional = 1\nsample_time = 1\n",
         ["[controller] output = 'voltage': needs a Motor among the effects"]),
        ("[layout]\nwheel_places = [[0, 1]]\n",
         ["[layout] wheel_places = [[0, 1]]: must be 3 rows of 2 numbers, in m"]),
        ("[reactions]\nfriction = 0\n", ["[reactions] height: is missing; must be a number, > 0, in m",
                                         "[reactions] friction = 0: must be a number, > 0"]),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_by_table_and_key(more, said, tmp_path):
    assert lines_of(tmp_path, more) == said


def test_a_rotor_counts_once_and_has_one_gear(tmp_path):
    """In [vehicle] parts or in [drive], not in both; the two gear ratios may not contradict each other."""
    parts = Path("scenes/robot-soccer-kit.toml").read_text().split("[start]")[0].split("[drive]")[0]
    start = "[start]\nnu = [1, 0, 0]\n[run]\nduration = 0.1\n"
    motor = "[drive]\nvoltage = 1\ntorque_constant = 0.02\nresistance = 1\n"

    def refused(vehicle: str, drive: str) -> list[str]:
        path = tmp_path / "scene.toml"
        path.write_text(parts + vehicle + start + motor + drive)
        try:
            load_scene(path)
        except SceneError as error:
            return [problem.key for problem in error.problems]
        return []

    rotor = "rotor_mass = 0.01\nrotor_axial_inertia = 1e-7\nrotor_transverse_inertia = 1e-7\ngear_ratio = 20\n"
    assert refused("", "rotor_inertia = 1e-7\ngear_ratio = 20\n") == []
    assert refused(rotor, "gear_ratio = 20\n") == []
    assert refused(rotor, "gear_ratio = 20\nrotor_inertia = 1e-7\n") == ["rotor_inertia"]
    assert refused(rotor, "gear_ratio = -20\n") == ["gear_ratio"]
    assert refused(rotor, "") == ["gear_ratio"]


@pytest.mark.parametrize(
    "more, table, words",
    [
        ("[bearings]\nwheel_coulomb = 0.01\n", "bearings", "give Bearings a wheel_speed"),
        ("[reactions]\nheight = 0.1\n", "reactions", "take rows = 1"),
        ("[contact]\nlaw = 'coulomb'\nfriction = 0.4\n[springs]\nheight = 0.1\n", "springs", "leave them out"),
    ],
)  # fmt: skip
def test_what_two_rows_refuse_is_said_of_its_table(more, table, words, tmp_path):
    path = tmp_path / "scene.toml"
    wheels = "[vehicle]\npreset = 'paper'\nrollers_per_wheel = 10\nrows = 2\nrow_offset = 0.01\n"
    path.write_text(wheels + "[start]\nnu = [1, 0, 0]\n[run]\nduration = 0.1\n" + more)
    with pytest.raises(SceneError) as refused:
        load_scene(path)
    (problem,) = refused.value.problems
    assert problem.table == table and problem.key is None and problem.line is not None
    assert "does not go with two rows of rollers" in problem.expected and words in problem.expected


@pytest.mark.parametrize("more, words", [
    ("", ["joints"]),
    ("[drive]\ntimes = [0, 1]\ntorque = [[0, 0, 0], [1, 0, 0]]\n", ["joints", "knots of the torques, 2"]),
    (MOTOR + "current_limit = 0.5\n", ["joints", "0.5 A"]),
    (MOTOR.replace("2.0", "[[1, 0, 0]]", 1) + "times = [0.5]\n", ["joints", "knots of the voltages, 1"]),
])  # fmt: skip
def test_events_of_a_scene(more, words, tmp_path):
    scene = scene_of(tmp_path, more)
    task = checked_task(scene.vehicle, **scene.options)
    events = events_of(task)
    assert len(events) == len(words)
    assert all(word in event for word, event in zip(words, events, strict=True))
    (free,) = (effect for effect in generated_data.load("effects")["effects"] if effect["name"] == "free")
    assert "free" in effects_on(scene, task) and called_by(scene, free) == []


def test_effects_that_no_scene_can_call_for_are_not_offered():
    """Neither what others bring along, nor what only has functions."""
    offered = {effect["name"] for effect in generated_data.load("effects")["effects"] if can_be_on(effect)}
    of_vehicles = {"layout", "kinds", "rows", "mecanum", "profile", "arcs"}
    assert {*ROLLER_MODELS, *LAWS, *of_vehicles, "reactions", "contact_coulomb", "contact_springs"} <= offered
    assert offered.isdisjoint({"joints", "moving_rows", "contact_loads", "derivatives"})


UNSTABLE = "[controller]\ntarget = [1, 0, 0]\nproportional = 0.02\nsample_time = 0.5\n"


@pytest.mark.filterwarnings("error")
def test_a_controller_that_is_not_stable_is_said_once_and_without_python_lines(tmp_path, capsys):
    """Reading the scene warns of nothing: who runs it is told, who has it explained finds a lint."""
    scene = scene_of(tmp_path, UNSTABLE)
    path = str(tmp_path / "scene.toml")
    assert len(scene.doubts()) == 1
    assert cli.main(["run", path, "--output", str(tmp_path / "out")]) == 0
    (said,) = capsys.readouterr().err.splitlines()
    place = "warning: [controller] sample_time: "
    assert said.startswith(place + "the controller's errors grow from sample to sample")
    assert json.loads((tmp_path / "out/summary.json").read_text())["warnings"] == [said.removeprefix(place)]
    assert cli.main(["explain", path, "--json"]) == 0
    assert [lint["key"] for lint in json.loads(capsys.readouterr().out)["lints"]] == ["sample_time"]


SLIPPERY = "[slope]\nangle = 0.3\n[reactions]\nheight = 0.1\nfriction = 0.05\n"


def test_reactions_are_kept_and_doubts_are_said(tmp_path, capsys):
    """Numbers as omniroll.reactions gives them; a vehicle on a slope of 0.3 rad does not hold with friction 0.05."""
    scene = scene_of(tmp_path, SLIPPERY)
    assert cli.main(["run", str(tmp_path / "scene.toml"), "--output", str(tmp_path / "out"), "--json"]) == 0
    captured = capsys.readouterr()
    said = json.loads(captured.out)["reactions"]
    with pytest.warns(RollingWarning):
        found = omniroll.reactions(omniroll.run(scene), height=0.1, friction=0.05)
    rows = np.genfromtxt(tmp_path / "out/reactions.csv", delimiter=",", names=True)
    assert rows["load_2"].tolist() == found.load[:, 1].tolist()
    assert rows["along_rolling_3"].tolist() == found.contact_force[:, 2, 1].tolist()
    assert said["least_slip_margin"] == found.slip_margin.min() < 0 and len(said["doubts"]) == len(found.doubts) > 0
    assert "could not have held: t = " in captured.err and "wheel" in captured.err


def test_reactions_that_cannot_be_are_refused_with_the_scene(tmp_path):
    """Two wheels cannot stand; off its wheels' centroid a vehicle must say how heavy its wheels are."""
    path = tmp_path / "scene.toml"
    path.write_text(GOOD.replace("'paper'", "'paper'\nwheels = 2") + "[reactions]\nheight = 0.1\n")
    with pytest.raises(SceneError, match=r":3: \[vehicle\] wheels = 2: loads need three wheels"):
        load_scene(path)
    beside = "[layout]\ncenter_of_mass = [0.01, 0]\n[reactions]\nheight = 0.1\n"
    assert lines_of(tmp_path, beside)[0].startswith("[reactions] wheel_mass: must be given")


def test_scenes_from_two_threads_give_what_they_give_alone():
    scenes = [
        load_scene(f"scenes/{name}.toml") for name in ("driven", "slope-bearings", "motion-3", "robot-soccer-kit")
    ]

    def end_of(scene: omniroll.Scene) -> np.ndarray:
        run = omniroll.run(scene, duration=0.5, control=False)
        return np.concatenate([run.t, run.nu.ravel(), run.pose.ravel(), run.energy])

    alone = [end_of(scene) for scene in scenes]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(end_of, scenes * 3))
    assert all(np.array_equal(found, alone[k % 4]) for k, found in enumerate(together))

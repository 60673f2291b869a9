"""[contact] in a scene: what runs, what is kept, what is refused, what looks wrong."""

import csv

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.engine.simulate import checked_task
from omniroll.scenes import SceneError, load_scene
from omniroll.scenes.costs import operations
from omniroll.scenes.lints import lints

SCENE = """
[vehicle]
preset = "paper"
[start]
nu = [1.0, 0.5, 0.0]
[run]
duration = 0.1
[contact]
"""


@pytest.fixture
def written(tmp_path):
    def write(contact, more=""):
        path = tmp_path / "slipping.toml"
        path.write_text(f"{SCENE}{contact}\n{more}")
        return path

    return write


def test_a_scene_runs_and_keeps_what_the_contacts_did(written, tmp_path, capsys):
    path = written('law = "regularised"\nfriction = [0.4, 0.6]\nspeed = 0.01\nwheel_rates = 0')
    assert cli.main(["run", str(path), "--output", str(tmp_path / "out")]) == 0
    assert "wheels that may slip" in capsys.readouterr().out
    rows = list(csv.DictReader((tmp_path / "out/slip.csv").open()))
    run = omniroll.Trajectory.load(tmp_path / "out/trajectory.npz")
    assert [float(row["slip_rolling_2"]) for row in rows] == run.slip[:, 1, 1].tolist()
    assert [float(row["force_axle_3"]) for row in rows] == run.ground_force[:, 2, 0].tolist()
    assert [float(row["loss_1"]) for row in rows] == run.quantity("ground_loss")[:, 0].tolist()
    assert np.ptp(run.slip[0, :, 1]) > 0.1 and not (tmp_path / "out/impulses.csv").exists()


def test_a_later_run_without_contacts_takes_the_file_away(written, tmp_path):
    assert cli.main(["run", str(written("coefficient = 30")), "--output", str(tmp_path / "out")]) == 0
    rolling = written("coefficient = 30")
    rolling.write_text(SCENE.replace("[contact]\n", ""))
    assert (tmp_path / "out/slip.csv").exists()
    assert cli.main(["run", str(rolling), "--output", str(tmp_path / "out")]) == 0
    assert not (tmp_path / "out/slip.csv").exists()


@pytest.mark.parametrize(
    "contact, more, said",
    [
        ("coefficient = 30", '[rollers]\nmodel = "locked"', "[rollers] model"),
        ("coefficient = -1", "", "[contact] coefficient"),
        ("", "", "[contact] coefficient"),
        ('law = "regularised"\nfriction = 0.5', "", "[contact] speed"),
        ("coefficient = 30\nload = 3", "", "[contact] load"),
        ("coefficient = 30", "[bearings]\nwheel_coulomb = 0.1", "wheel_speed"),
    ],
)
def test_what_makes_no_sense_is_named(written, contact, more, said):
    with pytest.raises(SceneError) as caught:
        load_scene(written(contact, more))
    assert said in str(caught.value)


def test_a_law_of_a_switch_has_no_part(written):
    scene = load_scene(written("coefficient = 30", '[switching]\nlaw = "smooth"'))
    assert [(lint.table, lint.key) for lint in lints(scene)] == [("switching", "law")]


def test_one_function_gives_all_accelerations(written):
    scene = load_scene(written("coefficient = 30"))
    counted = {cost.function for cost in operations(checked_task(scene.vehicle, **scene.options))}
    assert counted == {"pose_rates", "slip_dynamics", "ground_power"}

"""[contact] in a scene: what runs, what is kept, what is refused, what looks wrong."""

import csv
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.scenes import SceneError, load_scene
from omniroll.scenes.lints import lints

pytestmark = pytest.mark.long

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


@pytest.mark.parametrize("contact, more, said", [
    ("coefficient = 30", '[rollers]\nmodel = "locked"', "[rollers] model"),
    ("coefficient = -1", "", "[contact] coefficient"),
    ("", "", "[contact] coefficient"),
    ('law = "regularised"\nfriction = 0.5', "", "[contact] speed"),
    ("coefficient = 30\nload = 3", "", "[contact] load"),
    ('law = "coulomb"\nfriction = 0.4\nloads = "dynamic"', "", "[contact] loads"),
    (
        'law = "coulomb"\nfriction = 0.4',
        '[rollers]\nmodel = "massless"\n[bearings]\nroller_coulomb = 1e-3\nroller_viscous = 1e-5',
        "roller_viscous",
    ),
])  # fmt: skip
def test_what_makes_no_sense_is_named(written, contact, more, said):
    with pytest.raises(SceneError) as caught:
        load_scene(written(contact, more))
    assert said in str(caught.value)


def test_a_law_of_a_switch_has_no_part(written):
    scene = load_scene(written("coefficient = 30", '[switching]\nlaw = "smooth"'))
    assert [(lint.table, lint.key) for lint in lints(scene)] == [("switching", "law")]


@pytest.mark.parametrize("contact, key", [
    ('law = "coulomb"\nfriction = 5', "friction"),
    ('law = "regularised"\nfriction = 0.5\nspeed = 1e-7', "speed"),
    ('law = "coulomb"\nfriction = 0.5\nload = 70', "load"),
    ('law = "coulomb"\nfriction = 0.5\nload = 7', None),
])  # fmt: skip
def test_numbers_that_no_ground_has_are_named(written, contact, key):
    found = [lint.key for lint in lints(load_scene(written(contact))) if lint.table == "contact"]
    assert found == ([] if key is None else [key])


@pytest.mark.parametrize("name, modes", [
    ("wheel-spin", {(1, 1, 1), (0, 1, 0)}),
    ("ramp-lets-go", {(1, 1, 1), (1, 0, 0)}),
    ("hard-stop", {(0, 1, 0, 0), (0, 1, 0, 1), (1, 1, 1, 1)}),
])  # fmt: skip
def test_shipped_scenes_do_what_they_say(name, modes, tmp_path, capsys):
    """Wheels spin and grip again; two let go on the ramp for good; one leaves the ground. Pictures are drawn."""
    path = Path(__file__).parents[2] / "scenes" / f"{name}.toml"
    assert cli.main(["run", str(path), "--output", str(tmp_path), "--plot"]) == 0
    run = omniroll.Trajectory.load(tmp_path / "trajectory.npz")
    assert modes <= {tuple(row) for row in run.sticks.astype(int)} and (tmp_path / "slip.png").stat().st_size > 10_000
    assert run.sticks[-1].all() == (name != "ramp-lets-go")
    assert (run.presses is None or run.presses.all()) == (name != "hard-stop")
    rows = list(csv.DictReader((tmp_path / "slip.csv").open()))
    modes_in_file = [[int(row[f"sticks_{i}"]) for i in range(1, run.vehicle.wheels + 1)] for row in rows]
    assert modes_in_file == run.sticks.tolist()
    assert f"  slip on the ground {run.ledger.contributions['ground_loss']:.6e}\n" in capsys.readouterr().out
    assert abs(run.ledger.residual) <= 1e-9 * sum(map(abs, run.ledger.contributions.values()))

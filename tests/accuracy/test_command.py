"""`omniroll accuracy SCENE`: what it shows, writes and refuses."""

import csv
import json
import math

import numpy as np
import pytest

from omniroll import cli
from omniroll.engine.simulate import checked_task, one_run
from omniroll.scenes import load_scene
from omniroll.studies.accuracy.deviation import deviation
from omniroll.studies.accuracy.peers import PEERS, outcome_of
from omniroll.studies.accuracy.study import INTEGRATORS, Point, study
from omniroll.studies.accuracy.tables import text

pytestmark = pytest.mark.long

pytest.importorskip("flint")
FLOAT_EPS = 2.0**-23
NAMES = [peer.name for peer in INTEGRATORS]


@pytest.fixture(scope="module")
def found():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("omniroll.studies.accuracy.study.REPEATS", 2)
        return study(load_scene("scenes/motion-3.toml"), 1.0, wanted=1e-2)


def points(found, name):
    return [point for point in found.points if point.series == name]


def test_every_integrator_is_there(found):
    assert list(dict.fromkeys(point.series for point in found.points)) == NAMES and not found.failed
    for name in NAMES:
        errors = [point.trajectory for point in points(found, name)]
        in_float = (
            name.endswith("float") and max(errors) < 10 * FLOAT_EPS
        )  # the coarsest step is as exact as floats are
        assert min(errors) < max(errors) / 10 or in_float
        assert all(point.evaluations > 0 and point.microseconds > 0 for point in points(found, name))


def test_the_reference_is_finer_than_what_is_shown(found):
    assert found.confirmed < 1e-16
    for point in found.points:
        shown = (point.end, point.trajectory, point.switch_times, point.energy)
        assert not min(shown) < 100 * found.confirmed
    assert found.models_confirmed < 1e-16
    for point in found.models:
        assert not min(point.end, point.trajectory, point.switch_times, point.energy) < 100 * found.models_confirmed


def test_models_and_advice(found):
    best = {p.series: p.trajectory for p in found.models}  # the last is the finest
    assert best["free"] < 1e-11 and best["massless"] > 1e-5 and best["locked"] > 1e-5
    cheapest, following = found.advice["cheapest"], found.advice["next_digit"]
    assert cheapest["error"] <= 1e-2 and following["error"] <= 1e-3
    assert found.advice["times"] == following["microseconds"] / cheapest["microseconds"] >= 1
    assert found.advice["finest"]["error"] < 1e-11 and found.advice["finest"]["model"] == "free"


def test_effects_are_left_out_in_turn():
    """On a slope with bearings: integrators and models with every effect, and models with one less."""
    scene = load_scene("scenes/slope-bearings.toml")
    shown = study(scene, 0.1, wanted=1e-2, peers=(PEERS[0], PEERS[-1]))
    assert shown.effects == [type(effect).__name__ for effect in scene.options["effects"]] and not shown.failed
    best = {p.series: p.trajectory for p in shown.models}
    assert list(best) == ["massless", "locked", "free", "without Bearings", "without Slope"]
    assert best["free"] < 1e-7 and shown.models_floor < 1e-13
    assert min(best["without Slope"], best["without Bearings"]) > 1e-4
    assert {p.series for p in shown.points} == {"compiled"} and shown.left_out == [PEERS[-1].name]
    for point in shown.points:
        assert point.trajectory <= 10 * max(point.setting, 1e-14)
    assert "Slope" in text(shown).split("each effect left out")[1]


@pytest.mark.parametrize("name", ["driven", "tracked", "slope-bearings"])
def test_integrators_run_the_effects_of_a_scene(name):
    """Known times, samples, current limits, friction of free rollers: each at its finest setting."""
    scene, times = load_scene(f"scenes/{name}.toml"), np.linspace(0, 0.7, 5)
    options = scene.options | {"duration": 0.7, "accuracy": 1e-9, "engine": "compiled"}
    task = checked_task(scene.vehicle, **options)
    engine = outcome_of(one_run(task, 1e-13), task, times)
    for peer in PEERS:
        if peer.with_effects:
            error = deviation(peer.run(task, times, peer.settings[-1]), engine, task)["trajectory"]
            assert error < 100 * peer.settings[-1], peer.name


def test_a_run_that_stops_is_exit_code_3_and_the_others_are_kept(monkeypatch, bouncing, capsys, tmp_path):
    monkeypatch.setattr("omniroll.studies.accuracy.study.INTEGRATORS", PEERS[:2])
    monkeypatch.setattr(study, "__kwdefaults__", study.__kwdefaults__ | {"peers": PEERS[:2]})
    arguments = ["accuracy", "scenes/motion-3.toml", "--duration", "0.6", "--folder", str(tmp_path)]
    assert cli.main(arguments) == 3
    captured = capsys.readouterr()
    assert "without progress" in captured.err and "not done: Python engine at 0.001" in captured.out
    kept = json.loads((tmp_path / "accuracy.json").read_text())
    assert {point["series"] for point in kept["points"]} == {"compiled"} and "without progress" in kept["stopped"]
    assert kept["models"] and (tmp_path / "accuracy.md").exists()


def test_files_and_tables(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("omniroll.studies.accuracy.study.REPEATS", 1)
    arguments = ["accuracy", "scenes/motion-3-impact.toml", "--duration", "0.4", "--error", "1e-3"]
    arguments += ["--folder", str(tmp_path)]
    assert cli.main(arguments) == 0
    shown = capsys.readouterr().out
    assert "For an error of 0.001" in shown and "compiled" in shown
    assert cli.main([*arguments, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((tmp_path / "accuracy.json").read_text())
    rows = list(csv.DictReader((tmp_path / "accuracy.csv").open()))
    assert len(rows) == len(printed["points"]) + len(printed["models"])
    assert set(Point.__dataclass_fields__) < set(rows[0]) and not math.isnan(float(rows[0]["end"]))
    pytest.importorskip("matplotlib")
    assert (tmp_path / "accuracy.png").stat().st_size > 10_000
    assert (tmp_path / "accuracy.svg").read_text().endswith("</svg>\n")
    page = (tmp_path / "accuracy.md").read_text()
    assert "(accuracy.png)" in page and "## Advice" in page
    assert page.count("\n| ") == 3 * 2 + len(rows) + len(printed["laws"])  # three tables, each with a head of two lines


def test_what_there_is_no_time_for_is_named(tmp_path, capsys, monkeypatch):
    """The reference tells how far it is; with no time left nothing else is measured, and the page says so."""
    seen = []
    arguments = {"peers": PEERS[:1], "within": 0.0, "progress": lambda done, total: seen.append((done, total))}
    shown = study(load_scene("scenes/motion-3.toml"), 0.2, **arguments)
    assert not shown.points and not shown.models and len(shown.failed) == len(PEERS[0].settings) + 1
    assert f"compiled at {PEERS[0].settings[0]:g}: not begun within 0 s" in shown.failed
    assert "not done: models: not begun within 0 s" in text(shown)
    ends = [done for done, total in seen if done == total == 0.2]
    assert len(ends) == 2 and 0 < seen[0][0] < 0.2  # the reference and the solution that confirms it
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    assert cli.main(["accuracy", "scenes/motion-3.toml", "--duration", "0.2", "--within", "0",
                     "--folder", str(tmp_path)]) == 0  # fmt: skip
    said = capsys.readouterr()
    assert "reference: Taylor series" in said.err and "left at most" in said.err and "not begun within 0 s" in said.out


def test_bad_calls(tmp_path, capsys):
    bad = tmp_path / "bad.toml"
    bad.write_text("[vehicle]\npreset = 'papr'\n[start]\nnu = [1, nan, 0]\n[run]\nduraton = 1\n[roller]\n")
    assert cli.main(["accuracy", str(bad)]) == 2
    said = capsys.readouterr().err
    assert "did you mean duration?" in said and "did you mean [rollers]?" in said
    assert cli.main(["accuracy", str(tmp_path / "absent.toml")]) == 2
    assert cli.main(["accuracy", "scenes/motion-3.toml", "--error", "-1"]) == 2
    assert cli.main(["accuracy", "scenes/motion-3.toml", "--duration", "0"]) == 2
    assert cli.main(["accuracy", "scenes/motion-3.toml", "--within", "nan"]) == 2

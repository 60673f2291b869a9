"""`omniroll accuracy SCENE`: what it shows, writes and refuses."""

import csv
import json
import math

import pytest

from omniroll import cli
from omniroll.accuracy.heyoka_peer import heyoka_peer
from omniroll.accuracy.peers import PEERS
from omniroll.accuracy.study import INTEGRATORS, Point, advice, study
from omniroll.errors import SimulationStopped
from omniroll.scene import load_scene

pytest.importorskip("flint")
NAMES = [peer.name for peer in INTEGRATORS]


@pytest.fixture(scope="module")
def found():
    return study(load_scene("scenes/motion-3.toml"), 1.0, wanted=1e-2)


def points(found, name):
    return [point for point in found.points if point.series == name]


def test_every_integrator_is_there(found):
    assert list(dict.fromkeys(point.series for point in found.points)) == NAMES and not found.failed
    for name in NAMES:
        errors = [point.trajectory for point in points(found, name)]
        assert min(errors) < max(errors) / 10 or "float" in name
        assert all(point.evaluations > 0 and point.microseconds > 0 for point in points(found, name))


def test_the_reference_is_finer_than_what_is_shown(found):
    assert found.confirmed < 1e-16
    for point in found.points:
        shown = (point.end, point.trajectory, point.energy)
        assert min(shown) >= 100 * found.confirmed


def test_omnirolls_engines_keep_what_is_asked(found):
    for name in ("compiled", "Python engine"):
        for point in points(found, name):
            assert point.trajectory <= 10 * max(point.setting, 1e-14)
        constant, exponent = found.laws[name]
        assert 0.7 < exponent < 1.3 and constant < 10


def test_float_is_no_better_than_its_digits(found):
    assert min(point.trajectory for point in points(found, "RK4 fixed, float")) > 1e-6


def test_models_and_advice(found):
    best = {p.series: p.trajectory for p in found.models}  # the last is the finest
    assert best["free"] < 1e-11 and best["massless"] > 1e-5 and best["locked"] > 1e-5
    cheapest, following = found.advice["cheapest"], found.advice["next_digit"]
    assert cheapest["error"] <= 1e-2 and following["error"] <= 1e-3
    assert cheapest["microseconds"] <= following["microseconds"]


def test_effects_are_left_out_in_turn():
    """On a slope with bearings: integrators on the bare vehicle, models with every effect and with one less."""
    scene = load_scene("scenes/slope-bearings.toml")
    shown = study(scene, 0.3, wanted=1e-2, peers=PEERS[:1])
    assert shown.effects == [type(effect).__name__ for effect in scene.options["effects"]] and not shown.failed
    best = {p.series: p.trajectory for p in shown.models}
    assert list(best) == ["massless", "locked", "free", "without Bearings", "without Slope"]
    assert best["free"] < 1e-8
    assert min(best["without Slope"], best["without Bearings"]) > 1e4 * best["free"]
    assert shown.advice["cheapest"]["model"] in best


def test_what_cannot_be_left_out_is_said():
    """A controller whose output is a voltage needs the motors."""
    scene = load_scene("scenes/tracked.toml")
    shown = study(scene, 0.02, peers=PEERS[:1])
    without = {p.series for p in shown.models} - {"massless", "locked", "free"}
    kinds = {type(effect).__name__ for effect in scene.options["effects"]}
    assert {f"without {kind}" for kind in kinds} - without == {line.split(":")[0] for line in shown.failed}


def test_heyoka_where_it_is_installed():
    """Its curve falls with its tolerance as the compiled engine's does."""
    pytest.importorskip("heyoka")
    shown = study(load_scene("scenes/motion-3-impact.toml"), 1.0, peers=heyoka_peer())
    assert not shown.failed
    for point in shown.points:
        assert point.trajectory < 1e3 * point.setting


def test_a_motion_that_stops_has_an_exit_code_of_its_own(monkeypatch, capsys):
    def stopped(*_, **__):
        raise SimulationStopped("switches without progress in time", t=0.5, wheel=1, state={}, trajectory=None)

    monkeypatch.setattr("omniroll.accuracy.study.study", stopped)
    assert cli.main(["accuracy", "scenes/motion-3.toml"]) == 3
    assert "switches without progress" in capsys.readouterr().err


def test_advice_is_none_where_nothing_will_do(found):
    assert advice(found, 1e-30) == {"wanted": 1e-30, "cheapest": None, "next_digit": None}


def test_files_and_tables(tmp_path, capsys):
    arguments = ["accuracy", "scenes/motion-3-impact.toml", "--duration", "0.4", "--folder", str(tmp_path)]
    assert cli.main([*arguments, "--error", "1e-3"]) == 0
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
    assert "compiled" in (tmp_path / "accuracy.svg").read_text() or (tmp_path / "accuracy.svg").exists()


def test_bad_calls(tmp_path, capsys):
    bad = tmp_path / "bad.toml"
    bad.write_text("[vehicle]\npreset = 'papr'\n[start]\nnu = [1, nan, 0]\n[run]\nduraton = 1\n[roller]\n")
    assert cli.main(["accuracy", str(bad)]) == 2
    said = capsys.readouterr().err
    assert "did you mean duration?" in said and "did you mean [rollers]?" in said
    assert cli.main(["accuracy", str(tmp_path / "absent.toml")]) == 2
    assert cli.main(["accuracy", "scenes/motion-3.toml", "--error", "-1"]) == 2
    assert cli.main(["accuracy", "scenes/motion-3.toml", "--duration", "0"]) == 2

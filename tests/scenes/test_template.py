"""The scene that `omniroll new` writes: it runs, and it has every key of the schema with its unit and default."""

import inspect
import re

import numpy as np

import omniroll
from omniroll import Vehicle, cli, load_scene, robot
from omniroll.scenes.schema import SCENE, keys
from omniroll.scenes.template import GIVEN, template


def test_it_is_written_and_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["new"]) == 0 and cli.main(["run", "scene.toml"]) == 0
    assert (tmp_path / "out/run/scene/samples.csv").exists() and "warning" not in capsys.readouterr().err


def test_a_file_that_is_there_is_left_alone(tmp_path, capsys):
    file = tmp_path / "mine.toml"
    file.write_text("mine")
    assert cli.main(["new", str(file)]) == 1
    assert file.read_text() == "mine" and "is there already" in capsys.readouterr().err


def test_every_table_and_key_is_there_with_its_unit():
    tables = re.split(r"^(?:# )?\[(\w+)\]$", template("x.toml"), flags=re.MULTILINE)
    texts = dict(zip(tables[1::2], tables[2::2], strict=True))
    assert list(texts) == [table.name for table in SCENE]
    for table, key in keys():
        (line,) = re.findall(rf"^(?:# )?{key.name} = ?.*## (.*)$", texts[table.name], re.MULTILINE)
        assert key.unit in ("", "1") or line.startswith(f"{key.unit}: "), key.name
    lines = template("x.toml").splitlines()
    assert max(map(len, lines)) <= 120 and lines == [line.rstrip() for line in lines]


def test_the_defaults_that_it_shows_are_the_defaults(tmp_path):
    """With the keys of its tables switched on that have a default, the scene is the same."""
    on = {table for table, _ in GIVEN} - {"vehicle"}
    tables = template("x.toml").split("\n\n")
    switched = [
        re.sub(r"^# (\w+ = [^ #].*)$", r"\1", text, flags=re.MULTILINE)
        if any(f"\n[{name}]\n" in text for name in on)
        else text
        for text in tables
    ]
    assert sum(a != b for a, b in zip(tables, switched, strict=True)) >= 2
    scenes = []
    for text in (tables, switched):
        (tmp_path / "x.toml").write_text("\n\n".join(text))
        scenes.append(load_scene(tmp_path / "x.toml"))
    before, after = scenes
    shared = {name: after.options[name] for name in before.options}
    assert after.vehicle == before.vehicle and repr(shared) == repr(before.options)
    for name in set(after.options) - set(before.options):  # what simulate takes where it is not given
        default = inspect.signature(omniroll.simulate).parameters[name].default
        shown = after.options[name]
        assert default is None or (shown == default if isinstance(shown, str) else np.allclose(shown, default)), name


def test_a_scene_may_begin_with_the_wheels_of_a_robot(tmp_path):
    """They are marked as assumed; the rest stays that of the paper's preset."""
    path = tmp_path / "mine.toml"
    path.write_text(template("mine.toml", "robot-soccer-kit"), encoding="utf-8")
    vehicle, known = load_scene(path).vehicle, robot("robot-soccer-kit").vehicle
    for name in ("rollers_per_wheel", "wheel_radius", "roller_axis_radius", "wheel_inertia", "roller_inertia"):
        assert getattr(vehicle, name) == getattr(known, name)
        assert f"## Assumed: {name} of the wheels of robot-soccer-kit\n{name} = " in path.read_text(encoding="utf-8")
    assert vehicle.mass == Vehicle.paper(3, 20).mass

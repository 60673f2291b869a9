"""2000 wrong calls and 2000 wrong scenes, the readers of text, and the command line: no traceback and no NaN."""

import contextlib
import io
from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import omniroll
from fuzz.calls import run, try_call
from fuzz.scenes import try_scene
from omniroll import cli

COUNT = 2000


def test_wrong_calls():
    found = Counter(map(try_call, range(COUNT)))
    assert found["refused"] > COUNT / 2 and found["done"] > COUNT / 100


def test_wrong_scenes(tmp_path):
    found = Counter(try_scene(seed, tmp_path, with_effects=False) for seed in range(COUNT))
    assert found["refused"] > COUNT / 2 and found["done"] > COUNT / 100


@pytest.mark.parametrize(
    "call, field",
    [
        (lambda: omniroll.load_scene(0), "path"),  # the standard input
        (lambda: omniroll.Trajectory.load(0), "path"),
        (lambda: run().save(2), "path"),
        (lambda: omniroll.kernel("a vehicle"), "vehicle"),
        (lambda: omniroll.kernel(run().vehicle, backend=[]), "backend"),
        (lambda: omniroll.simulate(run().vehicle, nu=(1, 0, 0), duration=0.01, progress=3), "progress"),
        (lambda: omniroll.simulate(run().vehicle, nu=(1, 0, 0), duration=0.01, control="no"), "control"),
        (lambda: omniroll.simulate_many(run().vehicle, nu=(1, 0, 0), duration=0.01, executor=4), "executor"),
        (lambda: omniroll.simulate_many(run().vehicle, nu=(1, 0, 0), duration=0.01, progress="bar"), "progress"),
        (lambda: omniroll.Vehicle.paper(wheels=10**30), "wheels"),
        (lambda: run().physical_roller([1, 2]), "j"),
        (lambda: omniroll.tau("soon", 1), "t"),
    ],
)
def test_each_argument_is_named(call, field):
    with pytest.raises(omniroll.InvalidValueError) as refused:
        call()
    assert refused.value.field == field


def test_a_value_that_cannot_be_shown_is_named_by_its_type():
    with pytest.raises(omniroll.InvalidValueError, match="mass = a value of type int: must be"):
        run().vehicle.replace(mass=10**5000)
    with pytest.raises(omniroll.InvalidValueError) as refused:
        run().vehicle.replace(mass=[1.0] * 100_000)
    assert len(str(refused.value)) < 600 and len(refused.value.value) == 100_000


WORDS = st.sampled_from(
    ["run", "explain", "accuracy", "kernel", "where", "formulas", "motions", "scenes/motion-3.toml"]
)
OPTIONS = st.sampled_from(["--json", "--plot", "--output", "--import", "--error", "-x", "--", "--help", "m13", "free"])
ARGUMENTS = st.one_of(OPTIONS, st.text(max_size=8).filter(lambda text: "\0" not in text))


@settings(max_examples=60, deadline=None)
@given(first=st.one_of(WORDS, st.text(max_size=8)), others=st.lists(ARGUMENTS, max_size=3))
def test_any_command_line_ends_in_an_exit_code(first, others):
    """Scenes are not named, so that nothing is simulated."""
    if first in ("motions", "formulas"):  # these need no scene and do long work
        others = ["--no-such-option", *others]
    silent = io.StringIO()
    with contextlib.redirect_stdout(silent), contextlib.redirect_stderr(silent):
        try:
            code = cli.main([first, *others])
        except SystemExit as end:
            code = end.code
    assert code in (0, 1, 2, 3), (first, others)
    assert "Traceback" not in silent.getvalue()


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_any_csv_is_a_trajectory_or_refused(data, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "run.csv"
    run().save(path, dense=False)
    lines = path.read_text(encoding="utf-8").splitlines()
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(0, len(lines) - 1))
        start = data.draw(st.integers(0, len(lines[place])))
        length = data.draw(st.integers(0, 6))
        new = data.draw(st.one_of(st.text(alphabet='0123456789.,-e"{}[]:naif#', max_size=6), st.text(max_size=3)))
        lines[place] = lines[place][:start] + new + lines[place][start + length :]
    path.write_text("\n".join(lines), encoding="utf-8", errors="replace")
    try:
        omniroll.Trajectory.load(path)
    except (omniroll.InvalidValueError, OSError) as error:
        assert str(error)

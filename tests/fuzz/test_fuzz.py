"""900 wrong calls and 400 changed scenes, the readers of text, and the command line: no traceback and no NaN."""

import contextlib
import inspect
import io
import re
import warnings
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import omniroll
from fuzz.calls import CALLS, PARTS, Odd, good_of, itself, run, scene, try_call
from fuzz.keys import NUMBERS, scenes_with
from fuzz.scenes import try_scene
from omniroll import cli
from omniroll.effects import Effect
from omniroll.kinds import Whole

COUNT, FEW = 900, 400  # calls, scenes

METHODS_OF_ENGINES = (  # which take numbers that are checked, or functions of the package itself
    "Batch.bind", "Instruments.read", "Trajectory.contact_spins_in", "Trajectory.account_at",
    "Trajectory.drives_at", "Trajectory.state_and_row", "Trajectory.state_at", "Vehicle.with_drives",
)  # fmt: skip
OPENS_A_BROWSER = ("View.open",)
ERRORS = {name for name in omniroll.__all__ if name.endswith(("Error", "Warning", "Stopped", "Interrupted"))}
RESULTS = {  # what functions give
    "Doubt", "Impulses", "Imported", "Kernel", "Ledger", "LinearModel", "Many", "Reactions", "Results", "Samples",
    "Sensitivity", "Scene", "Trajectory", "View",
}  # fmt: skip


def test_wrong_calls(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = Counter(map(try_call, range(COUNT)))
    assert found["refused"] > COUNT / 2 and found["done"] > COUNT / 100


@pytest.mark.parametrize("seeds", [range(FEW // 4), pytest.param(range(FEW // 4, FEW), marks=pytest.mark.long)])
def test_wrong_scenes(seeds, tmp_path):
    found = Counter(try_scene(seed, tmp_path) for seed in seeds)
    assert found["refused"] > len(seeds) / 5 and found["done"] > len(seeds) / 2


@pytest.mark.parametrize("value", [10**22, 1e150, 5e-324])
def test_numbers_beyond_use_of_every_key(value, tmp_path):
    """A scene is read or refused, and nothing overflows on the way."""
    path, read = tmp_path / "scene.toml", 0
    for key, text in scenes_with(value):
        path.write_text(text, encoding="utf-8")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                warnings.filterwarnings("error", "(overflow|invalid|divide).*", RuntimeWarning)
                made = omniroll.load_scene(path)
                made.sample_times(np.inf)
                read += 1
        except omniroll.SceneError as error:
            assert str(error)
        except Exception as error:
            raise AssertionError(f"{key} = {value!r}: {type(error).__name__}: {error}") from error
    assert read or value == 5e-324


HUGE = st.one_of(
    st.integers(-(10**30), 10**30), st.sampled_from([2**53 + 1, 2**63, 10**400, -(10**400)]), st.floats(), st.booleans()
)


@settings(max_examples=200, deadline=None)
@given(value=HUGE, key=st.sampled_from(NUMBERS))
def test_a_number_is_read_alike_in_scenes_and_in_python(value, key):
    """What a key of a scene takes is a number that Python's arrays hold, or it is refused in words."""
    table, entry = key
    if entry.kind.complaint(value, {}) is None:
        plain = entry.kind.plain(value)
        assert plain == value or abs(value) > 2**53 and plain == float(value)
        assert isinstance(entry.kind, Whole) or np.asarray(plain).dtype.kind in "if"
    with contextlib.suppress(omniroll.InvalidValueError):
        entry.kind.checked(entry.name, value)


NO_VALUES = (Odd(), float("nan"), [[[[1.0]]]])
CALLED_OTHERWISE = {  # where the call here and the function itself have other names
    "cylinder": "cylinder_{}", "LinearModel.select state": "states", "run given": "scene", "gradient trajectory": "run",
    "Fit.save path": "what", "Robot.motor": "torque_constant",  # of which the kit says too little for a motor
}  # fmt: skip
TAKEN = {  # which is a value there, or is read where there is another argument beside it
    "Motor interpolation", "Scene.sample_times end", "simulate_many duration", "Instruments.counts wheel_angle",
    "Log lines",
}  # fmt: skip
TAKES_SECONDS = ("to_casadi", "to_fmu")


@pytest.mark.parametrize("call", [call for call in CALLS if call.name not in TAKES_SECONDS], ids=lambda call: call.name)
def test_each_argument_is_refused_by_its_name(call, tmp_path, monkeypatch):
    """What is no value, or may be out of bounds: the error's field is the argument, and its sentence begins with it."""
    monkeypatch.chdir(tmp_path)
    given = good_of(call)
    for name in given:
        said = CALLED_OTHERWISE.get(f"{call.name} {name}", CALLED_OTHERWISE.get(call.name, name)).format(name)
        for value in (*NO_VALUES, -7):
            try:
                with warnings.catch_warnings(), np.errstate(all="ignore"):
                    warnings.simplefilter("ignore")
                    call.function(**given | {name: value})
            except omniroll.InvalidValueError as refused:
                assert re.match(rf"{said}\b", refused.field) and refused.field in str(refused), (name, value, refused)
            else:
                assert value == -7 or f"{call.name} {name}" in TAKEN, (name, value)


@pytest.mark.parametrize("call, field", [
    (lambda: omniroll.load_scene(0), "path"),  # the standard input
    (lambda: omniroll.run(scene(), foo=1), "foo"),
    (lambda: omniroll.run(scene(), vehicle=run().vehicle), "vehicle"),
    (lambda: omniroll.Session(run().vehicle, foo=1), "foo"),
    (lambda: run().vehicle.replace(foo=1), "foo"),
    (lambda: omniroll.Trajectory.joined([]), "parts"),
    (lambda: omniroll.simulate(run().vehicle, nu=(1, 0, 0), duration=0.01, progress=len), "progress"),
    (lambda: omniroll.simulate(run().vehicle, nu=(1, 0, 0), duration=0.01, chi=10**400), "chi"),
    (lambda: omniroll.simulate_many(run().vehicle, nu=(1, 0, 0), duration=1, effects=itself()), "effects"),
    (lambda: omniroll.Vehicle.from_parts(**PARTS | {"platform_radius": None}), "platform_radius"),
])  # fmt: skip
def test_calls_that_make_no_sense_name_what_is_wrong(call, field):
    with pytest.raises(omniroll.InvalidValueError) as refused:
        call()
    assert refused.value.field == field


def test_every_public_function_is_tried():
    tried = {call.name.split(",")[0] for call in CALLS}
    kinds = {name.split(".")[0] for name in tried} | RESULTS
    assert kinds | ERRORS == set(omniroll.__all__)
    missing = {name for kind in kinds for name in _methods(kind)} - tried
    assert missing == {*METHODS_OF_ENGINES, *OPENS_A_BROWSER}


def _methods(kind: str) -> list[str]:
    """Public methods with arguments, of a class that is neither an effect nor a kernel: the engines call those."""
    there = getattr(omniroll, kind, None)
    if not isinstance(there, type) or issubclass(there, Effect | omniroll.Kernel):
        return []
    found = inspect.getmembers(there, callable)
    return [
        f"{kind}.{name}" for name, method in found
        if not name.startswith("_") and len(inspect.signature(method).parameters) > (not inspect.ismethod(method))
    ]  # fmt: skip


def test_a_value_that_cannot_be_shown_is_named_by_its_type():
    with pytest.raises(omniroll.InvalidValueError, match="mass = a value of type int: must be"):
        run().vehicle.replace(mass=10**5000)
    with pytest.raises(omniroll.InvalidValueError) as refused:
        run().vehicle.replace(mass=[1.0] * 100_000)
    assert len(str(refused.value)) < 600 and len(refused.value.value) == 100_000


WORDS = st.sampled_from(
    ["run", "explain", "accuracy", "kernel", "where", "formulas", "motions", "view", "scenes/motion-3.toml"]
)
OPTIONS = st.sampled_from(
    ["--json", "--plot", "--view", "--title", "--derivatives", "--output", "--import", "--error", "-x", "--", "--help",
     "m13", "free"]
)  # fmt: skip
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

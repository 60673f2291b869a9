"""Files of trajectories: what is read is what was written, or the error says which array is wrong."""

import io
import json
import zipfile
from dataclasses import dataclass

import numpy as np
import pytest

import omniroll
from omniroll.effects.named import KINDS
from omniroll.results.trajectory_content import ARRAYS, AXES, Stored

VEHICLE = omniroll.Vehicle.paper(rollers_per_wheel=6).replace(rows=2, row_offset=0.01)  # has every array but modes
DRIVEN = [omniroll.Torque((1e-3, 0, 0)), omniroll.Bearings(wheel_viscous=1e-5)]


@pytest.fixture(scope="module")
def run():
    return omniroll.simulate(VEHICLE, nu=(1, 0, 1), spins=0.1, duration=0.5, effects=DRIVEN, control=False)


@pytest.fixture(scope="module")
def saved(run, tmp_path_factory):
    """The content of the files of a run, by their ending."""
    place = tmp_path_factory.mktemp("saved")
    for ending in ("npz", "csv"):
        run.save(place / f"run.{ending}")
    return {ending: (place / f"run.{ending}").read_bytes() for ending in ("npz", "csv")}


@pytest.fixture(scope="module")
def arrays_with(saved, tmp_path_factory):
    """The arrays of a file that has this one: bearings that stick do not go with two rows."""
    sticks, path = [omniroll.Bearings(wheel_coulomb=1e-3)], tmp_path_factory.mktemp("sticks") / "run.npz"
    omniroll.simulate(omniroll.Vehicle.paper(), nu=(1, 0, 1), duration=0.1, effects=sticks).save(path)
    return lambda name: arrays_of(path.read_bytes() if name == "modes" else saved["npz"])


def arrays_of(content):
    with np.load(io.BytesIO(content)) as file:
        return dict(file)


def put(path, arrays, **changed):
    """A file with other arrays; their checksums fit, as if somebody had meant it. None leaves an array out."""
    arrays = {name: array for name, array in (arrays | changed).items() if array is not None}
    description = json.loads(str(arrays["description"]))
    description.pop("checksums")
    stored = Stored(description, {name: arrays.get(name) for name in ARRAYS}, arrays.get("switches"))
    description["checksums"] = stored.checksums()
    np.savez(path, **arrays | {"description": json.dumps(description)})


@pytest.mark.parametrize("name", [*AXES])
def test_an_array_that_is_wrong_is_named(name, arrays_with, tmp_path):
    arrays = arrays_with(name)
    array = arrays[name]
    wrong = {"of another type": array["t"] if name == "switches" else array.astype(complex)}
    if name != "switches":  # nothing else says how many there were
        wrong["short"] = array[:-1]
    wrong["with another axis"] = array[..., None]
    if name != "step_rows" and array.dtype.kind == "f":
        wrong["not finite"] = array.copy()
        wrong["not finite"].flat[-1] = np.nan
    if name not in ("dense", "modes"):  # which need not be saved, or older files lack
        wrong["missing"] = None
    for change in wrong.values():
        put(tmp_path / "a.npz", arrays, **{name: change})
        with pytest.raises(omniroll.InvalidValueError, match=r"is not a whole omniroll trajectory") as said:
            omniroll.Trajectory.load(tmp_path / "a.npz")
        assert any(other in str(said.value) for other in (name, "shape")), said.value


@pytest.mark.parametrize(
    "name, number",
    [("contact", 6), ("contact", -1), ("step_rows", 10**6), ("elapsed", -1.0), ("switches", (0.1, 3, 1, 0.0))],
)
def test_numbers_that_cannot_be_are_refused(name, number, saved, tmp_path):
    arrays = arrays_of(saved["npz"])
    array = arrays[name].copy()
    array[-1] = number
    put(tmp_path / "a.npz", arrays, **{name: array})
    with pytest.raises(omniroll.InvalidValueError, match=name):
        omniroll.Trajectory.load(tmp_path / "a.npz")


@pytest.mark.parametrize("name", [*ARRAYS, "switches", "description"])
def test_an_array_that_was_damaged_is_named(name, arrays_with, tmp_path):
    """One bit, in a file that is whole as a ZIP file."""
    arrays = arrays_with(name)
    if name == "description":
        arrays[name] = np.array(str(arrays[name]).replace('"start_time": 0.0', '"start_time": 4.0'))
    else:
        content = bytearray(arrays[name].tobytes())
        content[len(content) // 2] ^= 1
        arrays[name] = np.frombuffer(bytes(content), arrays[name].dtype).reshape(arrays[name].shape)
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(omniroll.InvalidValueError, match=f"checksum of {name} does not fit"):
        omniroll.Trajectory.load(tmp_path / "a.npz")


def test_a_file_of_another_version_is_refused_by_its_name(saved, tmp_path):
    (tmp_path / "a.csv").write_bytes(saved["csv"].replace(b"trajectory 2", b"trajectory 1"))
    with pytest.raises(omniroll.InvalidValueError, match="omniroll trajectory 1"):
        omniroll.Trajectory.load(tmp_path / "a.csv")
    arrays = arrays_of(saved["npz"])
    text = str(arrays["description"]).replace("trajectory 2", "trajectory 1")
    np.savez(tmp_path / "a.npz", **arrays | {"description": text})
    with pytest.raises(omniroll.InvalidValueError, match="omniroll trajectory 1"):
        omniroll.Trajectory.load(tmp_path / "a.npz")


def test_a_file_that_would_take_more_memory_than_it_is_long_is_refused(saved, tmp_path):
    np.savez_compressed(tmp_path / "a.npz", **arrays_of(saved["npz"]))
    with pytest.raises(omniroll.InvalidValueError, match="compressed"):
        omniroll.Trajectory.load(tmp_path / "a.npz")
    put(tmp_path / "b.npz", arrays_of(saved["npz"]))
    with zipfile.ZipFile(tmp_path / "b.npz", "a") as archive:
        archive.writestr("more.npy", b"")
    with pytest.raises(omniroll.InvalidValueError, match="does not have: more"):
        omniroll.Trajectory.load(tmp_path / "b.npz")


# Effects of one's own


@dataclass(frozen=True)
class Push(omniroll.Torque):
    """A torque that somebody has made an effect of."""


@pytest.fixture
def registry():
    before = dict(KINDS)
    yield
    KINDS.clear()
    KINDS.update(before)


@pytest.mark.parametrize("ending", ["npz", "csv"])
def test_an_effect_of_ones_own_is_kept_under_its_name_or_refused_when_it_is_saved(ending, registry, tmp_path):
    run = omniroll.simulate(VEHICLE, nu=(1, 0, 1), duration=0.1, effects=[Push(1e-3)], control=False)
    path = tmp_path / f"a.{ending}"
    with pytest.raises(omniroll.InvalidValueError, match="'Push'.*register_effect"):
        run.save(path)
    assert not path.exists()
    omniroll.register_effect("a push")(Push)
    run.save(path)
    assert omniroll.Trajectory.load(path).effects.effects == (Push(1e-3),)
    del KINDS["a push"]
    with pytest.raises(omniroll.InvalidValueError, match="'a push'.*register_effect"):
        omniroll.Trajectory.load(path)

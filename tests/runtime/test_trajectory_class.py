"""Trajectories: rows, sampling, roller numbers, files."""

import numpy as np
import pytest

import omniroll
from omniroll import Trajectory, Vehicle, simulate

PAPER = Vehicle.paper()
ROWS = ("t", "nu", "chi", "contact", "contact_spin", "spins", "pose", "energy")
ARRAYS = (*ROWS, "elapsed", "switches", "dense", "step_rows")
NUMBERS = ("vehicle", "roller_model", "switching", "accuracy", "engine", "start_time", "stats")


@pytest.fixture(scope="module")
def run():
    return simulate(PAPER, nu=(1, 0, 1), spins=0.1, duration=3, start_time=2.5, accuracy=1e-10)


@pytest.fixture(scope="module")
def locked():
    return simulate(PAPER, nu=(0, 0, 1), duration=3, accuracy=1e-7, roller_model="locked", switching="smooth")


def test_shapes_and_rows(run):
    for name, shape in zip(ROWS, ((), (3,), (3,), (3,), (3,), (3, 4), (3,), ()), strict=True):
        assert getattr(run, name).shape == (len(run), *shape), name
        assert getattr(run.sample(np.full((2, 5), 3.0)), name).shape == (2, 5, *shape), name
    assert run.contact.dtype.kind == "i"
    assert run.t[0] == 2.5 and run.t[-1] == 5.5 and (np.diff(run.t) >= 0).all()
    assert not run.nu.flags.writeable
    for time in run.switches.t:
        assert (run.t == time).sum() == 2


def test_two_rows_at_a_switch(run):
    joint = np.pi / 5
    for switch in run.switches:
        before, after = np.flatnonzero(run.t == switch.t)
        wheel, direction = switch.wheel, switch.direction
        assert after == before + 1
        assert run.chi[before, wheel] == direction * joint and run.chi[after, wheel] == -direction * joint
        assert (run.contact[after, wheel] - run.contact[before, wheel]) % 5 == -direction % 5
        assert (run.pose[before] == run.pose[after]).all()
        assert switch.energy_jump == pytest.approx(run.energy[after] - run.energy[before], abs=1e-16)


def test_sampling_at_rows_gives_the_rows_after_switches(run):
    found = run.sample(run.t)
    last = np.searchsorted(run.t, run.t, side="right") - 1
    for name in ("nu", "chi", "contact", "contact_spin", "spins", "pose", "energy"):
        assert (getattr(found, name) == getattr(run, name)[last]).all(), name


@pytest.mark.parametrize("time", [2.4999, 5.5001])
def test_sampling_outside_is_refused(run, time):
    with pytest.raises(ValueError, match=r"^t = "):
        run.sample(time)


def test_roller_numbers(run):
    for j in range(1, 6):
        assert (run.place_of_roller(run.physical_roller(j)) == j).all()
    assert (run.physical_roller(1) == run.contact).all()
    spins = run.spins_by_roller()
    assert spins.shape == (len(run), 3, 5)
    for j in range(2, 6):
        number = run.physical_roller(j)
        assert (np.take_along_axis(spins, number[..., None], -1)[..., 0] == run.spins[..., j - 2]).all()
    for bad in (0, 6, 1.5):
        with pytest.raises(ValueError, match=r"^j = "):
            run.physical_roller(bad)


@pytest.mark.parametrize("ending", ["npz", "csv"])
@pytest.mark.parametrize("which", ["run", "locked"])
def test_files_keep_every_bit(ending, which, request, tmp_path):
    trajectory = request.getfixturevalue(which)
    path = tmp_path / f"run.{ending}"
    trajectory.save(path)
    again = Trajectory.load(path)
    for name in ARRAYS:
        mine, other = getattr(trajectory, name), getattr(again, name)
        assert (mine is None) == (other is None), name
        assert mine is None or (mine.dtype == other.dtype and mine.shape == other.shape and (mine == other).all()), name
    for name in NUMBERS:
        assert getattr(trajectory, name) == getattr(again, name), name
    time = (trajectory.t[0] + trajectory.t[-1]) / 3
    assert (again.sample(time).nu == trajectory.sample(time).nu).all()
    assert again.switches.t.tolist() == trajectory.switches.t.tolist()


@pytest.mark.parametrize("ending", ["npz", "csv"])
def test_files_without_dense_output(ending, run, tmp_path):
    run.save(tmp_path / f"a.{ending}", dense=False)
    run.save(tmp_path / f"b.{ending}")
    assert (tmp_path / f"a.{ending}").stat().st_size < (tmp_path / f"b.{ending}").stat().st_size / 2
    again = Trajectory.load(tmp_path / f"a.{ending}")
    row = run.step_rows[1]  # a step starts there, so that it is no row before a switch
    assert (again.sample(again.t[row]).nu == run.nu[row]).all()
    with pytest.raises(ValueError, match="dense output"):
        again.sample((again.t[row] + again.t[row + 1]) / 2)


def test_csv_is_a_table_for_other_programs(run, tmp_path):
    run.save(tmp_path / "run.csv", dense=False)
    table = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True, skip_header=2)
    assert (
        (table["t"] == run.t).all() and (table["nu_3"] == run.nu[:, 2]).all() and (table["x"] == run.pose[:, 0]).all()
    )
    assert (table["spin_2_5"] == run.spins[:, 1, 3]).all()


def test_a_run_of_no_time_can_be_saved(tmp_path):
    still = simulate(PAPER, nu=(1, 0, 1), duration=0)
    for ending in ("npz", "csv"):
        still.save(tmp_path / f"still.{ending}")
        again = Trajectory.load(tmp_path / f"still.{ending}")
        assert (again.nu == still.nu).all() and (again.sample(0.0).nu == [1, 0, 1]).all()


def test_a_run_draws_itself():
    vehicle = omniroll.Vehicle.paper()
    motor = omniroll.Motor(voltage=(3, -2, 0), torque_constant=0.02, resistance=1.5)
    path = omniroll.PathFollower([0, 1], [[0, 0, 0], [0.1, 0, 0]], sample_time=0.01, bandwidth=5.0)
    driven = omniroll.simulate(vehicle, nu=(1, 0, 1), duration=0.1, effects=[motor])
    titles = [axis.get_title(loc="left") for axis in driven.plot("forces").axes if axis.lines]
    assert titles == ["torque at the axles, drive and bearings", "current of the motors", "voltage at the motors"]
    current = driven.plot("forces").axes[1].lines[0].get_ydata()
    assert current[0] == pytest.approx(driven.measure([0.0])["motor_current"][0, 0])
    follows = omniroll.simulate(vehicle, nu=(0, 0, 0), duration=0.5, effects=[path])
    away = follows.plot("forces").axes[1].lines[0].get_ydata()
    assert away[0] == 0 and 0 < away.max() < 0.05
    free = omniroll.simulate(vehicle, nu=(1, 0, 1), duration=0.1)
    assert len(free.plot(title="free").axes) == 7
    with pytest.raises(omniroll.InvalidValueError, match="what"):
        free.plot("forces")
    with pytest.raises(omniroll.InvalidValueError, match="what"):
        free.plot("torque")

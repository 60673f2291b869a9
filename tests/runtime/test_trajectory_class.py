"""Trajectories: rows, sampling, roller numbers, files."""

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, Torque, Trajectory, Vehicle, simulate

PAPER = Vehicle.paper()
ARRAYS = (
    "t",
    "elapsed",
    "nu",
    "chi",
    "contact",
    "contact_spin",
    "spins",
    "pose",
    "energy",
    "switches",
    "dense",
    "step_rows",
)
NUMBERS = ("vehicle", "roller_model", "switching", "accuracy", "engine", "start_time", "stats")


@pytest.fixture(scope="module")
def run():
    return simulate(PAPER, nu=(1, 0, 1), spins=0.1, duration=3, start_time=2.5, accuracy=1e-10)


@pytest.fixture(scope="module")
def locked():
    return simulate(PAPER, nu=(0, 0, 1), duration=3, accuracy=1e-7, roller_model="locked", switching="smooth")


def test_shapes_and_rows(run):
    rows = len(run)
    shapes = {
        "t": (),
        "nu": (3,),
        "chi": (3,),
        "contact": (3,),
        "contact_spin": (3,),
        "spins": (3, 4),
        "pose": (3,),
        "energy": (),
    }
    for name, shape in shapes.items():
        assert getattr(run, name).shape == (rows, *shape), name
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


def test_sampling_between_rows(run):
    times = np.random.default_rng(1).uniform(2.5, 5.5, (20, 30))
    found = run.sample(times)
    assert found.nu.shape == (20, 30, 3) and found.spins.shape == (20, 30, 3, 4) and found.energy.shape == (20, 30)
    row = np.searchsorted(run.t, times, side="right") - 1
    np.testing.assert_allclose(found.energy, run.energy[row], rtol=1e-7)
    flow = run.kernel.wheel_rates(found.nu, found.chi)
    assert (found.contact_spin == flow[1]).all()
    step = 1e-4
    inside = (run.t[np.minimum(row + 1, len(run) - 1)] > times + step) & (times - step > run.t[row])
    slope = (run.sample(times[inside] + step).chi - run.sample(times[inside] - step).chi) / (2 * step)
    np.testing.assert_allclose(slope, flow[0][inside], atol=1e-4)
    axial = run.kernel.axial_speeds(found.nu, found.chi, found.spins)
    rows_axial = run.kernel.axial_speeds(run.nu, run.chi, run.spins)[row]
    np.testing.assert_allclose(axial, rows_axial, rtol=1e-12, atol=1e-14)


@pytest.mark.long
@pytest.mark.parametrize(
    ("engine", "effects"),
    [("compiled", ()), ("compiled", (Torque(0.01), Bearings(roller_viscous=1e-6))), ("python", ())],
)
def test_few_samples_are_computed_alone(effects, engine):
    """What few samples need is a part of the whole, to the bit, and the whole is not made."""
    run, whole = (
        simulate(PAPER, nu=(1, 0, 1), duration=4, effects=effects, engine=engine, control=False) for _ in range(2)
    )
    times = np.append(whole.t[[0, 10]], [0.321, 2.65])
    arrays = [getattr(whole, name) for name in ("dense", "spins", "energy", "contact_spin")]
    assert len(arrays[0]) > 12
    found, wanted = run.sample(times), whole.sample(times)
    for name in ("nu", "chi", "contact", "contact_spin", "spins", "pose", "energy"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name), err_msg=name)
    assert not {"dense", "spins", "energy", "contact_spin"} & set(vars(run))
    assert not {"spins", "energy", "contact_spin"} & set(vars(whole.sample(times)))


def test_sampling_a_number(run):
    one = run.sample(3.0)
    assert one.nu.shape == (3,) and one.energy.shape == () and one.contact.shape == (3,)
    assert (run.sample([3.0]).nu[0] == one.nu).all()


@pytest.mark.parametrize("time", [2.4999, 5.5001, np.nan, "now"])
def test_sampling_outside_is_refused(run, time):
    with pytest.raises(ValueError, match=r"^t = "):
        run.sample(time)


def test_sampled_positions_agree_with_a_run_that_ends_there(run):
    end = simulate(PAPER, nu=(1, 0, 1), spins=0.1, duration=1.7, start_time=2.5, accuracy=1e-10)
    np.testing.assert_allclose(run.sample(end.t[-1]).pose, end.pose[-1], atol=1e-9)


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


@pytest.mark.parametrize("name, content", [
    ("a.csv", b"t,nu\n1,2\n"),
    ("a.npz", b"nothing"),
    ("a.csv", b""),
    ("a.csv", b"# omniroll trajectory 2\n# {}\n"),
    ("a.txt", b""),
])  # fmt: skip
def test_other_files_are_refused(name, content, tmp_path):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=r"^path = "):
        Trajectory.load(tmp_path / name)


def test_a_torn_file_is_refused(run, tmp_path):
    for ending in ("npz", "csv"):
        path = tmp_path / f"torn.{ending}"
        run.save(path)
        path.write_bytes(path.read_bytes()[:-2000])
        with pytest.raises(ValueError, match=r"^path = "):
            Trajectory.load(path)


def test_saving_elsewhere_is_refused(run, tmp_path):
    with pytest.raises(ValueError, match="must end in"):
        run.save(tmp_path / "run.mat")
    with pytest.raises(OSError):
        run.save(tmp_path / "no" / "run.npz")


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

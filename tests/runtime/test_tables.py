"""Motions as tables of pandas, xarray and Parquet: the same numbers, with names and units."""

import numpy as np
import pandas
import pyarrow.parquet
import pytest
import xarray

import omniroll
from omniroll import vocabulary

VEHICLE = omniroll.Vehicle.paper()
MOTOR = omniroll.Motor(3.0, 0.02, 1.5, gear_ratio=4)
TIMES = np.linspace(0, 1, 41)
INSTRUMENTS = omniroll.Instruments(
    noise={"gyro": 0.01}, seed=3, tracking_places=[(0, 0.1), (0.1, 0)], tracking_directions=[0, 1], tracking_radius=0.02
)


@pytest.fixture(scope="module")
def run():
    effects = [MOTOR, omniroll.Bearings(wheel_viscous=1e-3), omniroll.Slope(0.05)]
    return omniroll.simulate(VEHICLE, nu=(1, 0.3, 1), duration=1, effects=effects)


@pytest.mark.long
def test_rows_of_the_run_are_rows_of_the_table(run):
    frame = run.to_pandas()
    assert len(frame) == len(run) and (frame.index == run.t).all()
    assert (frame[["x", "y", "theta"]].to_numpy() == run.pose).all()
    assert (frame["chi_2"] == run.chi[:, 1]).all() and (frame["spins_3_2"] == run.spins[:, 2, 0]).all()
    assert frame["contact_1"].dtype.kind == "i"
    work = run.contributions()
    assert {"drive_work", "axle_loss", "slope_work"} <= set(work) <= set(frame.columns)
    assert (frame["slope_work"] == work["slope_work"]).all()


def test_at_given_times_the_account_closes(run):
    """What the effects have brought, between rows, and what switches took are the whole change."""
    frame = run.to_pandas(TIMES)
    switches = [run.switches.energy_jump[run.switches.t <= t].sum() for t in TIMES]
    brought = frame[["drive_work", "axle_loss", "slope_work"]].sum(axis=1) + switches
    assert len(run.switches) > 2
    assert np.abs(frame["energy"] - frame["energy"].iloc[0] - brought).max() < 1e-9 * frame["energy"].max()


def test_a_dataset_has_dimensions_and_units(run):
    data = run.to_xarray(TIMES, INSTRUMENTS)
    assert data["spins"].dims == ("t", "wheel", "place") and data["place"].values.tolist() == [2, 3, 4, 5]
    assert (data["chi"].sel(wheel=2) == run.sample(TIMES).chi[:, 1]).all()
    for name in ("chi", "nu", "x", "t", "energy", "drive_work", *(entry.name for entry in vocabulary.MEASUREMENTS)):
        assert data[name].attrs["units"] and data[name].attrs["long_name"], name
    assert data.attrs["roller_model"] == "free"
    assert isinstance(data, xarray.Dataset)


def test_parquet_keeps_numbers_and_units(run, tmp_path):
    run.to_parquet(tmp_path / "run.parquet", TIMES)
    frame = pandas.read_parquet(tmp_path / "run.parquet")
    pandas.testing.assert_frame_equal(frame, run.to_pandas(TIMES), check_exact=True)
    assert frame.attrs["units"]["energy"] == "J"
    assert pyarrow.parquet.read_schema(tmp_path / "run.parquet").field("contact_1").type == "int64"


def test_instruments_need_times(run):
    with pytest.raises(omniroll.InvalidValueError, match="t = None: must be increasing times"):
        run.to_pandas(instruments=INSTRUMENTS)
    with pytest.raises(omniroll.InvalidValueError, match="within the run"):
        run.to_xarray([0.5, 2.0])


def test_ends_of_many_runs_are_a_table_and_a_dataset():
    masses, speeds = [0.5, 1.0, 2.0], [1.0, 2.0]
    starts = np.array([[1.0, 0, 1], [2.0, 0, 1]])
    many = omniroll.simulate_many(
        [[VEHICLE.replace(mass=mass)] for mass in masses], nu=starts, duration=1, times=[0, 0.5, 1]
    )
    frame = many.to_pandas({"mass": masses, "speed": speeds})
    assert frame[["mass", "speed"]].to_numpy().tolist() == [[mass, speed] for mass in masses for speed in speeds]
    assert (frame["x"] == many.end.pose[..., 0].ravel()).all()
    assert (frame["spins_3_2"] == many.end.spins[..., 2, 0].ravel()).all()
    assert set(frame.columns) - {"mass", "speed", "reason"} == set(frame.attrs["units"])
    data = many.to_xarray({"mass": masses, "speed": speeds})
    assert float(data["energy"].sel(mass=2, speed=1)) == many.end.energy[2, 0]
    assert data["samples_nu"].dims == ("mass", "speed", "sample", "component")
    assert (data["samples_x"].isel(sample=1) == many.samples.pose[..., 1, 0]).all()
    assert many.to_xarray().sizes["run_2"] == 2
    for wrong in ({"mass": masses}, {"mass": masses, "speed": masses}, {"mass": masses, "x": speeds}, ["mass"]):
        with pytest.raises(omniroll.InvalidValueError, match="axes"):
            many.to_pandas(wrong)


def test_runs_that_stopped_say_why_in_the_table():
    fast = omniroll.PathFollower(times=[0, 1], poses=[[0, 0, 0], [1, 0, 0]], sample_time=0.01, bandwidth=2.0)
    broken = omniroll.FunctionController(lambda *_: [1 / 0] * 3, sample_time=0.01)
    many = omniroll.simulate_many(VEHICLE, nu=(0, 0, 0), duration=0.02, effects=[[fast], [broken]])
    frame = many.to_pandas()
    assert frame["stopped"].tolist() == [False, True] and frame["run"].tolist() == [0, 1]
    assert frame["reason"][0] == "" and "division by zero" in frame["reason"][1]

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
INSTRUMENTS = omniroll.Instruments(noise={"gyro": 0.01}, seed=3)


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


@pytest.mark.long
def test_every_column_has_a_unit(run):
    units = run.to_pandas(TIMES, INSTRUMENTS).attrs["units"]
    assert set(units) == {"t", *run.to_pandas(TIMES, INSTRUMENTS).columns}
    wanted = {"t": "s", "y": "m", "theta": "rad", "nu_3": "1/s", "spins_1_5": "rad/s", "energy": "J", "torque_1": "N m"}
    wanted |= {"damping_2": "N m s", "drive_work": "J", "gyro": "rad/s", "accelerometer_2": "m/s^2"}
    assert {name: units[name] for name in wanted} == wanted


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


def test_readings_are_those_that_measure_gives(run):
    data, read = run.to_xarray(TIMES, INSTRUMENTS), run.measure(TIMES, INSTRUMENTS)
    for name, values in read.items():
        assert (data[name].values == values).all(), name


def test_slip_has_directions():
    ground = omniroll.Contact(coefficient=50.0)
    run = omniroll.simulate(VEHICLE, nu=(1, 0, 0.5), duration=0.1, effects=[ground])
    data = run.to_xarray()
    assert (data["slip"].sel(wheel=3, direction="along_rolling") == run.slip[:, 2, 1]).all()
    assert "slip_1_along_axle" in run.to_pandas().columns


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

"""What instruments on a robot read, each against another way to know it."""

import csv
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.vocabulary import MEASUREMENTS

VEHICLE = omniroll.Vehicle.paper()
MOTOR = omniroll.Motor(3.0, 0.02, 1.5, gear_ratio=4, current_limit=0.9)
SLOPE = omniroll.Slope(0.05, 0.3)
TIMES = np.linspace(0, 1.5, 751)
PLACE = (0.1, 0.02)
TRACKING = {
    "tracking_places": [(0.02, 0.11), (0.0, -0.1), (-0.12, 0.03)],
    "tracking_directions": [0.1, 0.0, np.pi / 2],
    "tracking_radius": 0.024,
    "tracking_counts_per_turn": 1e7,
}


@pytest.fixture(scope="module")
def run():
    return omniroll.simulate(VEHICLE, nu=(1, 0.3, 1), duration=1.5, accuracy=1e-10, effects=[MOTOR, SLOPE])


@pytest.fixture(scope="module")
def read(run):
    return run.measure(TIMES, omniroll.Instruments(counts_per_turn=1e7, place=PLACE, **TRACKING))


def test_angles_grow_as_the_rates_say():
    """Simpson's rule over the rates, which do not jump where rollers are massless; joints and rollers besides."""
    run = omniroll.simulate(VEHICLE, nu=(1, 0.3, 1), duration=1.5, roller_model="massless")
    read = run.measure(TIMES, omniroll.Instruments(counts_per_turn=1e7))
    assert len(run.switches) > 4
    rates = read["wheel_rate"]
    grown = np.cumsum((rates[:-2:2] + 4 * rates[1:-1:2] + rates[2::2]) * (TIMES[1] / 3), axis=0)
    assert np.abs(read["wheel_angle"][2::2] - read["wheel_angle"][0] - grown).max() < 1e-10
    turns = read["wheel_angle"] / (2 * np.pi) * 1e7
    assert ((turns - 1 < read["encoder_count"]) & (read["encoder_count"] <= turns)).all()
    joint = np.pi / 5
    assert np.abs((read["wheel_angle"] - run.sample(TIMES).chi + joint / 2) % (2 * joint) - joint / 2).max() < 1e-12
    assert (read["contact_roller"] == run.sample(TIMES).contact).all()


def test_motors_read_what_drives_them(read):
    """The winding has the voltage that was given, but at the limit, where the current has its own."""
    limited = np.isclose(np.abs(read["motor_current"]), 0.9, rtol=1e-12)
    assert limited.any() and not limited.all()
    assert np.abs(read["motor_voltage"][~limited] - 3.0).max() < 1e-9
    assert (np.abs(read["motor_voltage"][limited]) < 3.0).all()
    assert np.allclose(read["net_torque"], 4 * 0.02 * read["motor_current"], rtol=1e-14)


def test_the_accelerometer_feels_the_place_less_gravity(run, read):
    """Second differences of the place's path in fixed axes, inside phases."""
    step = 1e-4
    times = np.array([0.111, 0.4, 0.777, 1.3])
    switches = run.switches["t"]
    times = times[[not ((switches > t - 2 * step) & (switches < t + 2 * step)).any() for t in times]]
    assert len(times) > 2

    def path(t):
        x, y, theta = run.sample(t).pose.T
        cosine, sine = np.cos(theta), np.sin(theta)
        return np.stack([x + PLACE[0] * cosine - PLACE[1] * sine, y + PLACE[0] * sine + PLACE[1] * cosine], axis=-1)

    pull = 9.80665 * np.sin(0.05) * np.array([np.cos(0.3), np.sin(0.3)])
    felt = (path(times + step) - 2 * path(times) + path(times - step)) / step**2 - pull
    theta = run.sample(times).pose[:, 2]
    wanted = np.stack([
        np.cos(theta) * felt[:, 0] + np.sin(theta) * felt[:, 1], np.cos(theta) * felt[:, 1] - np.sin(theta) * felt[:, 0]
    ], axis=-1)  # fmt: skip
    found = run.measure(times, omniroll.Instruments(place=PLACE))
    assert np.abs(found["accelerometer"] - wanted).max() < 1e-4 * np.abs(wanted).max()
    assert np.allclose(found["gyro"], run.sample(times).nu[:, 2] / VEHICLE.yaw_scale)


def test_odometry_follows_the_pose(run, read):
    """Dead reckoning errs by how much nu changes within a step: its square root of the number of steps is not seen."""
    far = np.abs(read["odometry"] - run.sample(TIMES).pose).max()
    coarse = run.measure(TIMES[::10], omniroll.Instruments(counts_per_turn=1e7))["odometry"]
    assert far < 1e-3 and far < np.abs(coarse - run.sample(TIMES[::10]).pose).max() / 20
    few = run.measure(TIMES, omniroll.Instruments(counts_per_turn=50))["odometry"]
    assert np.abs(few - run.sample(TIMES).pose).max() > 10 * far


def test_tracking_wheels_turn_as_their_places_move(run, read):
    """Chords of each place's path in fixed axes, projected on the wheel's direction half way; nu jumps at switches."""

    def grown(times):
        x, y, theta = run.sample(times).pose.T
        middle = run.sample((times[1:] + times[:-1]) / 2).pose[:, 2]
        found = []
        for (ahead, left), direction in zip(TRACKING["tracking_places"], TRACKING["tracking_directions"], strict=True):
            east, north = (
                x + ahead * np.cos(theta) - left * np.sin(theta), y + ahead * np.sin(theta) + left * np.cos(theta)
            )  # fmt: skip
            steps = np.diff(east) * np.cos(middle + direction) + np.diff(north) * np.sin(middle + direction)
            found.append(steps.sum() / 0.024)
        return np.array(found)

    coarse, fine = (np.abs(read["tracking_angle"][-1] - grown(np.linspace(0, 1.5, n))).max() for n in (3001, 12001))
    assert fine < 1e-6 * np.abs(read["tracking_angle"][-1]).max() and coarse > 2 * fine
    turns = read["tracking_angle"] / (2 * np.pi) * 1e7
    assert ((turns - 1 < read["tracking_count"]) & (read["tracking_count"] <= turns)).all()
    step = 1e-5
    ahead, behind = (run.measure(TIMES[1:-1:50] + way, omniroll.Instruments(**TRACKING)) for way in (step, -step))
    slopes = (ahead["tracking_angle"] - behind["tracking_angle"]) / (2 * step)
    assert np.abs(slopes - read["tracking_rate"][1:-1:50]).max() < 1e-3 * np.abs(slopes).max()


def test_tracking_wheels_reckon_the_pose(run, read):
    """Three of them, or two and the gyro; slip of the driven wheels is no matter."""
    pose = run.sample(TIMES).pose
    assert np.abs(read["tracking_odometry"] - pose).max() < 1e-5
    two = TRACKING | {name: TRACKING[name][::2] for name in ("tracking_places", "tracking_directions")}
    assert np.abs(run.measure(TIMES, omniroll.Instruments(**two))["tracking_odometry"] - pose).max() < 1e-4
    one = TRACKING | {name: TRACKING[name][:1] for name in ("tracking_places", "tracking_directions")}
    assert "tracking_odometry" not in run.measure(TIMES, omniroll.Instruments(**one))
    ground = [omniroll.Torque(0.2), omniroll.Contact(2.0)]
    slips = omniroll.simulate(VEHICLE, nu=(1, 0.3, 1), duration=1.5, roller_model="massless", effects=ground)
    found, pose = slips.measure(TIMES, omniroll.Instruments(**TRACKING)), slips.sample(TIMES).pose
    assert np.abs(found["odometry"] - pose).max() > 0.1 and np.abs(found["tracking_odometry"] - pose).max() < 1e-4


def test_errors_are_those_that_are_asked_for(run, read):
    assert set(read) == {entry.name for entry in MEASUREMENTS}
    errors = {"noise": {"gyro": 0.1}, "bias": {"wheel_rate": 0.5}, "resolution": {"net_torque": 0.01}}
    found = run.measure(TIMES, omniroll.Instruments(counts_per_turn=1e7, place=PLACE, seed=3, **errors))
    noise = found["gyro"] - read["gyro"]
    assert abs(noise.std() - 0.1) < 0.01 and abs(noise.mean()) < 0.02
    assert np.allclose(found["wheel_rate"] - read["wheel_rate"], 0.5, atol=1e-12)
    assert np.abs(found["net_torque"] / 0.01 - np.round(found["net_torque"] / 0.01)).max() < 1e-9
    assert 0.002 < np.abs(found["net_torque"] - read["net_torque"]).max() <= 0.005 * (1 + 1e-9)
    assert np.array_equal(found["accelerometer"], read["accelerometer"])
    again = run.measure(TIMES, omniroll.Instruments(counts_per_turn=1e7, seed=3, **errors))
    other = run.measure(TIMES, omniroll.Instruments(counts_per_turn=1e7, seed=4, **errors))
    assert np.array_equal(again["gyro"], found["gyro"]) and not np.array_equal(other["gyro"], found["gyro"])


@pytest.mark.parametrize("changes, field", [
    ({"counts_per_turn": 0}, "counts_per_turn"),
    ({"noise": {"compass": 0.1}}, "noise"),
    ({"noise": {"gyro": -0.1}}, "noise of gyro"),
    ({"tracking_places": [(0, 0.1)]}, "tracking_directions"),
    (TRACKING | {"tracking_directions": [0.1]}, "tracking_directions"),
    (TRACKING | {"tracking_radius": 0}, "tracking_radius"),
])  # fmt: skip
def test_instruments_that_cannot_be(changes, field):
    with pytest.raises(omniroll.InvalidValueError) as refused:
        omniroll.Instruments(**changes)
    assert refused.value.field == field


def test_a_session_reads_the_same(run):
    instruments = omniroll.Instruments(counts_per_turn=1e7, place=PLACE, **TRACKING)
    session = omniroll.Session(VEHICLE, nu=(1, 0.3, 1), accuracy=1e-10, effects=[MOTOR, SLOPE], driven=False)
    for duration in (0.3, 0.0, 0.7):
        session.step(duration)
    found, wanted = session.measure(instruments), run.measure([1.0], instruments)
    assert set(found) == set(wanted) - {"odometry", "tracking_odometry", "tracking_angle", "tracking_count"}
    for name, value in found.items():
        assert np.allclose(value, wanted[name][0], rtol=1e-6, atol=3 if name == "encoder_count" else 1e-6), name
    saved = session.save()
    session.step(0.5)
    session.restore(saved)
    assert all(np.array_equal(value, session.measure(instruments)[name]) for name, value in found.items())
    session.reset()
    assert np.array_equal(session.measure()["wheel_angle"], session.chi)


SCENE = """[vehicle]
preset = "paper"
[start]
nu = [1, 0, 1]
[run]
duration = 0.5
step = 0.1
[measurements]
counts_per_turn = 1000
place = [0.1, 0.0]
gyro_noise = 0.01
seed = 2
tracking_places = [[0, "100 mm"], [0, -0.1], [-0.12, 0]]
tracking_directions = [0, 0, "90 deg"]
tracking_radius = 0.024
tracking_rate_noise = 0.1
"""


def test_a_scene_writes_them_into_its_samples(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    assert cli.main(["run", str(path), "--output", str(tmp_path / "out")]) == 0
    with (tmp_path / "out/samples.csv").open() as file:
        rows = list(csv.DictReader(file))
    made = omniroll.Trajectory.load(tmp_path / "out/trajectory.npz")
    tracking = {"tracking_places": [(0, 0.1), (0, -0.1), (-0.12, 0)], "tracking_directions": [0, 0, np.pi / 2]}
    errors = {"noise": {"gyro": 0.01, "tracking_rate": 0.1}}
    instruments = omniroll.Instruments(1000, (0.1, 0.0), 2, **errors, **tracking, tracking_radius=0.024)
    wanted = made.measure(0.1 * np.arange(6), instruments)
    assert [float(row["gyro"]) for row in rows] == wanted["gyro"].tolist()
    assert [float(row["accelerometer_2"]) for row in rows] == wanted["accelerometer"][:, 1].tolist()
    assert [row["encoder_count_3"] for row in rows] == [str(count) for count in wanted["encoder_count"][:, 2]]
    for name in ("tracking_count", "tracking_rate", "tracking_odometry"):
        assert [float(row[f"{name}_3"]) for row in rows] == wanted[name][:, 2].tolist()
    path.write_text(SCENE.replace('[0, 0, "90 deg"]', "[0, 0]"))
    with pytest.raises(omniroll.SceneError, match=r":14: \[measurements\] tracking_directions = .*must be 3 numbers"):
        omniroll.load_scene(path)
    path.write_text(SCENE.replace("step = 0.1\n", ""))
    with pytest.raises(omniroll.SceneError, match=r"\[measurements\]: needs \[run\] step or times"):
        omniroll.load_scene(path)


def test_the_pages_table_is_the_one_table():
    page = (Path(__file__).parents[2] / "docs/measurements.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    assert rows == [f"| `{e.name}` | {e.unit} | {e.kind.shown()} | {e.meaning} |" for e in MEASUREMENTS]

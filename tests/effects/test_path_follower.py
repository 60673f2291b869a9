"""The controller of the pose: exact where its model is, errors that fade as they should, the same by motors."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import omniroll
from omniroll.effects.path_follower import growth

VEHICLE = omniroll.Vehicle.paper()
MOTOR = omniroll.Motor(0.0, 0.012, 2.5, gear_ratio=20)
AT_REST = dict(nu=(0, 0, 0), control=False)


def path(duration: float = 3.0) -> tuple[np.ndarray, np.ndarray]:
    """Round a curve, with a turn of the heading."""
    part = np.linspace(0, 1, 13)
    phase = np.pi * (3 * part**2 - 2 * part**3)
    return duration * part, np.stack([0.5 * np.sin(phase), 0.5 - 0.5 * np.cos(phase), -phase], axis=1)


def distance(sample_time: float, model: str, bandwidth: float = 6.0) -> float:
    """The largest distance from the path, in m and rad."""
    times, poses = path()
    follower = omniroll.PathFollower(times, poses, sample_time, bandwidth)
    run = omniroll.simulate(VEHICLE, duration=3, effects=[follower], roller_model=model, accuracy=1e-8, **AT_REST)
    at = np.linspace(0, 3, 301)
    return float(np.abs(run.sample(at).pose - CubicSpline(times, poses, bc_type="clamped")(at)).max())


def test_massless_rollers_are_on_the_path_but_for_the_sampling():
    """The feedforward is exact: what is left comes of outputs that are held, and falls with the sample time squared."""
    coarse, fine = distance(0.02, "massless"), distance(0.01, "massless")
    assert fine < 1e-4 and 3.3 < coarse / fine < 4.7


def test_feedback_takes_what_the_rollers_do():
    slow, fast = distance(0.005, "free", 4.0), distance(0.005, "free", 8.0)
    assert distance(0.005, "massless") < fast < slow / 2 < 0.01


def test_an_error_fades_as_its_equation_says():
    """e''' + 3 b e'' + 3 b^2 e' + b^3 e = 0, from e = 1, e' = 0 and no sum: e = (1 + b t - (b t)^2) exp(-b t)."""
    bandwidth, target = 4.0, np.array([0.1, -0.05, 0.2])
    follower = omniroll.PathFollower([0.0], [target], 5e-4, bandwidth)
    run = omniroll.simulate(VEHICLE, duration=1.5, effects=[follower], roller_model="massless", **AT_REST)
    at = np.linspace(0, 1.5, 31)
    scaled = bandwidth * at
    wanted = (1 + scaled - scaled**2) * np.exp(-scaled)
    assert np.abs((target - run.sample(at).pose) / target - wanted[:, None]).max() < 3e-3


@pytest.mark.parametrize("limit, waits", [(None, False), (1e-3, True)])
def test_a_sample_that_is_cut_off_leaves_the_sums(limit, waits):
    follower = omniroll.PathFollower([0.0], [[0.1, 0.2, 0.3]], 0.01, 6.0, limit=limit)
    process = follower.process(omniroll.kernel(VEHICLE), 0.0)
    process.pass_time(SimpleNamespace(nu=np.zeros(3), chi=np.zeros(3), pose=np.zeros(3)))
    assert process.sum == pytest.approx(np.zeros(3) if waits else 0.01 * np.array([0.1, 0.2, 0.3]))
    assert (np.abs(process.output) <= 1e-3).all() == waits


def test_a_limit_holds_and_the_vehicle_arrives():
    times, poses = path()
    free = omniroll.simulate(VEHICLE, duration=3, effects=[omniroll.PathFollower(times, poses, 0.01, 6.0)], **AT_REST)
    limit = 0.7 * np.abs(free.drive[:, 0]).max()
    follower = omniroll.PathFollower(times, poses, 0.01, 6.0, limit=limit)
    run = omniroll.simulate(VEHICLE, duration=6, effects=[follower], **AT_REST)
    assert np.abs(run.drive[:, 0]).max() == limit
    assert np.abs(run.pose[-1] - poses[-1]).max() < 0.01


def test_growth_is_that_of_the_errors():
    """Against the errors themselves, sample by sample; the bound of warnings lies between."""
    for bandwidth in (0.2, 0.5, 0.8):
        error, rate, summed, sizes = 1.0, 0.0, 0.0, []
        for _ in range(400):
            summed += error
            pull = 3 * bandwidth**2 * error + 3 * bandwidth * rate + bandwidth**3 * summed
            error, rate = error + rate - pull / 2, rate - pull
            sizes.append(np.hypot(error, rate))
        assert (sizes[-1] > sizes[0]) == (growth(bandwidth) > 1)
    assert growth(0.2) < 1 < growth(0.8)
    times, poses = path()
    with pytest.warns(omniroll.UnstableControllerWarning, match="errors of the path grow"):
        omniroll.simulate(VEHICLE, duration=0, effects=[omniroll.PathFollower(times, poses, 0.1, 8.0)], **AT_REST)


@pytest.mark.parametrize("change, field", [
    ({"poses": [[0, 0], [1, 0]]}, "poses"),
    ({"times": [1.0, 0.0]}, "times"),
    ({"bandwidth": 0.0}, "bandwidth"),
    ({"output": "voltage"}, "output"),
    ({"poses": [[0, 0, 0]]}, "poses"),
])  # fmt: skip
def test_wrong_numbers_are_refused(change, field):
    given = {"times": [0.0, 1.0], "poses": [[0, 0, 0], [1, 0, 0]], "sample_time": 0.01, "bandwidth": 5.0} | change
    with pytest.raises(omniroll.InvalidValueError) as raised:
        omniroll.simulate(VEHICLE, duration=1, effects=[omniroll.PathFollower(**given)], **AT_REST)
    assert raised.value.field == field


def test_wheels_that_cannot_drive_everywhere_are_refused():
    two = VEHICLE.replace(wheels=2, wheel_angles=None)
    with pytest.raises(omniroll.InvalidValueError, match="in every direction"):
        omniroll.simulate(two, duration=1, effects=[omniroll.PathFollower([0.0], [[0, 0, 0]], 0.01, 5.0)], **AT_REST)


def test_the_scene_follows_its_path(tmp_path):
    scene = omniroll.load_scene("scenes/figure-eight.toml")
    run = omniroll.run(scene, duration=4.5)
    times, poses = np.array(scene.tables["path"]["times"]), np.array(scene.tables["path"]["poses"])
    away = run.sample(times[:4]).pose - poses[:4]
    assert np.abs(away).max() < 5e-3


def test_voltages_do_what_torques_do():
    """With motors the same path, as closely: the voltages make the same torques in the middle of each sample."""
    times, poses = path()
    ends = []
    for effects in ([{"output": "torque"}], [{"output": "voltage"}, MOTOR]):
        follower = omniroll.PathFollower(times, poses, 0.01, 6.0, **effects[0])
        run = omniroll.simulate(
            VEHICLE, duration=3, effects=[follower, *effects[1:]], roller_model="massless", **AT_REST
        )
        ends.append(run.sample(np.linspace(0, 3, 61)).pose)
    assert np.abs(ends[0] - ends[1]).max() < 2e-4


def test_both_engines_and_a_session_follow_alike():
    times, poses = path()
    options = dict(effects=[omniroll.PathFollower(times, poses, 0.02, 5.0)], accuracy=1e-9)
    runs = [
        omniroll.simulate(VEHICLE, duration=1, engine=engine, **AT_REST, **options) for engine in ("compiled", "python")
    ]
    assert np.abs(runs[0].pose[-1] - runs[1].pose[-1]).max() < 1e-7
    session = omniroll.Session(VEHICLE, **options)
    session.step(0.33)
    saved = session.save()
    session.step(0.67)
    assert np.abs(session.pose - runs[0].pose[-1]).max() < 1e-7
    end = session.pose.copy()
    session.restore(saved)
    session.step(0.67)
    assert (session.pose == end).all()

"""Wheels that slip beside MuJoCo's model with a body for each roller, and the same coefficient of friction."""

import numpy as np
import pytest

import omniroll

pytest.importorskip("mujoco")
from benchmarks.ground_in_mujoco import ANGLES, driven, here, in_mujoco, model, vehicle  # noqa: E402

pytestmark = pytest.mark.long


def way_of(run):
    return np.hypot(*np.diff(run.sample(np.linspace(0, run.t[-1], 2001)).pose[:, :2], axis=0).T).sum()


@pytest.mark.parametrize("friction, rolls", [(0.3, 0.03), (0.1, 0.1), (0.08, 0.15)])
def test_ends_are_within_0_8_percent_of_the_way_where_rolling_is_not(friction, rolls):
    """At two steps of MuJoCo, so that it is not its step that makes the distance. Rolling without slip is far away."""
    run = here(omniroll.Contact(law="coulomb", friction=friction))
    rolling, ends = here(), [in_mujoco(friction, step) for step in (1e-4, 5e-5)]
    apart, far = ([np.hypot(*(own.pose[-1] - end)[:2]) / way_of(run) for end in ends] for own in (run, rolling))
    assert not run.sticks.all() and max(apart) < 0.008
    assert min(far) > rolls


HEIGHT, LIGHT = 0.06, 2e-6  # m, of the centre of mass; kg m^2, of rollers that a switch hardly brakes


@pytest.mark.parametrize("along, on_springs, at_rest", [("ahead", 0.006, 0.03), ("sideways", 0.025, 0.01)])
def test_a_hard_stop_ends_where_mujoco_ends_if_loads_follow_the_motion(along, on_springs, at_rest):
    """From 0.4 m/s, with wheels that slip as they brake. Ahead, loads at rest are far off: the wheels that brake lie
    behind, and are lighter than at rest."""
    way = np.sin(ANGLES) if along == "ahead" else -np.cos(ANGLES)
    times, torques = np.array([0.0, 0.4, 0.41, 0.8]), np.outer([0.15, 0.15, -0.4, -0.4], way)
    ends = [driven(model(0.5, step, HEIGHT, LIGHT), times, torques, 0.55) for step in (1e-4, 5e-5)]
    ground, drive = omniroll.Contact(law="coulomb", friction=0.5), omniroll.TorqueTable(tuple(times), torques)

    def apart(*effects):
        run = omniroll.simulate(vehicle(LIGHT), nu=(0, 0, 0), duration=0.55, effects=[drive, ground, *effects])
        return max(np.hypot(*(run.pose[-1, :2] - end)) for end in ends) / way_of(run)

    assert apart(omniroll.Springs(height=HEIGHT, damping_ratio=0.7)) < on_springs
    assert apart() > at_rest

"""Wheels that slip beside MuJoCo's model with a body for each roller, and the same coefficient of friction."""

import numpy as np
import pytest

import omniroll

pytest.importorskip("mujoco")
from benchmarks.ground_in_mujoco import DURATION, here, in_mujoco  # noqa: E402

pytestmark = pytest.mark.long


def way_of(run):
    return np.hypot(*np.diff(run.sample(np.linspace(0, DURATION, 2001)).pose[:, :2], axis=0).T).sum()


@pytest.mark.parametrize("friction, rolls", [(0.3, 0.03), (0.1, 0.1), (0.08, 0.15)])
def test_ends_are_within_0_8_percent_of_the_way_where_rolling_is_not(friction, rolls):
    """At two steps of MuJoCo, so that it is not its step that makes the distance. Rolling without slip is far away."""
    run = here(omniroll.Contact(law="coulomb", friction=friction))
    rolling, ends = here(), [in_mujoco(friction, step) for step in (1e-4, 5e-5)]
    apart, far = ([np.hypot(*(own.pose[-1] - end)[:2]) / way_of(run) for end in ends] for own in (run, rolling))
    assert not run.sticks.all() and max(apart) < 0.008
    assert min(far) > rolls

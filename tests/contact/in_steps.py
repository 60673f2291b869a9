"""A session that passes the time of a run in steps of random lengths."""

import numpy as np
import pytest

from omniroll import Session, Trajectory, Vehicle, simulate


def assert_a_session_ends_as_the_run(
    vehicle: Vehicle, *, duration: float, control: bool = False, **options
) -> Trajectory:
    """The run, at whose end the session has the same motion and the same rates of its wheels.

    options  arguments of simulate that a session takes, too
    """
    run = simulate(vehicle, duration=duration, control=control, **options)
    session = Session(vehicle, driven=False, **options)
    for step in np.random.default_rng(1).dirichlet(np.ones(20)) * duration:
        session.step(step)
    assert session.wheel_speeds == pytest.approx(run.quantity("rates")[-1], rel=1e-8, abs=1e-9)
    assert session.nu == pytest.approx(run.nu[-1], rel=1e-8, abs=1e-9)
    return run

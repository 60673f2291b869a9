"""What the summary says of slip: forces on the body are those that move it, paths those of the contacts."""

from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll.results.slip_in_short import _on_platform, slip_in_short

SCENE = Path(__file__).resolve().parents[2] / "scenes/wheel-spin.toml"


def test_the_ground_moves_the_body_by_the_forces_that_are_told():
    """The heading stays, and rollers are massless: the mass times the speed of S is the integral of the force."""
    run = omniroll.run(omniroll.load_scene(SCENE))
    force = _on_platform(run)
    gained = run.vehicle.mass * run.vehicle.platform_radius * (run.nu[-1, :2] - run.nu[0, :2])
    assert np.trapezoid(force, run.t, axis=0) == pytest.approx(gained, rel=1e-6)
    said = slip_in_short(run)
    assert said["force"] == pytest.approx(np.abs(force).max(axis=0))
    # Two of three wheels push, each 30 degrees beside the way; the largest force is that at which they stick.
    assert np.hypot(*said["force"]) == pytest.approx(2 * 0.3 * run.ground_load[0, 0] * np.cos(np.pi / 6), rel=1e-6)
    assert np.hypot(*said["friction"]) == pytest.approx(2 / 3 * 0.3 * np.cos(np.pi / 6), rel=1e-6)


def test_a_wheel_that_stands_on_a_viscous_ground_slips_as_far_as_the_body_goes():
    locked = omniroll.Bearings(wheel_coulomb=1e3)
    ground = omniroll.Contact(law="coulomb", friction=0.1)
    vehicle = omniroll.Vehicle.paper()
    run = omniroll.simulate(vehicle, nu=(1, 0, 0), duration=3, roller_model="massless", effects=[locked, ground])
    said = slip_in_short(run)
    assert said["distance"] == pytest.approx(np.linalg.norm(run.pose[-1, :2] - run.pose[0, :2]), rel=1e-6)
    first = said["slip_path"][1] / said["distance"]  # its axle lies at 120 degrees from the way
    assert first == pytest.approx(np.sin(np.radians(120)), rel=1e-3)


def test_wheels_that_roll_say_nothing():
    assert slip_in_short(omniroll.simulate(omniroll.Vehicle.paper(), nu=(1, 0, 0), duration=0.1)) is None

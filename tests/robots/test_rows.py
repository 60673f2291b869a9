"""Robots whose wheels have two rows of rollers, beside their presets, which have one."""

import numpy as np
import pytest

import omniroll
from omniroll.robots.catalogue import ROBOTS

IN_ROWS = [robot for robot in ROBOTS.values() if robot.row_offset]


@pytest.mark.parametrize("robot", IN_ROWS, ids=lambda robot: robot.name)
def test_rows_beside_a_preset(tmp_path, robot):
    """Turning, a wheel's rate at the start is that of the outer row's lever; the inertias are those of the preset."""
    path = tmp_path / "scene.toml"
    keys = f"preset = '{robot.name}'\nrows = 2\nrow_offset = {robot.row_offset}\n"
    path.write_text(f"[vehicle]\n{keys}[start]\ntwist = [0, 0, 1]\n[run]\nduration = 0.1\n")
    scene = omniroll.load_scene(path)
    found, plain = scene.vehicle, robot.vehicle
    assert (found.rows, found.row_offset) == (2, robot.row_offset)
    assert found.with_wheels_of_the_paper() == plain.replace(yaw_scale=found.yaw_scale)
    run = omniroll.run(scene)
    rates = np.abs(run.measure(run.t[:1], names=("wheel_rate",))["wheel_rate"][0])
    turning = run.nu[0, 2] / found.yaw_scale
    assert rates == pytest.approx(turning * (found.platform_radius + robot.row_offset) / found.wheel_radius, rel=1e-12)

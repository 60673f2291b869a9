"""Massless rollers beside contacts that stick, whose loads follow the motion: loads far from the last ones, where those
have no solution, and over which edge the vehicle tips where there are none."""

import re

import numpy as np
import pytest

from contact.test_axles_under_loads import run_or_stop
from contact.test_damped_rollers_and_loads import scene
from contact.test_massless_rollers_and_loads import scene as scene_without_viscous_friction
from contact.test_massless_rollers_that_stick import LAW, residuals
from contact.test_massless_rollers_that_stick_and_drag import assert_rows_obey
from omniroll.effects.rounds_with_loads import root
from omniroll.effects.tipping import where_it_tips
from omniroll.effects.where_it_stands import where_it_may_stand

CORNERS = np.array([[0.2, 0.15], [-0.2, 0.15], [-0.2, -0.15], [0.2, -0.15]])
ENGINES = pytest.mark.parametrize("engine", ["compiled", pytest.param("python", marks=pytest.mark.long)])


class Wheels:
    """Of a vehicle whose wheels are on rays from its centre, in the state (nu, chi = 0) in which a scene begins with
    wheels that roll: unit vectors along the axles and the rolling directions, places, and rates."""

    def __init__(self, vehicle, options):
        angles = np.array(vehicle.wheel_angles)
        self.vehicle, self.nu = vehicle, np.array(options["nu"])
        self.axles = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self.rolling = np.stack([-np.sin(angles), np.cos(angles)], axis=1)
        self.places = vehicle.platform_radius * self.axles
        self.speed, self.yaw_rate = vehicle.platform_radius * self.nu[:2], self.nu[2] / vehicle.yaw_scale
        self.rates = -(self.rolling @ self.speed + vehicle.platform_radius * self.yaw_rate) / vehicle.wheel_radius

    def moments(self, force, torque, height):
        """(2,) sum N p that Euler's equation of the whole vehicle asks for, under forces (N, 2) of the ground and
        torques (N,) at the axles."""
        inertia, lever = self.vehicle.wheel_inertia, self.vehicle.wheel_radius
        spins = (torque + lever * force[:, 1])[:, None] * self.axles
        turned = inertia * self.rates[:, None] * self.yaw_rate * self.rolling
        pushed = (force[:, :1] * self.axles + force[:, 1:] * self.rolling).sum(axis=0)
        x, y = (spins + turned).sum(axis=0) + height * np.array([-pushed[1], pushed[0]])
        return np.array([-y, x])


@ENGINES
@pytest.mark.parametrize("number, loads", [(70, (3.3734, 12.596, 7.5664, 0)), (76, (0, 0, 2.8606, 16.0892, 10.4701))])
def test_loads_are_found_that_are_far_from_the_last_ones(number, loads, engine):
    """The loads are those of a grid over all points at which they may act, on equations of its own. Under the loads at
    rest other rollers turn, and in their modes no contacts carry."""
    vehicle, options = scene(number, 0.1, 0.3)
    run, why = run_or_stop(vehicle, options, engine, 1e-6)
    assert not why
    assert run.ground_load[0] == pytest.approx(loads, abs=1e-3)
    assert_rows_obey(vehicle, options, run, number, LAW)
    ground, _, drive, _ = options["effects"]
    wheels = Wheels(vehicle, options)
    asked = wheels.moments(run.ground_force[0], np.array(drive.torque)[0], ground.height)
    assert run.ground_load[0] @ wheels.places == pytest.approx(asked, abs=1e-12 * run.ground_load.sum())


def test_cells_find_loads_that_no_start_leads_to():
    """The grid says loads of 19.202, 4.494, 0, 0 and 8.176 N in the last round; the determinant is negative there."""
    vehicle, options = scene(66, 0.1, 0.3)
    _, why = run_or_stop(vehicle, options, "compiled", 1e-6)
    assert "friction have several solutions" in why


@ENGINES
def test_where_no_loads_stand_it_tips(engine):
    """All contacts slip along their axles, on rollers that stick: forces are linear in loads. The weight on one edge
    acts where what the motion asks for is straight beyond it."""
    vehicle, options = scene(3)
    _, why = run_or_stop(vehicle, options, engine, 1e-6)
    ground, bearings, drive, _ = options["effects"]
    wheels = Wheels(vehicle, options)
    torque = np.array(drive.torque) - np.sign(wheels.rates) * np.array(bearings.wheel_coulomb)
    weight = vehicle.mass * ground.normal_gravity
    along, edge = wheels.axles @ wheels.speed, wheels.places[3] - wheels.places[2]

    def beyond(part):
        loads = weight * np.array([0, 0, 1 - part, part, 0])
        force = np.stack([-np.sign(along) * np.array(ground.friction)[0] * loads, 0 * loads], axis=1)
        return wheels.moments(force, torque, ground.height) / weight - loads @ wheels.places / weight

    first, last = (beyond(part) @ edge for part in (0.0, 1.0))
    off = beyond(first / (first - last))
    outwards = off @ np.array([edge[1], -edge[0]]) / np.linalg.norm(edge)
    assert first > 0 > last and outwards > 0
    told = re.search(r"tips over the edge of its wheels 2 and 3: the loads act there, ([\d.]+) mm beyond it", why)
    assert told, why
    assert float(told[1]) == pytest.approx(1000 * outwards, rel=2e-3)


def test_the_compiled_engine_finds_loads_of_which_a_bearing_takes_nearly_all():
    """Where a bearing leaves what goes with its load more than in proportion, one set of modes has several loads."""
    vehicle, options = scene_without_viscous_friction(601, 0.25)
    run, why = run_or_stop(vehicle, options, "compiled", 0.003)
    assert not why
    assert run.ground_load[0] == pytest.approx((2.923, 0, 4.341, 12.742, 11.865), abs=1e-3)
    assert max(residuals(vehicle, options["effects"], run).values()) <= LAW


# ---- maps of a polygon -----------------------------------------------------------------------------------------------


def test_a_cell_is_found_where_a_map_vanishes():
    """One that bends where it does."""
    point, slope = np.array([0.11, -0.06]), np.array([[1.0, 0.4], [-0.7, 0.5]])

    def moved(at):
        off = slope @ (point - at)
        return off + 0.9 * np.abs(off[0]) * np.array([0.5, 1])

    (near,) = where_it_may_stand(CORNERS, moved)
    assert np.linalg.norm(near - point) < 0.03
    assert root(moved, near, 1.0) == pytest.approx(point, abs=1e-9)
    assert not list(where_it_may_stand(CORNERS, lambda at: np.array([0.3, 0.01]) - at))


@pytest.mark.parametrize("point", [(0.23, 0.05), (-0.21, -0.1), (0.01, 0.4), (0.3, 0.2), (-0.25, -0.2)])
def test_it_tips_where_the_map_leads_straight_out(point):
    found = where_it_tips(CORNERS, lambda at, _: np.array(point) - at)
    assert found == pytest.approx(point, abs=1e-6)
    assert where_it_tips(CORNERS, lambda at, _: np.array([0.1, 0.05]) - at) is None

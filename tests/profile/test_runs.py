"""Rollers with a meridian of their own: radii of wheels of spheres, energy, the weight's work, what goes with them and
what does not. tests/mecanum/test_all_bodies.py has them beside a model of all bodies."""

from functools import partial

import numpy as np
import pytest

import omniroll
from omniroll import Vehicle
from omniroll.effects import Weight
from omniroll.kernels.kernel import kernel
from omniroll.vehicles import profiles

MODELS = ("massless", "locked", "free")
PAPER = Vehicle.paper(4, 9)
THICK = PAPER.wheel_radius - PAPER.roller_axis_radius
BALLS = PAPER.replace(meridian_radius=THICK)
BARRELS = PAPER.replace(meridian_radius=0.7 * PAPER.wheel_radius, roller_angle=0.6)
EDGES = [[-0.3 * THICK, THICK, 0], [0.3 * THICK, THICK, 0]]
CYLINDERS = PAPER.replace(roller_profile=EDGES)
ROUNDED = PAPER.replace(roller_angle=0.6, roller_profile=[
    [-0.5 * THICK, 0.75 * THICK, 0.2 * THICK], [0, 0.6 * THICK, 0.4 * THICK],
    [0.5 * THICK, 0.75 * THICK, 0.2 * THICK],
])  # fmt: skip
NU = (3.0, -2.0, 2.5)
PROFILES = {"spheres": BALLS, "mecanum barrels": BARRELS, "cylinders": CYLINDERS, "mecanum, rounded": ROUNDED}
VEHICLES = pytest.mark.parametrize("vehicle", PROFILES.values(), ids=PROFILES)


def run(vehicle, nu=NU, duration=1.0, **options):
    return omniroll.simulate(vehicle, nu=nu, duration=duration, **{"accuracy": 1e-12, "control": False} | options)


def height(vehicle, turn, psi):
    """Of a wheel's centre, on the arc that carries at this angle."""
    arc = next(piece.arc for piece in profiles.pieces(vehicle, psi) if turn <= piece.last)
    return profiles.ride(arc, vehicle, turn, psi)["height"]


def spheres(count, radius, axis_radius):
    """PickNik's wheels of spheres (moveit_pro_example_ws, hangar_sim)."""
    sizes = {"wheel_radius": radius + axis_radius, "roller_axis_radius": axis_radius, "meridian_radius": radius}
    return profiles.riding(PAPER.replace(rollers_per_wheel=count, roller_angle=np.pi / 4, **sizes))


def test_rolling_radii_of_wheels_of_spheres_are_those_that_were_published():
    """71.378 to 75.900 mm of eight spheres; of twelve the hull's radius, 75.630 mm in the mean."""
    eight, twelve = spheres(8, 16.5, 59.4), spheres(12, 52.16, 23.74)
    assert [eight["lowest"], eight["highest"]] == pytest.approx([71.378, 75.9], abs=5e-4)
    assert twelve["forward_radius"] == pytest.approx(75.630, abs=5e-4)
    assert eight["forward_radius"] == pytest.approx(16.5 + 59.4 * np.sin(np.pi / 8) / (np.pi / 8), rel=1e-14)
    pitch = np.pi / 8
    aside = (16.5 * np.sin(pitch) + 59.4 * (pitch + np.sin(2 * pitch) / 2) / 2) / pitch
    assert eight["sideways_radius"] == pytest.approx(aside, rel=1e-14)


def test_straight_ahead_a_wheel_turns_by_the_height_of_its_centre():
    places = [[x, y] for x in (0.1, -0.1) for y in (0.1, -0.1)]
    vehicle = BALLS.replace(wheel_angles=[np.pi / 2] * 4, wheel_places=places)
    joint = np.pi / 9
    chi = np.linspace(-joint, joint, 21)[:, None] * np.ones(4)
    height = PAPER.roller_axis_radius * np.cos(chi) + THICK
    rates = kernel(vehicle, "massless").wheel_speeds((1 / vehicle.platform_radius, 0, 0), chi)
    np.testing.assert_allclose(rates, 1 / height, rtol=1e-14)
    found = run(vehicle, (0.5 / vehicle.platform_radius, 0, 0), 2.0, roller_model="massless")
    turned = 2 * joint * (len(found.switches.t) // 4) + found.chi[-1, 0] - found.chi[0, 0]
    whole, rest = divmod(turned + joint, 2 * joint)
    way = lambda x: THICK * x + PAPER.roller_axis_radius * np.sin(x)  # noqa: E731
    expected = whole * 2 * way(joint) + way(rest - joint)
    assert found.pose[-1, 0] == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("model", MODELS)
@VEHICLES
def test_the_weight_takes_what_the_wheels_rise_by(vehicle, model):
    """Kinetic energy and N H together stay between switches, where H is that of both rollers; the account closes."""
    found = run(vehicle, roller_model=model, effects=(Weight(),), accuracy=1e-13)
    bound = found.effects.kernel(vehicle, model, "python")
    loads = bound.constants[bound.constant_names.index("wheel_loads")]
    assert loads.sum() == pytest.approx(vehicle.mass * 9.80665, rel=1e-12)
    lift = np.vectorize(partial(height, vehicle))(found.chi, vehicle.roller_angle) @ loads
    switched = np.concatenate([[0.0], np.cumsum(np.diff(found.energy + lift))])
    assert len(found.switches.t) > 20 and np.ptp(lift) > 1e-3 * found.energy[0]
    assert abs(switched[-1] - found.switches.energy_jump.sum()) < 1e-11 * found.energy[0]
    assert abs(found.ledger.residual) < 1e-11 * found.energy[0]
    assert found.ledger.contributions["weight_work"] == pytest.approx(lift[0] - lift[-1], abs=1e-12 * lift[0])

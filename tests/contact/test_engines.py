"""Slipping vehicles with any number of wheels, on general sets and on those of a scene alone."""

import numpy as np
import pytest
from random_scenes import PAPER, PLACES

from omniroll import Bearings, Contact, Vehicle, simulate
from omniroll.results.comparison import distance_at

pytestmark = pytest.mark.long

SPINNING = (20, -10, 5)  # rad/s, of the wheels
# The general sets have rollers that stick beside friction that fades, and axles that stick beside both.
SCENES = {
    "coulomb": [Contact(law="coulomb", friction=(0.3, 0.5), normal_gravity=9.8, wheel_rates=SPINNING)],
    "viscous, fading": [Contact((20.0, 30.0), wheel_rates=SPINNING),
                        Bearings(wheel_coulomb=2e-3, roller_coulomb=2e-4, roller_speed=0.5)],
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_the_set_of_a_scene_gives_what_the_general_one_gives(name):
    """Every contact begins near its joint."""
    vehicle, rng = PAPER.replace(wheel_places=PLACES, center_of_mass=(0.005, -0.01)), np.random.default_rng(1)
    task = {"nu": rng.normal(scale=2, size=3), "chi": (0.6, -0.57, 0.6), "pose": rng.normal(size=3), "duration": 0.1}
    task |= {"spins": rng.normal(scale=3, size=(3, 4)), "effects": SCENES[name], "accuracy": 1e-11, "control": False}
    own, general = (simulate(vehicle, **task, engine=engine) for engine in ("specialised", "compiled"))
    assert own.stats["kernel"] != general.stats["kernel"] and len(own.switches) >= 1
    assert own.switches.wheel.tolist() == general.switches.wheel.tolist()
    assert distance_at(own, general, np.linspace(0, 0.1, 7)) < 1e-9
    np.testing.assert_allclose(own.added[-1], general.added[-1], rtol=0, atol=1e-8 * (1 + np.abs(own.added).max()))
    assert all(abs(run.ledger.residual) <= 1e-9 * run.energy.max() for run in (own, general))


@pytest.mark.parametrize("wheels, rollers", [(1, 5), (2, 4), (5, 7)])
def test_any_number_of_wheels(wheels, rollers):
    """In other numbers than those whose loops are unrolled; a viscous ground asks for no loads."""
    task = {"nu": (2, -1, 1), "duration": 0.5, "effects": [Contact(20)], "control": False}
    fine, coarse = (simulate(Vehicle.paper(wheels, rollers), **task, accuracy=a) for a in (1e-11, 1e-8))
    assert len(fine.switches) >= 1 and distance_at(fine, coarse, np.linspace(0, 0.5, 5)) < 1e-8

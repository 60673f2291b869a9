"""Slipping vehicles with any number of wheels, on general sets, and their estimated errors."""

import numpy as np
import pytest
from random_scenes import PAPER, PLACES

from omniroll import Bearings, Contact, Vehicle, simulate
from omniroll.engine.control import one_run
from omniroll.engine.simulate import checked_task
from omniroll.results.comparison import distance_at

pytestmark = pytest.mark.long


GRAVITY = 9.8  # across the plane
ACCURACY = 1e-11
GROUNDS = {
    "viscous": Contact((20.0, 30.0), wheel_rates=(20, -10, 5)),
    "regularised": Contact(
        law="regularised", friction=(0.3, 0.5), speed=0.05, normal_gravity=GRAVITY, wheel_rates=(20, -10, 5)
    ),
    "coulomb": Contact(law="coulomb", friction=(0.3, 0.5), normal_gravity=GRAVITY, wheel_rates=(20, -10, 5)),
}
# The general sets have rollers that stick beside friction that fades, and axles that stick beside both.
BEARINGS = {"no friction": [], "fading": [Bearings(wheel_coulomb=2e-3, roller_coulomb=2e-4, roller_speed=0.5)]}


def slipping_task(law, bearings="no friction"):
    """A vehicle whose wheels slip, with every contact near its joint."""
    vehicle = PAPER.replace(wheel_places=PLACES, center_of_mass=(0.005, -0.01))
    rng = np.random.default_rng(1)
    start = {"nu": rng.normal(scale=2, size=3), "chi": (0.6, -0.57, 0.6), "pose": rng.normal(size=3)}
    start["spins"] = rng.normal(scale=3, size=(3, 4))
    effects = [GROUNDS[law], *BEARINGS[bearings]]
    return vehicle, start | {"duration": 0.1, "roller_model": "free", "effects": effects}


def assert_agreement(own, other, bound):
    times = np.linspace(0, own.elapsed[-1], 7)
    assert own.switches.wheel.tolist() == other.switches.wheel.tolist() and len(own.switches) >= 1
    assert distance_at(own, other, times) < bound
    size = 1 + np.abs(other.added).max()
    np.testing.assert_allclose(own.added[-1], other.added[-1], rtol=0, atol=10 * bound * size)
    for run in (own, other):
        assert abs(run.ledger.residual) <= 1e-9 * (run.energy.max() + 1e-3)


@pytest.mark.parametrize("law, bearings", [("coulomb", "no friction"), ("viscous", "fading")])
def test_the_set_of_a_scene_gives_what_the_general_one_gives(law, bearings):
    vehicle, options = slipping_task(law, bearings)
    own, general = (
        one_run(checked_task(vehicle, **options, engine=engine), ACCURACY) for engine in ("specialised", "compiled")
    )
    assert own.stats["kernel"] != general.stats["kernel"]
    assert_agreement(own, general, 1e-9)


@pytest.mark.parametrize("wheels, rollers", [(1, 5), (2, 4), (5, 7)])
def test_any_number_of_wheels(wheels, rollers):
    """Wheels in other numbers than those whose loops are unrolled; a viscous ground asks for no loads."""
    vehicle = Vehicle.paper(wheels, rollers)
    runs = [
        simulate(vehicle, nu=(2, -1, 1), duration=0.5, effects=[Contact(20)], accuracy=accuracy, control=False)
        for accuracy in (1e-11, 1e-8)
    ]
    assert len(runs[0].switches) >= 1
    assert distance_at(*runs, np.linspace(0, 0.5, 5)) < 1e-8

"""Which contacts carry: sets of contacts under couplings that are made up, and what has no solution or several."""

import numpy as np
import pytest
from scipy.optimize import nnls

from omniroll.effects.ground_loads import GroundFailsError, Loads
from omniroll.vehicles.loads import Springs, contact_loads

CORNERS = np.array([[0.2, 0.15], [-0.2, 0.15], [-0.2, -0.15], [0.2, -0.15]])
WEIGHT = 40.0


def made(places, point, coupling=None):
    """Loads on `places` whose sums act at a point (2,); each N of load adds coupling (N, 2) to their moments."""
    loads = Loads(places, contact_loads(places, WEIGHT * np.array([[1.0, 0.0, 0.0]]))[0])
    matrix = np.zeros((len(places), 2)) if coupling is None else coupling

    def sums_for(_):
        return lambda own: WEIGHT * np.array([1.0, *point]) + np.array([0.0, *(own @ matrix)])

    return loads, sums_for


@pytest.mark.parametrize("point", [(0, 0), (0.02, -0.04), (0.15, 0.1), (-0.19, 0.02)])
def test_without_friction_they_are_the_loads_of_least_norm(point):
    """Against a program of least squares in numbers that are not negative; also of eight wheels, where not all sets are
    tried."""
    angles = 2 * np.pi * np.arange(8) / 8
    eight = 0.3 * np.stack([np.cos(angles), 0.8 * np.sin(angles)], axis=1)
    for places in (CORNERS, eight):
        loads, sums_for = made(places, point)
        found = loads.decide(sums_for, friction=True)
        rows = np.vstack([np.ones(len(places)), places.T])
        sums = WEIGHT * np.array([1.0, *point])
        heavy = 1e7  # so that the sums come first
        wanted, _ = nnls(np.vstack([heavy * rows, np.eye(len(places))]), np.append(heavy * sums, np.zeros(len(places))))
        assert rows @ found.loads == pytest.approx(sums, abs=1e-12 * WEIGHT)
        assert found.loads == pytest.approx(wanted, abs=1e-6 * WEIGHT)
        assert (found.loads[~loads.carries] == 0).all() and (found.loads >= 0).all()


def test_where_no_contact_holds_it_tips_over_an_edge():
    for places, point, edge in (
        (CORNERS, (0.25, 0.0), "wheels 0 and 3"),
        (CORNERS, (0.0, -0.2), "wheels 2 and 3"),
        (CORNERS[:3], (0.1, -0.1), "wheels 0 and 2"),
    ):
        loads, sums_for = made(places, point)
        with pytest.raises(GroundFailsError, match=edge):
            loads.decide(sums_for, friction=True)


def test_loads_that_feed_themselves_are_refused():
    """A load in front that moves the point of the loads ahead by more than it holds: no solution, or two."""
    places = np.array([[0.2, 0.0], [-0.1, 0.15], [-0.1, -0.15]])
    strong = np.zeros((3, 2))
    strong[0, 0] = 0.4  # the determinant is 1 - 0.4/0.3
    loads, sums_for = made(places, (0.0, 0.0), strong)
    with pytest.raises(GroundFailsError, match=r"no solution: wheel 0.*determinant of the coupled matrix is -0\.333"):
        loads.decide(sums_for, friction=True)
    loads, sums_for = made(places, (-0.08, 0.0), strong)
    with pytest.raises(GroundFailsError, match="no solution"):
        loads.decide(sums_for, friction=True)
    loads, sums_for = made(CORNERS, (-0.02, 0.0), np.array([[0.45, 0.0], [0.0, 0.0], [0.0, 0.0], [0.45, 0.0]]))
    with pytest.raises(GroundFailsError, match="loads and friction"):
        loads.decide(sums_for, friction=True)


def test_what_has_gone_off_at_an_instant_stays_off():
    loads, sums_for = made(CORNERS, (0.0, 0.0))
    loads.pass_guards(np.array([True, False, False, False]))
    found = loads.decide(sums_for, friction=True)
    assert not loads.carries[0] and loads.carries[1:].all() and found.loads[0] == 0
    loads.moved()
    assert loads.decide(sums_for, friction=True).loads == pytest.approx(np.full(4, WEIGHT / 4))


def test_springs_share_with_the_least_norm():
    shares = Springs(CORNERS).shares(np.ones(4, bool))
    sums = WEIGHT * np.array([1.0, 0.03, -0.02])
    assert shares @ sums == pytest.approx(contact_loads(CORNERS, sums[None])[0], rel=1e-13)
    assert Springs(CORNERS).shares(np.array([True, True, False, False])) is None


def test_a_contact_that_its_own_friction_lifts_again_has_no_mode():
    """It comes back with no load. With it, the sums ask that it pulls; without it, its spring is compressed."""
    loads, _ = made(CORNERS, (0.0, 0.0))
    loads.carries[0] = False
    loads.pass_guards(np.array([True, False, False, False]))
    lifted, pressed = (WEIGHT * np.array([1.0, *(-part * CORNERS[0])]) for part in (0.7, -0.01))
    with pytest.raises(GroundFailsError, match="no solution"):
        loads.decide(lambda carries: lambda found: lifted if carries[0] else pressed, friction=False)

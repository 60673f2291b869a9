"""Sensitivities of runs whose wheels slip under smooth laws of the ground, against differences of runs."""

import numpy as np
import pytest

import omniroll
from omniroll import Contact, InvalidValueError, OneSidedWarning
from omniroll.engine.motion import Motion
from tests.sensitivities.differences import Case, derivative, motion
from tests.sensitivities.test_runs import TIED, check

VISCOUS = Contact((40.0, 30.0), wheel_rates=(3.0, -2.0, 1.0))
REGULARISED = Contact(law="regularised", friction=(0.3, 0.4), speed=0.05)
NUMBERS = {"nu[0]": 1e-4, "chi[1]": 1e-4, "pose[2]": 1e-4, "mass": 1e-3, "wheel_inertia": 1e-6, "wheel_radius": 1e-6,
           "platform_radius": 1e-5, "wheel_angles[1]": 1e-5}  # fmt: skip
OF_FREE = {"spins[1][2]": 1e-3, "roller_inertia": 1e-9, "roller_axis_radius": 1e-6}
OF_LAWS = {
    VISCOUS: {"coefficient[0]": 1e-3, "coefficient[1]": 1e-3, "coefficient": 1e-3, "wheel_rates[1]": 1e-3},
    REGULARISED: {"friction[0]": 1e-5, "friction[1]": 1e-5, "speed": 1e-6},
}


@pytest.mark.long
@pytest.mark.parametrize("law", [VISCOUS, REGULARISED], ids=["viscous", "regularised"])
@pytest.mark.parametrize("roller_model", ["massless", "free"])
def test_they_are_the_differences_of_runs(roller_model, law):
    """A switch jumps in the rates alone: the roller that comes into contact has the speed that it has."""
    case = Case(roller_model, effects=(law,))
    check(case, NUMBERS | OF_LAWS[law] | (OF_FREE if roller_model == "free" else {}), switches=2)
    check(case, {"nu[0]": 1e-4, "mass": 1e-3}, t=0.637, switches=2)


@pytest.mark.long
def test_wheels_that_switch_together_have_one_derivative_whatever_their_order(recwarn):
    """No speed jumps at a switch, so that no order of the wheels makes a difference, under `impact` as well. The second
    derivatives do differ, so that differences are taken on each side."""
    case = Case("free", "impact", effects=(Contact(40.0),), start=TIED, duration=1.3)
    assert len(set(case.run().switches.t)) == 1 and len(case.run().switches) == 3
    run = case.run(sensitivities=("chi[0]",))

    def one_sided(by):
        ends = [motion(case.changed("chi[0]", by * part).run()) for part in (0, 0.5, 1)]
        return (4 * ends[1] - ends[2] - 3 * ends[0]) / by

    for by in (1e-5, -1e-5):
        expected = (4 * one_sided(by / 2) - one_sided(by)) / 3
        assert np.abs(derivative(run, "chi[0]") - expected).max() < 1e-5
    assert not [w for w in recwarn if w.category is OneSidedWarning]


def test_a_strong_ground_is_rolling():
    """The derivatives come to those of rolling as the coefficient grows, as the motion does: at a distance of 1/C."""
    rolling = derivative(Case("massless").run(sensitivities=("nu[0]",)), "nu[0]")
    apart = []
    for coefficient in (1e4, 2e4):
        case = Case("massless", effects=(Contact(coefficient),))
        own = derivative(case.run(sensitivities=("nu[0]",), accuracy=1e-12), "nu[0]")
        apart.append(np.abs(own - rolling).max())
    assert apart[1] == pytest.approx(apart[0] / 2, rel=0.02) and apart[0] < 1e-2


def test_names_of_numbers_that_the_law_does_not_have():
    for effect, name in ((VISCOUS, "friction"), (REGULARISED, "load"), (REGULARISED, "coefficient[0]")):
        with pytest.raises(InvalidValueError, match="is no number of this run"):
            Case("massless", effects=(effect,)).run(sensitivities=(name,))
    assert Motion(Case("massless", effects=(VISCOUS,)).run()).plain.slips


def test_a_contact_that_carries_nothing_has_no_part_in_the_slopes_of_the_others():
    """The centre of mass of four wheels so far ahead that the load of the wheel behind would pull."""
    ground = Contact(law="regularised", friction=0.3, speed=0.05)

    def loads(mass):
        vehicle = omniroll.Vehicle.paper(4, 5).replace(mass=mass, center_of_mass=(0.1, 0.0))
        return vehicle, np.array(ground.constants(vehicle)["contact_load"])

    vehicle, own = loads(1.0)
    assert (own == 0).sum() == 1
    slopes = ground.constants_along(vehicle, {"mass": np.ones(())})["contact_load"]
    assert np.ravel(slopes) == pytest.approx((loads(1.5)[1] - loads(0.5)[1]), rel=1e-12, abs=1e-14)

"""What makes no sense of grounds, springs and wheels is refused by name, or in a sentence."""

from dataclasses import replace

import pytest

import omniroll
from contact.test_other_kinds_move import VEHICLES
from omniroll import Contact, InvalidValueError, Slope, Vehicle, simulate

PAPER = Vehicle.paper()
SET_VALUED = {"law": "coulomb", "friction": 0.3}
NAMED = {"law": "regularised", "friction": 0.5, "speed": 1e-2}


@pytest.mark.parametrize("numbers, field", [
    (SET_VALUED | {"friction": None}, "friction"),
    (SET_VALUED | {"speed": 0.1}, "speed"),
    (SET_VALUED | {"static_friction": 0.2}, "static_friction"),
    (SET_VALUED | {"static_friction": (0.6, 0.2)}, "static_friction"),
    (NAMED | {"static_friction": 0.6}, "static_friction"),
    (NAMED | {"speed": None}, "speed"),
    (NAMED | {"coefficient": 1.0}, "coefficient"),
    (NAMED | {"friction": (0.5, 0.0)}, "friction"),
    (NAMED | {"load": -1.0}, "load"),
    ({"coefficient": 1.0, "load": 2.0}, "load"),
    ({"coefficient": -1.0}, "coefficient"),
    ({"coefficient": (1.0, -1.0)}, "coefficient"),
    ({"coefficient": (1, 2, 3)}, "coefficient"),
])  # fmt: skip
def test_numbers_of_a_ground(numbers, field):
    with pytest.raises(InvalidValueError) as caught:
        Contact(**numbers)
    assert caught.value.field == field


@pytest.mark.parametrize("field, vehicle, effects, options", [
    ("roller_model", PAPER, [Contact(1.0)], {"roller_model": "locked"}),
    ("contact_spins", PAPER, [Contact(1.0, contact_spins=0)], {"roller_model": "massless"}),
    ("wheel_rates", PAPER, [Contact(1.0, wheel_rates=(1, 2))], {}),
    ("effects", PAPER, [Contact(1.0), Contact(2.0)], {}),
    ("wheels", Vehicle.paper(2, 5).replace(wheel_angles=(0.0, 3.14)), [Contact(**NAMED)], {}),
    ("load", PAPER.replace(center_of_mass=(-0.1, 0.0)), [Contact(**NAMED)], {}),
    ("normal_gravity", PAPER, [Contact(**NAMED), Slope(0.1)], {}),
    ("joints", PAPER, [Contact(**SET_VALUED, joints=True), omniroll.Springs(height=0.1)], {}),
    ("joints", PAPER, [Contact(1.0, joints=True), omniroll.Bearings(roller_viscous=1e-6)], {}),
    ("sensitivities", PAPER, [Contact(1.0, joints=True)], {"sensitivities": ("mass",)}),
])  # fmt: skip
def test_grounds_that_do_not_fit_the_run(field, vehicle, effects, options):
    with pytest.raises(InvalidValueError) as caught:
        simulate(vehicle, nu=(1, 0, 0), duration=0.1, effects=effects, **options)
    assert caught.value.field == field


@pytest.mark.parametrize("kind", VEHICLES)
def test_springs_do_not_go_with_other_wheels(kind):
    springs = [Contact(**SET_VALUED), omniroll.Springs(height=0.1)]
    with pytest.raises(InvalidValueError, match="leave them out for the loads of the vehicle at rest"):
        simulate(VEHICLES[kind], nu=(1, 0, 0), duration=0.1, effects=springs)


def test_what_springs_do_not_go_with_is_said():
    vehicle, springs = omniroll.Vehicle.paper(), omniroll.Springs(height=0.06)
    ground = omniroll.Contact(law="regularised", friction=0.5, speed=0.05)

    def run(*effects, **options):
        omniroll.simulate(vehicle, nu=(1, 0, 0), duration=0.01, effects=effects, **options)

    rolling = omniroll.Bearings(roller_viscous=1e-5)
    for effects, options, message in (
        ((springs,), {}, "law that knows loads"),
        ((omniroll.Contact(2.0), springs), {}, "law that knows loads"),
        ((ground, springs, rolling), {}, "rollers have no friction"),
        ((ground, springs), {"engine": "python"}, "choose compiled"),
        ((ground, springs), {"sensitivities": ["mass"]}, "leave Springs out"),
        ((ground, replace(springs, tilt_inertia=1e-6)), {}, "must exceed"),
        ((ground, replace(springs, normal_gravity=5.0)), {}, "that of the contacts"),
    ):
        with pytest.raises(omniroll.InvalidValueError, match=message):
            run(*effects, **options)

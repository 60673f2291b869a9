"""Coulomb's friction of the ground with a named speed: closed forms, loads, and what is refused."""

import numpy as np
import pytest

from omniroll import Contact, InvalidValueError, Slope, Vehicle, simulate

PAPER = Vehicle.paper()
PAIR = Vehicle.paper(2, 5).replace(wheel_angles=(0.0, np.pi))
GRAVITY = 9.80665


def skidding(speed, load=10.0, friction=0.4, end=0.1):
    """The vehicle starts across the axles of its two wheels, which stand; the slip and the time at every row."""
    ground = Contact(law="regularised", friction=friction, speed=speed, load=load, wheel_rates=0)
    run = simulate(PAIR, nu=(0, 6.0, 0), duration=end, effects=[ground], control=False)
    strength = friction * load * (2 / PAIR.mass + PAIR.wheel_radius**2 / PAIR.wheel_inertia)
    return run, run.slip[:, 0, 1], strength


@pytest.mark.long
def test_a_skidding_vehicle_in_closed_form():
    """s' = -k s/sqrt(s^2 + v^2): sqrt(s^2 + v^2) - v asinh(v/s) falls by k t."""
    speed = 0.05
    run, slip, strength = skidding(speed)
    assert slip[-1] < 1e-2 * slip[0] and len(run.switches) >= 1
    times = np.linspace(0, run.t[-1], 60)
    slip = np.array([run.sample(time).slip[0, 1] for time in times])
    fallen = np.hypot(slip, speed) - speed * np.arcsinh(speed / slip)
    seen = slip > 1e-3 * slip[0]  # the logarithm of a slower slip has fewer digits
    assert (fallen[0] - fallen)[seen] == pytest.approx(strength * times[seen], abs=1e-7) and seen.sum() > 10
    assert run.ledger.residual == pytest.approx(0, abs=1e-9 * run.energy[0])


def test_loads_at_rest():
    """Three wheels determine them; four share by the least norm; a given load stands."""
    aside = PAPER.replace(center_of_mass=(0.03, -0.01))
    ground = Contact(law="regularised", friction=0.5, speed=1e-2)
    loads = ground.loads_at_rest(aside)
    angles = np.array(PAPER.wheel_angles)
    places = PAPER.platform_radius * np.stack([np.cos(angles), np.sin(angles)])
    assert loads.sum() == pytest.approx(PAPER.mass * GRAVITY, rel=1e-14)
    assert places @ loads == pytest.approx(PAPER.mass * GRAVITY * np.array([0.03, -0.01]), rel=1e-12)
    four = Vehicle.paper(4, 5).replace(center_of_mass=(0.02, 0.0))
    spare = np.array([1, -1, 1, -1])
    assert ground.loads_at_rest(four) @ spare == pytest.approx(0, abs=1e-12)
    assert Contact(law="regularised", friction=0.5, speed=1e-2, load=3.0).loads_at_rest(PAIR).tolist() == [3.0, 3.0]


def test_what_makes_no_sense_is_refused():
    law = {"law": "regularised", "friction": 0.5, "speed": 1e-2}
    for changes, field in (
        ({"speed": None}, "speed"),
        ({"coefficient": 1.0}, "coefficient"),
        ({"friction": (0.5, 0.0)}, "friction"),
        ({"load": -1.0}, "load"),
    ):
        with pytest.raises(InvalidValueError) as caught:
            Contact(**law | changes)
        assert caught.value.field == field
    with pytest.raises(InvalidValueError, match="law viscous"):
        Contact(1.0, load=2.0)
    for vehicle, effects, field in (
        (PAIR, [Contact(**law)], "wheels"),
        (PAPER.replace(center_of_mass=(-0.1, 0.0)), [Contact(**law)], "load"),
        (PAPER, [Contact(**law), Slope(0.1)], "normal_gravity"),
    ):
        with pytest.raises(InvalidValueError) as caught:
            simulate(vehicle, nu=(0, 0, 0), duration=0.1, effects=effects)
        assert caught.value.field == field

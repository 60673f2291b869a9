"""The same motion told in other words: wheels renumbered, axes turned, mirrored, moved; and run backwards."""

import numpy as np
import pytest
from oracle.bridge import error, simulated, switch_table
from oracle.lagrange import MODELS
from oracle.states import ordinary_vehicle, random_state, time_for_switches

LAWS = ("smooth", "impact")


def simulate(vehicle, nu, chi, spins, model, law, duration, **more):
    return simulated(vehicle, nu, chi, spins, model, law, duration=duration, accuracy=1e-10, **more)


def turn_nu(nu, angle):
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([cos * nu[0] - sin * nu[1], sin * nu[0] + cos * nu[1], nu[2]])


MIRROR = np.array([1.0, -1.0, -1.0])


def mirrored(vehicle):
    return vehicle.with_(wheel_angles=tuple(-a for a in vehicle.wheel_angles))


def motion_case(seed, model):
    rng = np.random.default_rng(seed)
    vehicle = ordinary_vehicle(rng, 3, 5)
    nu, chi, spins = random_state(rng, vehicle, filled=0.9)
    return rng, vehicle, nu, chi, spins, time_for_switches(vehicle, nu, 6)


def same_switches(found, wanted, wheel=lambda w: w, sign=1):
    assert len(found) == len(wanted) >= 3
    for a, b in zip(found, wanted, strict=True):
        assert a[0] == pytest.approx(b[0], rel=1e-7) and (a[1], a[2]) == (wheel(b[1]), sign * b[2])


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("model", MODELS)
def test_motions_do_not_know_the_wheels_numbers(model, law):
    _, vehicle, nu, chi, spins, duration = motion_case(4, model)
    order = np.array([2, 0, 1])
    first = simulate(vehicle, nu, chi, spins, model, law, duration)
    other = simulate(vehicle.permuted(order), nu, chi[order], spins[order], model, law, duration)
    assert error(vehicle, nu, other.pose[-1], other.nu[-1], first.pose[-1], first.nu[-1]) <= 2e-10
    same_switches(switch_table(other), switch_table(first), wheel=lambda w: int(np.flatnonzero(order == w)[0]))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("model", MODELS)
def test_motions_have_a_mirror_image(model, law):
    _, vehicle, nu, chi, spins, duration = motion_case(5, model)
    first = simulate(vehicle, nu, chi, spins, model, law, duration)
    other = simulate(mirrored(vehicle), MIRROR * nu, -chi, spins[:, ::-1], model, law, duration)
    pose, nu_end = MIRROR * first.pose[-1], MIRROR * first.nu[-1]
    assert error(vehicle, nu, other.pose[-1], other.nu[-1], pose, nu_end) <= 2e-10
    same_switches(switch_table(other), switch_table(first), sign=-1)


@pytest.mark.parametrize("model", MODELS)
def test_motions_move_with_their_start(model):
    """Another pose and another time at the start: the same motion, moved."""
    _, vehicle, nu, chi, spins, duration = motion_case(6, model)
    first = simulate(vehicle, nu, chi, spins, model, "impact", duration)
    x, y, theta = 2.0, -1.0, 2.2
    other = simulate(vehicle, nu, chi, spins, model, "impact", duration, pose=(x, y, theta), start_time=5.0)
    moved = turn_nu(first.pose[-1], theta) + np.array([x, y, theta])
    assert error(vehicle, nu, other.pose[-1], other.nu[-1], moved, first.nu[-1]) <= 2e-10
    assert other.t[0] == 5.0 and other.t[-1] == pytest.approx(5.0 + duration, rel=1e-15)


@pytest.mark.parametrize("model", ["massless", "locked"])
def test_smooth_motions_run_backwards(model):
    """From the end with opposite speeds back to the start. (Free rollers forget the entering roller's
    spin.)
    """
    _, vehicle, nu, chi, spins, duration = motion_case(7, model)
    first = simulate(vehicle, nu, chi, spins, model, "smooth", duration)
    back = simulate(vehicle, -first.nu[-1], first.chi[-1], spins, model, "smooth", duration, pose=first.pose[-1])
    assert len(switch_table(back)) == len(switch_table(first)) >= 3
    assert error(vehicle, nu, back.pose[-1], -back.nu[-1], np.zeros(3), nu) <= 1e-8
    assert np.abs(back.chi[-1] - chi).max() <= 1e-8

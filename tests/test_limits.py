"""Limits of the models: a circle in closed form, and light rollers beside massless ones."""

import numpy as np
import pytest
from oracle.bridge import error, simulated
from oracle.states import ordinary_vehicle, random_state, random_vehicle, time_for_switches


def regular(rng, wheels, rollers=6):
    angles = tuple(float(a) for a in 0.3 + 2 * np.pi * np.arange(wheels) / wheels)
    return random_vehicle(rng, wheels, rollers, wheel_angles=angles)


def turning_rates(vehicle, nu):
    """(theta', Omega) of the massless vehicle on a regular polygon.

    With B = 0 the energy is 2T = (M + N J/(2 l^2)) v^2 + (I_S + N J R^2/l^2) theta'^2, for the sums of cos^2
    and sin^2 over a regular polygon are N/2 each and every mixed sum is zero. The constraints give the
    wheels' angles only: no wheel's momentum depends on them, so that the one gyroscopic term is that of the
    mass M in turning axes, (M + N J/(2 l^2)) (nu_1', nu_2') = M theta' (nu_2, -nu_1), and theta' is constant.
    """
    turn = nu[2] / vehicle.yaw_scale
    wheels = vehicle.wheels * vehicle.wheel_inertia / (2 * vehicle.wheel_radius**2)
    return turn, turn * vehicle.mass / (vehicle.mass + wheels)


@pytest.mark.parametrize("wheels, switching, engine", [
    (3, "smooth", "compiled"), (4, "impact", "compiled"), (6, "impact", "python"),
])  # fmt: skip
def test_massless_vehicle_goes_round_its_circle(wheels, switching, engine):
    """v_S turns in the fixed axes at theta' - Omega: a circle of radius |v_S|/(theta' - Omega)."""
    rng = np.random.default_rng([5, wheels])
    vehicle = regular(rng, wheels)
    nu = rng.normal(size=3)
    turn, rate = turning_rates(vehicle, nu)
    speed = vehicle.platform_radius * np.abs(nu).max()
    duration = float(min(6 / abs(turn), 40 * vehicle.wheel_radius / speed))
    pose = (0.4, -0.7, 0.9)
    options = {"pose": pose, "duration": duration, "accuracy": 1e-10, "engine": engine}
    trajectory = simulated(vehicle, nu, 0, None, "massless", switching, **options)
    assert trajectory.t[-1] == duration and len(trajectory.t) > 2
    t = np.asarray(trajectory.t)
    body = (nu[0] + 1j * nu[1]) * np.exp(-1j * rate * t)
    start = vehicle.platform_radius * (nu[0] + 1j * nu[1]) * np.exp(1j * pose[2])
    place = pose[0] + 1j * pose[1] + start * np.expm1(1j * (turn - rate) * t) / (1j * (turn - rate))
    wanted_pose = np.stack([place.real, place.imag, pose[2] + turn * t], axis=1)
    wanted_nu = np.stack([body.real, body.imag, np.full_like(t, nu[2])], axis=1)
    assert error(vehicle, nu, trajectory.pose, trajectory.nu, wanted_pose, wanted_nu) <= 1e-10
    assert np.ptp(trajectory.energy) <= 1e-9 * trajectory.energy[0]


@pytest.mark.parametrize("switching", ["smooth", "impact"])
@pytest.mark.parametrize("model", ["locked", "free"])
def test_motions_with_light_rollers_tend_to_massless_ones(model, switching):
    """Over some switches, too, the end is a constant times B away from that of massless rollers."""
    rng = np.random.default_rng(6)
    vehicle = ordinary_vehicle(rng, 3, 5)
    nu, chi, _ = random_state(rng, vehicle, filled=0.9)
    duration = time_for_switches(vehicle, nu, 6)

    def end(model, inertia):
        lighter = vehicle.with_(roller_inertia=inertia)
        trajectory = simulated(lighter, nu, chi, 0, model, switching, duration=duration, accuracy=1e-12)
        assert len(trajectory.switches) >= 4
        return np.concatenate([trajectory.pose[-1], trajectory.nu[-1], trajectory.chi[-1]])

    light = 1e-4 * vehicle.roller_inertia
    massless = end("massless", light)
    steps = [end(model, k * light) - massless for k in (1, 2)]
    assert np.abs(steps[1] - 2 * steps[0]).max() <= 1e-3 * np.abs(steps[1]).max()
    assert np.abs(steps[0]).max() >= 1e-8  # it is there to be seen

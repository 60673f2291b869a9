"""Whole motions with every effect at once against the oracle: Taylor series of Lagrange's equations with multipliers,
in all coordinates, with generalised forces that are written down body by body, switches located in 16 digits."""

import numpy as np
import pytest
from oracle import lagrange, taylor
from oracle.balls import exact, working_precision
from oracle.bridge import floats, project_vehicle
from oracle.states import ordinary_vehicle

from omniroll import Bearings, Motor, Slope, Torque, simulate

WHEELS, ROLLERS = 3, 6
VEHICLE = ordinary_vehicle(np.random.default_rng(42), WHEELS, ROLLERS).with_(offset=(0.01, -0.02))
START = {"nu": (2.0, 0.6, 1.0), "chi": (0.4, -0.4, -0.35), "pose": (0.0, 0.1, 0.3)}
TORQUES, VOLTS = (0.02, -0.04, 0.03), (2.0, -1.0, 0.5)
MOTOR = {"torque_constant": 0.02, "resistance": 1.5, "gear_ratio": 3.0, "back_emf": 0.03}
AXLES = {"wheel_viscous": 2e-3, "wheel_coulomb": 4e-3, "wheel_speed": 1.5}
ROLLING = {"roller_viscous": 2e-6, "roller_coulomb": 1e-5, "roller_speed": 4.0}
SLOPE = {"angle": 0.1, "direction": 0.7, "gravity": 9.8}


def friction(speed, viscous, coulomb, fade):
    pull = -exact(viscous) * speed
    return pull - exact(coulomb) * speed / (speed * speed + exact(fade) * exact(fade)).sqrt() if coulomb else pull


def applied(rolling):
    """The generalised forces in all coordinates: theta and q' are series in time."""
    per_volt = exact(MOTOR["gear_ratio"]) * exact(MOTOR["torque_constant"]) / exact(MOTOR["resistance"])
    weight = VEHICLE.number("mass") * exact(SLOPE["gravity"]) * exact(SLOPE["angle"]).sin()
    down = exact(SLOPE["direction"])

    def forces(theta, dq):
        found = lagrange.Speeds.zero(VEHICLE)
        found.x, found.y = weight * down.cos(), weight * down.sin()
        dx, dy = lagrange.offset_in_fixed_axes(VEHICLE, theta)
        found.theta = dx * found.y - dy * found.x
        for i in range(WHEELS):
            current = exact(VOLTS[i]) - exact(MOTOR["back_emf"]) * exact(MOTOR["gear_ratio"]) * dq.chi[i]
            found.chi[i] = exact(TORQUES[i]) + per_volt * current + friction(dq.chi[i], *AXLES.values())
            found.phi[i] = [friction(spin, *rolling.values()) for spin in dq.phi[i]]
        return found

    return forces


@pytest.mark.long
@pytest.mark.parametrize("roller_model, law, rolling", [
    ("locked", "impact", ROLLING),
    ("free", "smooth", ROLLING | {"roller_coulomb": None, "roller_speed": None}),
    ("free", "impact", ROLLING),
], ids=["locked", "free, viscous", "free, Coulomb"])  # fmt: skip
@working_precision
def test_every_effect_at_once(roller_model, law, rolling):
    spins = np.full((WHEELS, ROLLERS - 1), 0.4) if roller_model == "free" else None
    state = taylor.start(VEHICLE, **START, spins=spins, model=roller_model)
    motion = taylor.simulate(
        VEHICLE, state, 0.3, model=roller_model, law=law, digits=15, order=20, forces=applied(rolling)
    )
    vehicle = project_vehicle(VEHICLE).replace(center_of_mass=VEHICLE.offset)
    run = simulate(
        vehicle, **START, spins=0.0 if spins is None else 0.4, duration=0.3, roller_model=roller_model, switching=law,
        effects=[Torque(TORQUES), Motor(VOLTS, **MOTOR), Bearings(**AXLES, **rolling), Slope(**SLOPE)],
        accuracy=1e-13, control=False,
    )  # fmt: skip
    assert len(run.switches) == len(motion.switches) >= 2
    np.testing.assert_allclose(run.switches.t, floats(s.t for s in motion.switches), rtol=1e-12)
    jumps = floats(s.energy_after - s.energy_before for s in motion.switches)
    np.testing.assert_allclose(run.switches.energy_jump, jumps, atol=1e-12 * run.energy.max())
    np.testing.assert_allclose(run.nu[-1], floats(taylor.nu(VEHICLE, motion.end)), atol=1e-11)
    np.testing.assert_allclose(run.pose[-1], floats(motion.end.pose), atol=1e-12)
    if spins is not None:
        wanted = [floats(wheel[1:]) for wheel in motion.end.dq.phi]
        np.testing.assert_allclose(run.spins[-1], wanted, atol=1e-9)

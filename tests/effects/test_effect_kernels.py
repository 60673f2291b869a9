"""The kernels with effects against the multiplier oracle, both in 60 digits: Lagrange's equations in all coordinates,
with the torques, the friction and the gravity of the effects as generalised forces, wheels anywhere, the centre of mass
beside S.

The generated Python kernel runs on balls unchanged, so that what is compared is the derivation itself, not its
rounding.
"""

import numpy as np
import pytest
from effects.cases import MODELS, OPTIONAL, WHEELS, balls, prepared_kernel, random_case, without_layout
from oracle import lagrange
from oracle.balls import exact, working_precision
from oracle.bridge import project_vehicle
from oracle.directions import directions_allowed

from omniroll.kernels.kernel import form, kernel

CLOSE = 1e-40


def friction(viscous, coulomb, fade, speed):
    return -viscous * speed - coulomb * speed / (speed * speed + fade * fade).sqrt()


@working_precision
def applied_forces(vehicle, nu, chi, spins, model, effects, numbers):
    """The generalised forces in the full coordinates, written down body by body."""
    present = lambda effect, name: balls(numbers[name]) if effect in effects else balls(np.zeros(WHEELS))  # noqa: E731
    theta = exact(numbers["heading"])
    speeds = lagrange.speeds(vehicle, nu, chi, spins, model="locked" if model == "massless" else model, theta=theta)
    forces = lagrange.Speeds.zero(vehicle)
    torque, damping = present("drive", "torque"), present("motor", "damping")
    bearing, contact_bearing = present("axle_sticking", "bearing_torque"), present("roller_sticking", "contact_bearing")
    free_bearing = present("roller_sticking", "free_bearing") if "roller_sticking" in effects else None
    for i, rate in enumerate(speeds.chi):
        forces.chi[i] = torque[i] + bearing[i] - damping[i] * rate + friction(
            present("axle_viscous", "axle_damping")[i], present("axle_coulomb", "axle_torque")[i],
            exact(numbers["axle_fade_speed"]), rate)  # fmt: skip
        for j, spin in enumerate(speeds.phi[i]):
            forces.phi[i][j] = friction(
                present("roller_viscous", "roller_damping")[i], present("roller_coulomb", "roller_torque")[i],
                exact(numbers["roller_fade_speed"]), spin)  # fmt: skip
            if j == 0:
                forces.phi[i][j] += contact_bearing[i]
            elif free_bearing is not None:
                forces.phi[i][j] += free_bearing[i][j - 1]
    if "slope" in effects:
        weight = vehicle.number("mass") * exact(numbers["gravity"]) * exact(numbers["slope_angle"]).sin()
        direction = exact(numbers["slope_direction"])
        forces.x, forces.y = weight * direction.cos(), weight * direction.sin()
        dx, dy = lagrange.offset_in_fixed_axes(vehicle, theta)
        forces.theta = dx * forces.y - dy * forces.x
    return forces


@working_precision
def found_accelerations(vehicle, nu, chi, spins, model, effects, numbers):
    base = model.removesuffix("_sharp")
    module, constants = prepared_kernel(vehicle, base, effects, numbers)
    asked = {"drive": "torque", "motor": "damping", "axle_sticking": "bearing_torque",
             "roller_sticking": "contact_bearing", "slope": "heading"}  # fmt: skip
    inputs = [balls(numbers[name]) for effect, name in asked.items() if effect in effects]
    if base == "free" and "roller_sticking" in effects:
        inputs.append(balls(numbers["free_bearing"]))
    spins = [balls(spins)] if base == "free" else []
    name = "accelerations" if base == "free" else "forward_dynamics"
    found = getattr(module, form(name, base != model, vars(module)))(constants, balls(nu), balls(chi), *spins, *inputs)
    return (found[0], found[1]) if base == "free" else (found, [])


def flat(values):
    return [v for value in values for v in (flat(value) if isinstance(value, list) else [value])]


def oracle_accelerations(vehicle, state, base, effects, numbers):
    """nu' and the free rollers' spins' by Lagrange's equations with multipliers, one after the other."""
    nu, chi, spins = state
    spins = spins if base == "free" else None
    forces = applied_forces(vehicle, nu, chi, spins, base, effects, numbers)
    model = base
    if base == "massless":  # the oracle drops a massless roller: ask it for one that hardly has inertia
        vehicle, model = vehicle.with_(roller_inertia=exact("1e-60")), "locked"
    wanted = lagrange.accelerations(vehicle, nu, chi, spins, model=model, theta=numbers["heading"], forces=forces)
    return wanted.nu_dot + ([s for wheel in wanted.spins_dot for s in wheel] if base == "free" else [])


def check(vehicle, state, model, effects, numbers):
    base = model.removesuffix("_sharp")
    nu, chi, spins = state
    expected = oracle_accelerations(vehicle, state, base, effects, numbers)
    nu_dot, spins_dot = found_accelerations(
        vehicle, nu, chi, spins if base == "free" else None, model, effects, numbers
    )
    for got, want in zip(flat(nu_dot) + flat(spins_dot), expected, strict=True):
        assert abs(float(got - want)) <= CLOSE * (1 + abs(float(want)))


@pytest.mark.parametrize("model", ["massless", "locked", "free", "locked_sharp", "free_sharp"])
def test_all_effects_together(model):
    rng = np.random.default_rng(5)
    vehicle, state, numbers = random_case(rng)
    check(vehicle, state, model, OPTIONAL, numbers)


@pytest.mark.parametrize("effects, model", [
    *(((effect,), MODELS[k % 3]) for k, effect in enumerate(OPTIONAL) if effect != "motor"),
    (("drive", "motor"), "free"), (("layout",), "free"), (("slope",), "locked"),
])  # fmt: skip
def test_each_effect_alone(effects, model):
    rng = np.random.default_rng([7, OPTIONAL.index(effects[-1])])
    vehicle, state, numbers = random_case(rng)
    if "layout" not in effects:
        vehicle = without_layout(vehicle)
    check(vehicle, state, model, effects, numbers)


@pytest.mark.parametrize("base", ["massless", "locked"])
@pytest.mark.parametrize("stuck", [1, 2, 3])
def test_what_holds_an_axle_keeps_it_at_rest(stuck, base):
    """held_dynamics: its force as torques of the bearings lets the wheels stand still, by the accelerations that the
    oracle is asked for above."""
    vehicle, (nu, chi, _), numbers = random_case(np.random.default_rng([29, stuck]))
    vehicle = project_vehicle(without_layout(vehicle))
    bound = kernel(vehicle, base, "python", effects=("drive", "axle_sticking"))
    rows, bearing = bound.wheel_rows[:stuck], np.where(np.arange(WHEELS) < stuck, 0.0, numbers["bearing_torque"])
    directions = directions_allowed(rows, np.eye(3))
    ways = directions.ravel(), (~directions.any(axis=0)).astype(float)
    nu_dot, held = bound.call("held_dynamics", nu, chi, numbers["torque"], bearing, *ways)
    holding = np.append(np.linalg.lstsq(rows.T, held, rcond=None)[0], bearing[stuck:])
    wanted = bound.forward_dynamics(nu, chi, numbers["torque"], holding)
    size = np.abs(held).max() / vehicle.mass + np.abs(wanted).max()
    assert np.abs(nu_dot - wanted).max() <= 1e-11 * size and np.abs(rows @ nu_dot).max() <= 1e-11 * size

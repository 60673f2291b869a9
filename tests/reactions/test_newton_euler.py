"""Contact forces, loads and accelerations of the kernels against Newton's and Euler's equations of every body."""

from dataclasses import replace

import numpy as np
import pytest
from flint import arb
from oracle.balls import exact, working_precision
from oracle.bodies import Solid

from omniroll.kernels.kernel import kernel
from omniroll.vehicles.loads import contact_loads
from reactions.machines import contacts, height, platform_products, random_case, vehicle_of, wheel_mass
from reactions.newton_euler import Acting

MODELS = ("massless", "locked", "free")
RELATIVE = 1e-12
GRAVITY, SLOPE, DIRECTION = 9.81, 0.2, 1.1
EVERYTHING = (
    "drive",
    "motor",
    "axle_viscous",
    "axle_coulomb",
    "roller_viscous",
    "roller_coulomb",
    "slope",
    "reactions",
)
FADE = {"axle_fade_speed": 0.3, "roller_fade_speed": 0.2}


def call(bound, name, values):
    return bound.call(name, *(values[argument.name] for argument in bound.signatures[name].inputs))


def found_by_kernel(case, bound, **inputs):
    """(nu', forces, loads) of the generated functions."""
    machine, count = case.machine, case.machine.wheels
    values = {
        "nu": case.nu,
        "chi": case.chi,
        "spins": case.spins,
        "heading": case.heading,
        "normal_gravity": 9.80665,
        "height": height(machine),
        "wheel_mass": wheel_mass(machine),
        "platform_products": platform_products(machine),
        "spin_inertia": np.full(count, case.vehicle.wheel_inertia),
    } | inputs
    if case.model == "free":
        values["axial"] = call(bound, "axial_speeds", values)
        values["momenta"] = call(bound, "momenta", values)
    if "coulomb_momenta" in bound.signatures:
        values["coulomb_momenta_dot"] = call(bound, "coulomb_momenta", values)
    rates = call(bound, bound.of_every_roller, values)
    values["nu_dot"] = rates[0] if case.model == "free" else rates
    sums, places = call(bound, "load_balance", values)
    return values["nu_dot"], call(bound, "contact_forces", values), contact_loads(places, sums)


@working_precision
def nu_dot(case, found):
    """nu' of what the oracle found: the velocity of S differentiated along the turning axes."""
    dq, second = case.speeds(), found.second
    sin, cos = arb(case.heading).sin(), arb(case.heading).cos()
    scale = exact(case.vehicle.platform_radius)
    along = cos * second.x + sin * second.y + dq.theta * (cos * dq.y - sin * dq.x)
    across = cos * second.y - sin * second.x - dq.theta * (cos * dq.x + sin * dq.y)
    return np.array([float(v) for v in (along / scale, across / scale, second.theta * exact(case.vehicle.yaw_scale))])


def assert_same(case, found, answer, relative=RELATIVE):
    rates, forces, loads = answer
    wanted_forces, wanted_loads = contacts(found)
    for values, wanted in ((rates, nu_dot(case, found)), (forces, wanted_forces), (loads, wanted_loads)):
        assert values == pytest.approx(wanted, rel=relative, abs=relative * np.abs(wanted).max())


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("rollers, has_layout", [(3, True), (5, False), (8, True)])
def test_three_wheels_agree_with_every_body(model, rollers, has_layout):
    rng = np.random.default_rng([rollers, MODELS.index(model)])
    case = random_case(rng, 3, rollers, model, has_layout=has_layout)
    bound = kernel(case.vehicle, model, "python", effects=("reactions",))
    answer = found_by_kernel(case, bound)
    assert_same(case, case.oracle(), answer)
    assert np.ptp(answer[2]) > 1e-4 * answer[2].mean(), "loads that differ by the motion"


def random_inputs(rng, wheels):
    """Constants of the kernel, and drive inputs, for every effect."""
    constants = {
        "axle_damping": rng.uniform(0, 0.01, wheels),
        "axle_torque": rng.uniform(0, 0.02, wheels),
        "roller_damping": rng.uniform(0, 1e-5, wheels),
        "roller_torque": rng.uniform(0, 1e-4, wheels),
        "gravity": GRAVITY,
        "slope_angle": SLOPE,
        "slope_direction": DIRECTION,
        "torque_constant": 0.03,
        "resistance": 2.0,
        "motor_gear_ratio": 10.0,
        "back_emf": 0.03,
        "current_limit": 5.0,
    }
    constants = {name: value if np.ndim(value) == 0 else tuple(value) for name, value in constants.items()} | FADE
    return constants, {"torque": 0.1 * rng.normal(size=wheels), "damping": rng.uniform(0, 0.01, wheels)}


def acting(case, constants, inputs):
    """The same for the oracle, as a function of q'."""

    def law(viscous, coulomb, fade, speed):
        return -exact(viscous) * speed - exact(coulomb) * speed / (speed * speed + exact(fade) ** 2).sqrt()

    def moments(dq):
        count, n = case.machine.wheels, case.machine.rollers_per_wheel
        axle, roller = (
            [
                lambda speed, i=i, kind=kind: law(
                    constants[f"{kind}_damping"][i],
                    constants[f"{kind}_torque"][i],
                    constants[f"{kind}_fade_speed"],
                    speed,
                )
                for i in range(count)
            ]
            for kind in ("axle", "roller")
        )
        drive = [exact(inputs["torque"][i]) - exact(inputs["damping"][i]) * dq.chi[i] for i in range(count)]
        down, level = exact(GRAVITY) * exact(SLOPE).sin(), exact(GRAVITY) * exact(SLOPE).cos()
        return Acting(
            gravity=(down * exact(DIRECTION).cos(), down * exact(DIRECTION).sin(), -level),
            wheel_torques=[drive[i] + axle[i](dq.chi[i]) for i in range(count)],
            roller_torques=[[roller[i](dq.phi[i][j]) for j in range(n)] for i in range(count)],
        )

    return working_precision(moments)


@pytest.mark.parametrize("model", MODELS)
def test_every_effect_at_once_agrees_with_every_body(model):
    """Locked rollers do not turn in their bearings, and there is no friction at rest."""
    rng = np.random.default_rng([7, MODELS.index(model)])
    case = random_case(rng, 3, 5, model, has_layout=True)
    constants, inputs = random_inputs(rng, 3)
    bound = kernel(case.vehicle, model, "python", effects=EVERYTHING, constants=tuple(constants.items()))
    answer = found_by_kernel(case, bound, normal_gravity=GRAVITY * np.cos(SLOPE), **inputs)
    assert_same(case, case.oracle(acting(case, constants, inputs)), answer)


@pytest.mark.parametrize("wheels", [4, 6])
def test_more_wheels_agree_where_the_spare_loads_are_given(wheels):
    rng = np.random.default_rng(wheels)
    case = random_case(rng, wheels, 4, "free", has_layout=True)
    bound = kernel(case.vehicle, "free", "python", effects=("reactions",))
    answer = found_by_kernel(case, bound)
    spare = {i: float(answer[2][i]) for i in range(3, wheels)}
    assert_same(case, case.oracle(loads=spare), answer)


def test_a_rotor_behind_a_gear_turns_with_its_own_momentum():
    """What it adds to wheel_inertia is gear^2 of its inertia, to the momentum about the axle gear times it."""
    rng = np.random.default_rng(11)
    rotor, gear = Solid(exact("0.05"), exact("3e-6"), exact("2e-6")), -12.5
    case = random_case(rng, 3, 5, "free", has_layout=True, rotor=rotor, gear=gear)
    bound = kernel(case.vehicle, "free", "python", effects=("reactions",))
    spin_inertia = case.vehicle.wheel_inertia - gear * (gear - 1) * 3e-6
    found = case.oracle()
    assert_same(case, found, found_by_kernel(case, bound, spin_inertia=np.full(3, spin_inertia)))
    naive = found_by_kernel(case, bound)[2]
    assert np.abs(naive - contacts(found)[1]).max() > 1e-4 * naive.mean()


@pytest.mark.parametrize("model", ["locked", "free"])
def test_rollers_cut_close_to_their_tips(model):
    """B/rho^2 outgrows the mass, and so does what rounding leaves of the contact roller's acceleration."""
    case = random_case(np.random.default_rng(17), 3, 5, model)
    axis = case.machine.wheel_radius * np.cos(np.pi / 5) * (1 - 1e-4)
    machine = replace(case.machine, roller_axis_radius=axis)
    chi = np.array([1, -1, 1]) * np.pi / 5 * (1 - 1e-7)
    case = replace(case, machine=machine, vehicle=vehicle_of(machine), chi=chi)
    bound = kernel(case.vehicle, model, "python", effects=("reactions",))
    assert bound.set_name == f"{model}_reactions" and bound.sharp
    assert_same(case, case.oracle(), found_by_kernel(case, bound), relative=1e-10)

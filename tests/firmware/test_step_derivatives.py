"""omniroll_step_derivatives: against the step itself; twists; what an encoder's angle says of the contact."""

import math

import numpy as np
import pytest

from firmware.test_step import CASES, JOINT, MODELS, PAPER, START
from firmware.vehicle import BAD_NUMBER, BAD_STATE, OK, FirmwareVehicle
from omniroll.effects.effect_set import EffectSet

MOVED, STEP = 1e-5, 0.01  # differences of second order: their errors are a few 1e-10
SIZE = 6 + PAPER.wheels


def with_derivatives(model, case, number_type="double"):
    effects, inputs = CASES[case]
    acting = EffectSet.checked(effects, PAPER)
    names = (*acting.kernel(PAPER, model, "python").effects, "derivatives")
    constants = acting.constants(PAPER)
    return FirmwareVehicle(
        acting.equipped(PAPER), model, names, constants=constants, inputs=inputs, number_type=number_type
    )


def derivatives(vehicle, columns, h=STEP):
    found, work = np.zeros((columns, SIZE), vehicle.real), np.zeros(2000, vehicle.real)
    pointers = (vehicle.pointer(a.reshape(-1)) for a in (found, work))
    status = vehicle.lib.omniroll_step_derivatives(vehicle.model, *vehicle.inputs, h, vehicle.state, *pointers)
    return status, found


def after(vehicle, start, torque=0.0, axle=0):
    """nu, pose and chi a step later; where the vehicle has free rollers, from the same momenta."""
    assert vehicle.start(start[:3], start[6:], start[3:6]) == OK
    if "momenta" in vehicle.arrays:
        vehicle.arrays["momenta"][:] = 0.01
    if vehicle.inputs:
        vehicle.inputs[0].torque[axle] += torque
    assert vehicle.step(STEP) == OK and not vehicle.contact.any()
    if vehicle.inputs:
        vehicle.inputs[0].torque[axle] -= torque
    return vehicle.numbers()


@pytest.mark.parametrize(
    "model, case", [("massless", "alone"), ("locked", "motor"), ("locked", "slope"), ("free", "torque")]
)
def test_they_are_the_slopes_of_the_step(model, case):
    """The first index says by what, the last of what."""
    vehicle = with_derivatives(model, case)
    has_torque = bool(CASES[case][1])
    start = np.array([*START["nu"], *START["pose"], *START["chi"]])
    after(vehicle, start)
    assert vehicle.start(start[:3], start[6:], start[3:6]) == OK
    if "momenta" in vehicle.arrays:
        vehicle.arrays["momenta"][:] = 0.01
    status, found = derivatives(vehicle, SIZE + has_torque * PAPER.wheels)
    assert status == OK
    for column, by in enumerate(np.eye(SIZE)):
        wanted = (after(vehicle, start + MOVED * by) - after(vehicle, start - MOVED * by)) / (2 * MOVED)
        np.testing.assert_allclose(found[column], wanted, rtol=0, atol=2e-9)
    for axle in range(has_torque * PAPER.wheels):
        wanted = (after(vehicle, start, MOVED, axle) - after(vehicle, start, -MOVED, axle)) / (2 * MOVED)
        np.testing.assert_allclose(found[SIZE + axle], wanted, rtol=0, atol=2e-9)


def test_what_the_step_refuses():
    vehicle = with_derivatives("locked", "motor")
    assert vehicle.start(**START) == OK
    assert derivatives(vehicle, SIZE + 3, math.nan)[0] == BAD_NUMBER
    vehicle.contact[1] = PAPER.rollers_per_wheel
    assert derivatives(vehicle, SIZE + 3)[0] == BAD_STATE


@pytest.mark.parametrize("number_type", ["double", "float"])
def test_twists_go_both_ways(number_type):
    vehicle = FirmwareVehicle(PAPER, "massless", number_type=number_type)
    nu, twist, back = np.array([0.3, -2.0, 5.0], vehicle.real), np.zeros(3, vehicle.real), np.zeros(3, vehicle.real)
    vehicle.lib.omniroll_twist_from_nu(vehicle.model, *map(vehicle.pointer, (nu, twist)))
    wanted = nu * (PAPER.platform_radius, PAPER.platform_radius, 1 / PAPER.yaw_scale)
    np.testing.assert_allclose(twist, wanted, rtol=4 * np.finfo(vehicle.real).eps)
    vehicle.lib.omniroll_nu_from_twist(vehicle.model, *map(vehicle.pointer, (twist, back)))
    np.testing.assert_allclose(back, nu, rtol=4 * np.finfo(vehicle.real).eps)


@pytest.mark.parametrize("number_type", ["double", "float"])
def test_the_contact_from_an_encoder_is_that_of_the_drive(number_type):
    """The wheels turn through hundreds of joints; their whole angles say where they are."""
    vehicle = FirmwareVehicle(PAPER, "massless", number_type=number_type)
    start = np.array([0.1, -0.2, 0.3])
    assert vehicle.start((0, 0, -4), start) == OK
    chi, contact = vehicle.ffi.new("omniroll_real *"), vehicle.ffi.new("int *")
    rates = vehicle.wheel_speeds().astype(float)
    close = 400 * np.finfo(vehicle.real).eps
    for k in range(1, 400):
        assert vehicle.step(0.02) == OK
        if not k % 7:
            for i in range(PAPER.wheels):
                angle = start[i] + rates[i] * 0.02 * k
                assert vehicle.lib.omniroll_contact_from_angle(vehicle.model, angle, chi, contact) == OK
                if abs(chi[0]) < JOINT - close:  # at the joint either roller may be meant
                    assert contact[0] == vehicle.contact[i]
                    assert chi[0] == pytest.approx(float(vehicle.arrays["chi"][i]), abs=close * (1 + abs(angle)))


@pytest.mark.parametrize("angle", [math.nan, math.inf, -1e12])
def test_an_angle_that_says_nothing(angle):
    vehicle = FirmwareVehicle(PAPER, "massless")
    chi, contact = vehicle.ffi.new("omniroll_real *"), vehicle.ffi.new("int *")
    assert vehicle.lib.omniroll_contact_from_angle(vehicle.model, angle, chi, contact) == BAD_NUMBER


@pytest.mark.parametrize("model", MODELS)
def test_a_step_refuses_what_a_start_refuses(model):
    """A contact that is no roller's number, too."""
    vehicle = FirmwareVehicle(PAPER, model)
    for wrong in (PAPER.rollers_per_wheel, 9, -1):
        assert vehicle.start(**START) == OK
        vehicle.contact[2] = wrong
        before = vehicle.numbers()
        assert vehicle.lib.omniroll_start(vehicle.model, vehicle.state) == BAD_STATE
        assert vehicle.step(1e-3) == BAD_STATE
        assert np.array_equal(vehicle.numbers(), before)

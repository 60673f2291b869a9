"""omniroll_step_derivatives: against the step itself; twists; what an encoder's angle says of the contact."""

import math

import numpy as np
import pytest

import omniroll
from firmware.test_step import CASES, JOINT, MODELS, PAPER, START, firmware
from firmware.vehicle import BAD_NUMBER, NO_DERIVATIVE, OK, UNFINISHED, FirmwareVehicle

MOVED, STEP = 3e-6, 0.01  # of second order
HERE = [*START["nu"], *START["pose"], *START["chi"]]
SPINNING = np.linspace(-2, 3, PAPER.wheels * (PAPER.rollers_per_wheel - 1))  # axial speeds, rad/s
QUICK = [3.0, -2.0, -20.0, *HERE[3:]]
kinds = pytest.mark.parametrize(
    "model, case",
    [("massless", "motor"), ("locked", "motor"), ("locked", "slope"), ("free", "alone"), ("free", "motor")],
)


def with_derivatives(model, case, number_type="double", law="impact"):
    return firmware(model, law, case, number_type, also=("derivatives",))


def row_of(vehicle):
    """nu, pose, chi and what axial speeds there are, one behind the other."""
    return np.concatenate([vehicle.numbers(), vehicle.arrays.get("axial", np.zeros(0)).astype(float)])


def start(vehicle, model):
    return np.array([*QUICK, *SPINNING] if model == "free" else QUICK)


def put(vehicle, row):
    """The vehicle at these numbers, on the first roller of each wheel."""
    if "axial" in vehicle.arrays:
        vehicle.arrays["axial"][:] = row[9:]
    vehicle.state.nu[0:3], vehicle.state.pose[0:3] = [float(x) for x in row[:3]], [float(x) for x in row[3:6]]
    vehicle.arrays["chi"][:] = row[6:9]
    vehicle.contact[:] = 0
    return vehicle.lib.omniroll_start(vehicle.model, vehicle.state)


def derivatives(vehicle, h=STEP):
    """A step: its status, and the derivatives of its result."""
    size = len(row_of(vehicle))
    columns = size + PAPER.wheels * bool(vehicle.inputs)
    found, work = np.zeros((columns, size), vehicle.real), np.full(20000, np.nan, vehicle.real)
    pointers = (vehicle.pointer(a.reshape(-1)) for a in (found, work))
    return vehicle.lib.omniroll_step_derivatives(
        vehicle.model, vehicle.law, *vehicle.inputs, h, vehicle.state, *pointers
    ), found


def after(vehicle, row, h, torque=0.0, axle=0):
    """What a step leads to, and the rollers in contact then."""
    assert put(vehicle, row) == OK
    if vehicle.inputs:
        vehicle.inputs[0].torque[axle] += torque
    assert vehicle.step(h) == OK
    if vehicle.inputs:
        vehicle.inputs[0].torque[axle] -= torque
    return row_of(vehicle), vehicle.contact.tolist()


def differences(vehicle, row, h, moved=MOVED):
    wanted = []
    for column in range(len(row) + PAPER.wheels * bool(vehicle.inputs)):
        by, axle = moved * (np.arange(len(row)) == column), column - len(row)
        push, axle = (moved, axle) if axle >= 0 else (0.0, 0)
        (late, there), (early, here) = after(vehicle, row + by, h, push, axle), after(vehicle, row - by, h, -push, axle)
        assert there == here
        wanted.append((late - early) / (2 * moved))
    return np.array(wanted)


@kinds
@pytest.mark.parametrize("law, h", [("impact", 0.002), ("impact", 0.05), ("impact", 0.4), ("smooth", 0.4)])
def test_they_are_the_slopes_of_the_step(model, case, law, h):
    """Within a roller, through one joint, and through many with rollers that come back; the step keeps its bits."""
    vehicle = with_derivatives(model, case, law=law)
    row = start(vehicle, model)
    wanted = differences(vehicle, row, h)
    end, contact = after(vehicle, row, h)
    assert put(vehicle, row) == OK
    status, found = derivatives(vehicle, h)
    assert status == OK and np.array_equal(row_of(vehicle), end) and vehicle.contact.tolist() == contact
    assert any(contact) == (h > 0.01) and (h < 0.1 or sum(map(bool, contact)) >= 2)
    assert np.abs(found - wanted).max() < 5e-8 * np.abs(wanted).max()


@pytest.mark.parametrize("model, case", [("massless", "motor"), ("locked", "motor"), ("free", "alone")])
def test_steps_one_after_the_other_are_the_sensitivities_of_the_run(model, case):
    """The product of a thousand steps' derivatives, in double and in float, beside those that simulate follows."""
    names = [f"nu[{k}]" for k in range(3)] + [f"pose[{k}]" for k in range(3)] + [f"chi[{i}]" for i in range(3)]
    spins = {"spins": SPINNING.reshape(PAPER.wheels, -1)} if model == "free" else {}
    run = omniroll.simulate(
        PAPER, nu=QUICK[:3], pose=QUICK[3:6], chi=QUICK[6:], duration=1, accuracy=1e-10, roller_model=model,
        switching="impact", sensitivities=names, effects=CASES[case][0], **spins,
    )  # fmt: skip
    assert len(run.switches) >= 15
    found = [run.sensitivity(name) for name in names]
    wanted = np.array([[*one.nu[-1], *one.pose[-1], *one.chi[-1]] for one in found])
    for number_type, close in (("double", 2e-5), ("float", 1e-2)):
        vehicle = with_derivatives(model, case, number_type)
        assert vehicle.start(QUICK[:3], QUICK[6:], QUICK[3:6], **spins) == OK
        product = np.eye(len(row_of(vehicle)))
        if model == "free":  # at given spins the axial speeds move with chi and nu
            product[:9] = at_given_spins(vehicle)
        for _ in range(1000):
            status, one = derivatives(vehicle, 1e-3)
            assert status == OK
            product = product @ one[: len(product)]
        assert np.abs(product[:9, :9] - wanted).max() < close * np.abs(wanted).max()


def at_given_spins(vehicle):
    """The derivatives of nu, pose, chi and axial by nu, pose and chi: spins are speeds beside those of the disk."""
    near = row_of(vehicle)
    rows = np.eye(9, len(near))
    spins = vehicle.spins()
    for k in (*range(3), *range(6, 9)):
        ends = []
        for side in (1, -1):
            row = near[:9] + side * 1e-4 * (np.arange(9) == k)
            assert vehicle.start(row[:3], row[6:], row[3:6], spins) == OK
            ends.append(vehicle.arrays["axial"].astype(float))
        rows[k, 9:] = (ends[0] - ends[1]) / 2e-4
    assert vehicle.start(near[:3], near[6:9], near[3:6], spins) == OK
    return rows


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("side", [1, -1])
def test_a_start_and_an_end_on_a_joint(model, side):
    """One-sided there: on the side on which the switch is in the step."""
    vehicle = with_derivatives(model, "alone")
    row = start(vehicle, model)
    row[2] *= -side  # chi' has the sign of -nu_3
    row[6] = -side * float(vehicle.lib.omniroll_joint(vehicle.model))
    assert put(vehicle, row) == OK
    status, found = derivatives(vehicle, 0.002)
    end, contact = after(vehicle, row, 0.002)
    assert status == OK and contact == [side % PAPER.rollers_per_wheel, 0, 0]
    inside, _ = after(vehicle, row + side * MOVED * (np.arange(len(row)) == 6), 0.002)
    assert found[6] == pytest.approx(side * (inside - end) / MOVED, rel=1e-4, abs=1e-4)
    row, low, high = start(vehicle, model), 0.0, 0.05
    for _ in range(60):  # the first length of a step with a switch, by halves
        middle = (low + high) / 2
        low, high = (low, middle) if any(after(vehicle, row, middle)[1]) else (middle, high)
    found = []
    for h in (high, high + 1e-8):
        assert put(vehicle, row) == OK
        found.append(derivatives(vehicle, h)[1])
        assert vehicle.contact.any()
    assert found[0] == pytest.approx(found[1], abs=1e-6)


@pytest.mark.parametrize("model", MODELS)
def test_wheels_that_switch_at_once(model):
    """Of heavy rollers there is no derivative, but one along changes that keep the wheels together."""
    vehicle = with_derivatives(model, "alone")
    row = start(vehicle, model)
    row[:3], row[6:9] = (0, 0, -20), 0
    row[9:] = np.tile(row[9:13], PAPER.wheels) if model == "free" else row[9:]
    assert put(vehicle, row) == OK
    status, found = derivatives(vehicle, 0.1)
    assert status == (OK if model == "massless" else NO_DERIVATIVE) and vehicle.state.left == 0
    assert vehicle.contact.tolist() == [PAPER.rollers_per_wheel - 1] * 3
    for way in (np.eye(len(row))[2], np.concatenate([np.zeros(6), np.ones(3), np.zeros(len(row) - 9)])):
        (late, there), (early, here) = (after(vehicle, row + side * MOVED * way, 0.1) for side in (1, -1))
        assert there == here
        assert way @ found[: len(row)] == pytest.approx((late - early) / (2 * MOVED), abs=1e-7)
    if model == "massless":
        wanted = differences(vehicle, row, 0.1)
        assert np.abs(found - wanted).max() < 1e-7


def test_a_call_that_is_cut_has_those_at_its_time():
    """How the cut deviates, by differences, and what the motion does until the fixed time."""
    vehicle = with_derivatives("locked", "alone")
    row, cuts = np.array([3.0, -2.0, -90.0, *HERE[3:]]), []
    assert put(vehicle, row) == OK
    status, found = derivatives(vehicle, 0.3)
    assert status == UNFINISHED
    for side in (1, -1):
        assert put(vehicle, row + side * 1e-7 * np.eye(9)[2]) == OK
        assert vehicle.step(0.3) == UNFINISHED
        cuts.append(np.array([*row_of(vehicle), vehicle.state.left]))
    by, cut = (cuts[0] - cuts[1]) / 2e-7, row_of(vehicle)
    assert vehicle.step(1e-7) == OK
    rates = (row_of(vehicle) - cut) / 1e-7
    assert abs(by[9]) > 1e-3 and found[2] == pytest.approx(by[:9] + rates * by[9], abs=1e-5)


def test_a_wheel_that_only_just_passes():
    vehicle = with_derivatives("massless", "alone")
    row = np.array(QUICK)
    rates = np.linalg.inv(np.array([(vehicle.start(by), vehicle.wheel_speeds())[1] for by in np.eye(3)]).T)
    row[:3] = rates @ [1e-7, 1.0, 1.0]
    row[6:] = float(vehicle.lib.omniroll_joint(vehicle.model)), 0, 0
    assert put(vehicle, row) == OK
    assert derivatives(vehicle, 0.1)[0] == NO_DERIVATIVE and vehicle.contact[0] != 0


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

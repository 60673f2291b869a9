"""omniroll_step, from joint to joint: against the Python engine, and at the edges that a controller may meet."""

import math

import numpy as np
import pytest
from held_wheel import CHI, torques_that_hold

import omniroll
from firmware.vehicle import BAD_COUNT, BAD_NUMBER, BAD_SHAPE, BAD_STATE, NO_PROGRESS, OK, UNFINISHED, FirmwareVehicle
from omniroll.effects.effect_set import EffectSet
from omniroll.kernels.kernel import kernel

PAPER = omniroll.Vehicle.paper()
JOINT = math.pi / PAPER.rollers_per_wheel
MOST_JOINTS = PAPER.wheels * PAPER.rollers_per_wheel  # in a call, as the header has it
MODELS = ("massless", "locked", "free")
LAWS = ("smooth", "impact")
START = {"nu": (1, 0.2, 0.3), "chi": (0.1, -0.2, 0.3), "pose": (0, 0, 0.3)}
TORQUE = (0.02, -0.01, 0.005)
VOLTAGE, CONSTANT, RESISTANCE, GEAR = (2.0, -1.0, 0.5), 0.02, 1.5, 4.0
PER_VOLT = GEAR * CONSTANT / RESISTANCE
MOTOR_INPUTS = {"torque": [PER_VOLT * u for u in VOLTAGE], "damping": [PER_VOLT * GEAR * CONSTANT] * 3}
MOTOR = omniroll.Motor(voltage=VOLTAGE, torque_constant=CONSTANT, resistance=RESISTANCE, gear_ratio=GEAR)
SLOPE = omniroll.Slope(angle=0.1, direction=0.5)
VISCOUS = omniroll.Bearings(wheel_viscous=1e-3, roller_viscous=1e-6)
COULOMB = omniroll.Bearings(wheel_coulomb=1e-3, wheel_speed=0.3, roller_coulomb=1e-6, roller_speed=0.3)
CASES = {
    "alone": ([], {}),
    "torque": ([omniroll.Torque(TORQUE)], {"torque": TORQUE}),
    "motor": ([MOTOR], MOTOR_INPUTS),
    "slope": ([SLOPE], {}),
    "viscous": ([VISCOUS], {}),
    "Coulomb": ([COULOMB], {}),
    "motor, slope, viscous": ([MOTOR, SLOPE, VISCOUS], MOTOR_INPUTS),
    "motor, slope, Coulomb": ([MOTOR, SLOPE, COULOMB], MOTOR_INPUTS),
}
models = pytest.mark.parametrize("model", MODELS)
laws = pytest.mark.parametrize("law", LAWS)


def firmware(model, law="impact", case="alone", number_type="double", also=()):
    """The paper's vehicle with the effects of a case and what acts on it; `also`: further parts of its set."""
    effects, inputs = CASES[case]
    acting = EffectSet.checked(effects, PAPER)
    names = (*acting.kernel(PAPER, model, "python").effects, *also)
    constants = acting.constants(PAPER)
    return FirmwareVehicle(
        acting.equipped(PAPER), model, names, constants=constants, inputs=inputs, law=law, number_type=number_type
    )


def engine(model, law, case):
    """The trajectory of the Python engine over 1 s."""
    return omniroll.simulate(
        PAPER, **START, duration=1.0, roller_model=model, switching=law, accuracy=1e-10, engine="python",
        effects=CASES[case][0],
    )  # fmt: skip


def end(run):
    return np.array([*run.nu[-1], *run.pose[-1], *run.chi[-1]])


@pytest.mark.long
@models
@laws
@pytest.mark.parametrize("case", CASES)
def test_it_drives_as_the_python_engine_does(model, law, case):
    """1 s in steps of 1 ms, through joints; the error of fourth order is far below the engine's bound."""
    run = engine(model, law, case)
    assert len(run.switches) >= 2
    vehicle = firmware(model, law, case)
    assert vehicle.start(**START) == OK and vehicle.run(1e-3, 1000) == OK
    np.testing.assert_allclose(vehicle.numbers(), end(run), rtol=0, atol=1e-7)
    assert vehicle.contact.tolist() == run.contact[-1].tolist()
    if model == "free":
        np.testing.assert_allclose(vehicle.spins(), run.spins[-1], rtol=0, atol=1e-6)


@pytest.mark.parametrize("model, case", [
    ("massless", "motor"),
    ("locked", "alone"),
    ("free", "alone"),
    ("free", "viscous"),
    ("free", "Coulomb"),
    ("free", "motor, slope, viscous"),
])  # fmt: skip
def test_the_order_is_four(model, case):
    """Mean order over the last halvings of h whose errors are above rounding; a joint cuts a step wherever it lies, so
    that one halving alone may say less."""
    counts = np.array([40, 80, 160, 320, 640, 1280, 2560])
    fine = firmware(model, "impact", case)
    assert fine.start(**START) == OK and fine.run(1 / 12800, 12800) == OK
    errors = []
    for count in counts:
        vehicle = firmware(model, "impact", case)
        assert vehicle.start(**START) == OK and vehicle.run(1 / count, int(count)) == OK
        errors.append(np.abs(vehicle.numbers() - fine.numbers()).max())
    last = np.flatnonzero(np.array(errors) > 1e-12)[-4:]
    order = -np.polyfit(np.log(counts[last]), np.log(np.array(errors)[last]), 1)[0]
    assert len(last) >= 3 and order > 3.6, errors


# Joints


@models
@laws
def test_wheels_that_reach_their_joints_together_switch_together(model, law):
    for number_type in ("double", "float"):
        vehicle = firmware(model, law, number_type=number_type)
        assert vehicle.start((0, 0, -1)) == OK
        wait, wheel = vehicle.time_to_joint()
        assert wheel in (0, 1, 2) and wait > 0
        counts = []
        while len(set(vehicle.contact)) == 1 and len(counts) < 400:
            assert vehicle.step(wait / 7.3) == OK
            counts.append(vehicle.contact[0])
        assert len(counts) == 400 and len(set(counts)) == PAPER.rollers_per_wheel  # all rollers have had contact


@models
@laws
@pytest.mark.parametrize("side", [1, -1])
def test_a_start_on_the_joint(model, law, side):
    """A wheel that moves outwards there switches at once; one that moves inwards stays on its roller."""
    vehicle = firmware(model, law)
    exact = vehicle.lib.omniroll_joint(vehicle.model)
    for chi, direction in ((side * exact, 1), (side * exact, -1)):
        assert vehicle.start((0, 0, -side * direction), (chi, 0.1, -0.1)) == OK  # chi' has the sign of side*direction
        assert vehicle.step(0.0) == OK
        if direction > 0:
            assert vehicle.arrays["chi"][0] == -chi and vehicle.contact[0] == -side % PAPER.rollers_per_wheel
        else:
            assert vehicle.arrays["chi"][0] == chi and vehicle.contact[0] == 0
        assert vehicle.contact[1] == vehicle.contact[2] == 0
        before = vehicle.contact.copy()
        assert vehicle.run(1e-4, 10) == OK
        assert abs(vehicle.arrays["chi"][0]) < exact and vehicle.contact.tolist() == before.tolist()


@models
@laws
def test_rest_on_the_joint_and_a_push_outwards(model, law):
    """The wheel starts with no speed; the switch comes at once, as the Python engine has it."""
    start = {"nu": (0, 0, 0), "chi": (JOINT, 0.1, -0.1)}
    push = (0.02, 0.0, 0.0)
    for number_type, tolerance in (("double", 1e-8), ("float", 1e-3)):
        vehicle = FirmwareVehicle(PAPER, model, ("drive",), inputs={"torque": push}, law=law, number_type=number_type)
        chi = (vehicle.lib.omniroll_joint(vehicle.model), 0.1, -0.1)
        run = omniroll.simulate(
            PAPER, **start, duration=0.05, roller_model=model, switching=law, engine="python", accuracy=1e-10,
            effects=[omniroll.Torque(push)],
        )  # fmt: skip
        assert vehicle.start((0, 0, 0), chi) == OK and vehicle.run(1e-3, 50) == OK
        np.testing.assert_allclose(vehicle.numbers(), end(run), rtol=0, atol=tolerance)
        assert vehicle.contact.tolist() == run.contact[-1].tolist() == [4, 0, 0]


@models
@laws
@pytest.mark.parametrize("reach", [0.999999, 1.0, 1.000001])
def test_a_wheel_that_turns_back_at_its_joint(model, law, reach):
    """A torque turns the vehicle back when its wheels are just before their joints, about there, or just beyond."""
    torque, spin = (0.01,) * 3, 0.5
    bound = kernel(PAPER, model, "python", effects=("drive",))
    momenta = (np.zeros((3, 2)),) if model == "free" else ()
    brake = bound.forward_dynamics((0, 0, spin), (0, 0, 0), *momenta, torque)[2]
    assert brake < 0
    # Forward until it rests, and the same way back: nu_3 falls from spin to 0 while the wheels turn to -joint*reach.
    wheel_rate = bound.wheel_speeds((0, 0, 1.0))[0]
    assert wheel_rate < 0
    way = -wheel_rate * spin * spin / (2 * -brake)
    chi0 = -JOINT * reach + way
    start = {"nu": (0, 0, spin), "chi": (chi0,) * 3}
    duration = 2 * spin / -brake * 0.9
    run = omniroll.simulate(
        PAPER, **start, duration=duration, roller_model=model, switching=law, engine="python", accuracy=1e-10,
        effects=[omniroll.Torque(torque)],
    )  # fmt: skip
    vehicle = FirmwareVehicle(PAPER, model, ("drive",), inputs={"torque": torque}, law=law)
    assert vehicle.start(**start) == OK
    assert vehicle.run(duration / 200, 200) == OK
    assert np.all(np.abs(vehicle.arrays["chi"]) <= JOINT)
    assert vehicle.state.nu[2] < 0  # on its way back
    np.testing.assert_allclose(vehicle.numbers()[:6], end(run)[:6], rtol=0, atol=1e-4)


@models
def test_a_vehicle_that_turns_by_many_rollers_in_a_step(model):
    """Hundreds of joints in one step, a bounded number in each call."""
    vehicle = firmware(model)
    assert vehicle.start((0, 0, -500)) == OK
    status, calls = vehicle.finish(1.0)
    assert status == OK and calls > 500 / PAPER.wheels / (MOST_JOINTS + 1)
    run = omniroll.simulate(PAPER, nu=(0, 0, -500), duration=1, roller_model=model, accuracy=1e-8)
    assert len(run.switches) > 500
    assert vehicle.state.pose[2] == pytest.approx(run.pose[-1, 2], rel=1e-4)


def test_motors_at_their_current_limit():
    """The modes of the motors are those at the beginning of each step, as the program of docs/c-interface.md has them;
    where a mode changes within a step, the step is wrong by the part of it that is in the other mode."""
    limit, voltage = 0.5, (6.0, -1.0, -3.0)
    motor = omniroll.Motor(
        voltage=voltage, torque_constant=CONSTANT, resistance=RESISTANCE, gear_ratio=GEAR, current_limit=limit
    )
    run = omniroll.simulate(PAPER, duration=1, effects=[motor], engine="python", accuracy=1e-10, nu=(0, 0, 0))
    acting = EffectSet.checked([motor], PAPER)
    errors, seen = [], set()
    for steps in (250, 1000):
        vehicle = FirmwareVehicle(
            acting.equipped(PAPER), "free", ("drive", "motor"), constants=acting.constants(PAPER), inputs={}
        )
        volts, modes, margins = np.array(voltage), np.zeros(3), np.zeros((3, 2))
        given, lib = vehicle.inputs[0], vehicle.lib
        assert vehicle.start((0, 0, 0)) == OK
        for _ in range(steps):
            u, m, r = map(vehicle.pointer, (volts, modes, margins.reshape(-1)))
            modes[:] = 0
            lib.omniroll_motor_margins(vehicle.model, vehicle.state.nu, u, m, r)
            modes[:] = np.where(margins[:, 0] > 0, 1, np.where(margins[:, 1] > 0, -1, 0))
            seen |= set(modes)
            lib.omniroll_motor_torques(vehicle.model, u, m, given.torque, given.damping)
            assert vehicle.step(1 / steps) == OK
        errors.append(np.abs(vehicle.numbers() - end(run)).max())
    assert seen == {-1, 0, 1}
    assert errors[1] < 1e-3 and errors[1] < errors[0] / 2


# The bound of a call


def is_valid(vehicle):
    """Whether a motion can go on from the state."""
    joint = vehicle.lib.omniroll_joint(vehicle.model)
    on_rollers = np.all(np.abs(vehicle.arrays["chi"]) <= joint) and set(vehicle.contact) <= set(range(vehicle.rollers))
    return on_rollers and all(np.isfinite(x).all() for x in (vehicle.numbers(), *vehicle.arrays.values()))


@pytest.mark.parametrize("number_type", ["double", "float"])
@pytest.mark.parametrize("joints", [0, 1, MOST_JOINTS - 1, MOST_JOINTS, MOST_JOINTS + 1, MOST_JOINTS + 2, 40])
def test_a_call_ends_behind_the_joint_that_is_one_too_many(joints, number_type):
    """All wheels turn alike at a constant rate, so that it is known when which joint comes."""
    vehicle = firmware("massless", number_type=number_type)
    assert vehicle.start((0, 0, -10)) == OK
    rate = float(vehicle.wheel_speeds()[0])
    h = 2 * JOINT * joints / rate  # in the middle of a roller again
    status = vehicle.step(h)
    passed = min(joints, MOST_JOINTS + 1)
    assert vehicle.contact.tolist() == [-passed % PAPER.rollers_per_wheel] * 3
    assert status == (OK if joints <= MOST_JOINTS else UNFINISHED)
    tolerance = float(100 * np.finfo(vehicle.real).eps * h)
    done = h if status == OK else JOINT * (2 * passed - 1) / rate
    assert h - vehicle.state.left == pytest.approx(done, abs=tolerance)
    assert is_valid(vehicle) and vehicle.lib.omniroll_start(vehicle.model, vehicle.state) == OK


# Refusals


def put(place, value):
    """What puts a number into a vehicle: into an array, a field of its state, or the rollers in contact."""

    def putting(vehicle):
        array = vehicle.arrays.get(place, vehicle.contact if place == "contact" else None)
        if place == "torque":
            vehicle.inputs[0].torque[1] = value
        else:
            (getattr(vehicle.state, place) if array is None else array)[1] = value

    return putting


@models
@pytest.mark.parametrize("place, value, h, status", [
    *(("", 0, h, BAD_NUMBER) for h in (-1e-3, math.nan, math.inf)),
    *((place, value, 1e-3, BAD_STATE) for place in ("nu", "pose", "chi") for value in (math.nan, math.inf)),
    ("chi", 1.001 * JOINT, 1e-3, BAD_STATE), ("axial", math.nan, 1e-3, BAD_STATE),
    ("torque", -math.inf, 1e-3, BAD_NUMBER),
    *(("contact", number, 1e-3, BAD_STATE) for number in (PAPER.rollers_per_wheel, -1)),
])  # fmt: skip
def test_a_step_that_cannot_be_changes_nothing(model, place, value, h, status):
    """And a start refuses what a step refuses of a state."""
    if place == "axial" and model != "free":
        return
    vehicle = FirmwareVehicle(PAPER, model, ("drive",))
    assert vehicle.start(**START) == OK
    if place:
        put(place, value)(vehicle)
    before = vehicle.numbers()
    assert vehicle.step(h) == status and np.array_equal(vehicle.numbers(), before, equal_nan=True)
    if status == BAD_STATE:
        assert vehicle.lib.omniroll_start(vehicle.model, vehicle.state) == BAD_STATE


def test_a_law_that_nobody_knows_and_a_motion_out_of_the_range_of_numbers():
    vehicle = FirmwareVehicle(PAPER, "free", ("drive",), inputs={"torque": (1e300, 0.0, 0.0)})
    assert vehicle.start(**START) == OK
    assert vehicle.step(1e3) in (BAD_STATE, NO_PROGRESS)
    vehicle.law = 2
    assert vehicle.start(**START) == OK and vehicle.step(1e-3) == BAD_NUMBER


@pytest.mark.parametrize("field, value, status", [
    *((field, wrong, BAD_NUMBER) for field in ("mass", "wheel_radius", "yaw_scale") for wrong in (math.nan, 0.0, -1.0)),
    ("wheel_angles", math.inf, BAD_NUMBER), ("wheels", 0, BAD_COUNT), ("rollers_per_wheel", 2, BAD_COUNT),
    ("roller_axis_radius", 0.99, BAD_SHAPE), ("yaw_inertia", 1e-12, BAD_SHAPE),
])  # fmt: skip
def test_a_vehicle_that_is_none(field, value, status):
    vehicle = firmware("free")
    if field == "wheel_angles":
        vehicle.vehicle.wheel_angles[1] = value
    else:
        setattr(vehicle.vehicle, field, value)
    assert vehicle.lib.omniroll_prepare(vehicle.vehicle, *vehicle.storage, vehicle.model) == status


@pytest.mark.parametrize("number_type", ["double", "float"])
@pytest.mark.parametrize("model", ["locked", "free"])
@laws
def test_a_wheel_that_is_held_on_its_joint_ends_or_says_so(model, law, number_type):
    inputs = {"torque": torques_that_hold(model)}
    vehicle = FirmwareVehicle(PAPER, model, ("drive",), inputs=inputs, law=law, number_type=number_type)
    joint = vehicle.lib.omniroll_joint(vehicle.model)
    assert vehicle.start((0, 0, 0), (joint, *CHI[1:])) == OK
    first = vehicle.step(1e-3)
    assert first in (OK, UNFINISHED, NO_PROGRESS)
    if number_type == "double":
        assert first == NO_PROGRESS  # float leaves the joint by rounding
    for _ in range(500):
        assert is_valid(vehicle)
        assert vehicle.finish(1e-3)[0] == OK

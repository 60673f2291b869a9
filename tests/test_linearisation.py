"""Linear models: against the motion itself, what they refuse, and what others make of them."""

from dataclasses import replace

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, Controller, InvalidValueError, Motor, Slope, Torque, Vehicle, linearise

VEHICLE = Vehicle.paper()
MOTOR = Motor(voltage=(1, 2, 3), torque_constant=0.02, resistance=1.5, gear_ratio=4)
FRICTION = Bearings(wheel_viscous=1e-3, wheel_coulomb=2e-3, wheel_speed=0.5, roller_viscous=1e-5)
CASES = [(), (MOTOR,), (FRICTION, Torque((0.01, 0.02, -0.01))), (Slope(angle=0.2, direction=0.3), MOTOR)]


def point(model, seed=1):
    rng = np.random.default_rng(seed)
    chi = rng.uniform(-0.5, 0.5, 3) * np.pi / VEHICLE.rollers_per_wheel
    spins = {"spins": rng.normal(size=(3, VEHICLE.rollers_per_wheel - 1))} if model == "free" else {}
    return {"nu": rng.normal(size=3), "chi": chi, "pose": rng.normal(size=3), "roller_model": model} | spins


def after(state, effects, duration):
    """nu, chi and pose after a short motion without a switch."""
    run = omniroll.simulate(VEHICLE, **state, effects=effects, duration=duration, accuracy=1e-13, control=False)
    assert len(run.switches) == 0
    return np.concatenate([run.nu[-1], run.chi[-1], run.pose[-1]])


@pytest.mark.long
@pytest.mark.parametrize("model", ["massless", "locked", "free"])
@pytest.mark.parametrize("effects", CASES, ids=["bare", "motor", "friction and torque", "slope and motor"])
def test_it_foretells_where_the_vehicle_is_after_a_moment(model, effects):
    """What the linear model leaves out of the motion is of second order in the rates, and so of third in the step."""
    state = point(model)
    errors = []
    for step in (1e-3, 5e-4):
        model_ = linearise(VEHICLE, **state, effects=effects).discrete(step)
        errors.append(np.abs((model_.state + model_.rates)[:9] - after(state, effects, step)).max())
    assert errors[0] < 1e-4
    assert errors[1] < errors[0] / 5  # of third order: by 8 for half the step


def test_names_follow_the_scene():
    model = linearise(VEHICLE, effects=(MOTOR,), outputs=("wheel_rates", "yaw_rate"))
    assert model.states[:3] == ("nu[0]", "nu[1]", "nu[2]") and model.states[-1] == "momenta[2][1]"
    assert model.inputs == ("voltage[0]", "voltage[1]", "voltage[2]")
    assert model.outputs == ("wheel_rates[0]", "wheel_rates[1]", "wheel_rates[2]", "yaw_rate[0]")
    assert model.input.tolist() == [1, 2, 3]
    assert model.A.shape == (15, 15) and model.B.shape == (15, 3) and model.C.shape == (4, 15)
    assert linearise(VEHICLE, roller_model="locked").inputs[0] == "torque[0]"
    controller = Controller(target=(1, 0, 0), proportional=1, sample_time=0.01, output="voltage")
    voltage = Motor(voltage=0, torque_constant=0.02, resistance=1.5)
    model = linearise(VEHICLE, effects=(voltage, controller))
    assert model.inputs[0] == "voltage[0]" and not model.input.any()


def test_many_states_at_once_are_the_same_one_by_one():
    nu = np.random.default_rng(2).normal(size=(4, 2, 3))
    together = linearise(VEHICLE, nu=nu, chi=0.1)
    assert together.A.shape == (4, 2, 15, 15)
    assert (together.A[3, 1] == linearise(VEHICLE, nu=nu[3, 1], chi=0.1).A).all()
    assert (together.discrete(0.01).A[3, 1] == linearise(VEHICLE, nu=nu[3, 1], chi=0.1).discrete(0.01).A).all()


def test_a_scene_brings_its_start_and_its_effects(tmp_path):
    scene = omniroll.load_scene("scenes/driven.toml")
    model = linearise(scene)
    assert model.state[:3].tolist() == list(scene.options["nu"]) and len(model.inputs) == scene.vehicle.wheels


@pytest.mark.parametrize(("arguments", "field"), [
    ({"effects": (Bearings(wheel_coulomb=0.1),)}, "wheel_coulomb"),
    ({"effects": (Bearings(roller_coulomb=0.1, roller_speed=1.0),)}, "roller_coulomb"),
    ({"outputs": ("speed",)}, "outputs"),
    ({"outputs": ("encoder_count",)}, "whole number"),
    ({"outputs": ("motor_current",)}, "Motor"),
    ({"nu": np.zeros((0, 3))}, "nu"),
    ({"nu": np.zeros((2, 3)), "pose": np.zeros((3, 3))}, "nu"),
])  # fmt: skip
def test_what_it_refuses(arguments, field):
    with pytest.raises(InvalidValueError, match=field):
        linearise(VEHICLE, **arguments)


def test_a_second_step_is_refused():
    with pytest.raises(InvalidValueError, match="discrete already"):
        linearise(VEHICLE).discrete(0.1).discrete(0.1)


TIP = VEHICLE.wheel_radius * np.cos(np.pi / VEHICLE.rollers_per_wheel)
SHARP = VEHICLE.replace(roller_axis_radius=TIP * (1 - 1e-6))


@pytest.mark.parametrize("vehicle, model", [
    *((VEHICLE, model) for model in ("massless", "locked", "free")), (SHARP, "locked"), (SHARP, "free"),
], ids=lambda value: {VEHICLE: "round", SHARP: "sharp"}.get(value, value))  # fmt: skip
@pytest.mark.parametrize("effects", CASES, ids=["bare", "motor", "friction and torque", "slope and motor"])
def test_the_rates_beside_the_state_are_those_that_it_foretells(vehicle, model, effects):
    """Every row, those of the momenta too: rates of states a little to both sides, over how far these are apart."""
    assert omniroll.kernel(vehicle, model, "python").sharp == (vehicle is SHARP)
    state, rng = point(model), np.random.default_rng(7)
    names = ("nu", "chi", "pose") + (("spins",) if model == "free" else ())
    for _ in range(4):
        step = {name: 1e-5 * rng.normal(size=np.shape(state[name])) for name in names}
        ends = [
            linearise(vehicle, **(state | {name: state[name] + side * step[name] for name in names}), effects=effects)
            for side in (-1, 1)
        ]
        foretold = linearise(vehicle, **state, effects=effects).A @ (ends[1].state - ends[0].state)
        found = ends[1].rates - ends[0].rates
        seen = linearise(vehicle, **state, effects=effects).C @ (ends[1].state - ends[0].state)
        assert seen == pytest.approx(ends[1].outputs_at - ends[0].outputs_at, rel=1e-6, abs=1e-12)
        for part in ("nu", "chi", "pose", "momenta"):
            rows = [k for k, name in enumerate(ends[0].states) if name.startswith(part)]
            size = np.abs(found[rows]).max(initial=0)
            assert np.abs(foretold[rows] - found[rows]).max(initial=0) <= 1e-6 * size, part


READ = ("wheel_rate", "wheel_angle", "net_torque", "gyro", "accelerometer", "odometry")
LIMITED = replace(MOTOR, voltage=(0.5, 40, -40), current_limit=2.0)
DRIVEN = {
    "torque": (FRICTION, Torque((0.01, 0.02, -0.01))),
    "motor": (MOTOR,),
    "motor on a slope": (Slope(angle=0.2, direction=0.3), MOTOR, FRICTION),
    "motors at their limits": (LIMITED,),
}
PLACE = (0.05, -0.02)


def with_signal(effects, moved):
    """The effects with what drives moved by (3,) voltages or torques."""
    drive = next(effect for effect in effects if isinstance(effect, Motor | Torque))
    name = "voltage" if isinstance(drive, Motor) else "torque"
    other = replace(drive, **{name: np.asarray(getattr(drive, name)) + moved})
    return tuple(other if effect is drive else effect for effect in effects)


def read_of(state, effects, names):
    """What a session's instruments read a moment after the start; its odometry, the pose."""
    session = omniroll.Session(VEHICLE, **state, effects=effects, driven=False)
    session.step(1e-13)
    read = session.measure(omniroll.Instruments(place=PLACE)) | {"odometry": session.pose}
    return np.concatenate([np.ravel(read[name]) for name in names])


@pytest.mark.long
@pytest.mark.parametrize("model", ["massless", "locked", "free"])
@pytest.mark.parametrize("effects", DRIVEN.values(), ids=DRIVEN)
def test_outputs_are_what_instruments_read(model, effects):
    """Values, and C and D together: readings of states and inputs a little to both sides, along random ways."""
    motors = any(isinstance(effect, Motor) for effect in effects)
    names = READ + (("motor_current", "motor_voltage") if motors else ())
    if model == "free":
        effects = tuple(e if e is not FRICTION else Bearings(wheel_viscous=1e-3, roller_viscous=1e-5) for e in effects)
    state, rng = point(model), np.random.default_rng(3)
    model_ = linearise(VEHICLE, **state, effects=effects, outputs=names, place=PLACE)
    assert model_.outputs_at == pytest.approx(read_of(state, effects, names), rel=1e-9, abs=1e-11)
    assert len(model_.outputs) == len(model_.C) == len(model_.D)
    for _ in range(4):
        step = {name: 1e-5 * rng.normal(size=np.shape(state[name])) for name in state if name != "roller_model"}
        signal = 1e-5 * rng.normal(size=3)
        ends, read = [], []
        for side in (-1, 1):
            beside = state | {name: state[name] + side * own for name, own in step.items()}
            driven = with_signal(effects, side * signal)
            ends.append(linearise(VEHICLE, **beside, effects=driven))
            read.append(read_of(beside, driven, names))
        foretold = model_.C @ (ends[1].state - ends[0].state) + model_.D @ (ends[1].input - ends[0].input)
        for name in names:
            rows = [k for k, own in enumerate(model_.outputs) if own.split("[")[0] == name]
            found = (read[1] - read[0])[rows]
            assert foretold[rows] == pytest.approx(found, abs=1e-6 * np.abs(found).max() + 2e-13), name


def test_a_motor_at_its_limit_reads_the_limit_whatever_its_voltage():
    model = linearise(VEHICLE, nu=(0, 0, 0), effects=(LIMITED,), outputs=("motor_current", "motor_voltage"))
    assert model.outputs_at[:3] == pytest.approx([0.5 / 1.5, 2, -2], rel=1e-14)
    assert np.diag(model.D[:3]) == pytest.approx([1 / 1.5, 0, 0]) and not model.D[1:3].any()
    assert model.outputs_at[3:] == pytest.approx([0.5, 3, -3], rel=1e-14)


def test_python_control_takes_it_with_all_names():
    control = pytest.importorskip("control")
    model = linearise(VEHICLE, effects=(MOTOR,), outputs=("motor_current", "accelerometer", "odometry"), place=PLACE)
    for step, own in ((0, model), (0.02, model.discrete(0.02))):
        system = own.to_control()
        assert system.dt == step and (system.A == own.A).all() and (system.D == own.D).all() and system.D.any()
        assert tuple(system.state_labels) == own.states and tuple(system.output_labels) == own.outputs
        assert isinstance(system, control.StateSpace) and tuple(system.input_labels) == own.inputs


def test_parallel_axles_have_no_odometry():
    cart = Vehicle.paper(4, 5).replace(wheel_angles=(np.pi / 2,) * 4, wheel_places=((1, 1), (-1, 1), (-1, -1), (1, -1)))
    with pytest.raises(InvalidValueError, match="odometry"):
        linearise(cart, outputs=("odometry",))


# Parts of a model, second derivatives, other tools


def test_states_are_selected_by_name():
    model = linearise(VEHICLE, **point("locked"), effects=(MOTOR,), outputs=("nu", "chi", "yaw_rate"), hessians=True)
    own = model.select("nu", "chi[1]")
    assert own.states == ("nu[0]", "nu[1]", "nu[2]", "chi[1]")
    assert own.outputs == ("nu[0]", "nu[1]", "nu[2]", "chi[1]", "yaw_rate[0]")  # the others read what is gone
    places = [0, 1, 2, 4]
    assert (own.A == model.A[np.ix_(places, places)]).all() and (own.B == model.B[places]).all()
    assert (own.C == model.C[np.ix_([0, 1, 2, 4, 6], places)]).all() and (own.rates == model.rates[places]).all()
    every = [*places, 9, 10, 11]
    assert (own.hessians == model.hessians[np.ix_(places, every, every)]).all()
    assert model.select("nu", outputs=("yaw_rate",)).outputs == ("yaw_rate[0]",)
    with pytest.raises(InvalidValueError, match="speed.*must be one of nu"):
        model.select("speed")
    with pytest.raises(InvalidValueError, match="reads a state"):
        model.select("nu", outputs=("chi[0]",))
    many = linearise(VEHICLE, nu=np.random.default_rng(1).normal(size=(2, 3)), roller_model="locked")
    assert (many.select("nu").A == many.A[..., :3, :3]).all() and "2 linear models" in str(many)


def test_without_integrals_riccati_has_a_solution():
    """With free rollers the pose is an integral, and nothing moves the momenta; at rest nothing depends on chi."""
    control = pytest.importorskip("control")
    motor = replace(MOTOR, voltage=0)
    model = linearise(VEHICLE, nu=(0, 0, 0), effects=(motor,), outputs=("wheel_rates", "pose"))
    rest = model.without_integrals()
    assert rest.states == ("nu[0]", "nu[1]", "nu[2]") and rest.outputs == tuple(f"wheel_rates[{i}]" for i in range(3))
    sampled = rest.discrete(0.02)
    gain, _, poles = control.dlqr(sampled.A, sampled.B, np.eye(3), 0.05 * np.eye(3))
    assert np.abs(poles).max() < 1
    assert np.allclose(sampled.A, model.discrete(0.02).A[:3, :3]) and sampled.rates == pytest.approx(
        model.discrete(0.02).rates[:3]
    )
    on_slope = linearise(VEHICLE, nu=(0, 0, 0), roller_model="massless", effects=(MOTOR, Slope(angle=0.2)))
    assert "pose[2]" in on_slope.without_integrals().states and "pose[0]" not in on_slope.without_integrals().states
    with pytest.raises(InvalidValueError, match="before discrete"):
        model.discrete(0.02).without_integrals()


@pytest.mark.parametrize("model", ["massless", "locked", "free"])
@pytest.mark.parametrize("effects", CASES[1:], ids=["motor", "friction and torque", "slope and motor"])
def test_second_derivatives_are_the_slopes_of_the_first(model, effects):
    """By differences of A and B along nu, chi and the heading, at given momenta: of second order in what is moved."""
    state, moved = point(model), 1e-5
    found = linearise(VEHICLE, **state, effects=effects, hessians=True)
    assert found.hessians.shape == (len(found.state), len(found.state) + 3, len(found.state) + 3)
    assert np.abs(found.hessians - np.swapaxes(found.hessians, -1, -2)).max() <= 1e-12 * np.abs(found.hessians).max()
    for name, places in (("nu", range(3)), ("chi", range(3, 6)), ("pose", [8])):
        for place in places:
            if model == "free" and name != "pose":
                continue  # at given spins the momenta move with these
            step = moved * np.eye(3)[place % 3]
            starts = (state | {name: state[name] + side * step} for side in (1, -1))
            ends = [linearise(VEHICLE, **start, effects=effects) for start in starts]
            first, last = (np.hstack([end.A, end.B]) for end in ends)
            assert found.hessians[:, :, place] == pytest.approx((first - last) / (2 * moved), abs=1e-7)
    assert found.discrete(0.01).hessians is None
    with pytest.raises(InvalidValueError, match="hessians"):
        linearise(VEHICLE, effects=(omniroll.Contact(100.0),), hessians=True)


def test_a_mat_file_reads_back(tmp_path):
    from scipy.io import loadmat

    model = linearise(VEHICLE, nu=(1, 0, 0.5), roller_model="locked", hessians=True)
    model.to_mat(tmp_path / "robot.mat")
    read = loadmat(tmp_path / "robot.mat")
    assert all((read[name] == getattr(model, name)).all() for name in "ABCD") and (read["H"] == model.hessians).all()
    assert [str(name[0]) for name in read["StateName"].ravel()] == list(model.states) and read["Ts"] == 0
    assert read["x0"].shape == (9, 1) and (read["f0"][:, 0] == model.rates).all()

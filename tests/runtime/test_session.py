"""Sessions: stepping is one run whatever the steps; save and restore are exact; what is given acts."""

import pickle
import sys
import threading

import numpy as np
import pytest
from held_wheel import CHI, torques_that_hold

from omniroll import (
    Bearings,
    Controller,
    FunctionController,
    InvalidValueError,
    Motor,
    OmnirollError,
    Session,
    SimulationStopped,
    Slope,
    Torque,
    TorqueTable,
    Vehicle,
    simulate,
    tau,
)
from omniroll.effects.effect import Process
from omniroll.scenes import load_scene

PAPER = Vehicle.paper()
ACCURACY = 1e-10
FINE = 1e-14  # switches are located to less than tau
LIMITED = Motor(
    ((4.0, -3.0, -2.0), (-4.0, 2.0, 3.0), (1.0, 1.0, 0.0)), 0.02, 1.5, gear_ratio=3, current_limit=0.7,
    times=(0.2, 0.7, 1.1),
)  # fmt: skip


def braking(time, state):
    return -0.005 * state.wheel_speeds


class ToAPlace:
    """A controller of the pose that remembers something: the integral of the distance."""

    def __init__(self):
        self.sum = np.zeros(2)

    def __call__(self, time, state):
        x, y, theta = state.pose
        away = np.array([0.2 - x, 0.1 - y])
        self.sum = self.sum + 0.05 * away
        along = np.array([[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]]) @ (away + 0.1 * self.sum)
        wanted = np.array([*(3 * along / PAPER.platform_radius), -0.3 * np.sin(theta)])
        return 0.3 * (state.kernel.wheel_speeds(wanted) - state.wheel_speeds)


SCENES = {
    "free": {},
    "locked": {"roller_model": "locked"},
    "massless": {"roller_model": "massless"},
    "smooth": {"switching": "smooth"},
    "linear table": {"effects": [TorqueTable((0.1, 0.5, 1.3), ((0, 0, 0), (0.04, 0, -0.03), (-0.02, 0.03, 0)))]},
    "held table": {"effects": [TorqueTable((0.1, 0.5, 1.3), ((0.03, 0, 0), (0, -0.03, 0), (0, 0, 0.02)), "hold")]},
    "limited motors": {"effects": [LIMITED]},
    "motors with a controller": {
        "effects": [LIMITED, Controller(((0.5, 0, 0.5), (0, 1, 0)), 1.0, 0.07, 0.5, "voltage", times=(0.3, 1.2))]
    },
    "viscous friction": {"effects": [Bearings(wheel_viscous=1e-3, roller_viscous=1e-5), Torque((0.01, 0, -0.02))]},
    "Coulomb's friction on a slope": {
        "effects": [
            Bearings(wheel_coulomb=1e-3, wheel_speed=0.5, roller_coulomb=1e-5, roller_speed=0.5), Slope(0.1, 0.5),
        ]
    },
    "axles that stick": {"effects": [Bearings(wheel_coulomb=(6e-3, 4e-3, 5e-3), wheel_break_away=7e-3)]},
    "motors with axles that stick": {
        "effects": [LIMITED, Controller((1.5, 0, -1), 1.0, 0.07, 0.5, "voltage"), Bearings(wheel_coulomb=3e-3)]
    },
    "rollers that stick": {
        "effects": [Bearings(roller_coulomb=1e-6, roller_break_away=3e-6), Torque((0.01, 0, -0.02))]
    },
    "motors with axles and rollers that stick": {
        "effects": [
            LIMITED, Controller((1.5, 0, -1), 1.0, 0.07, 0.5, "voltage"),
            Bearings(wheel_coulomb=3e-3, roller_coulomb=3e-5),
        ]
    },
    "a function": {"effects": [FunctionController(ToAPlace, 0.05, "voltage"), LIMITED]},
}  # fmt: skip
START = {"nu": (1.0, 0.2, 0.8), "chi": (0.1, -0.3, 0.2), "start_time": 0.05}
DURATION = 1.5


def made(name, **more):
    return Session(PAPER, **START, **SCENES[name], accuracy=ACCURACY, **more)


def one_run(name):
    """The same motion in one run, with the drive that a session has."""
    effects = SCENES[name].get("effects", [])
    effects = effects if any(isinstance(effect, Torque) for effect in effects) else [*effects, Torque(0)]
    scene = SCENES[name] | {"effects": effects}
    return simulate(PAPER, **START, **scene, duration=DURATION, accuracy=ACCURACY, control=False)


def go_to(session, elapsed):
    """Go to a time that is hit to the bit: the last step is so short that its length is exact."""
    if elapsed - session.elapsed > 10 * np.spacing(elapsed):
        session.step((elapsed - session.elapsed) * (1 - 1e-6))
    if session.elapsed != elapsed:
        session.step(elapsed - session.elapsed - session._rest)
    assert session.elapsed == elapsed


def bits(session):
    parts = (session.nu, session.chi, session.pose, session.contact, session.energy, session.spins)
    outputs = (value for _, value in sorted(session.outputs.items()))
    return [np.asarray(part, float).tobytes() for part in (*parts, *outputs) if part is not None]


def distance_to(run, session):
    """In the norm of the accuracy, at the end of both; the contacts are the same."""
    assert session.contact.tolist() == run.contact[-1].tolist()
    size = np.abs(run.nu).max()
    pose = np.abs(session.pose - run.pose[-1]) / [PAPER.platform_radius, PAPER.platform_radius, 1.0]
    return max(pose.max(), np.abs(session.nu - run.nu[-1]).max() / size)


# Stepping


def instants(run):
    """Elapsed at every switch, knot, sample, limit of the run, and at whatever else has a row on both sides."""
    again = np.flatnonzero(np.diff(run.elapsed) == 0)
    return np.unique(run.elapsed[again])


def test_time_keeps_its_accuracy_over_hours():
    """The sum of a hundred thousand steps is rounded once; adding them up one by one is not."""
    session, plain = Session(PAPER, driven=False), 0.0
    for _ in range(100_000):
        session.step(0.036)
        plain += 0.036
    exact = np.longdouble(0.036) * 100_000
    assert abs(session.elapsed - exact) <= np.spacing(3600.0) < abs(plain - exact)


def two_switches(apart):
    """Two wheels that come to their joints `apart` tau after each other: chi at the start, the first's time, tau."""
    chi = np.array([0.0, 0.1, -0.1])
    run = simulate(PAPER, nu=(1, 0, 0), chi=chi, duration=0.5, accuracy=FINE, control=False, effects=[Torque(0)])
    first, second = run.switches.wheel[:2]
    assert run.switches.t[0] == run.switches.t[1]
    row = np.searchsorted(run.t, run.switches.t[0])
    together = tau(run.switches.t[0], run.switches.t[0])
    assert together == 200 * np.finfo(float).eps * run.switches.t[0]
    chi[second] -= np.sign(chi[second]) * apart * together * abs(run.kernel.wheel_speeds(run.nu[row])[second])
    return chi, run.switches.t[0], together


@pytest.mark.parametrize("before", [0.2, 0.5, 0.9])
@pytest.mark.parametrize(("apart", "switches"), [(0.95, 1), (1.05, 2)])
def test_tau_counts_from_the_last_transition_and_not_from_a_pause(apart, switches, before):
    """A step that ends closer than tau before the first of two wheels: the second is with it, or not, as in one run."""
    chi, first, together = two_switches(apart)
    start = {"nu": (1, 0, 0), "chi": chi, "accuracy": FINE}
    run = simulate(PAPER, **start, duration=1.0, control=False, effects=[Torque(0)])
    assert len(np.unique(run.switches.t[:2])) == switches
    session = Session(PAPER, **start)
    go_to(session, first - before * together)
    assert (session.contact == 0).all()
    go_to(session, 1.0)
    assert distance_to(run, session) < 1e3 * FINE


def test_a_step_of_no_length_changes_nothing():
    session = made("motors with a controller")
    session.step(0.3)
    before = bits(session)
    session.step(0)
    assert bits(session) == before


# What a step is given


@pytest.mark.parametrize("given, limit", [("torque", None), ("voltage", None), ("voltage", 0.7)])
def test_what_is_held_is_a_held_table(given, limit):
    rng = np.random.default_rng(4)
    lengths, values = rng.uniform(0.01, 0.2, 12), rng.normal(scale=0.02 if given == "torque" else 4, size=(12, 3))
    times = np.concatenate([[0.0], np.cumsum(lengths)])
    motor = {"torque_constant": 0.02, "resistance": 1.5, "gear_ratio": 3, "current_limit": limit}
    if given == "torque":
        effects, table = [], TorqueTable(times[:-1], values, "hold")
    else:
        effects, table = [Motor(9.0, **motor)], Motor(values, **motor, times=times[:-1], interpolation="hold")
    task = {"nu": START["nu"], "accuracy": ACCURACY}
    run = simulate(PAPER, **task, duration=times[-1], control=False, effects=[table])
    session, largest = Session(PAPER, **task, effects=effects), 0.0
    for length, value in zip(lengths, values, strict=True):
        session.step(length / 2, **{given: value})
        session.step(length / 2)
        largest = max(largest, np.abs(session.outputs.get("currents", 0)).max())
    go_to(session, times[-1])
    assert distance_to(run, session) < 10 * ACCURACY
    assert session.outputs["drive_work"] == pytest.approx(run.quantity("drive_work")[-1], rel=1e-8)
    if given == "voltage":
        assert largest == pytest.approx(limit) if limit else largest > 0.7


def test_the_same_value_again_is_no_event():
    """Torques that are given anew in each step and stay as they are: the motion of one run, in as few phases."""
    session = Session(PAPER, nu=START["nu"], accuracy=ACCURACY)
    run = simulate(
        PAPER, nu=START["nu"], duration=1.0, accuracy=ACCURACY, effects=[Torque((0.01, 0, -0.02))], control=False
    )
    for _ in range(100):
        session.step(0.01, torque=[0.01, 0, -0.02])
    go_to(session, 1.0)
    assert distance_to(run, session) < 10 * ACCURACY
    assert session._run.run.record.phase_count == run.stats["phases"] - 1  # which counts the last one too


@pytest.mark.parametrize("asked", [False, True])
def test_a_target_holds_from_the_next_sample_on(asked):
    """As a loop that is closed outside: the same controller, with its target given and with none of its own."""
    effects = [FunctionController(braking, 100.0)] if asked else []
    effects.append(Controller((0, 0, 0), 0.03, 0.1))
    inside = Session(PAPER, nu=START["nu"], effects=effects, accuracy=ACCURACY)
    outside = Session(PAPER, nu=START["nu"], effects=effects[:-1], accuracy=ACCURACY)
    for k in range(12):
        target = np.array([1.0, 0.1 * k, -0.5])
        go_to(outside, k * 0.1)
        torque = 0.03 * (outside._task.kernel.wheel_speeds(target) - outside.wheel_speeds)
        go_to(inside, k * 0.1)
        outside.step(0.05, torque=torque)
        inside.step(0.05, target=target)
    np.testing.assert_allclose(inside.nu, outside.nu, rtol=1e-10)
    assert np.abs(inside.nu - START["nu"]).max() > 0.1


def test_what_is_given_acts_beside_a_function():
    """The compiled engine asks all effects where one is a Python function: the motion is the same."""
    motor = Motor(0.0, 0.02, 1.5, gear_ratio=3, current_limit=0.7)
    effects = [motor, FunctionController(lambda time, state: 0.0, 0.03)]
    session, plain = (Session(PAPER, nu=START["nu"], effects=e, accuracy=ACCURACY) for e in (effects, [motor]))
    rng = np.random.default_rng(5)
    for _ in range(20):
        given = {"voltage": rng.normal(scale=4, size=3), "torque": rng.normal(scale=0.01, size=3)}
        length = rng.uniform(0.01, 0.1)
        session.step(length, **given)
        plain.step(length, **given)
        for name, value in plain.outputs.items():
            np.testing.assert_allclose(session.outputs[name], value, rtol=0, atol=1e-8, err_msg=name)
    np.testing.assert_allclose(session.nu, plain.nu, rtol=0, atol=1e-9)


# Saving, restoring, resetting


def whole(saved):
    """All that is saved, in a form in which equal things are the same; pickle has more than one for them."""
    return saved.memory, saved.clock, repr(pickle.loads(saved.effects)), saved.made_for


@pytest.mark.parametrize("name", SCENES)
def test_save_and_restore_are_exact(name):
    """Also into another session, by way of pickle; in the middle of a phase, before, at and after events."""
    session, other, run = made(name), made(name), one_run(name)
    rng = np.random.default_rng(7)
    pauses = np.concatenate([instants(run)[1:8], rng.uniform(0, DURATION, 4)])
    for pause in np.sort(pauses):
        if pause <= session.elapsed:
            continue
        go_to(session, pause)
        saved = pickle.loads(pickle.dumps(session.save()))
        lengths = rng.uniform(0, 0.2, 4)

        def states(which, lengths=lengths):
            found = [bits(which)]
            for length in lengths:
                which.step(length)
                found.append(bits(which))
            return found

        first, after = states(session), whole(session.save())
        session.restore(saved)
        assert whole(session.save()) == whole(saved)
        assert states(session) == first and whole(session.save()) == after
        other.restore(saved)
        assert states(other) == first and whole(other.save()) == after
        session.restore(saved)


def test_what_was_given_is_saved():
    session = Session(PAPER, nu=START["nu"], effects=[Motor(0, 0.02, 1.5), Controller((0, 0, 0), 0.05, 0.1)])
    session.step(0.25, torque=0.01, voltage=(1, 2, 3), target=(1, 1, 1))
    saved = session.save()
    session.step(0.3)
    wanted = bits(session)
    session.step(0.1, torque=-0.3, voltage=0, target=(0, 0, 0))
    session.restore(saved)
    session.step(0.3)
    assert bits(session) == wanted


@pytest.mark.parametrize("name", ["free", "locked", "viscous friction", "a function"])
def test_reset_to_another_state(name):
    start = {"nu": (0.3, -1.0, 0.5), "chi": 0.2, "pose": (1.0, 2.0, 3.0)}
    start |= {} if name == "locked" else {"spins": 0.3}
    session = made(name)
    session.step(0.8)
    session.reset(**start)
    scene = SCENES[name] | {"start_time": START["start_time"], "accuracy": ACCURACY}
    new = Session(PAPER, **scene, **start)
    assert bits(session) == bits(new)
    for each in (session, new):
        each.step(0.7)
    assert bits(session) == bits(new)
    session.reset()
    assert session.nu.tolist() == list(START["nu"])


# Reading


def test_views_follow_the_motion_and_cannot_be_written():
    session = made("limited motors")
    views = {name: getattr(session, name) for name in ("nu", "chi", "pose", "contact")}
    before = {name: view.copy() for name, view in views.items()}
    session.step(0.5)
    for name, view in views.items():
        assert getattr(session, name) is view and not view.flags.owndata
        assert (view != before[name]).any()
        with pytest.raises(ValueError, match="read-only"):
            view[0] = 1


@pytest.mark.parametrize("name", SCENES)
def test_outputs_are_those_of_a_run(name):
    """At times at which nothing happens: all that a row of one run has."""
    session, run = made(name), one_run(name)
    for elapsed in (0.11, 0.6543, 1.234):
        go_to(session, elapsed)
        there = run.sample(START["start_time"] + elapsed)
        np.testing.assert_allclose(session.nu, there.nu, atol=1e-8)
        np.testing.assert_allclose(session.contact_spin, there.contact_spin, atol=1e-8)
        np.testing.assert_allclose(session.energy, there.energy, atol=1e-8)
        np.testing.assert_allclose(session.wheel_speeds, run.kernel.wheel_speeds(there.nu), atol=1e-8)
        assert (session.spins is None) == (there.spins is None)
        if there.spins is not None:
            np.testing.assert_allclose(session.spins, there.spins, atol=1e-7)


def test_torques_of_bearings_are_those_of_the_rows():
    """Also where an axle sticks: inside a phase, at the ends of its steps."""
    session, run = made("axles that stick"), one_run("axles that stick")
    place = run.effects.drives().index("bearing_torque")
    alone = np.flatnonzero(~np.isin(run.elapsed, instants(run)) & (run.elapsed > 0))
    stuck = 0
    for row in alone:
        go_to(session, run.elapsed[row])
        np.testing.assert_allclose(session.outputs["bearing_torque"], run.drive[row, place], rtol=0, atol=1e-9)
        stuck += (np.abs(run.drive[row, place]) < 3.9e-3).any()
    assert stuck > 0


def test_a_session_of_a_scene():
    scene = load_scene("scenes/driven.toml")
    session = Session(scene)
    run = simulate(scene.vehicle, **scene.options | {"duration": 1.0, "control": False})
    for _ in range(10):
        session.step(0.1)
    go_to(session, 1.0)
    assert distance_to(run, session) < 1e-8
    assert Session(scene, nu=(1, 0, 0)).nu.tolist() == [1, 0, 0]


# Errors


MOTOR_TABLE = Motor(((1.0, 1.0, 1.0), (0.0, 0.0, 0.0)), 0.02, 1.5, times=(0, 1))
WRONG = [
    ("duration", {}, {"duration": -1.0}),
    ("torque", {}, {"torque": np.array([0.0, np.nan, 0.0])}),
    ("torque", {"driven": False}, {"torque": 1.0}),
    ("torque", {"effects": [Torque(0.1), Torque(0.2)]}, {"torque": 1.0}),
    ("voltage", {}, {"voltage": 1.0}),
    ("voltage", {"effects": [MOTOR_TABLE]}, {"voltage": 1.0}),
    ("target", {}, {"target": (0, 0, 0)}),
    ("target", {"effects": [Controller((0, 0, 0), 0.1, 0.1)]}, {"torque": 1.0, "target": (0.0, np.nan, 0.0)}),
    ("target", {"effects": [Controller(((0, 0, 0), (1, 0, 0)), 0.1, 0.1, times=(0, 1))]}, {"target": (0, 0, 0)}),
]


@pytest.mark.parametrize(("field", "options", "step"), WRONG)
def test_wrong_steps_are_refused_and_change_nothing(field, options, step):
    session, other = (Session(PAPER, nu=(1, 0, 1), **options) for _ in range(2))
    session.step(0.1)
    other.step(0.1)
    with pytest.raises(InvalidValueError) as refused:
        session.step(**{"duration": 0.1} | step)
    assert refused.value.field == field
    assert bits(session) == bits(other) and session.elapsed == 0.1
    for each in (session, other):  # of several values of which one is wrong none holds
        each.step(0.05)
    assert bits(session) == bits(other)


class Secretive(Process):
    """A process that does not say what it remembers."""


class Forgetful(Torque):
    def process(self, kernel, start_time):
        return Secretive()


@pytest.mark.parametrize(("field", "make"), [
    ("duration", lambda: Session(PAPER, duration=1)),
    ("engine", lambda: Session(PAPER, engine="python")),
    ("engine", lambda: Session(Vehicle.paper(65, 5))),
    ("speed", lambda: Session(PAPER).reset(speed=1)),
    ("saved", lambda: Session(PAPER).restore(Session(PAPER.replace(mass=9)).save())),
    ("saved", lambda: Session(PAPER).restore(Session(PAPER, effects=[Torque(1)]).save())),
    ("saved", lambda: Session(PAPER).restore(Session(PAPER, roller_model="locked").save())),
    ("saved", lambda: Session(PAPER).restore(Session(PAPER, accuracy=1e-5).save())),
    ("effects", lambda: Session(PAPER, effects=[Forgetful(0.1)]).save()),
])  # fmt: skip
def test_wrong_sessions_are_refused(field, make):
    with pytest.raises(InvalidValueError) as refused:
        make()
    assert refused.value.field == field


def test_a_session_that_stops_stands_where_it_stopped():
    """Torques push a wheel outwards on both sides of its joint: it is held there, and goes to and fro."""
    session = Session(PAPER, chi=CHI, roller_model="locked", accuracy=1e-6)
    session.step(0.1)
    with pytest.raises(SimulationStopped, match="without progress") as stopped:
        session.step(1.0, torque=torques_that_hold("locked"))
    assert 0.1 <= session.time == stopped.value.t < 0.1 + 1e-4
    assert stopped.value.trajectory is None and stopped.value.state["contact"] == session.contact.tolist()
    session.reset()
    session.step(1.0)
    assert session.time == 1.0


def test_an_error_in_a_function_leaves_the_session_whole():
    calls = []

    def failing(time, state):
        calls.append(time)
        if len(calls) == 6:
            raise RuntimeError("no sensor")
        return 0.0

    session = Session(PAPER, nu=(1, 0, 1), effects=[FunctionController(failing, 0.1)], accuracy=ACCURACY)
    plain = Session(PAPER, nu=(1, 0, 1), accuracy=ACCURACY)
    calls.clear()
    with pytest.raises(RuntimeError, match="no sensor"):
        session.step(1.0)
    assert session.elapsed == 0.5
    session.step(0.5)
    plain.step(1.0)
    np.testing.assert_allclose(session.nu, plain.nu, atol=1e-8)


# Cost


def calls_of(function):
    """How many functions, of Python and of C, `function` calls."""
    count = 0

    def count_one(frame, event, argument):
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(count_one)
    try:
        function()
    finally:
        sys.setprofile(None)
    return count - 2  # `function` itself, and setprofile


@pytest.mark.filterwarnings("ignore::omniroll.UnstableControllerWarning")
def test_a_step_makes_few_calls():
    """However large the vehicle is, and however long the session has run."""
    effects = [Motor(0.0, 0.02, 1.5, current_limit=2), Controller((0, 0, 0), 1.0, 0.001, output="voltage")]
    session, plain, given = Session(Vehicle.paper(8, 60), effects=effects), set(), set()
    for k in range(50):
        values = {"torque": np.full(8, 1e-6 * k), "target": np.array([1.0, 1e-3 * k, 0.0])}
        plain.add(calls_of(lambda: session.step(1e-3)))
        given.add(calls_of(lambda values=values: session.step(1e-3, **values)))
    assert min(plain) <= 10 and min(given) <= 40 and max(len(plain), len(given)) <= 2  # the first step's is another


def test_a_session_keeps_no_rows():
    """Its memory does not grow with what it has done."""
    session = made("motors with a controller")
    sizes = []
    for _ in range(3):
        session.step(1.0)
        sizes.append(len(pickle.dumps(session.save())))
    assert len(set(sizes)) == 1 and not session._run.run.record.steps


def test_several_threads_lose_no_step_without_a_word():
    session, done, refused = Session(PAPER, nu=(1, 0, 0.5), accuracy=1e-6), [], []

    def work():
        for _ in range(100):
            try:
                session.step(0.01)
                done.append(1)
            except OmnirollError as error:
                refused.append(str(error))

    threads = [threading.Thread(target=work) for _ in range(4)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert session.elapsed == pytest.approx(0.01 * len(done), rel=1e-12)
    assert all("belongs to one thread" in text for text in refused)


def test_a_controller_that_steps_its_session_is_refused():
    made = []  # the controller is also tried while the session is made

    def steps(t, state):
        for session in made:
            session.step(0.01)
        return 0.0

    session = Session(PAPER, nu=(1, 0, 0), effects=[FunctionController(steps, 0.1)], driven=False)
    made.append(session)
    with pytest.raises(OmnirollError, match="has not ended yet"):
        session.step(0.2)

"""Runs that could not end, or would take more memory than there is: stopped while they are young, with the reason."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.commands import explain
from omniroll.engine.control import made
from omniroll.engine.outlook import outlook_of
from omniroll.engine.simulate import checked_task
from omniroll.engine.stiffness import sharpest
from omniroll.scenes import costs, explanation

PAPER = omniroll.Vehicle.paper()
ROLLERS = omniroll.Bearings(roller_coulomb=1e-4, roller_speed=1e-15)
WHEELS = omniroll.Bearings(wheel_viscous=1e12)
ROLLERS_OF_TWO = omniroll.Bearings(roller_viscous=1e3, wheel_viscous=1e-4)  # one of its two terms is stiff
MOTOR = omniroll.Motor(6.0, torque_constant=20.0, resistance=1.5, gear_ratio=4)


def done(effects, engine, **changes):
    task = checked_task(PAPER, **{"nu": (1, 0, 1), "duration": 20, "effects": effects, "engine": engine} | changes)
    return made(task, 1e-9)


@pytest.mark.parametrize("effects, engine, term", [
    ([ROLLERS], "compiled", "roller_coulomb = 0.0001, roller_speed = 1e-15"),
    ([ROLLERS], "python", "roller_coulomb = 0.0001, roller_speed = 1e-15"),
    ([WHEELS], "python", "wheel_viscous = 1000000000000.0"),
    ([MOTOR], "python", "Motor"),
    ([ROLLERS_OF_TWO], "python", "roller_viscous = 1000.0"),
])  # fmt: skip
def test_steps_that_collapse_are_stopped_and_the_term_is_named(effects, engine, term):
    run = done(effects, engine)
    assert not run.done and run.stats()["steps"] < 1000
    said = str(run.stop)
    assert term in said and "has a time constant of" in said and "memory allows" in said
    assert "wheel_viscous = 0.0001" not in said
    assert 0 < run.part().t[-1] < 20


@pytest.mark.parametrize("effects", [[WHEELS], [MOTOR], [ROLLERS_OF_TWO]])
def test_terms_that_the_compiled_engine_can_follow_run(effects):
    run = done(effects, "compiled")
    assert run.done and run.stats()["steps"] < 1000


def test_the_time_constant_is_the_terms():
    """Of a wheel's friction alone: the inertia that it brakes over the coefficient."""
    for coefficient in (1.0, 100.0):
        found = sharpest(checked_task(PAPER, nu=(0, 0, 1), duration=20, effects=[
            omniroll.Bearings(wheel_viscous=coefficient)], roller_model="massless"))  # fmt: skip
        kernel = omniroll.kernel(PAPER, "massless", "python")
        speeds = np.array([kernel.wheel_speeds(column) for column in np.eye(3)]).T
        rates = np.linalg.eigvals(np.linalg.solve(kernel.mass_matrix(np.zeros(3)), coefficient * speeds.T @ speeds))
        assert found.time == pytest.approx(1 / rates.real.max(), rel=1e-2)
    assert sharpest(checked_task(PAPER, nu=(1, 0, 1), duration=20, effects=[omniroll.Slope(0.1)])) is None
    assert sharpest(checked_task(PAPER, nu=(1, 0, 1), duration=20)) is None


def test_phases_of_one_step_are_watched_too():
    """Samples may follow so closely that each phase is one step, which no further step follows."""
    closely = omniroll.Controller(target=(1, 0, 0), proportional=1e-3, sample_time=1e-9)
    run = done([closely], "python", memory=1e6)
    assert "at its present pace the run needs" in str(run.stop) and run.stats()["steps"] < 1000
    task = checked_task(PAPER, nu=(1, 0, 1), duration=1, effects=[replace(closely, sample_time=1e-3)], engine="python")
    asked = iter(["", "", "that is enough"])
    ended = made(replace(task, interrupted=lambda: next(asked)), 1e-9)
    assert "that is enough" in str(ended.stop) and ended.stop.t == 3e-3


def test_steps_that_are_short_for_a_moment_stop_no_run():
    """100 steps have room. One window of short steps is a moment; of two in a row nobody sees the end."""
    outlook = outlook_of(1.0, 1e4, 1e6, None)
    looks = [(32 * (k + 1), 0, end) for k, end in enumerate(np.cumsum([0.1, 0.1, 0.1, 1e-9, 0.1, 1e-9, 1e-9]))]
    assert [outlook.is_hopeless(*look) for look in looks] == [False] * 6 + [True]


@pytest.mark.parametrize("start, duration", [({}, 1e30), ({"spins": 1e30}, 0.001)])
def test_a_step_of_a_session_that_could_not_end_is_stopped(start, duration):
    session = omniroll.Session(PAPER, driven=False, nu=(1, 0, 1))
    session.reset(**start)
    with pytest.raises(omniroll.SimulationStopped, match="make shorter ones") as stopped:
        session.step(duration)
    assert 0 < session.time == stopped.value.t < duration
    session.reset()
    session.step(1000.0)  # thousands of joints: long, and it ends
    assert session.time == 1000


def test_a_run_of_very_many_steps_goes_on_and_its_term_is_named():
    """Memory would hold these steps, which take the Python engine an hour; it is ended here once the word is said."""
    options = {"nu": (1, 0, 1), "duration": 20, "engine": "python", "memory": 1e12}
    task = checked_task(PAPER, effects=[omniroll.Bearings(roller_viscous=1.0)], **options)
    looks = iter(range(1000))
    term = r"more steps of the Python engine: Bearings \(roller_viscous = 1.0\) has a time constant of"
    with pytest.warns(RuntimeWarning, match=term) as said:
        ended = made(replace(task, interrupted=lambda: "" if next(looks) < 300 else "that is enough"), 1e-9)
    assert len(said) == 1 and "that is enough" in str(ended.stop)


def test_a_long_run_that_memory_does_not_hold_is_one_sentence():
    for engine in ("compiled", "python"):
        memory = 1e6 if engine == "python" else 2**30
        run = done([], engine, duration=1e10, roller_model="locked", switching="smooth", memory=memory)
        said = str(run.stop)
        assert "at its present pace the run needs" in said and "time constant" not in said
        assert run.stats()["steps"] < 20_000


# Sizes


@pytest.mark.parametrize("sizes", [(10**30, 5), (3, 10**30), (10**6 + 1, 5), (3, 10**6 + 1)])
def test_sizes_that_no_vehicle_has_are_refused(sizes):
    wheels, rollers = sizes
    with pytest.raises(omniroll.InvalidValueError, match="must be at most 1000000"):
        omniroll.Vehicle.paper(wheels, rollers)


def test_a_vehicle_whose_states_have_no_room_is_refused():
    many = omniroll.Vehicle.paper(1000, 10_000)
    with pytest.raises(omniroll.InvalidValueError, match="1000 wheels of 10000 free rollers: 8 GB"):
        omniroll.simulate(many, nu=(1, 0, 1), duration=1)
    with pytest.raises(omniroll.InvalidValueError, match="wheels = 1000: must be at most 100"):
        omniroll.linearise(many)
    with pytest.raises(omniroll.InvalidValueError, match="spheres = 31: must be at most 0 for 10000000 rollers"):
        omniroll.to_mjcf(many)
    with pytest.raises(omniroll.InvalidValueError, match="memory"):
        omniroll.simulate(PAPER, nu=(1, 0, 1), duration=1, memory=100)


@pytest.mark.parametrize("ground", [[], [omniroll.Contact(law="coulomb", friction=0.3)]])
def test_friction_that_sticks_in_very_many_places_is_refused(ground):
    """Before anything is allocated for it: what couples 30000 rollers takes gigabytes."""
    bearings = omniroll.Bearings(wheel_coulomb=1e-3, roller_coulomb=1e-5)
    with pytest.raises(omniroll.InvalidValueError, match="may stick in 300[0-9]{2} places of 3 wheels") as said:
        omniroll.simulate(omniroll.Vehicle.paper(3, 10_000), nu=(1, 0, 0), duration=1, effects=[bearings, *ground])
    assert said.value.field == "memory"


def test_a_scene_may_lower_the_bound_of_memory_and_its_caller_may_raise_it(tmp_path, capsys):
    path = tmp_path / "scene.toml"
    text = re.sub(r"duration = .*", "duration = 0.1", Path("scenes/motion-3.toml").read_text())
    path.write_text(text.replace("[run]", "[run]\nmemory = 1e15"))
    with pytest.raises(omniroll.SceneError, match="must be at most 1073741824 in a scene"):
        omniroll.load_scene(path)
    path.write_text(text.replace("[run]", "[run]\nmemory = 5e4").replace("duration = 0.1", "duration = 60"))
    assert cli.main(["run", str(path), "--output", str(tmp_path / "out")]) == 3
    assert cli.main(["run", str(path), "--output", str(tmp_path / "out"), "--memory", "2e9"]) == 0
    assert cli.main(["run", str(path), "--output", str(tmp_path / "out"), "--memory", "nan"]) == 2


def test_samples_without_end_are_refused(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text("[vehicle]\npreset = 'paper'\n[start]\nnu = [1, 0, 1]\n[run]\nduration = 1\nstep = 1e-9\n")
    with pytest.raises(omniroll.SceneError, match="must leave at most 1000000 samples"):
        omniroll.load_scene(path)


# What explain does with them

SCENE = "[vehicle]\npreset = 'paper'\n[start]\nnu = [1, 0, 1]\n[run]\nduration = 20\n"


@pytest.fixture
def explained_scene(tmp_path, monkeypatch):
    monkeypatch.setattr(costs, "MANY", {"compiled": 200, "Python": 20})
    monkeypatch.setattr(costs, "ENOUGH", 0.0)

    def explained(more):
        path = tmp_path / "scene.toml"
        path.write_text(SCENE + more)
        return explanation.explained(omniroll.load_scene(path))

    return explained


def test_explain_says_which_term_is_too_fast(explained_scene):
    found = explained_scene("[bearings]\nroller_coulomb = 1e-4\nroller_speed = 1e-15\n")
    (left_out,) = found["left_out"]
    assert "all estimates, since the motion itself stopped" in left_out and "roller_speed = 1e-15" in left_out
    assert found["prices"][0]["operations"] > 0  # counted, not timed
    assert left_out in explain.text(found)

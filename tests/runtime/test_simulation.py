"""Whole runs: what stops them, what they report, refusals."""

import warnings
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import AccuracyWarning, InvalidValueError, SimulationStopped, Vehicle, simulate
from omniroll.engine.integrate import PhaseIntegrator, StepTooSmallError

PAPER = Vehicle.paper()
JOINT = np.pi / 5
MODELS = ("massless", "locked", "free")


def test_the_watchdog_stops_a_run_and_keeps_it(bouncing):
    with pytest.raises(SimulationStopped, match="without progress") as raised:
        simulate(PAPER, nu=(0, 0, 1), duration=10, roller_model="locked", control=False, engine="python")
    stopped = raised.value
    assert stopped.wheel in (0, 1, 2) and stopped.t == pytest.approx(stopped.trajectory.t[-1])
    assert stopped.trajectory.pose[-1, 2] > 0 and len(stopped.trajectory.switches) > 100
    assert set(stopped.state) == {"nu", "chi", "pose", "contact"}


def test_a_step_that_becomes_too_small_names_a_wheel_and_what_to_change(monkeypatch):
    """The Python engine; the compiled one in contact/test_scenes_that_failed.py."""

    def step(*_):
        raise StepTooSmallError

    monkeypatch.setattr(PhaseIntegrator, "_step", step)
    with pytest.raises(SimulationStopped, match="too small; change what acts on the wheel, the start or") as raised:
        simulate(PAPER, nu=(1, 0, 1), duration=1, roller_model="locked", control=False, engine="python")
    assert raised.value.wheel in (0, 1, 2) and raised.value.t == 0


def test_many_switches_are_no_reason_to_stop():
    run = simulate(PAPER, nu=(1, 0, 1), duration=300, roller_model="massless", engine="compiled", accuracy=1e-6)
    assert len(run.switches) > 900 and run.t[-1] == 300


def test_a_run_that_fills_memory_stops_and_can_go_on():
    task = {"chi": (0.1, -0.2, 0.3), "roller_model": "locked", "accuracy": 1e-9, "control": False}
    whole = simulate(PAPER, nu=(1, 0.2, 1), duration=3000, **task)
    with pytest.raises(SimulationStopped, match="another run") as raised:
        simulate(PAPER, nu=(1, 0.2, 1), duration=3000, **task, memory=len(whole.t) // 2 * 1300)
    stopped, rows = raised.value, len(raised.value.trajectory)
    assert stopped.wheel is None and 1000 < rows < len(whole.t)
    np.testing.assert_array_equal(stopped.trajectory.pose, whole.pose[:rows])
    assert stopped.state["pose"] == stopped.trajectory.pose[-1].tolist()


def test_out_of_reach_is_said():
    with pytest.warns(AccuracyWarning, match="estimate"):
        run = simulate(PAPER, nu=(1, 0, 1), duration=1, accuracy=1e-18)
    assert run.stats["error_estimate"] > 1e-18


@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_progress_is_reported(engine):
    seen = []
    simulate(PAPER, nu=(1, 0, 1), duration=2, engine=engine, progress=lambda done, whole: seen.append((done, whole)))
    assert seen == sorted(seen) and seen[-1] == (2, 2)
    assert engine == "compiled" or len(seen) > 3


# Refusals


@pytest.mark.parametrize("change, field, bound", [
    ({"nu": (1e-200, 0, 0)}, "nu", "number range"),
    ({"chi": 0.63}, "chi", "within"),
    ({"spins": np.zeros((3, 5))}, "spins", "shape"),
    ({"spins": 1.0, "roller_model": "locked"}, "spins", "must be 0"),
    ({"duration": 1e160}, "duration", "number range"),
    ({"accuracy": 2}, "accuracy", "between"),
    ({"roller_model": "loose"}, "roller_model", "massless, locked, free"),
])  # fmt: skip
def test_bad_input_is_named(change, field, bound):
    task = {"vehicle": PAPER, "nu": (1, 0, 1), "duration": 1} | change
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ValueError, match=bound) as raised:
            simulate(task.pop("vehicle"), **task)
    assert raised.value.field == field and str(raised.value).startswith(f"{field} = ")


@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_an_energy_beyond_the_number_range_is_refused(engine):
    heavy = PAPER.replace(mass=1e120, platform_radius=1e80)
    with pytest.raises(ValueError, match="leave the number range") as raised:
        simulate(heavy, nu=(1e60, 0, 0), duration=1e-70, engine=engine)
    assert raised.value.field == "nu"


@pytest.mark.parametrize("roller_model", MODELS)
def test_accelerations_broadcast(roller_model):
    random = np.random.default_rng(3)
    nu, chi = random.normal(size=(4, 1, 3)), random.uniform(-JOINT, JOINT, size=(5, 3))
    spins = random.normal(size=(4, 5, 3, 4)) if roller_model == "free" else None
    nu_dot, spins_dot = omniroll.accelerations(PAPER, nu, chi, spins, roller_model=roller_model)
    assert nu_dot.shape == (4, 5, 3) and (spins_dot is None or spins_dot.shape == (4, 5, 3, 4))
    one, one_spins = omniroll.accelerations(
        PAPER, nu[2, 0], chi[3], None if spins is None else spins[2, 3], roller_model=roller_model
    )
    assert (one == nu_dot[2, 3]).all()
    assert one_spins is None or (one_spins == spins_dot[2, 3]).all()
    python = omniroll.kernel(PAPER, roller_model, "python")
    found = python.accelerations(nu, chi, *python.spins_or_nothing(spins))
    np.testing.assert_allclose(found[0] if spins is not None else found, nu_dot, rtol=1e-11, atol=1e-13)


def test_a_scene_in_the_place_of_a_vehicle_is_told_what_runs_it():
    scene = omniroll.load_scene(Path(__file__).parents[2] / "scenes/driven.toml")
    with pytest.raises(InvalidValueError, match=r"vehicle = 'driven'.*omniroll\.run\(scene\)"):
        omniroll.simulate(scene)
    with pytest.raises(InvalidValueError, match=r"omniroll\.run\(omniroll\.load_scene"):
        omniroll.simulate("scenes/driven.toml", nu=(0, 0, 0), duration=1)

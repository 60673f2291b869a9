"""Controllers that are Python functions: what they are told, what they do, and how files and scenes name them."""

import pickle

import numpy as np
import pytest

import omniroll
from omniroll import (
    Controller,
    FunctionController,
    InvalidValueError,
    Motor,
    SceneError,
    Trajectory,
    Vehicle,
    cli,
    register_controller,
    simulate,
    simulate_many,
)
from omniroll.effects import function_controller
from omniroll.kernels.kernel import kernel
from omniroll.results.comparison import difference
from omniroll.scenes import load_scene

PAPER = Vehicle.paper()
START = {"nu": (1.0, 0.2, 0.8), "chi": (0.1, -0.3, 0.2), "accuracy": 1e-10, "control": False}
LIMITED = Motor(1.0, 0.02, 1.5, gear_ratio=3, current_limit=0.7)
TARGET = np.array([0.5, 0.1, -0.4])
SCENE = """
[vehicle]
preset = "paper"
[start]
nu = [1, 0.2, 0.8]
[run]
duration = 0.5
[function_controller]
function = "tests: proportional"
sample_time = 0.05
"""


@register_controller("tests: proportional")
def proportional(time, state):
    bound = kernel(PAPER, "free", "python")
    return 0.02 * (bound.wheel_speeds(TARGET) - state.wheel_speeds)


@register_controller("tests: integrating")
class Integrating:
    """The built-in controller again: it remembers the sums."""

    def __init__(self):
        self.sum = np.zeros(3)

    def __call__(self, time, state):
        error = kernel(PAPER, "free", "python").wheel_speeds(TARGET - state.nu)
        self.sum += 0.05 * error
        return 0.02 * error + 0.03 * self.sum


@pytest.fixture
def forgotten(monkeypatch):
    """No function is registered, as in a program that has not imported the module."""
    return lambda: monkeypatch.setattr(function_controller, "CONTROLLERS", {})


# What they do


@pytest.mark.parametrize("engine", ["compiled", "python"])
@pytest.mark.parametrize(("function", "integral"), [(proportional, 0.0), (Integrating, 0.03)])
def test_it_does_what_the_built_in_controller_does(engine, function, integral):
    own, built_in = (
        simulate(PAPER, **START, duration=1.0, engine=engine, effects=[effect])
        for effect in (FunctionController(function, 0.05), Controller(TARGET, 0.02, 0.05, integral))
    )
    assert own.stats["engine"] == engine
    assert difference(own, built_in) < 1e-9 and own.switches.wheel.tolist() == built_in.switches.wheel.tolist() != []
    assert own.quantity("drive_work")[-1] == pytest.approx(built_in.quantity("drive_work")[-1], rel=1e-9)


@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_it_is_called_at_its_samples_with_the_state_there(engine):
    told = []

    def function(time, state):
        told.append((time, state))
        return 1e-3 * time

    run = simulate(
        PAPER, **START, duration=0.5, start_time=2.0, engine=engine, effects=[FunctionController(function, 0.1)]
    )
    calls = told[-5:]  # those of this run
    assert [time for time, _ in calls] == [2.0 + 0.1 * k for k in range(5)]
    for time, state in calls:
        there = run.sample(time)
        for name in ("nu", "chi", "pose", "contact"):
            np.testing.assert_allclose(getattr(state, name), getattr(there, name), rtol=0, atol=1e-12)
            assert not getattr(state, name).flags.writeable
        np.testing.assert_allclose(state.wheel_speeds, run.kernel.wheel_speeds(there.nu), atol=1e-12)
    held = run.drive[np.searchsorted(run.elapsed, 0.25), 0]
    assert held.tolist() == [1e-3 * 2.2] * 3


def test_many_runs_with_a_function():
    effects = [FunctionController(Integrating, 0.05)]
    nu = np.array([[1.0, 0.2, 0.8], [0.0, 1.0, 0.0]])
    many = simulate_many(PAPER, nu=nu, duration=0.5, accuracy=1e-8, effects=effects, control=False)
    for k in range(2):
        alone = simulate(PAPER, nu=nu[k], duration=0.5, accuracy=1e-8, effects=effects, control=False)
        assert (many.end.pose[k] == alone.pose[-1]).all()


def test_an_error_of_the_function_is_not_hidden():
    def failing(time, state):
        raise ZeroDivisionError("no sensor")

    with pytest.raises(ZeroDivisionError, match="no sensor"):
        simulate(PAPER, **START, duration=1.0, effects=[FunctionController(failing, 0.1)])


# Files and scenes


@pytest.mark.parametrize("ending", [".npz", ".csv"])
@pytest.mark.parametrize("function", ["tests: integrating", Integrating, "tests: proportional"])
def test_a_saved_run_is_loaded_by_the_name(tmp_path, ending, function):
    run = simulate(PAPER, **START, duration=0.5, effects=[FunctionController(function, 0.05), LIMITED])
    run.save(tmp_path / f"run{ending}")
    again = Trajectory.load(tmp_path / f"run{ending}")
    assert again.effects == run.effects and (again.nu == run.nu).all() and (again.drive == run.drive).all()
    assert again.ledger == run.ledger
    more = simulate(PAPER, **START, duration=0.5, effects=again.effects.effects)
    assert (more.nu == run.nu).all()


def test_without_a_name_a_run_cannot_be_saved_and_says_so(tmp_path):
    run = simulate(PAPER, **START, duration=0.1, effects=[FunctionController(lambda time, state: 0.0, 0.05)])
    with pytest.raises(InvalidValueError, match="register_controller") as refused:
        run.save(tmp_path / "run.npz")
    assert refused.value.field == "function" and "lambda" in refused.value.value


def test_a_name_that_is_not_registered_is_refused(tmp_path, forgotten):
    simulate(PAPER, **START, duration=0.1, effects=[FunctionController(proportional, 0.05)]).save(tmp_path / "run.npz")
    (tmp_path / "scene.toml").write_text(SCENE)
    forgotten()
    with pytest.raises(InvalidValueError, match="not the name of a registered controller .there is none") as refused:
        Trajectory.load(tmp_path / "run.npz")
    assert (refused.value.field, refused.value.value) == ("function", "tests: proportional")
    with pytest.raises(SceneError, match=r"scene.toml:9.*\[function_controller\] function.*register_controller"):
        load_scene(tmp_path / "scene.toml")


def test_a_scene_names_the_function(tmp_path):
    (tmp_path / "scene.toml").write_text(SCENE)
    scene = load_scene(tmp_path / "scene.toml")
    assert scene.options["effects"] == (FunctionController(proportional, 0.05),)
    run = omniroll.run(scene, accuracy=1e-10, control=False)
    direct = simulate(
        PAPER, nu=(1, 0.2, 0.8), duration=0.5, accuracy=1e-10, control=False, effects=scene.options["effects"]
    )
    assert (run.nu == direct.nu).all()
    session = omniroll.Session(scene)
    session.step(0.5)
    np.testing.assert_allclose(session.nu, run.nu[-1], rtol=0, atol=1e-8)


def test_the_command_line_imports_the_module_that_registers(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE.replace("tests: proportional", "tests: of a module"))
    (tmp_path / "braking_for_tests.py").write_text(
        "import omniroll\n\n@omniroll.register_controller('tests: of a module')\n"
        "def brake(time, state):\n    return -0.01 * state.wheel_speeds\n"
    )
    assert cli.main(["run", "scene.toml"]) == 2
    assert "tests: of a module" in capsys.readouterr().err
    assert cli.main(["--import", "nothing_of_this_name", "run", "scene.toml"]) == 1
    assert "nothing_of_this_name" in capsys.readouterr().err
    assert cli.main(["--import", "braking_for_tests", "run", "scene.toml"]) == 0
    again = Trajectory.load(next((tmp_path / "out/run/scene").glob("*.npz")))
    assert again.effects.effects[0].function == "tests: of a module"


def test_pickle_takes_the_function_along(forgotten):
    """Where a process reads it that has not registered it, the function comes without its name."""
    effect = FunctionController(proportional, 0.05)
    data = pickle.dumps(effect)
    assert pickle.loads(data) == effect and effect.function == "tests: proportional"
    forgotten()
    assert pickle.loads(data).function is proportional


def test_each_run_makes_its_own_object_of_a_class():
    """simulate makes three runs and more, and each starts with sums that are 0."""
    effects = [FunctionController(Integrating, 0.05)]
    first, again = (simulate(PAPER, **START | {"control": True}, duration=0.5, effects=effects) for _ in range(2))
    assert first.stats["error_estimate"] < START["accuracy"]
    assert (first.nu == again.nu).all()

"""What `accuracy` promises and what the promise costs, over random scenes of every effect."""

import warnings

import numpy as np
import pytest
from random_scenes import MODELS, PAPER, SCENES, random_scene

import omniroll
from omniroll.engine import control
from omniroll.engine.control import controlled, made, making
from omniroll.engine.python_engine import Run
from omniroll.engine.simulate import checked_task
from omniroll.results.comparison import difference

pytestmark = pytest.mark.long

EPS = np.finfo(float).eps
SEEDS = (0,)  # without a layout: its sets are tested elsewhere, and take seconds each to compile


def scenes():
    """Tasks of random scenes, lengths and accuracies; also without effects."""
    for seed in SEEDS:
        for place, name in enumerate((*SCENES, None)):
            for model in MODELS if name is None else (MODELS[place % 3],):
                vehicle, arguments = random_scene(name or "torques", model, seed)
                rng = np.random.default_rng([17, seed, MODELS.index(model), len(name or "")])
                arguments |= {
                    "duration": float(rng.choice([2.0, 5.0, 15.0])),
                    "accuracy": float(10 ** rng.uniform(-11, -3)),
                }
                if name is None:
                    arguments |= {"effects": [], "nu": rng.normal(size=3)}
                yield f"{name} {model} {seed}", checked_task(vehicle, **arguments)


@pytest.fixture(scope="module")
def counted():
    """{name: (task, trajectory, its error, evaluations of the plain run, evaluations of all runs)}

    The error is that against a run of the same engine at its finest tolerance; tests/runtime holds this engine to the
    Python engine.
    """
    found, spent = {}, []

    def counting(task, tolerance):
        run = yield from making(task, tolerance)
        spent.append(run.stats()["evaluations"])
        return run

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(control, "making", counting)
        for name, task in scenes():
            made(task, task.accuracy).release()
            plain = spent.pop()
            trajectory = controlled(task).trajectory()
            price = sum(spent)
            found[name] = task, trajectory, difference(trajectory, made(task, 1e-14).trajectory()), plain, price
            spent.clear()
    return found


def test_the_error_is_at_most_ten_times_the_request(counted):
    for name, (task, run, error, *_) in counted.items():
        assert error <= 10 * max(task.accuracy, EPS * run.stats["sensitivity"]), name


def test_the_estimate_is_not_far_below_the_error_and_not_below_the_rounding(counted):
    """Two runs that events cut into the same steps share what landing on these leaves, up to 1e-3 of the tolerance."""
    for name, (task, run, error, *_) in counted.items():
        assert run.stats["error_estimate"] + 1e-3 * task.accuracy >= 0.1 * error, name
        assert run.stats["error_estimate"] >= EPS * run.stats["sensitivity"], name


def test_the_promise_costs_less_than_another_run(counted):
    """In evaluations: at most twice the plain run in the median, below three times for 95 %."""
    prices = np.array([all_runs / plain for *_, plain, all_runs in counted.values()])
    assert prices.min() > 1, "nothing was counted"
    assert np.median(prices) <= 2
    assert np.mean(prices < 3) >= 0.95


def test_a_step_that_becomes_stiff_settles_before_it_is_taken():
    """The first stiff sweep has no ratio of changes yet. Such a step once ended with errors of 4e-6."""
    vehicle, arguments = random_scene("viscous friction", "free", 0)
    task = checked_task(vehicle, **arguments | {"duration": 15.0}, accuracy=1e-8)
    assert difference(made(task, 1e-8).trajectory(), made(task, 1e-14).trajectory()) < 1e-8


def test_a_request_out_of_reach_does_not_go_on_for_ever(monkeypatch):
    """The sensitivity shows that no tolerance reaches it: no second try."""
    runs = []
    monkeypatch.setattr(control, "making", lambda *arguments: runs.append(arguments) or making(*arguments))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", omniroll.AccuracyWarning)
        omniroll.simulate(PAPER, nu=(1, 0, 0), duration=20, roller_model="locked", accuracy=1e-13)
    assert len(runs) == 3


def test_the_python_engine_is_controlled_alike():
    task = checked_task(PAPER, nu=(1, 0, 1), duration=0.5, accuracy=1e-6, engine="python")
    checked = controlled(task)
    assert isinstance(checked.run, Run)
    fine = made(task, 1e-12).trajectory()
    assert difference(checked.trajectory(), fine) <= checked.error_estimate <= 1e-6

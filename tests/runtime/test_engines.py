"""The compiled engine against the Python engine, over random scenes of every effect."""

import numpy as np
import pytest
from random_scenes import MODELS, PAPER, SCENES, random_scene

from omniroll import TorqueTable, simulate
from omniroll.engine.control import one_run
from omniroll.engine.python_engine import Run
from omniroll.engine.simulate import checked_task
from omniroll.kernels import sets
from omniroll.results.comparison import difference

ACCURACY = 1e-11
SMOOTH = [name for name in SCENES if "stick" not in name]  # friction that sticks the Python engine steps in time


def scene(name, model, seed):
    vehicle, task = random_scene(name, model, seed)
    return vehicle, task | {"accuracy": ACCURACY}


def both(vehicle, task):
    compiled = simulate(vehicle, **task, control=False)
    python = Run(checked_task(vehicle, **task), ACCURACY).trajectory()
    assert (compiled.stats["engine"], python.stats["engine"]) == ("compiled", "python")
    return compiled, python


def pairs(run):
    """The first rows of those pairs that stand at one instant."""
    return np.flatnonzero(np.diff(run.elapsed) == 0)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "seed", "model"), [(name, (0, 3, 5)[k % 3], MODELS[(k + k // 3) % 3]) for k, name in enumerate(SMOOTH)]
)
def test_both_engines_agree(name, model, seed):
    assert_agreement(*both(*scene(name, model, seed)))


@pytest.mark.long
@pytest.mark.parametrize(("name", "seed", "model"), [
    ("limited motors", 0, "massless"), ("motors with a controller", 1, "locked"),
    ("all with axles and rollers that stick", 1, "free"), ("contacts that stick", 0, "free"),
])  # fmt: skip
def test_the_general_set_runs_each_scene_as_its_own_set_does(name, model, seed):
    """Seed 1 gives the vehicle another layout."""
    vehicle, options = scene(name, model, seed)
    tasks = [checked_task(vehicle, **options, engine=engine) for engine in ("specialised", "compiled")]
    own, general = (one_run(task, ACCURACY) for task in tasks)
    kernels = [run.stats["kernel"] for run in (own, general)]
    assert kernels[0] == tasks[0].kernel.set_name == tasks[1].kernel.set_name
    assert kernels[1] in general_names(model) and kernels[0] != kernels[1]
    assert_agreement(own, general)
    assert (own.drive is None) == (general.drive is None) and own.added.shape[1:] == general.added.shape[1:]


def general_names(model):
    return [sets.set_name(model, effects) for effects in sets.general_sets(model)]


def assert_agreement(compiled, other):
    assert compiled.switches.wheel.tolist() == other.switches.wheel.tolist()
    assert compiled.switches.direction.tolist() == other.switches.direction.tolist()
    np.testing.assert_allclose(compiled.switches.t, other.switches.t, rtol=0, atol=3e-9)
    assert difference(compiled, other) < 3e-10
    if compiled.added is not None:
        size = 1 + np.abs(other.added).max(initial=0)
        np.testing.assert_allclose(compiled.added[-1], other.added[-1], rtol=0, atol=1e-8 * size)
    for run in (compiled, other):
        assert abs(run.ledger.residual) < 1e-9 * (1e-3 + run.energy.max())
    rows, others = pairs(compiled), pairs(other)
    assert len(rows) == len(others)
    if compiled.drive is not None:
        np.testing.assert_allclose(compiled.drive[0], other.drive[0], rtol=1e-6, atol=1e-9)
        for step in (0, 1):
            np.testing.assert_allclose(compiled.drive[rows + step], other.drive[others + step], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("interpolation, rows", [("hold", 2), ("linear", 1)])
@pytest.mark.parametrize("engine", ["compiled", "python"])
def test_rows_stand_on_both_sides_of_what_changes_the_torque(engine, interpolation, rows):
    table = TorqueTable([0.5, 1.0], [[0.01] * 3, [-0.02] * 3], interpolation)
    run = simulate(PAPER, nu=(0, 0, 0), duration=1.5, effects=[table], engine=engine, control=False)
    here = np.flatnonzero(run.elapsed == 1.0)
    assert len(here) == rows
    if rows == 2:
        np.testing.assert_array_equal(run.drive[here, 0], [[0.01] * 3, [-0.02] * 3])
        np.testing.assert_array_equal(run.nu[here[0]], run.nu[here[1]])


@pytest.mark.long
@pytest.mark.parametrize("name", ["limited motors", "controller", "all with viscous friction"])
def test_buffers_do_not_matter(monkeypatch, name):
    """A run in many calls is the run in one call, to the bit, with its events."""
    vehicle, task = scene(name, "free", 0)
    whole = simulate(vehicle, **task, control=False)
    monkeypatch.setattr("omniroll.engine.workspace.ROWS", 5)
    pieces = simulate(vehicle, **task, control=False)
    for field in ("elapsed", "nu", "chi", "pose", "contact", "spins", "added", "drive", "dense", "switches"):
        np.testing.assert_array_equal(getattr(pieces, field), getattr(whole, field), err_msg=field)

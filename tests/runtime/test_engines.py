"""The compiled engine against the Python engine, over random scenes of every effect, and against the equations."""

from dataclasses import dataclass

import numpy as np
import pytest
from random_scenes import MODELS, PAPER, SCENES, random_scene

from omniroll import Bearings, Controller, TorqueTable, Vehicle, simulate
from omniroll.effects.effect import Influence, Process, Signal
from omniroll.effects.torque import Drive
from omniroll.engine.compiled_engine import can_run
from omniroll.engine.control import one_run
from omniroll.engine.python_engine import Run
from omniroll.engine.simulate import checked_task
from omniroll.kernels import sets
from omniroll.kernels.kernel import kernel
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


@pytest.mark.parametrize("wheels, rollers, model, law", [
    (1, 4, "free", "impact"), (2, 3, "locked", "impact"), (3, 5, "massless", "smooth"), (3, 5, "locked", "smooth"),
    (3, 5, "free", "impact"), (4, 8, "free", "smooth"), (5, 6, "massless", "impact"),
])  # fmt: skip
def test_both_engines_agree_without_effects(wheels, rollers, model, law):
    rng = np.random.default_rng([wheels, rollers])
    angles = tuple(np.linspace(0.3, 5.8, wheels)) if rollers == 3 else None
    changes = {"wheels": wheels, "rollers_per_wheel": rollers, "wheel_angles": angles, "roller_axis_radius": 0.03}
    vehicle = PAPER.replace(**changes) if rollers == 3 else Vehicle.paper(wheels, rollers)
    spins = {"spins": rng.normal(size=(wheels, rollers - 1))} if model == "free" else {}
    start = {"nu": rng.normal(size=3), "chi": rng.uniform(-1, 1, wheels) * np.pi / rollers} | spins
    options = {"duration": 2.0, "roller_model": model, "switching": law, "accuracy": ACCURACY}
    compiled, python = both(vehicle, start | options)
    assert len(compiled.switches)
    assert_agreement(compiled, python)
    np.testing.assert_allclose(
        compiled.switches.energy_jump, python.switches.energy_jump, rtol=0, atol=1e-9 * python.energy[0]
    )


@pytest.mark.parametrize("law", ["smooth", "impact"])
def test_what_is_between_rows_obeys_the_equations(law):
    """The derivative of the polynomials is the kernel's right-hand side."""
    run = simulate(PAPER, nu=(1, 0.2, 1), duration=5, roller_model="locked", switching=law, accuracy=1e-10)
    starts = run.step_rows
    lengths = run.t[starts + 1] - run.t[starts]
    long = lengths > 1e-3
    times = run.t[starts][long] + lengths[long] * np.random.default_rng(1).uniform(0.1, 0.9, long.sum())
    slope = (run.sample(times + 1e-5).nu - run.sample(times - 1e-5).nu) / 2e-5
    middle = run.sample(times)
    np.testing.assert_allclose(slope, kernel(PAPER, "locked").forward_dynamics(middle.nu, middle.chi), atol=1e-6)


@pytest.mark.long
@pytest.mark.parametrize(("name", "seed", "model"), [
    ("limited motors", 0, "massless"), ("motors with a controller", 1, "locked"),
    ("all with axles and rollers that stick", 1, "free"),
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


@dataclass(frozen=True)
class Copied(Drive):
    """An effect of another kind that gives what a controller gives."""

    controller: Controller

    def process(self, kernel, start_time):
        return CopiedProcess(self.controller.process(kernel, start_time))


class CopiedProcess(Process):
    def __init__(self, inner):
        self.inner = inner

    def next_time(self):
        return self.inner.next_time()

    def pass_time(self, state):
        self.inner.pass_time(state)

    def influence(self, elapsed, given):
        return Influence({"torque": Signal.constant(self.inner.output)})


@pytest.mark.long
@pytest.mark.parametrize(
    "beside", [[], [Bearings(wheel_coulomb=(5e-3, 3e-3, 4e-3))]], ids=["alone", "axles that stick"]
)
def test_an_effect_of_another_kind_is_asked_at_its_events(beside):
    """The engine that asks gives what the engine gives that knows the controller."""
    controller = Controller((0.5, 0.1, -0.5), 0.01, 0.05, integral=0.01)
    task = {"nu": (1, 0.2, 0.8), "duration": 2, "accuracy": ACCURACY}
    assert can_run(checked_task(PAPER, **task, effects=[Copied(controller), *beside]))
    known, asked = (
        simulate(PAPER, **task, effects=[effect, *beside], control=False) for effect in (controller, Copied(controller))
    )
    assert asked.stats["engine"] == "compiled"
    np.testing.assert_allclose(asked.nu, known.nu, rtol=0, atol=1e-13)
    np.testing.assert_allclose(asked.drive, known.drive, rtol=0, atol=1e-15)


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

"""simulate_many: what simulate makes of each, whatever the executor."""

import pickle
import warnings
from concurrent.futures import Executor, Future, ProcessPoolExecutor

import numpy as np
import pytest

import omniroll
from omniroll.effects.function_controller import FunctionController
from omniroll.engine import works
from omniroll.sweeps import sweep
from omniroll.sweeps.many import simulate_many
from omniroll.sweeps.member import SAMPLED

PAPER = omniroll.Vehicle.paper()
HEAVY = PAPER.replace(roller_inertia=3 * PAPER.roller_inertia)
NU = np.array([[1, 0, 1], [0.5, 0.2, -1], [0, 1, 0.3]])
TASK = {"nu": NU, "duration": 1.5, "chi": (0.1, -0.2, 0.3), "accuracy": 1e-8}


def check(many, roller_model="free", times=None):
    """Every run of [PAPER, HEAVY] x NU against simulate, to the bit."""
    assert many.shape == (2, 3)
    for (v, k), vehicle in zip(np.ndindex(2, 3), [PAPER] * 3 + [HEAVY] * 3, strict=True):
        run = omniroll.simulate(vehicle, **TASK | {"nu": NU[k], "roller_model": roller_model})
        for name in SAMPLED:
            one = getattr(run, name)
            found = getattr(many.end, name)
            assert found is None if one is None else (found[v, k] == one[-1]).all()
        assert many.energy_start[v, k] == run.energy[0]
        for name in ("switches", "steps", "evaluations", "error_estimate", "sensitivity"):
            assert getattr(many, name)[v, k] == run.stats[name]
        if times is not None:
            assert (many.samples.pose[v, k] == run.sample(times).pose).all()
            assert (many.samples.contact[v, k] == run.sample(times).contact).all()
    assert not many.stopped.any() and many.reasons == {}


VEHICLES = [[PAPER], [HEAVY]]


@pytest.mark.parametrize("roller_model", ["massless", "locked", "free"])
def test_equal_to_runs_one_by_one(roller_model):
    times = [0.0, 0.4, 1.5]
    many = simulate_many(VEHICLES, **TASK, roller_model=roller_model, times=times)
    check(many, roller_model, times)
    assert many.samples.nu.shape == (2, 3, 3, 3)


def test_processes():
    with ProcessPoolExecutor(1) as executor:
        check(simulate_many(VEHICLES, **TASK, executor=executor))


def test_runs_of_a_group_are_one_call_of_the_engine(monkeypatch):
    """A run whose effect raises among them takes nobody along."""
    sizes = []

    def counted(calls):
        sizes.append(len(calls))
        return of_library(calls)

    def fails(time, state):
        raise RuntimeError("no output")

    of_library = works._of_library
    monkeypatch.setattr(works, "_of_library", counted)
    monkeypatch.setattr(sweep, "TOGETHER", 1e6)
    monkeypatch.setattr(sweep, "cores", lambda: 1)
    failing = FunctionController(fails, 0.1)
    effects = [[failing] if k == 5 else [omniroll.Torque(0.01 * k)] for k in range(16)]
    many = simulate_many(PAPER, nu=(1, 0, 1), duration=0.5, effects=effects)
    assert max(sizes) == 2 * sweep.MOST_TOGETHER > 2  # a coarser run and the run itself of each
    assert list(many.reasons) == [(5,)] and "no output" in many.reasons[5,]
    for k in (4, 6, 7):
        assert (many.end.nu[k] == omniroll.simulate(PAPER, nu=(1, 0, 1), duration=0.5, effects=effects[k]).nu[-1]).all()


class Pickling(Executor):
    """Runs at once what it is given, after a journey through pickle."""

    def submit(self, function, /, *arguments):
        future = Future()
        function, arguments = pickle.loads(pickle.dumps((function, arguments)))
        future.set_result(pickle.loads(pickle.dumps(function(*arguments))))
        return future


def test_tasks_and_results_pickle():
    seen = []
    many = simulate_many(VEHICLES, **TASK, executor=Pickling(), progress=lambda done, total: seen.append((done, total)))
    check(pickle.loads(pickle.dumps(many)))
    assert seen[-1] == (6, 6) and [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_a_run_that_stops_does_not_end_the_others(bouncing):
    many = simulate_many(
        PAPER, nu=[(0, 0, 1), (0, 0, 0.5)], duration=4, roller_model="locked", engine="python",
        control=False, times=[0.0, 4.0],
    )  # fmt: skip
    assert many.stopped.tolist() == [True, False] and "without progress" in many.reasons[0,]
    assert np.isnan(many.samples.nu[0, 1]).all() and (many.samples.contact[0, 1] == -1).all()
    assert np.isfinite(many.samples.nu[1]).all() and np.isnan(many.error_estimate).all()
    assert many.end.t[0] < 4 == many.end.t[1]


@pytest.mark.parametrize("executor", [None, Pickling()])
def test_a_member_that_fails_is_named(executor):
    """The second one's torques are those of another vehicle, the third one's numbers leave the range."""
    effects = [[omniroll.Torque((0.001, 0, 0))], [omniroll.Torque((1, 2, 3, 4))], [omniroll.Torque((1e150, 0, 0))]]
    many = simulate_many(PAPER, nu=(1, 0, 1), duration=0.5, effects=effects, executor=executor, times=[0.0, 0.5])
    assert many.stopped.tolist() == [False, True, True] and set(many.reasons) == {(1,), (2,)}
    assert "torque" in many.reasons[1,]
    alone = omniroll.simulate(PAPER, nu=(1, 0, 1), duration=0.5, effects=effects[0])
    assert (many.end.spins[0] == alone.spins[-1]).all() and (many.samples.nu[0, 1] == alone.nu[-1]).all()
    assert np.isnan(many.end.nu[1]).all() and np.isnan(many.end.energy[1]) and (many.end.contact[1] == -1).all()
    assert np.isnan(many.error_estimate[1]) and many.switches[1] == 0


@pytest.mark.parametrize("executor", [None, Pickling()])
def test_an_interruption_keeps_what_is_done(executor, monkeypatch):
    monkeypatch.setattr("omniroll.sweeps.sweep.cores", lambda: 1)

    def interrupt(done, total):
        if done >= 2:
            raise KeyboardInterrupt

    with pytest.raises(omniroll.SweepInterrupted) as raised:
        simulate_many(PAPER, nu=np.tile(NU, (3, 1)), duration=0.2, executor=executor, progress=interrupt)
    many = raised.value.many
    assert isinstance(raised.value, KeyboardInterrupt) and many.shape == (9,)
    assert np.count_nonzero(~many.stopped) >= 2 and np.isfinite(many.end.pose[~many.stopped]).all()
    for place in np.flatnonzero(many.stopped):
        assert "interrupted" in many.reasons[place,] and np.isnan(many.end.pose[place]).all()


def test_out_of_reach_is_said_once():
    with pytest.warns(omniroll.AccuracyWarning, match="2 of 2 runs") as said:
        simulate_many(PAPER, nu=NU[:2], duration=1, accuracy=1e-18)
    assert len(said) == 1


@pytest.mark.parametrize("change, field", [
    ({"nu": [(1, 0, 1), (np.nan, 0, 0)]}, "nu"),
    ({"chi": np.zeros((4, 3))}, "chi"),
    ({"chi": 1.0}, "chi"),
    ({"times": [2.0]}, "times"),
    ({"vehicles": []}, "vehicles"),
    ({"vehicles": [PAPER, omniroll.Vehicle.paper(4)]}, "vehicles"),
])  # fmt: skip
def test_bad_input_is_named(change, field):
    task = {"vehicles": PAPER, "nu": NU, "duration": 1.0} | change
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ValueError) as raised:
            simulate_many(task.pop("vehicles"), **task)
    assert raised.value.field == field


def test_a_sweep_without_room_is_refused_before_it_is_made():
    starts = np.broadcast_to(np.array(NU[0], float), (10**6, 1, 3))
    with pytest.raises(omniroll.InvalidValueError, match=r"for 1000000000000 runs: \d.* PB; or make") as raised:
        simulate_many(PAPER, nu=starts, chi=np.zeros((1, 10**6, 3)), duration=1)
    assert raised.value.field == "memory"
    with pytest.raises(omniroll.InvalidValueError, match="for 2 runs of 100000000 samples"):
        simulate_many(PAPER, nu=NU[:2], duration=1, times=np.broadcast_to(0.5, 10**8))
    assert not simulate_many(PAPER, nu=NU[:2], duration=0.1, memory=1e5).stopped.any()

"""The reference solutions of `omniroll accuracy` against the oracle's, which know nothing of the kernels."""

import numpy as np
import pytest
from oracle import references
from oracle.bridge import project_vehicle

from omniroll import Bearings, Controller, FunctionController, Motor, Slope, Torque, TorqueTable, Vehicle
from omniroll.effects import effect
from omniroll.engine.simulate import checked_task, one_run
from omniroll.errors import OmnirollError
from omniroll.studies.accuracy.deviation import deviation
from omniroll.studies.accuracy.peers import outcome_of
from omniroll.studies.accuracy.reference import Extrapolated, Taylor, confirmed, digits, extended, follow

pytestmark = pytest.mark.long

flint = pytest.importorskip("flint")
CASES = [c for c in references.load() if c["name"].startswith(("2 wheels", "paper 2")) and c["model"] != "massless"]


@pytest.mark.parametrize("case", CASES, ids=lambda c: f"{c['name']} {c['model']} {c['law']}")
def test_references_agree_with_the_oracle(case):
    start = dict(case["start"])
    if case["model"] != "free":
        del start["spins"]
    task = checked_task(
        project_vehicle(case["vehicle"]), **start, duration=case["duration"],
        roller_model=case["model"], switching=case["law"],
    )  # fmt: skip
    times = np.array([float(s["t"]) for s in case["samples"]] + [case["duration"]])
    with digits():
        one = follow(Taylor(task), task, times)
        wanted = [flint.arb(v) for v in (*case["end"]["nu"], *case["end"]["chi"], *case["end"]["pose"])]
        # Wheels that are meant to switch together come some 1e-16 s apart, as their rounded angles have it.
        most = 5e-16 if case["name"].startswith("paper") else 1e-18
        assert max(abs(a - extended(b)) for a, b in zip(one.y[-1], wanted, strict=True)) < most
    gaps = deviation(follow(Extrapolated(task), task, times), one, task)
    assert max(gaps.values()) < 2e-15
    moves = [(int(i), d) for s in case["switches"] for i, d in s["moves"].items()]
    assert sorted(s[1:] for s in one.switches) == sorted(moves)
    for row, sample in zip(one.y, case["samples"], strict=False):
        np.testing.assert_allclose(row[:3], np.array(sample["nu"], float), atol=1e-15)


class Tracking:
    """A controller that remembers: the integral of the distance in x."""

    def __init__(self):
        self.sum = 0.0

    def __call__(self, time, state):
        self.sum += 0.07 * (0.1 - state.pose[0])
        return 0.05 * self.sum * (1 + time) - 0.01 * state.wheel_speeds + 1e-3 * state.chi + 1e-4 * state.contact


ACTING = {
    "a table with jumps, on a slope": (TorqueTable([0.1, 0.25], [[0.01] * 3, [-0.02, 0.03, 0.0]], "hold"), Slope(0.1)),
    "motors at their limit": (Motor([[5, -3, -2], [1, 2, 3]], 0.02, 1.5, current_limit=0.7, times=[0, 0.4]),),
    "a sampled controller with motors": (
        Motor(0.0, 0.02, 1.5), Controller((0.5, 0.1, -0.5), 1.0, 0.07, integral=2.0, output="voltage", limit=3.0),
    ),
    "friction of both kinds of axle": (
        Bearings(wheel_viscous=2e-3, wheel_coulomb=1e-3, wheel_speed=0.5, roller_viscous=1e-5),
    ),
    "a controller whose output is cut off at first": (
        Controller([[3, 0, 0], [1, 0.2, 0.8]], 0.01, 0.05, integral=0.3, times=[0, 0.1], limit=0.02),
    ),
    "friction that each roller has by itself": (Bearings(roller_coulomb=1e-5, roller_speed=0.5),),
    "axles that stop and break away": (
        TorqueTable([0, 0.3], [[0.0] * 3, [-0.15] * 3]), Bearings(wheel_coulomb=0.02, wheel_break_away=0.03),
    ),
    "a Python function on a slope": (FunctionController(Tracking, 0.07), Slope(0.1)),
}  # fmt: skip


@pytest.mark.parametrize("name", ACTING)
def test_references_with_effects_agree_with_each_other_and_with_the_engine(name):
    start = {"nu": (1.0, 0.2, 0.8), "chi": (-0.5, 0.55, -0.6), "spins": np.linspace(-1, 1, 12).reshape(3, 4)}
    task = checked_task(Vehicle.paper(), **start, duration=0.3, effects=ACTING[name])
    found = confirmed(task, np.linspace(0, 0.3, 5))
    assert 0 < found.confirmed < 1e-15 and found.switches
    engine = outcome_of(one_run(task, 1e-13), task, found.times)
    assert max(deviation(engine, found, task).values()) < 1e-12


PAPER = Vehicle.paper()


def test_an_effect_that_acts_through_python_has_no_reference():
    class Asked(Torque):
        def process(self, kernel, start_time):
            return Process()

    class Process(effect.Process):
        pass

    task = checked_task(Vehicle.paper(), nu=(1, 0, 0), duration=0.1, effects=[Asked(0.01)])
    with pytest.raises(OmnirollError, match="no reference solution with Asked"):
        confirmed(task, np.array([0.1]))


MOTION = {"nu": (1.0, 0.0, 1.0), "duration": 0.6, "roller_model": "locked"}


def test_the_second_solution_says_how_fine_the_first_is(monkeypatch):
    task, times = checked_task(Vehicle.paper(), **MOTION), np.linspace(0, 0.6, 5)
    found = confirmed(task, times)
    assert 0 < found.confirmed < 1e-16 and found.floor == 100 * found.confirmed
    monkeypatch.setattr("omniroll.studies.accuracy.reference.TAYLOR_ERROR", 1e-9)
    coarse = confirmed(task, times)
    assert 1e-14 < deviation(coarse, found, task)["trajectory"] < 2 * coarse.confirmed

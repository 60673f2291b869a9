"""Question 4: what a switch costs beyond the integration around it."""

import time

import numpy as np

import omniroll
from omniroll.engine.compiled_engine import DONE, CompiledRun
from omniroll.engine.simulate import checked_task
from omniroll.kernels.kernel import kernel

from .common import Answer, Target, Times

NU, LENGTH = (1.0, 0.0, 0.3), 0.01  # no joint is reached after the first
RUNS, REPEATS = 400, 25


class OneStep:
    """The compiled engine over one step, again and again from the same state."""

    def __init__(self, roller_model, switching, at_joint):
        vehicle = omniroll.Vehicle.paper()
        compiled = kernel(vehicle, roller_model, "compiled")
        joint = np.pi / vehicle.rollers_per_wheel
        chi = np.zeros(vehicle.wheels)
        direction = np.sign(compiled.wheel_speeds(np.array(NU))[1])
        # Either at the joint and about to pass it, or just behind it: the phase after it is the same.
        chi[1] = direction * joint * (1 if at_joint else -1)
        task = checked_task(vehicle, nu=NU, chi=chi, duration=LENGTH, roller_model=roller_model, switching=switching)
        self.run = CompiledRun(task, 1e-9)
        module = self.run.module
        self.step, self.model = module.lib.omniroll_run, compiled.model_for(module.ffi)
        arrays = [getattr(self.run, name) for name in ("nu", "chi", "pose", "axial", "contact")]
        self.start = [(array, array.copy()) for array in arrays]

    def seconds(self):
        run, start = self.run.run, time.thread_time
        total = 0.0
        for _ in range(RUNS):
            for array, first in self.start:
                array[...] = first
            run.state.elapsed = run.state.carry = run.past.step = run.past.phase_start = run.past.anchor = 0
            run.record.row_count = run.record.switch_count = run.past.idle_switches = 0
            before = start()
            status = self.step(self.run.struct, self.model)
            total += start() - before
            assert status == DONE
        return total / RUNS


def measure(roller_model, switching):
    """Times of the run without and with the switch, in turns, and of their difference."""
    behind, at = OneStep(roller_model, switching, False), OneStep(roller_model, switching, True)
    pairs = np.array([(behind.seconds(), at.seconds()) for _ in range(REPEATS)])
    assert (behind.run.run.record.switch_count, at.run.run.record.switch_count) == (0, 1)
    least, median = pairs.min(axis=0), np.median(pairs, axis=0)
    # Both runs end in the same state, but for the nu that an impact changes.
    error = np.abs(at.run.chi - behind.run.chi).max()
    without, with_one = (Times(least[k], median[k]) for k in range(2))
    return without, with_one, Times(least[1] - least[0], median[1] - median[0]), error


def answer() -> Answer:
    rows, targets = [], []
    for roller_model in ("locked", "free"):
        for switching in ("smooth", "impact"):
            without, with_one, cost, error = measure(roller_model, switching)
            times = without.in_unit(1e6), with_one.in_unit(1e6), cost.in_unit(1e9, ".0f")
            rows.append([roller_model, switching, *times, f"{error:.0e}"])
            claim = f"a switch costs less than 1 microsecond: {roller_model}, {switching}"
            targets.append(Target(claim, f"{cost.least * 1e9:.0f} ns", cost.least < 1e-6))
    return Answer(
        title="4. A switch",
        text=(
            "The compiled engine runs one step from a state at the joint, which it has to pass first, and "
            "from the state just behind the joint; the difference is the switch: finding that it is due, "
            "the law, its record and its row. The last column has the largest difference of the wheels' "
            "angles at the end of the two runs: none for locked rollers and smooth switches, elsewhere "
            "what the law itself changes. That steps end at joints at all is part of question 3."
        ),
        headings=["rollers", "law", "microseconds without", "with", "switch, ns", "difference"],
        rows=rows,
        targets=targets,
    )

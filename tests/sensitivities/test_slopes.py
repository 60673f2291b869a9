"""Slopes of the rates along a run: the generated ones against those of the functions that run."""

import numpy as np
import pytest

from omniroll import Slope
from omniroll.engine.motion import Motion
from omniroll.engine.slopes import Slopes
from omniroll.kernels.kernel import PythonKernel
from omniroll.kernels.tangent_kernel import TangentKernel
from tests.sensitivities.differences import Case
from tests.sensitivities.test_runs import LIMITED, VISCOUS


@pytest.mark.parametrize(
    "case",
    [Case("massless"), Case("locked"), Case("free"), Case("free", effects=(VISCOUS,)),
     Case("free", effects=(Slope(0.1, 0.4),)), Case("free", effects=(LIMITED,))],
    ids=["massless", "locked", "free", "viscous", "slope", "motor"],
)  # fmt: skip
def test_generated_slopes_are_those_of_the_functions_that_run(case):
    motion = Motion(case.run())
    generated, carried = (
        Slopes(motion.deviations, motion.trajectory, motion.plain, generated=way) for way in (True, False)
    )
    assert len(generated.rest) < len(carried.rest) == sum(place.size for place in motion.deviations.places.values())
    one, other = (slopes.at(motion.y, motion.inputs) for slopes in (generated, carried))
    assert np.abs(one - other).max() <= 1e-13 * np.abs(other).max()


@pytest.mark.parametrize("effects", [(), (VISCOUS,)], ids=["none", "viscous"])
def test_generated_functions_are_called_as_often_however_many_switches_there_are(effects, monkeypatch):
    """For all steps and switches at once, in groups: some more calls where there are several groups."""
    calls = []
    for kernel in (PythonKernel, TangentKernel):
        own = kernel.call
        monkeypatch.setattr(kernel, "call", lambda self, name, *v, own=own: calls.append(name) or own(self, name, *v))

    def counted(duration):
        run = Case("free", effects=effects, duration=duration).run(sensitivities=("nu[0]", "mass"))
        count = len(calls)
        calls.clear()
        return len(run.switches), count

    (few, once), (many, again) = counted(2.0), counted(10.0)
    assert many > 2 * few
    assert again <= once + 30


def test_the_derivatives_by_many_numbers_at_the_same_times_need_one_look():
    names = ("nu[0]", "nu[1]", "mass")
    run = Case("locked").run(sensitivities=names)
    times = np.linspace(0, 1, 50)
    found = [run.sensitivity(name, times) for name in names]
    look = run.followed.look
    assert all(run.sensitivity(name, list(times)).t is look.times for name in names)
    one = Case("locked").run(sensitivities=names).sensitivity("nu[1]", times)
    assert np.array_equal(found[1].nu, one.nu) and np.array_equal(found[1].pose, one.pose)

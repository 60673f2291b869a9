"""A loss's derivatives backwards through a run are those that the sensitivities add up to."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll import InvalidValueError, NoDerivativeError, gradient
from tests.sensitivities.differences import VEHICLE, Case
from tests.sensitivities.test_runs import CONTROLLER, MOTOR, TABLE, TIED, VISCOUS

EVERY_SPIN = tuple(f"spins[{i}][{j}]" for i in range(3) for j in range(VEHICLE.rollers_per_wheel - 1))
NUMBERS = ("nu[0]", "chi[1]", "pose[2]", "mass", "wheel_radius", "roller_inertia")
CASES = [
    (Case("massless"), NUMBERS),
    (Case("locked"), NUMBERS),
    (Case("free"), NUMBERS + EVERY_SPIN),
    (Case("free", "smooth"), NUMBERS + EVERY_SPIN),
    (Case("free", effects=(VISCOUS,)), ("chi[0]", "wheel_viscous", "roller_viscous", *EVERY_SPIN)),
    (Case("free", effects=(TABLE,)), tuple(f"torque[{k}][{i}]" for k in range(3) for i in range(3))),
    (Case("free", effects=(replace(MOTOR, voltage=0), CONTROLLER)), ("nu[0]", "mass", "target[0]", "integral[1]")),
]


@pytest.mark.parametrize("case, names", CASES, ids=lambda case: case.roller_model if isinstance(case, Case) else "")
def test_backwards_is_forwards(case, names):
    run, random = case.run(sensitivities=names), np.random.default_rng(1)
    times = np.array([0.0, 0.31, run.switches.t[0], 0.6, case.duration])
    weights = {name: random.normal(size=(len(times), 3)) for name in ("nu", "chi", "pose")}
    found = gradient(case.run(), names, times, **weights)
    for name in names:
        moved = run.sensitivity(name, times)
        terms = np.concatenate([(weights[part] * getattr(moved, part)).ravel() for part in weights])
        assert found[name] == pytest.approx(terms.sum(), abs=1e-11 * np.abs(terms).sum() + 1e-300), name


def test_what_does_not_fit_is_refused():
    run = Case().run()
    with pytest.raises(InvalidValueError, match="row of times"):
        gradient(run, ("mass",), 0.5)
    with pytest.raises(InvalidValueError, match="nu"):
        gradient(run, ("mass",), [0.5], nu=[1, 2, 3])
    with pytest.raises(InvalidValueError, match="is no number"):
        gradient(run, ("weight",), [0.5])
    tied = Case("free", start=TIED, duration=4.0).run()
    with pytest.raises(NoDerivativeError):
        gradient(tied, ("mass",), [3.0])

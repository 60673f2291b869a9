"""A loss's derivatives backwards through a run are those that the sensitivities add up to."""

import numpy as np
import pytest

from omniroll import InvalidValueError, NoDerivativeError, gradient
from tests.sensitivities.differences import TIED, VEHICLE, Case
from tests.sensitivities.test_differences import CASES

EVERY_SPIN = tuple(f"spins[{i}][{j}]" for i in range(3) for j in range(VEHICLE.rollers_per_wheel - 1))
FOLLOWED = [
    "massless, impact", "locked, impact", "free, impact", "free, smooth", "viscous bearings", "table", "controller",
    "axles break away at their torque", "axles break away above it", "free rollers rest", "massless, break-aways",
    "free rollers, break-aways", "rollers beside contacts, stop",
    "in series, rollers let go and contacts come to rest",
]  # fmt: skip


@pytest.mark.parametrize("name", FOLLOWED)
def test_backwards_is_forwards(name):
    case, names = CASES[name]
    names += EVERY_SPIN if name in ("free, impact", "viscous bearings") else ()
    names = tuple(dict.fromkeys(names))
    run, random = case.run(sensitivities=names, accuracy=1e-13), np.random.default_rng(1)
    times = case.duration * np.array([0.0, 0.31, 0.6, 1.0])
    times = np.sort(np.append(times, run.switches.t[:1]))
    weights = {name: random.normal(size=(len(times), 3)) for name in ("nu", "chi", "pose")}
    found = gradient(case.run(accuracy=1e-13), names, times, **weights)
    for name in names:
        moved = run.sensitivity(name, times)
        terms = np.concatenate([(weights[part] * getattr(moved, part)).ravel() for part in weights])
        growth = max(np.abs(run.sensitivity(name).pose).max(), np.abs(terms).sum())
        assert found[name] == pytest.approx(terms.sum(), abs=1e-11 * growth + 1e-300), name


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

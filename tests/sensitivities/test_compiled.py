"""Deviations followed in C: with how many nodes, what is made for them and how often, and what they cost."""

import numpy as np
import pytest

from omniroll import Vehicle, simulate
from omniroll.engine import compiled_variations
from omniroll.engine.compiled_variations import Models, library_of
from omniroll.engine.deviations import Deviations
from omniroll.engine.motion import Columns, Motion
from omniroll.kernels import sets
from omniroll.kernels.tangent_kernel import TangentKernel
from tests.costs import counting
from tests.sensitivities.costs import task
from tests.sensitivities.differences import Case

NAMES = ("nu[0]", "chi[1]", "pose[2]", "mass", "wheel_radius", "platform_radius", "wheel_angles[1]")


def test_from_row_to_row_fewer_nodes_are_as_exact_as_the_run(monkeypatch):
    """At 1e-9, where steps are as long as the accuracy lets them be; between rows there are as many nodes as before."""
    for case in (Case("free", duration=4.0), Case("locked", "smooth", duration=4.0)):
        run = case.run(sensitivities=NAMES, accuracy=1e-9)
        with monkeypatch.context() as context:
            context.setattr(compiled_variations, "FEWER", compiled_variations.NODES)
            exact = case.run(sensitivities=NAMES, accuracy=1e-9)
        assert exact.followed.compiled.nodes == compiled_variations.NODES
        size = np.abs(exact.followed.rows).max(axis=(0, 1))
        times = np.linspace(0, case.duration, 101)
        assert (np.abs(run.followed.rows - exact.followed.rows).max(axis=(0, 1)) <= 1e-10 * size).all()
        for name, own in zip(NAMES, size, strict=True):
            apart = run.sensitivity(name, times).pose - exact.sensitivity(name, times).pose
            assert np.abs(apart).max() <= 1e-9 * own


def test_a_run_that_is_asked_for_no_derivative_needs_none_of_it(monkeypatch):
    def refused(*_):
        raise AssertionError("nobody has asked for derivatives")

    monkeypatch.setattr(sets, "variations", refused)
    run = Case("free").run()
    assert run.followed is None
    with pytest.raises(AssertionError):
        library_of(Motion(run))


@pytest.mark.parametrize("kind", ["massless", "free", "massless, coulomb, axles stick, no drive"])
def test_what_follows_from_effects_and_names_is_made_once(kind, monkeypatch):
    """A second run with the same vehicle, effects and names makes no columns, kernels with tangents or models in C."""
    made = []
    for own in (Deviations, Columns, TangentKernel, Models):

        def counted(self, *given, make=own.__init__, name=own.__name__, **named):
            made.append(name)
            make(self, *given, **named)

        monkeypatch.setattr(own, "__init__", counted)
    given = task(kind) | {"vehicle": Vehicle.paper().replace(mass=3.25), "duration": 0.1}
    first = simulate(**given)
    assert {"Deviations", "Columns", "Models"} <= set(made)
    made.clear()
    second = simulate(**given)
    assert made == []
    assert (first.sensitivity("mass").nu == second.sensitivity("mass").nu).all()


# A run of each way that derivatives go, the dearest over its plain run: `python -m costs.derivatives` has all.
COUNTED = ("free", "coulomb, axles stick, no drive")
MOST = 6  # times the plain run


@pytest.mark.long
def test_a_run_with_twelve_derivatives_costs_at_most_six_runs():
    """In instructions of the run with its control, and of all that C and Python do for its derivatives."""
    if counting.missing():
        pytest.skip(f"not there: {counting.missing()}")
    parts = counting.CONTROLLED, counting.DERIVED
    ratios = {}
    for kind, (plain, derived) in counting.counted_parts("sensitivities.costs", list(COUNTED), parts).items():
        assert plain > 1e5, kind
        ratios[kind] = 1 + derived / plain
    assert min(ratios.values()) > 1.5 and max(ratios.values()) <= MOST, ratios

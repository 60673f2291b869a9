"""Deviations followed in C against the reference in Python, which differentiates the generated functions by the complex
step; and what they cost."""


import numpy as np
import pytest

from omniroll import Bearings, Vehicle, simulate
from omniroll.engine import sensitivities
from omniroll.engine.compiled_variations import Models, library_of
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.variations import Deviations
from omniroll.kernels import sets
from omniroll.kernels.tangent_kernel import TangentKernel
from tests.costs import counting
from tests.sensitivities.costs import task
from tests.sensitivities.differences import Case, derivative

NAMES = ("nu[0]", "chi[1]", "pose[2]", "mass", "wheel_radius", "platform_radius", "wheel_angles[1]")
EVERY = ("yaw_inertia", "wheel_inertia", "roller_inertia", "roller_axis_radius", "yaw_scale")
PLAIN = [Case(model, law, duration=4.0) for model in ("massless", "locked", "free") for law in ("impact", "smooth")]
FADING, RUBBING = Bearings(wheel_viscous=1e-3, roller_viscous=1e-5), Bearings(roller_coulomb=2e-5, roller_speed=0.5)
ROUNDINGS = 1e-11  # of the largest derivative; both solve the same equations at the same nodes, in other orders


def far_from_rest(run):
    """(T,) bool: rows in which no slip is about to come to rest, or has just begun. The direction of one turns faster
    and faster on its way to rest, and turns roundings as well; where it rests nothing is left of that."""
    contacts = Motion(run).contacts
    if contacts is None:
        return np.ones(len(run), bool)
    return (run.sticks | (np.linalg.norm(run.slip, axis=-1) > 1e-5)).all(axis=1)


def parts_of(run, names, times):
    """{number: its derivatives in the rows, at the end with the spins, and of nu at some times}."""
    rows = run.followed.rows[far_from_rest(run)]
    assert len(rows) >= len(run) / 3
    return {
        name: (rows[..., k], derivative(run, name), run.sensitivity(name, times).nu) for k, name in enumerate(names)
    }


def apart(one, other):
    """{number: how far its derivatives are apart, by part}."""
    return {name: np.array([np.abs(a - b).max() for a, b in zip(one[name], other[name], strict=True)]) for name in one}


def runs_in_c_and_python(case, names, monkeypatch, others=(), **options):
    """The run with its derivatives in C and in Python, and what `others` make of it, in Python."""
    own = case.run(sensitivities=names, **options)
    with monkeypatch.context() as context:
        context.setattr(sensitivities, "library_of", lambda motion: None)
        runs = [case.run(sensitivities=names, **options), *(other(case.run()) for other in others)]
    assert own.followed.compiled is not None and all(run.followed.compiled is None for run in runs)
    return own, *runs


def in_c_and_python(case, names, monkeypatch, others=(), switches=2):
    """The derivatives of the run in C and in Python, and those in Python of what `others` make of it."""
    times, runs = np.linspace(0, case.duration, 23), runs_in_c_and_python(case, names, monkeypatch, others)
    assert len(runs[0].switches) >= switches
    with monkeypatch.context() as context:
        context.setattr(sensitivities, "library_of", lambda motion: None)
        reference = [parts_of(run, names, times) for run in runs[1:]]
    return parts_of(runs[0], names, times), *reference


def sizes_of(parts):
    """{number: the sizes of its derivatives, by part}; between rows that of the rows."""
    sizes = {name: [np.abs(part).max() for part in own] for name, own in parts.items()}
    return {name: np.array([rows, max(rows, end), rows]) for name, (rows, end, _) in sizes.items()}


def same_as_in_python(case, names, monkeypatch, bound=ROUNDINGS, switches=2):
    own, reference = in_c_and_python(case, names, monkeypatch, switches=switches)
    differences, sizes = apart(own, reference), sizes_of(reference)
    for name in names:
        assert (differences[name] <= bound * sizes[name]).all(), name


@pytest.mark.parametrize("case", PLAIN, ids=lambda case: f"{case.roller_model} {case.switching}")
def test_it_gives_what_the_reference_gives(case, monkeypatch):
    same_as_in_python(case, NAMES + EVERY + (("spins[1][2]",) if case.roller_model == "free" else ()), monkeypatch)


def test_from_row_to_row_fewer_nodes_are_as_exact_as_the_run(monkeypatch):
    """At 1e-9, where steps are as long as the accuracy lets them be; between rows there are as many nodes as before."""
    for case in (Case("free", duration=4.0), Case("locked", "smooth", duration=4.0)):
        run = case.run(sensitivities=NAMES, accuracy=1e-9)
        exact = sensitivities.Followed.along(run, NAMES, 24)
        size = np.abs(exact.rows).max(axis=(0, 1))
        times = np.linspace(0, case.duration, 101)
        assert (np.abs(run.followed.rows - exact.rows).max(axis=(0, 1)) <= 1e-10 * size).all()
        for name, own in zip(NAMES, size, strict=True):
            apart = run.sensitivity(name, times).pose - exact.at(run, name, times).pose
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
COUNTED = ("free", "coulomb, axles stick, no drive", "in series, coulomb, skid, no drive")
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

"""Deviations followed in C against the reference in Python, which differentiates the generated functions by the complex
step; and what they cost."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from omniroll import Bearings, Contact, Slope, Vehicle, simulate
from omniroll.engine import sensitivities, variations
from omniroll.engine.compiled_variations import Models, library_of
from omniroll.engine.motion import Columns, Motion, columns_beside
from omniroll.engine.variations import Deviations
from omniroll.kernels import sets
from omniroll.kernels.tangent_kernel import TangentKernel
from omniroll.results.dense import weights_at
from tests.costs import counting
from tests.sensitivities.costs import task
from tests.sensitivities.differences import Case, derivative
from tests.sensitivities.test_ground import FOUR, FOUR_START, MOTOR, REGULARISED
from tests.sensitivities.test_ground import VISCOUS as SLIPPING
from tests.sensitivities.test_runs import COULOMB, LIMITED, TABLE, TIED, VISCOUS

NAMES = ("nu[0]", "chi[1]", "pose[2]", "mass", "wheel_radius", "platform_radius", "wheel_angles[1]")
EVERY = ("yaw_inertia", "wheel_inertia", "roller_inertia", "roller_axis_radius", "yaw_scale")
PLAIN = [Case(model, law, duration=4.0) for model in ("massless", "locked", "free") for law in ("impact", "smooth")]
OF_EACH = replace(VISCOUS, roller_viscous=(1e-5, 3e-5, 1e-5))  # two wheels' rollers alike
WITH_EFFECTS = [
    (Case("free", effects=(VISCOUS,), duration=3.0), ("wheel_viscous[1]", "roller_viscous")),
    (Case("free", effects=(OF_EACH,), duration=1.0), ("roller_viscous[0]", "roller_viscous[2]")),
    (Case("free", effects=(COULOMB,), duration=1.0), ("roller_coulomb", "roller_speed")),
    (Case("free", effects=(Slope(0.1, 0.4),), duration=2.0), ("angle", "direction")),
    (Case("locked", effects=(LIMITED,), duration=1.0), ("voltage[1]", "torque_constant")),
    (Case("free", effects=(TABLE,)), ("torque[1][2]", "times[1]")),
]
OF_VISCOUS, OF_REGULARISED = ("coefficient[0]", "coefficient[1]", "wheel_rates[1]"), ("friction[0]", "speed")
OF_FREE = ("spins[1][2]", "roller_inertia")
FADING, RUBBING = Bearings(wheel_viscous=1e-3, roller_viscous=1e-5), Bearings(roller_coulomb=2e-5, roller_speed=0.5)
AT_ONCE = Case("free", "impact", effects=(Contact(40.0),), start=TIED, duration=1.3)
ON_THE_GROUND = {
    "massless, viscous": (Case("massless", effects=(SLIPPING,)), NAMES + OF_VISCOUS),
    "massless, regularised": (Case("massless", effects=(REGULARISED,)), NAMES + OF_REGULARISED),
    "viscous": (Case("free", effects=(SLIPPING,)), NAMES + OF_VISCOUS + OF_FREE),
    "regularised": (Case("free", effects=(REGULARISED,)), NAMES + OF_REGULARISED + OF_FREE),
    "together": (AT_ONCE, ("nu[0]", "chi[1]", "wheel_radius", "platform_radius", "coefficient", "spins[1][2]")),
    "four": (Case("massless", vehicle=FOUR, effects=(REGULARISED,), start=FOUR_START), NAMES + ("center_of_mass[0]",)),
    "motor": (Case("free", effects=(SLIPPING, MOTOR)), NAMES + ("voltage[1]", "current_limit")),
    "slope": (Case("massless", effects=(SLIPPING, Slope(0.1, 0.4))), NAMES + ("angle", "direction")),
    "bearings": (Case("free", effects=(SLIPPING, FADING)), NAMES + ("wheel_viscous[1]", "roller_viscous")),
    "rubbing": (Case("free", effects=(SLIPPING, RUBBING)), NAMES + ("roller_coulomb", "roller_speed")),
}
ROUNDINGS = 1e-11  # of the largest derivative; both solve the same equations at the same nodes, in other orders
TRIALS = 4


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


@pytest.mark.long
@pytest.mark.parametrize("case, names", WITH_EFFECTS, ids=["viscous", "unlike", "coulomb", "slope", "motor", "table"])
def test_with_effects_too(case, names, monkeypatch):
    same_as_in_python(case, NAMES + names, monkeypatch)


@pytest.mark.long
@pytest.mark.parametrize("case, names", ON_THE_GROUND.values(), ids=ON_THE_GROUND)
def test_wheels_that_slip_under_smooth_laws_too(case, names, monkeypatch):
    same_as_in_python(case, names, monkeypatch)


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


def with_other_roundings(run, names, trial):
    """The run with its derivatives in Python where each wheel's angle in the rows is one rounding elsewhere, and the
    polynomials of the steps are summed up in another order."""
    rng, motion = np.random.default_rng(trial), Motion(run)
    angles = motion.y[:, motion.vector.slices["chi"]]
    angles[:] = np.nextafter(angles, angles + rng.choice([-1, 1], size=angles.shape))

    def summed(coefficients, x):
        weights, order = weights_at(coefficients.shape[1] - 1, x), rng.permutation(coefficients.shape[1])
        return sum(weights[k, :, None] * coefficients[:, k] for k in order)

    with pytest.MonkeyPatch.context() as context:
        context.setattr(variations, "values_at", summed)
        sweep = sensitivities.Sweep(motion, columns_beside(run, names))
        sweep.run()
    object.__setattr__(run, "followed", sweep.followed())  # a trajectory is frozen
    return run


@pytest.mark.long
@pytest.mark.parametrize("tip", [1e-3, 1e-6])
@pytest.mark.parametrize("model", ["locked", "free"])
def test_with_sharp_tips_too(model, tip, monkeypatch):
    """Near a joint a rounding of the angle moves the slopes by as many roundings as the tips are sharp. The roller that
    leaves turns on with the rest of a constraint, divided by the tip's radius: that is in its spin at the end. How much
    it comes to is measured on the reference alone, by what it is with other roundings of the same motion: C may be at
    most twice as far from it.
    """
    case = Case(model, duration=2.0)
    radius = case.vehicle.wheel_radius * np.cos(np.pi / case.vehicle.rollers_per_wheel) * (1 - tip)
    case = replace(case, vehicle=case.vehicle.replace(roller_axis_radius=radius))
    assert Motion(case.run()).plain.sharp
    names = ("nu[0]", "mass", "wheel_inertia")
    others = [partial(with_other_roundings, names=names, trial=trial) for trial in range(TRIALS)]
    own, reference, *moved = in_c_and_python(case, names, monkeypatch, others)
    differences, sizes = apart(own, reference), sizes_of(reference)
    for name in names:
        roundings = np.max([apart(other, reference)[name] for other in moved], axis=0)
        assert (differences[name] <= ROUNDINGS * sizes[name] + 2 * roundings).all(), name


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
COUNTED = ("free", "axles that stick", "massless, regularised", "coulomb, axles stick, no drive",
           "in series, coulomb, skid, no drive")  # fmt: skip
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

"""Sensitivities of runs in which free rollers come to rest on their disks, stick there and break away."""

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, InvalidValueError, NoDerivativeError, Slope, Torque, TorqueTable
from omniroll.engine import sensitivities, variations
from omniroll.engine.hold_deviations import HoldDeviations
from omniroll.engine.motion import Motion, columns_beside
from tests.sensitivities.differences import Case, derivative
from tests.sensitivities.spies import rows_passed
from tests.sensitivities.test_compiled import NAMES, ROUNDINGS, runs_in_c_and_python, same_as_in_python
from tests.sensitivities.test_runs import HELD, check
from tests.sensitivities.test_sticking import AT_REST, RAMP

RUBBING = Bearings(roller_coulomb=2e-5)
HELD_LONGER = Bearings(roller_coulomb=2e-5, roller_break_away=4e-5)
FADING = Bearings(roller_coulomb=2e-5, wheel_viscous=1e-3, roller_viscous=1e-6)
AXLES, ROLLERS = {"wheel_coulomb": 1e-3}, {"roller_coulomb": 2e-3, "roller_break_away": 4e-3}
NUMBERS = {"nu[0]": 1e-4, "chi[1]": 1e-4, "spins[1][2]": 1e-3, "mass": 1e-3, "roller_coulomb": 1e-8}
OF_VEHICLE = {"roller_inertia": 1e-9, "roller_axis_radius": 1e-6, "wheel_angles[1]": 1e-5, "yaw_scale": 1e-4}
STILL = AT_REST | {"spins": 0.0}
BACK_AND_FORTH = TorqueTable((0, 0.5, 1), ((0, 0, 0), (0.3, 0.2, 0.3), (-0.1, 0.05, -0.2)))
PUSHED = {"mass": 1e-3, "torque[1][0]": 5e-6, "times[1]": 1e-5, "roller_coulomb": 4e-8, "roller_break_away": 4e-8}

OF_ROLLERS = ("spins[1][2]", "roller_inertia", "yaw_scale", "roller_axis_radius", "roller_coulomb")
IN_C = {  # against Python
    "impact": (Case("free", effects=(RUBBING,), duration=3.0), NAMES + OF_ROLLERS),
    "smooth": (Case("free", "smooth", effects=(RUBBING,), duration=3.0), NAMES + OF_ROLLERS),
    "they break away": (Case("free", effects=(BACK_AND_FORTH, HELD_LONGER), start=STILL, duration=0.6), tuple(PUSHED)),
    "axles too": (
        Case("free", effects=(Bearings(roller_coulomb=2e-5, wheel_coulomb=2e-3),), duration=12.0),
        ("nu[0]", "mass", "wheel_coulomb", "roller_axis_radius"),
    ),
    "those in contact too": (
        Case("free", effects=(RAMP, Bearings(**AXLES, **ROLLERS)), start=STILL, duration=2.5),
        ("mass", "torque[1][0]", "wheel_coulomb[2]", "roller_coulomb", "roller_break_away", "wheel_radius"),
    ),
    "slope": (Case("free", effects=(Slope(0.1, 0.4), RUBBING)), NAMES + ("angle", "direction", "roller_coulomb")),
    "fading": (Case("free", effects=(FADING,), duration=3.0), NAMES + OF_ROLLERS + ("wheel_viscous", "roller_viscous")),
    "unlike": (
        Case("free", "smooth", effects=(Bearings(roller_coulomb=2e-5, roller_viscous=(1e-5, 3e-5, 1e-5)),)),
        NAMES + OF_ROLLERS + ("roller_viscous[1]",),
    ),
}  # fmt: skip


def turns(run):
    """How many times free rollers go from one mode to another (before, after), where no wheel switches."""
    motion = Motion(run)
    spins, first = motion.holds.spins, run.step_rows
    together = np.array([not motion.directions[a + 1 : b + 1].any() for a, b in zip(first, first[1:], strict=False)])
    before, after = spins.of_steps[:-1][together], spins.of_steps[1:][together]
    return {(a, b): int(((before == a) & (after == b)).sum()) for a in (-1, 0, 1) for b in (-1, 0, 1) if a != b}


@pytest.mark.long
@pytest.mark.parametrize("law", ["smooth", "impact"])
def test_rollers_come_to_rest_on_their_disks(law):
    """Under `impact` each switch sets all that stuck spinning again; one that sticks comes into contact and spins."""
    case = Case("free", law, effects=(RUBBING,), duration=3.0)
    check(case, NUMBERS | OF_VEHICLE, switches=9)
    found, run = turns(case.run()), case.run(sensitivities=("nu[0]",))
    assert found[-1, 0] + found[1, 0] >= (60 if law == "impact" else 8)
    stuck = Motion(run).holds.spins.modes[-1] == 0
    assert stuck.any() and not run.sensitivity("nu[0]").spins[-1][stuck].any()


@pytest.mark.long
@pytest.mark.parametrize("law", ["smooth", "impact"])
def test_rollers_break_away_from_their_disks_and_pass_rest(law):
    """The disk turns faster and faster; above the sliding torque the rates jump where a roller breaks away."""
    case = Case("free", law, effects=(BACK_AND_FORTH, HELD_LONGER), start=STILL, duration=0.6)
    check(case, PUSHED, switches=10)
    found = turns(case.run())
    assert found[0, 1] + found[0, -1] >= 8 and found[1, -1] + found[-1, 1] >= 2


@pytest.mark.long
def test_axles_rollers_in_contact_and_free_ones_stick_together():
    case = Case("free", effects=(RAMP, Bearings(**AXLES, **ROLLERS)), start=STILL, duration=2.5)
    changes = {"mass": 1e-3, "torque[1][0]": 5e-6, "wheel_coulomb[2]": 1e-7, "roller_coulomb": 2e-7,
               "roller_break_away": 2e-7, "wheel_radius": 1e-6, "roller_axis_radius": 1e-6}  # fmt: skip
    check(case, changes)
    sets = Motion(case.run()).holds.sets
    found = turns(case.run())
    assert {3, 6} <= set(sets.sum(axis=1)) and min(found[1, 0], found[-1, 0]) >= 20


@pytest.mark.long
def test_at_the_end_everything_rests():
    case = Case("free", effects=(Bearings(roller_coulomb=2e-5, wheel_coulomb=2e-3),), duration=12.0)
    check(case, {"nu[0]": 1e-4, "mass": 1e-3, "wheel_coulomb": 1e-7, "roller_axis_radius": 1e-6}, switches=10)
    end = case.run(sensitivities=("nu[0]",)).sensitivity("nu[0]")
    assert not end.spins[-1].any() and np.abs(end.nu[-1]).max() < 1e-12 and np.abs(end.pose[-1]).max() > 1
    reason = r"what sticks together would leave other directions; by wheel_angles\[1\]"
    with pytest.raises(NoDerivativeError, match=reason):  # two axles hold the third wheel's roller: in this shape alone
        case.run(sensitivities=("wheel_angles[1]",))


@pytest.mark.long
@pytest.mark.parametrize("case, changes", [
    (Case("free", effects=(FADING,), duration=3.0), {"nu[0]": 1e-4, "wheel_viscous": 1e-7, "roller_viscous": 1e-9}),
    (Case("free", effects=(HELD, Bearings(roller_coulomb=1e-4, wheel_coulomb=0.03)), start=STILL, duration=1.5),
     {"voltage[1][2]": 1e-3, "times[1]": 1e-5, "roller_coulomb": 1e-8}),
], ids=["fading", "motor"])  # fmt: skip
def test_beside_other_friction_and_motors(case, changes):
    check(case, changes)


@pytest.mark.long
def test_between_rows_and_backwards_they_are_the_same():
    case, names = Case("free", effects=(Torque((0.02, 0.01, -0.01)), RUBBING)), tuple(NUMBERS)
    check(case, {"nu[0]": 1e-4, "mass": 1e-3, "roller_coulomb": 1e-8}, t=0.637)
    run, weights, times = case.run(sensitivities=names), np.array([[1.0, 2, 3], [0.5, -1, 2]]), np.array([0.33, 0.9])
    found = omniroll.gradient(run, names, times, pose=weights)
    for name in names:
        forwards = (weights * run.sensitivity(name, times).pose).sum()
        assert found[name] == pytest.approx(forwards, rel=1e-11)


@pytest.mark.long
def test_a_spin_that_friction_takes_at_once_does_nothing():
    """At rest on its disk a little spin is gone before anything has moved by more than its square."""
    case = Case(
        "free", effects=(Torque((0.0, 0.0, 0.0)), Bearings(roller_coulomb=2e-5, wheel_coulomb=0.01)), start=STILL
    )
    run = case.run(sensitivities=("spins[1][2]", "nu[0]"))
    assert not derivative(run, "spins[1][2]").any() and not derivative(run, "nu[0]").any()


def test_linear_models_of_them_are_still_refused():
    with pytest.raises(InvalidValueError, match="stick"):
        omniroll.linearise(omniroll.Vehicle.paper(), nu=(1, 0, 0), roller_model="free", effects=[RUBBING])


@pytest.mark.long
def test_sweeps_find_what_one_linear_system_finds(monkeypatch):
    """The deviations of a step in Python: of ordinary rates by sweeps alone, which break off where rates are fast."""
    monkeypatch.setattr(sensitivities, "library_of", lambda motion: None)
    options = {"nu": (1, 0.3, 0.8), "duration": 2, "effects": [RUBBING]}
    names = ("mass", "nu[0]", "roller_coulomb")

    def followed():
        run = omniroll.simulate(omniroll.Vehicle.paper(), **options, sensitivities=names)
        return np.array([[*run.sensitivity(name).nu[-1], *run.sensitivity(name).pose[-1]] for name in names])

    at_once, asked = variations._at_once, []
    monkeypatch.setattr(variations, "_at_once", lambda *parts: asked.append(len(parts[0])) or at_once(*parts))
    by_sweeps = followed()
    assert not asked
    monkeypatch.setattr(variations, "MOST_SWEEPS", 0)
    assert by_sweeps == pytest.approx(followed(), rel=1e-11, abs=1e-13 * np.abs(by_sweeps).max())
    assert asked
    fast = np.full((1, 2, 1, 1), 1e3)
    _, found = variations._by_sweeps(fast, lambda x: -1e3 * x)
    assert not found.any()


@pytest.mark.long
@pytest.mark.parametrize("case, names", IN_C.values(), ids=IN_C)
def test_c_gives_what_python_gives(case, names, monkeypatch):
    same_as_in_python(case, names, monkeypatch)


def with_rollers_that_stick(seed):
    """A random scene of free rollers that stick, some beside axles that do, some with viscous friction or torques."""
    rng = np.random.default_rng(seed)
    sliding = 10 ** rng.uniform(-6, -4)
    numbers = {"roller_coulomb": sliding, "roller_break_away": sliding * rng.choice([1.0, 1.0, 1.5])}
    if rng.random() < 0.3:
        numbers["wheel_coulomb"] = 10 ** rng.uniform(-4, -2.5)
    torques = [Torque(tuple(rng.normal(size=3) * 0.03))] if rng.random() < 0.4 else []
    if rng.random() < 0.5:
        numbers["roller_viscous"] = rng.choice([0.0, 1e-7, 1e-5])
    spins = rng.normal(size=(3, 4)) * rng.choice([0, 1, 3])
    start = {"nu": tuple(rng.normal(size=3)), "chi": tuple(rng.uniform(-0.4, 0.4, 3)), "spins": spins}
    return Case("free", str(rng.choice(["impact", "smooth"])), (*torques, Bearings(**numbers)), 1.0, start=start)


@pytest.mark.long
def test_c_gives_what_python_gives_in_random_scenes(monkeypatch):
    """Runs as exact as can be; and at 1e-9, where steps are long and may have 12 nodes in C."""
    names = ("nu[0]", "chi[1]", "mass", "yaw_scale", *OF_ROLLERS[:2], "roller_coulomb", "roller_break_away")
    for seed in range(12):
        accuracy, bound = ((1e-14, ROUNDINGS), (1e-9, 1e-9))[seed % 2]
        runs = runs_in_c_and_python(with_rollers_that_stick(seed), names, monkeypatch, accuracy=accuracy)
        own, reference = (run.followed.rows for run in runs)
        size = np.abs(reference).max(axis=(0, 1))
        assert (np.abs(own - reference) <= bound * size).all(), seed


def rests_alone(run, names):
    """Rows in which a step ends and free rollers come to rest, and nothing else happens."""
    motion = Motion(run)
    modes, left = motion.holds.spins.modes, HoldDeviations(motion, columns_beside(run, names)).left_to_do > 0
    before = np.concatenate([modes[:1], modes[:-1]])
    ends = np.append(False, motion.starts_step[:-1])
    turns_on = ((before != modes) & (modes != 0)).any(axis=(1, 2))
    return set(np.flatnonzero(left & ends & ~turns_on).tolist())


@pytest.mark.long
def test_rests_of_rollers_are_passed_in_c(monkeypatch):
    passed = rows_passed(monkeypatch, HoldDeviations, "entered")
    for name, rests in {"impact": 60, "smooth": 8, "axles too": 60}.items():
        passed.clear()
        case, names = IN_C[name]
        run = case.run(sensitivities=names)
        found = rests_alone(run, names)
        assert len(found) >= rests and found.isdisjoint(passed), name
        with monkeypatch.context() as context:
            context.setattr(sensitivities, "library_of", lambda motion: None)
            case.run(sensitivities=names)
        assert found <= set(passed), name

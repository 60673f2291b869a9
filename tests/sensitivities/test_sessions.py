"""Sensitivities of sessions: those of one run, whatever the steps; and by what steps hold, against differences."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, Controller, InvalidValueError, Motor, NoDerivativeError, Torque
from tests.sensitivities.differences import SPINS, START, TIED, VEHICLE, Case
from tests.sensitivities.test_differences import CASES, MOTOR

FINE = 1e-12
STEPS = (0.0, 0.003, 0.05, 0.2)
STEPPED = [
    "locked, smooth", "axles rest one after the other", "axles break away above it", "viscous bearings",
    "free rollers rest", "free rollers break away and pass rest", "voltages, held", "controller",
    "massless, break-aways", "free rollers, break-aways", "rollers beside contacts, stop",
    "in series, rollers let go and contacts come to rest",
]  # fmt: skip


def session(case, names, **start):
    given = START | ({"spins": SPINS} if case.roller_model == "free" else {}) | case.start | start
    return omniroll.Session(
        case.vehicle, driven=False, **given, roller_model=case.roller_model, switching=case.switching,
        effects=case.effects, accuracy=FINE, sensitivities=names,
    )  # fmt: skip


def same(found, wanted, bound=1e-10):
    for part in ("nu", "chi", "pose", "spins"):
        own, other = getattr(found, part), getattr(wanted, part)
        assert (own is None) == (other is None)
        if own is not None:
            assert np.abs(own - other).max() <= bound * max(1.0, np.abs(wanted.pose).max(), np.abs(other).max()), part


def stepped_like_one_run(case, names):
    run = case.run(sensitivities=names, accuracy=FINE)
    followed, rng = session(case, names), np.random.default_rng(1)
    saved = None
    while followed.elapsed < case.duration:
        followed.step(min(float(rng.choice(STEPS)), case.duration - followed.elapsed))
        if saved is None and followed.elapsed > case.duration / 2:
            saved = pickle.loads(pickle.dumps(followed.save()))
    ends = {name: followed.sensitivity(name) for name in names}
    for name in names:
        same(ends[name], run.sensitivity(name, case.duration))
    for other in (followed, session(case, names)):
        other.restore(saved)
        other.step(case.duration - other.elapsed)
        for name in names:
            same(other.sensitivity(name), ends[name])
    followed.reset()
    followed.step(case.duration)
    for name in names:
        same(followed.sensitivity(name), ends[name])
        assert followed.sensitivity(name).t == followed.time


def test_steps_change_nothing():
    stepped_like_one_run(Case("free", duration=3.0), ("nu[0]", "mass", "spins[1][2]"))


@pytest.mark.long
@pytest.mark.parametrize("name", STEPPED)
def test_with_effects_too(name):
    stepped_like_one_run(*CASES[name])


LIMITED_CONTROL = Controller((1, 0, 0.5), 1, 0.05, 2, "voltage", limit=1.5)
HELD_BY_STEPS = {
    "torque[1]": ((Torque(0.0), Bearings(wheel_coulomb=0.005)),
                  [{"torque": (0.02, 0.03, -0.01)}, {}, {"torque": (-0.02, 0.01, 0.03)}]),
    "voltage[2]": ((Motor(0.0, 0.02, 1.5, gear_ratio=4, current_limit=0.4), Torque(0.004)),
                   [{"voltage": (1.0, 2.0, 0.3)}, {"torque": 0.01}, {"voltage": (-1.0, 0.2, 0.1)}]),
    "resistance": ((Motor(0.5, 0.02, 1.5, gear_ratio=4), Torque(0.0)), [{}, {"torque": 0.02}, {}]),
    "target[2]": ((MOTOR, LIMITED_CONTROL),
                  [{"target": (0.5, 0.5, 0.0)}, {}, {"target": (0.0, 0.0, 3.0)}, {"target": (0.0, 0.0, 0.0)}]),
}  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("name", HELD_BY_STEPS)
def test_what_steps_hold_moves_together(name):
    """The number is one that is added to all that steps give, and to what was there before; others see what is held."""
    effects, steps = HELD_BY_STEPS[name]
    held, _, place = name.removesuffix("]").partition("[")

    def gone(by):
        values = np.zeros(3)
        values[int(place or 0)] = by
        added = tuple(values) if place else by
        own = session(Case("locked", effects=tuple(
            replace(e, **{held: np.add(getattr(e, held), added).tolist()}) if hasattr(e, held) else e for e in effects
        )), (name,))  # fmt: skip
        for step in steps:
            own.step(0.23, **{k: tuple(values + v) if k == held else v for k, v in step.items()})
        return own

    found = gone(0.0).sensitivity(name)
    ends = {by: gone(by) for by in (2e-4, 1e-4, -1e-4, -2e-4)}
    for part in ("nu", "chi", "pose"):
        wide, narrow = ((getattr(ends[by], part) - getattr(ends[-by], part)) / (2 * by) for by in (2e-4, 1e-4))
        wanted = (4 * narrow - wide) / 3
        assert np.abs(getattr(found, part) - wanted).max() <= 1e-8 * max(1.0, np.abs(wanted).max()), part


def test_before_the_first_step_it_is_that_of_the_start():
    own = session(Case("free", start={"spins": 0}), ("nu[1]", "spins[0][2]", "mass"))
    assert own.sensitivity("nu[1]").nu.tolist() == [0, 1, 0]
    assert own.sensitivity("spins[0][2]").spins[0, 2] == 1 and not own.sensitivity("mass").pose.any()


def test_a_motion_without_derivatives_goes_on_and_says_so_when_asked():
    case = Case("free", "impact", start=TIED)
    own = session(case, ("chi[0]",))
    own.step(4.0)
    for _ in range(2):
        with pytest.raises(NoDerivativeError, match=r"wheels 0, 1, 2.*by chi\[0\]"):
            own.sensitivity("chi[0]")
        own.step(0.1)
    own.reset()
    own.step(0.5)
    assert own.sensitivity("chi[0]").chi[0] == pytest.approx(1, abs=1e-5)


def test_what_is_not_followed_is_refused():
    plain = omniroll.Session(VEHICLE)
    with pytest.raises(InvalidValueError, match="was not asked for it"):
        plain.sensitivity("mass")
    followed = omniroll.Session(VEHICLE, sensitivities=("mass",))
    with pytest.raises(InvalidValueError, match="must be one of"):
        followed.sensitivity("nu[0]")
    with pytest.raises(InvalidValueError, match="whose sensitivities is not"):
        followed.restore(plain.save())
    with pytest.raises(InvalidValueError, match="is no number of this run"):
        omniroll.Session(VEHICLE, sensitivities=("weight",))

"""Sensitivities of runs in which massless rollers stick on their disks beside contacts that stick on the ground, and
loads follow the motion, against differences of runs in 40 digits, in which the loads are three more unknown numbers
(hard.true_strips)."""

from dataclasses import replace

import numpy as np
import pytest
from contact.test_massless_rollers_and_loads import scene

from omniroll import Bearings, Contact, NoDerivativeError, simulate
from omniroll.engine.motion import Motion
from tests.sensitivities import test_massless_rollers_beside_contacts as static
from tests.sensitivities.differences import Case, assert_the_same_backwards_and_in_sessions, derivative
from tests.sensitivities.test_compiled_beside_contacts import (
    BOUND,
    IN_SERIES,
    apart,
    in_series_at_random,
    refuse_python,
)
from tests.sensitivities.test_loads_that_follow import STARTING, TALL
from tests.sensitivities.test_massless_rollers_beside_contacts import ways
from tests.sensitivities.test_massless_rollers_under_loads import LIFT
from tests.sensitivities.test_true_events import true


def loaded(case, height=0.05):
    """The case with loads that follow the motion."""
    effects = (replace(e, loads="dynamic", height=height) if isinstance(e, Contact) else e for e in case.effects)
    return replace(case, effects=tuple(effects))


HIGH = Contact(law="coulomb", friction=(0.5, 0.45), static_friction=(0.6, 0.55), loads="dynamic", height=0.25)
SOFT = Bearings(roller_coulomb=0.002, roller_break_away=0.003)
LIFTED = Case("massless", vehicle=TALL, effects=(HIGH, SOFT, LIFT), start=STARTING, duration=0.23)
# Modes are those of the contact and of its roller: "s" sticks, "m" moves, the contact first.
CASES = {name: (loaded(case), names[0], seen) for name, (case, names, seen) in static.CASES.items()}
LET_GO, GIVES_WAY = "a contact that stands lets go", "a roller that turns gives way to one that stands"
IN_BOTH = ("break-aways with a jump, and a wheel that stands", "a roller that stands lets go, then its contact",
           "switches", "axles stop and stick")  # fmt: skip


def assert_true(case, name, seen):
    run = case.run(sensitivities=(name,), accuracy=1e-13)
    wanted, log = true(case, name)
    assert log and seen <= ways(run)
    assert np.abs(derivative(run, name) - wanted).max() <= 1e-9 * np.abs(wanted).max()
    return run


def test_where_rollers_let_go_and_contacts_come_to_rest_beside_others_in_corners():
    """Rates are no linear function of the force that brings a slip to rest."""
    assert_true(replace(loaded(static.SLIPPING), duration=0.021), "height", {"ms mm", "mm sm"})


@pytest.mark.long
@pytest.mark.parametrize("case, name, seen", [CASES[LET_GO], CASES[GIVES_WAY]],
                         ids=["a contact lets go", "its roller stands then"])  # fmt: skip
def test_they_are_the_differences_of_runs_in_40_digits(case, name, seen):
    assert_true(case, name, seen)


@pytest.mark.long
def test_where_rollers_break_away_and_a_load_vanishes_and_comes_back_they_are():
    run = assert_true(LIFTED, "mass", {"ms mm", "sm mm", "sm ms"})
    assert np.diff(Motion(run).contacts.carries.astype(int), axis=0).ravel().tolist().count(-1) == 1


@pytest.mark.long
@pytest.mark.parametrize("name", IN_BOTH)
def test_c_gives_what_python_gives(name, monkeypatch):
    case, names, seen = static.CASES[name]
    own, difference = apart(loaded(case), (*names, "height"), monkeypatch)
    assert difference <= BOUND["massless"] and seen <= ways(own)


@pytest.mark.long
def test_a_contact_lets_go_whose_roller_stands_then_in_c_as_in_python(monkeypatch):
    case, name, seen = CASES[GIVES_WAY]
    with monkeypatch.context() as context:
        refuse_python(context)
        assert case.run(sensitivities=(name,)).followed.compiled is not None
    own, difference = apart(case, (name,), monkeypatch)
    assert difference <= BOUND["massless"] and seen <= ways(own)


@pytest.mark.long
def test_it_does_in_random_scenes(monkeypatch):
    """Some in which much happens."""
    found = set()
    for seed in (5, 9, 11, 21, 23):
        case = loaded(in_series_at_random(seed), (0.03, 0.06, 0.12)[seed % 3])
        own, difference = apart(case, (*IN_SERIES, "height"), monkeypatch)
        assert difference <= BOUND["massless"], seed
        found |= ways(own)
    assert {"ms mm", "mm ms", "mm sm", "sm mm", "sm ss"} <= found


@pytest.mark.long
def test_backwards_and_in_the_steps_of_a_session_they_are_the_same():
    assert_the_same_backwards_and_in_sessions(loaded(static.SLIPPING))


def test_a_slip_beside_a_run_that_starts_without_it_has_none_where_rollers_turn_on_contacts_that_slip():
    """Rates are no linear function of the force that takes it away."""
    nu = (1.0, 0.3, 0.8)
    plain = Motion(Case("massless", start={"nu": nu}, duration=1e-3).run()).plain
    rolling = plain.wheel_speeds(np.array(nu))
    rates = (float(rolling[0]), -2.0, 1.0)
    ground = replace(static.HELD, wheel_rates=rates, loads="dynamic", height=0.05)
    case = Case("massless", effects=(ground, Bearings(roller_coulomb=0.002)), start={"nu": nu}, duration=1e-3)
    motion = Motion(case.run(sensitivities=("mass",), accuracy=1e-9))
    assert motion.contacts.sticks[0].tolist() == [True, False, False] and motion.massless.modes[0].all()
    with pytest.raises(NoDerivativeError, match="slips beside the run that sticks") as error:
        case.run(sensitivities=("wheel_rates[0]",), accuracy=1e-9)
    assert error.value.t == 0 and error.value.wheels == (0,)


def test_there_is_none_where_a_roller_stops_in_a_fold():
    """Scene 409: nothing comes to its bound there; the solution in which the roller turns ends."""
    vehicle, options = scene(409)
    with pytest.raises(NoDerivativeError, match="a roller stops in a fold") as error:
        simulate(vehicle, duration=0.006, sensitivities=("mass",), **options)
    run = simulate(vehicle, duration=0.006, **options)
    modes = Motion(run).massless.modes.reshape(len(run), -1)
    stops = np.argwhere((modes[:-1] != 0) & (modes[1:] == 0) & (np.abs(run.contact_spin[:-1]) > 0.01))
    assert [(run.t[row], wheel) for row, wheel in stops] == [(error.value.t, *error.value.wheels)]

"""Deviations followed in C against the reference in Python, where axles and rollers come to rest, stick and break away
beside wheels that may slip under smooth laws."""

from collections import Counter

import numpy as np
import pytest

from omniroll import Bearings, Contact, OmnirollError, Torque, TorqueTable
from omniroll.engine import sensitivities
from omniroll.engine.axle_deviations import AxleDeviations
from omniroll.engine.contact_deviations import ContactDeviations
from omniroll.engine.massless_deviations import MasslessDeviations
from omniroll.engine.motion import Motion
from omniroll.engine.roller_deviations import RollerDeviations
from tests.sensitivities import test_axles_on_the_ground as axles
from tests.sensitivities import test_massless_rollers as massless
from tests.sensitivities import test_rollers_on_the_ground as rollers
from tests.sensitivities.differences import SPINS, Case, sticking_at_random
from tests.sensitivities.test_compiled import runs_in_c_and_python

# Of the largest derivative. Free rollers in contact are light, so that their speeds decay within steps; what rounding
# does to these equations came to 4e-12 in one scene without an event.
BOUND = {"massless": 1e-12, "free": 1e-10}
REGULARISED = {"law": "regularised", "friction": (0.3, 0.4), "speed": 0.05}
NAMES = ("nu[0]", "chi[1]", "mass", "wheel_radius", "wheel_inertia", "yaw_scale", "torque[1][1]")
OF_AXLES, OF_ROLLERS = ("wheel_coulomb[1]", "wheel_break_away"), ("roller_coulomb[1]", "roller_break_away")
OF_SPINS = ("spins[1][2]", "roller_inertia", *OF_ROLLERS)
# Model, ground, which bearings, how long (s), further numbers.
KINDS = {
    "massless, axles": ("massless", {"coefficient": 20.0}, "wheel", 1.0, OF_AXLES),
    "massless, rollers": ("massless", {"coefficient": 20.0}, "roller", 0.8, ("coefficient", *OF_ROLLERS)),
    "massless, rollers, regularised": ("massless", REGULARISED, "roller", 0.5, ("speed", *OF_ROLLERS)),
    "massless, both": ("massless", {"coefficient": 20.0}, "both", 0.5, (*OF_AXLES, *OF_ROLLERS)),
    "free, rollers": ("free", {"coefficient": 15.0}, "roller", 0.05, OF_SPINS),
    "free, all, friction": ("free", REGULARISED, "both", 0.03, ("roller_viscous", *OF_AXLES, *OF_SPINS)),
}


def at_random(kind, seed):
    """The paper's vehicle, of which some bearings stick; it starts near joints, and is driven more and more."""
    model, law, which, duration, _ = KINDS[kind]
    random = np.random.default_rng(seed)
    numbers = sticking_at_random(random, which, 0.05)
    if model == "massless" and which != "wheel":  # as heavy as the ground's torque on a roller that sticks
        numbers |= {name: 15 * numbers[name] for name in ("roller_coulomb", "roller_break_away")}
        numbers.pop("roller_viscous", None)
    push = TorqueTable((0.0, 0.5 * duration, duration), 0.3 * random.uniform(-1, 1, (3, 3)) * [[0], [1], [1]])
    start = {"nu": random.uniform(-0.8, 0.8, 3), "chi": random.choice([-1, 1], 3) * random.uniform(0.61, 0.627, 3)}
    ground = Contact(**law) if seed % 2 else Contact(**law, wheel_rates=0.0)
    start |= {"spins": SPINS * random.uniform(0, 2) * (seed % 3 > 0)} if model == "free" else {}
    return Case(model, effects=(ground, Bearings(**numbers), push), start=start, duration=duration)


def count(found, modes):
    """Add how often bearings come to rest and break away from step to step, by their modes (S, ...)."""
    found["rests"] += int(((modes[:-1] != 0) & (modes[1:] == 0)).sum())
    found["breaks"] += int(((modes[:-1] == 0) & (modes[1:] != 0)).sum())


def happened(run):
    """How often bearings have come to rest and have broken away, and wheels have switched."""
    motion, found = Motion(run), Counter(switches=len(run.switches))
    for own in (motion.axles, motion.rollers):
        if own is not None:
            count(found, own.of_steps)
    if motion.massless is not None:
        count(found, motion.massless.modes[run.step_rows])
    return found


def between_rows(run, names, duration):
    """{(number, part): derivatives at some times}."""
    times, parts = np.linspace(0, duration, 17), ("nu", "pose") + (("spins",) if run.spins is not None else ())
    return {(name, part): getattr(run.sensitivity(name, times), part) for name in names for part in parts}


def apart(case, names, monkeypatch):
    """The run with its derivatives in C, and by how much these and Python's are apart, in the rows and between them, of
    the largest one. A speed of the start deviates by 1 until a bearing takes that away: what is left is known to a
    rounding of 1."""
    own, reference = runs_in_c_and_python(case, names, monkeypatch)
    one, other = own.followed.rows, reference.followed.rows
    sizes, found = np.abs(other).max(axis=(0, 1)), [np.abs(one - other).max(axis=(0, 1))]
    known = np.finfo(float).eps / BOUND[case.roller_model]
    sizes = np.maximum(sizes, [name.startswith("spins") * known for name in names])
    sizes, read = dict(zip(names, np.where(sizes > 0, sizes, 1), strict=True)), between_rows(own, names, case.duration)
    with monkeypatch.context() as context:
        context.setattr(sensitivities, "library_of", lambda motion: None)
        wanted = between_rows(reference, names, case.duration)
    assert reference.followed.compiled is None
    between = [np.abs(read[key] - wanted[key]).max() / sizes[key[0]] for key in wanted]
    return own, max((np.array(found) / list(sizes.values())).max(), *between)


def noted(monkeypatch):
    """How often each class's methods have passed something in Python from now on."""
    found = Counter()

    def counting(own):
        def passed(self, *given):
            found[type(self)] += 1
            return own(self, *given)

        return passed

    passing = (
        (AxleDeviations, ("passed",)),
        (RollerDeviations, ("passed", "turned")),
        (MasslessDeviations, ("passed",)),
        (ContactDeviations, ("passed",)),
    )
    for kind, names in passing:
        for name in names:
            monkeypatch.setattr(kind, name, counting(getattr(kind, name)))
    return found


CASES = {f"axles, {name}": found[:2] for name, found in axles.CASES.items()}
CASES |= {f"rollers, {name}": found for name, found in rollers.CASES.items()}
CASES |= {f"massless, {name}": found[:2] for name, found in massless.CASES.items()}


@pytest.mark.long
@pytest.mark.parametrize("case, names", CASES.values(), ids=CASES)
def test_it_gives_what_the_reference_gives_and_passes_what_happens(case, names, monkeypatch):
    names = tuple(dict.fromkeys((*names, "nu[2]", "mass", "wheel_radius")))
    case.run(sensitivities=names)
    with monkeypatch.context() as context:
        left = noted(context)
        case.run(sensitivities=names)
        assert not left
    assert apart(case, names, monkeypatch)[1] <= BOUND[case.roller_model]


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_random_scenes_too(kind, monkeypatch):
    """Seven of each kind; what happens in them is asked for all of them together."""
    names, found, count = NAMES + KINDS[kind][-1], Counter(), 0
    for seed in range(30):
        case = at_random(kind, seed)
        try:
            own, difference = apart(case, names, monkeypatch)
        except OmnirollError:  # it tips, or something only just happens
            continue
        assert difference <= BOUND[case.roller_model], seed
        found += happened(own)
        count += 1
        if count == 7:
            break
    assert count == 7 and found["rests"] >= 7 and found["breaks"] + found["switches"] >= 2, found


@pytest.mark.long
def test_slips_of_massless_rollers_that_stick_have_as_many_nodes_as_in_python(monkeypatch):
    """They decay within the steps of a run at 1e-11: with fewer nodes this one was 1.6e-10 off."""
    bearings = Bearings(
        roller_coulomb=0.00215, roller_break_away=0.00328, wheel_coulomb=0.0344, wheel_break_away=0.0689
    )
    ground = Contact(law="regularised", friction=(0.3, 0.4), speed=0.0122)
    start = {"nu": (0.38, 0.1, 0.26), "chi": (-0.615, -0.62, 0.619)}
    case = Case("massless", effects=(ground, bearings, Torque((0.127, -0.072, 0.179))), start=start, duration=0.4)
    names = ("nu[0]", "mass", "wheel_radius", "wheel_inertia", "speed", "wheel_coulomb[1]", *OF_ROLLERS)
    own = case.run(sensitivities=names, accuracy=1e-11)
    assert own.followed.compiled is not None
    monkeypatch.setattr(sensitivities, "library_of", lambda motion: None)
    wanted = case.run(sensitivities=names, accuracy=1e-11).followed.rows
    largest = np.abs(wanted).max(axis=(0, 1))
    assert (np.abs(own.followed.rows - wanted).max(axis=(0, 1)) <= 1e-12 * largest).all()

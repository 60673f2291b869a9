"""Deviations followed in C against the reference in Python, where axles and rollers come to rest, stick and break away
beside contacts that do, under Coulomb's friction on the ground."""

from collections import Counter

import numpy as np
import pytest

from omniroll import Bearings, Contact, Motor, OmnirollError, TorqueTable, simulate
from omniroll.engine import sensitivities
from omniroll.engine.contact_deviations import ContactDeviations
from omniroll.engine.motion import Motion
from omniroll.engine.standing_deviations import StandingDeviations
from tests.sensitivities import test_bearings_beside_contacts as beside
from tests.sensitivities import test_massless_rollers_beside_contacts as series
from tests.sensitivities import test_standing_wheels as standing
from tests.sensitivities.costs import AXLES, COULOMB, HELD_LONGER, MOTOR, ROLLERS, task
from tests.sensitivities.differences import SPINS, Case, sticking_at_random
from tests.sensitivities.test_compiled import far_from_rest, runs_in_c_and_python

CASES = {f"standing, {name}": own for name, own in standing.CASES.items()}
CASES |= {f"beside, {name}": own for name, own in (beside.CASES | beside.UNDETERMINED).items()}
CASES |= {f"in series, {name}": (case, names) for name, (case, names, _) in series.CASES.items()}
# Of the largest derivative. Where the contact of a free roller begins to slip, the direction of the slip is known to a
# rounding of 1 m/s over the slip, in a short step to 1e-9, and so is what its derivative does: there Python itself
# comes to 3e-11 with 20 nodes in a step where it has 16.
BOUND = {"massless": 1e-12, "free": 1e-10}
STATIC = {"law": "coulomb", "friction": (0.2, 0.3)}
NAMES = ("nu[0]", "chi[1]", "mass", "wheel_radius", "wheel_inertia", "friction[1]")
OF_AXLES, OF_ROLLERS = ("wheel_coulomb[1]", "wheel_break_away"), ("roller_coulomb[1]", "roller_break_away")
OF_SPINS = ("spins[1][2]", "roller_inertia", *OF_ROLLERS)
# Model, further numbers of the ground, which bearings, how long (s), further numbers.
KINDS = {
    "massless, axles": ("massless", {}, "wheel", 0.6, OF_AXLES),
    "free, axles": ("free", {}, "wheel", 0.1, ("roller_inertia", *OF_AXLES)),
    "free, rollers": ("free", {}, "roller", 0.03, OF_SPINS),
    "free, all, friction": ("free", {}, "both", 0.03, ("roller_viscous", *OF_AXLES, *OF_SPINS)),
}
IN_SERIES = ("nu[0]", "chi[1]", "mass", "wheel_radius", "friction[1]", "roller_coulomb[1]", "roller_break_away")


def in_series_at_random(seed):
    """The paper's vehicle with massless rollers that stick, of which each takes another torque, beside axles in one of
    three scenes; not driven, driven more and more, or by motors."""
    random = np.random.default_rng(seed)
    slides, duration = 10.0 ** random.uniform(-3, -1.2, 3), (0.02, 0.05)[seed % 2]
    numbers = {"roller_coulomb": slides.tolist(), "roller_break_away": (slides * random.uniform(1.1, 1.6, 3)).tolist()}
    if seed % 3 == 1:
        numbers |= sticking_at_random(random, "wheel", 0.1)
    push = TorqueTable((0.0, 0.5 * duration, duration), 0.9 * random.uniform(-1, 1, (3, 3)) * [[0], [1], [1]])
    motor = Motor(tuple(random.uniform(-6, 6, 3)), torque_constant=0.02, resistance=1.5, gear_ratio=4)
    drive = ((), (push,), (motor,))[seed % 4 % 3]
    start = {"nu": random.uniform(-0.6, 0.6, 3), "chi": random.choice([-1, 1], 3) * random.uniform(0.1, 0.627, 3)}
    rates = {"wheel_rates": random.uniform(-4, 4, 3)} if seed % 2 else {}
    ground = Contact(law="coulomb", friction=(0.3, 0.25), static_friction=(0.4, 0.35) if seed % 5 else None, **rates)
    return Case("massless", effects=(ground, Bearings(**numbers), *drive), start=start, duration=duration)


def at_random(kind, seed):
    """The paper's vehicle, of which some bearings stick; it starts near joints, and is driven more and more, or by
    motors."""
    model, further, which, duration, _ = KINDS[kind]
    random = np.random.default_rng(seed)
    numbers = sticking_at_random(random, which, 0.1)
    push = TorqueTable((0.0, 0.5 * duration, duration), 0.6 * random.uniform(-1, 1, (3, 3)) * [[0], [1], [1]])
    start = {"nu": random.uniform(-0.8, 0.8, 3), "chi": random.choice([-1, 1], 3) * random.uniform(0.61, 0.627, 3)}
    rates = {"wheel_rates": random.uniform(-4, 4, 3)} if seed % 2 else {}
    ground = Contact(**STATIC, static_friction=(0.25, 0.35) if seed % 3 else None, **further, **rates)
    start |= {"spins": SPINS * random.uniform(0, 2) * (seed % 4 > 0)} if model == "free" else {}
    return Case(model, effects=(ground, Bearings(**numbers), push), start=start, duration=duration)


def happened(run):
    """How often contacts and bearings have come to rest and have let go, and wheels have switched."""
    motion = Motion(run)
    found = Counter(switches=len(run.switches), steps=len(run.step_rows))
    moves = [(run.step_rows, ~motion.contacts.sticks)]
    for own in (motion.axles, motion.rollers):
        if own is not None:
            moves.append((run.step_rows, own.modes.reshape(len(run), -1) != 0))
    for kind, (rows, moving) in zip(("contact", "bearing", "bearing"), moves, strict=False):
        before, after = moving[rows[:-1]], moving[rows[1:]]
        found[f"{kind} rests"] += int((before & ~after).sum())
        found[f"{kind} breaks"] += int((~before & after).sum())
    return found


def passes_rest(run):
    """Whether a slip comes to rest and goes on at once: its derivative there depends on the nodes, in Python, too."""
    motion = Motion(run)
    ends = 1 + np.flatnonzero(motion.starts_step[:-1])
    slides, slip = motion.contacts.slides, np.linalg.norm(run.slip, axis=-1)
    ends = ends[ends < len(run) - 1]
    return bool((slides[ends] & slides[ends + 1] & slides[ends - 1] & (slip[ends] < 1e-12)).any())


def apart(case, names, monkeypatch):
    """The run with its derivatives in C, and by how much these and Python's are apart of the largest one: in rows that
    are far from a rest, at the end, and between rows."""
    own, reference = runs_in_c_and_python(case, names, monkeypatch)
    one, other, far = own.followed.rows, reference.followed.rows, far_from_rest(own)
    sizes = np.abs(other).max(axis=(0, 1))
    sizes = np.where(sizes > 0, sizes, 1.0)
    found = [(np.abs(one - other)[rows].max(axis=1) / sizes).max(initial=0.0) for rows in (far, -1 + np.zeros(1, int))]
    x = np.linspace(0.1, 0.9, 3)[:, None]
    first = own.step_rows[np.flatnonzero(far[own.step_rows] & far[own.step_rows + 1])]
    times = (own.t[first] + x * (own.t[first + 1] - own.t[first])).T.ravel()
    read = [[getattr(own.sensitivity(name, times), part) for part in ("nu", "pose")] for name in names]
    with monkeypatch.context() as context:
        context.setattr(sensitivities, "library_of", lambda motion: None)
        wanted = [[getattr(reference.sensitivity(name, times), part) for part in ("nu", "pose")] for name in names]
    assert reference.followed.compiled is None
    between = [np.abs(a - b).max() / size for row, other, size in zip(read, wanted, sizes, strict=True)
               for a, b in zip(row, other, strict=True)]  # fmt: skip
    return own, max(*found, *between)


@pytest.mark.long
@pytest.mark.parametrize("case, names", CASES.values(), ids=CASES)
def test_it_gives_what_the_reference_gives(case, names, monkeypatch):
    names = tuple(dict.fromkeys((*names, "nu[2]", "mass", "wheel_radius")))
    assert apart(case, names, monkeypatch)[1] <= BOUND[case.roller_model]


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_random_scenes_too(kind, monkeypatch):
    """Five of each kind; what happens in them is asked for all of them together."""
    names, found, count = NAMES + KINDS[kind][-1], Counter(), 0
    for seed in range(20):
        case = at_random(kind, seed)
        try:
            if passes_rest(case.run()):
                continue
            own, difference = apart(case, names, monkeypatch)
        except OmnirollError:  # it tips, or something only just happens
            continue
        assert difference <= BOUND[case.roller_model], seed
        found += happened(own)
        count += 1
        if count == 5:
            break
    assert count == 5 and found["contact rests"] + found["bearing rests"] >= 4, found
    assert found["contact breaks"] + found["bearing breaks"] >= 4, found


@pytest.mark.long
def test_massless_rollers_that_stick_in_random_scenes(monkeypatch):
    """Thirty of them; what happens is asked for all together."""
    found, count = Counter(), 0
    for seed in range(50):
        case = in_series_at_random(seed)
        try:
            if passes_rest(case.run()):
                continue
            own, difference = apart(case, IN_SERIES, monkeypatch)
        except OmnirollError:  # something only just happens
            continue
        assert difference <= BOUND["massless"], seed
        found.update(series.ways(own))
        count += 1
        if count == 30:
            break
    assert count == 30 and {"ms mm", "mm ms", "mm sm", "sm mm", "ms ss", "sm ss"} <= found.keys(), found


def refuse_python(monkeypatch):
    """Nothing that happens to contacts and bearings may be left to Python."""

    def refused(*_):
        raise AssertionError("left to Python")

    for kind, name in ((ContactDeviations, "passed"), (StandingDeviations, "passed"), (StandingDeviations, "turned")):
        monkeypatch.setattr(kind, name, refused)


TIMES = np.linspace(0, 0.15, 4)
SWINGS = TorqueTable(TIMES, np.array([[-1.0], [1.0], [-1.0], [1.0]]) * [0.3, -0.2, 0.12])
TURNS_BACK = {  # further numbers of the ground, bearings, whether another contact lets go with one that turns back
    "contacts": ({}, (), True),
    "axles": ({}, (Bearings(wheel_coulomb=1e-2),), False),
    "rollers": ({}, (Bearings(roller_coulomb=3e-3, roller_break_away=4e-3),), True),
}


@pytest.mark.long
@pytest.mark.parametrize("which", TURNS_BACK)
def test_contacts_of_massless_rollers_that_turn_back_are_passed_in_c(which, monkeypatch):
    """Torques swing, and slips along the rolling direction with them, through zero: by two derivations, since Python
    lets the contact rest in between."""
    further, bearings, go = TURNS_BACK[which]
    ground = Contact(
        law="coulomb", friction=(0.1, 0.08), static_friction=(0.12, 0.1), wheel_rates=(6.0, -4.0, 3.0), **further
    )
    case = Case("massless", effects=(ground, *bearings, SWINGS), start={"nu": (0.4, 0.2, -0.3)}, duration=TIMES[-1])
    names = ("nu[0]", "chi[1]", "mass", "friction[1]", "wheel_rates[1]")
    with monkeypatch.context() as context:
        refuse_python(context)
        assert case.run(sensitivities=names).followed.compiled is not None
    own, difference = apart(case, names, monkeypatch)
    contacts, between = Motion(own).contacts, ~Motion(own).starts_step[:-1]
    one_way = contacts.slides & ~contacts.turning
    turned = one_way[:-1] & one_way[1:] & (np.diff(np.sign(np.sin(contacts.headings)), axis=0) != 0)
    lets_go = (contacts.sticks[:-1] & ~contacts.sticks[1:]).any(axis=1)
    assert turned[between].sum() >= 4 and (turned.any(axis=1) & lets_go)[between].any() == go
    assert difference <= BOUND["massless"]


def test_massless_rollers_that_stick_are_passed_in_c(monkeypatch):
    """Wheels roll until their rollers stop; of the last two, which do so together, one holds what the other does."""
    refuse_python(monkeypatch)
    case = Case("massless", effects=(COULOMB, HELD_LONGER), start={"nu": (1.0, 0.3, 0.8)}, duration=0.8)
    run = case.run(sensitivities=("mass", "roller_coulomb[1]"), accuracy=1e-9)
    motion = Motion(run)
    modes = motion.massless.modes
    assert run.followed.compiled is not None and motion.contacts.sticks.all() and not modes[-1].any()
    assert ((modes[:-1] != 0) & (modes[1:] == 0)).sum(axis=1).max() == 2


@pytest.mark.long
@pytest.mark.parametrize("name", series.CASES)
def test_so_is_all_that_is_held_to_40_digits(name, monkeypatch):
    refuse_python(monkeypatch)
    case, names, seen = series.CASES[name]
    run = case.run(sensitivities=names)
    assert run.followed.compiled is not None and seen <= series.ways(run)


@pytest.mark.long
def test_so_is_what_happens_under_a_drive(monkeypatch):
    refuse_python(monkeypatch)
    run = simulate(**task("in series, coulomb, skid, torque"))
    assert run.followed.compiled is not None
    assert {"ms mm", "mm ms", "mm sm", "sm mm", "ms ss", "sm ss", "ss ms"} <= series.ways(run)


@pytest.mark.long
@pytest.mark.parametrize("model, bearings", [("massless", AXLES), ("free", ROLLERS)], ids=["axles", "rollers"])
def test_what_happens_beside_motors_is_passed_in_c(model, bearings, monkeypatch):
    """Axles turn back while their contacts stick; contacts of free rollers come to rest and let go beside these."""
    refuse_python(monkeypatch)
    run = Case(model, effects=(COULOMB, bearings, MOTOR), duration=0.3).run(sensitivities=("mass",))
    motion = Motion(run)
    assert run.followed.compiled is not None
    sticks = motion.contacts.sticks
    assert (sticks[1:] != sticks[:-1]).any() or motion.axles is not None
    own = motion.axles if motion.rollers is None else motion.rollers
    assert (own.modes[1:] != own.modes[:-1]).any()

"""Accelerations, forces and rates of the slip of wheels that may slip, in all modes of contacts and bearings, against
rigid bodies that know none (moving_bodies.py): the forces that are found make the bodies move as the kernel says, obey
the laws, and leave at rest what rests."""

from dataclasses import replace

import numpy as np
import pytest
from mecanum.all_bodies import along_motion, mass_matrix
from oracle.directions import directions_allowed

import omniroll
from contact.moving_bodies import CLOSE, moving, named
from omniroll.effects.effect_set import EffectSet
from omniroll.results.accelerations import call_named

MODELS = ("massless", "free")
DAMPING, FRICTION, LOAD, SPEED = np.array([3.7, 1.9]), np.array([0.7, 0.3]), 8.5, 0.02
BEARINGS = {"axles": ("axle_sticking",), "rollers": ("roller_sticking",), "both": ("roller_sticking", "axle_sticking")}
GRAVITY, ANGLE, DIRECTION = 9.81, 0.2, 1.1  # of a slope
PULL = GRAVITY * np.sin(ANGLE) * np.array([np.cos(DIRECTION), np.sin(DIRECTION), 0])
NORMAL = GRAVITY * np.cos(ANGLE)


def viscous(slip):
    return -DAMPING * slip


def regularised(slip, load=LOAD):
    size = np.sqrt(((FRICTION * slip) ** 2).sum(axis=1) + FRICTION.prod() * SPEED**2)
    return -np.reshape(load, (-1, 1)) * FRICTION**2 * slip / size[:, None]


def coulomb(slip):
    size = np.sqrt(((FRICTION * slip) ** 2).sum(axis=1))
    return -LOAD * FRICTION**2 * slip / np.where(size > 0, size, 1)[:, None]


LAWS = {
    "viscous": (viscous, {"ground_damping": tuple(DAMPING)}),
    "regularised": (
        regularised, {"contact_load": LOAD, "ground_friction": tuple(FRICTION), "ground_fade_speed": SPEED}
    ),
    "coulomb": (coulomb, {}),
}  # fmt: skip


def fading(torque, fade, speed):
    return -torque * speed / np.sqrt(speed**2 + fade**2)


def of_others(case, draw):
    """Names and numbers of all further effects, what drives have beside a torque, and the torques on wheels and on
    rollers, and the weight, that they mean. Where massless rollers rub they slip: that is asked below."""
    each = draw.uniform(0.5, 1, (4, case.count)) * [[0.01], [0.02], [1e-5], [1e-4]]
    effects = ("motor", "axle_viscous", "axle_coulomb", "slope")
    numbers = {"axle_damping": tuple(each[0]), "axle_torque": tuple(each[1]), "axle_fade_speed": 0.3,
               "gravity": GRAVITY, "slope_angle": ANGLE, "slope_direction": DIRECTION, "torque_constant": 0.03,
               "resistance": 2.0, "motor_gear_ratio": 10.0, "back_emf": 0.03, "current_limit": 5.0}  # fmt: skip
    rates, damping = case.rates[case.wheels], draw.uniform(0, 0.01, case.count)
    spins = np.append(case.rates[case.contacts][:, None], case.rates[case.frees].reshape(case.count, -1), axis=1)
    on_wheels = -(damping + each[0]) * rates + fading(each[1], 0.3, rates)
    on_rollers = -each[2][:, None] * spins + fading(each[3][:, None], 0.2, spins)
    if case.model == "free":
        effects += ("roller_viscous", "roller_coulomb")
        numbers |= {"roller_damping": tuple(each[2]), "roller_torque": tuple(each[3]), "roller_fade_speed": 0.2}
    return effects, numbers, damping, (on_wheels, on_rollers * (case.model == "free"), PULL)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("kind", ["omni", "mecanum", "rows"])
def test_contacts_of_wheels_of_each_kind_beside_all_other_effects(kind, law, model):
    """Every second contact sticks under Coulomb's law. Rollers at angles and two rows go with fewer effects. A massless
    roller slips across its axis by what its bearing takes: beside friction there its slip is the kernel's."""
    sizes = {"omni": (3, 5), "mecanum": (4, 7), "rows": (5, 8)}[kind]
    case, draw, (force_of, constants) = moving(kind, 3, *sizes, model), np.random.default_rng(7), LAWS[law]
    sticks = (np.arange(case.count) % 2 == 0) & (law == "coulomb")
    case, effects, acting = case.rolling(sticks), ("contact", f"contact_{law}"), (0, 0, (0, 0, 0))
    torque = np.linspace(-1, 2, case.count)
    known = case.known() | {"torque": torque, "sticks": sticks.astype(float)}
    if kind == "omni":
        others, numbers, known["damping"], acting = of_others(case, draw)
        effects, constants = effects + others, constants | numbers
    bound = case.bound(effects, **constants)
    if "slip_roller_rates" in bound.signatures:
        known |= {"roller_drag": named(bound, "slip_roller_rates", known)["roller_drag"]}
    slip = case.slip(case.q, case.rates).real
    known["ground_push"] = force_of(slip) * ~sticks[:, None]
    told = named(bound, "slip_forces", known)
    assert np.abs(told["slip"] - slip).max() <= CLOSE * np.abs(slip).max()
    found = named(bound, "ground_dynamics" if law == "coulomb" else "slip_dynamics", known)
    force = found.get("ground_force", told["ground_force"])
    assert np.abs(force - force_of(slip))[~sticks].max() <= CLOSE * np.abs(force).max()
    on_wheels, on_rollers, pull = acting
    second = case.second(force, torque + on_wheels, on_rollers, gravity=pull)
    case.assert_moves(found, *second, sticks=np.flatnonzero(sticks))
    if kind != "omni":
        energy = case.rates @ case.mass @ case.rates / 2
        asked = known | {"axial": case.axial(case.q, case.rates)[:, 1:].real}
        assert call_named(bound, "slip_energy", asked) == pytest.approx(energy, rel=1e-12)


# ---- bearings that stick ---------------------------------------------------------------------------------------------


def rollers_of(case):
    """(N, n) their places, that in contact first."""
    return np.append(np.array(case.contacts)[:, None], np.reshape(case.frees, (case.count, -1)), axis=1)


def laid_down(case, sticks, stands, stuck):
    """The state in which these contacts (N,), axles (N,) and rollers (N, n) are at rest."""
    unit, places, contacts = np.eye(case.bodies.size), np.array(case.wheels), case.rows(case.q).real
    rows = contacts[sticks].reshape(-1, case.bodies.size)
    rows = np.vstack([rows, contacts[:, 0]]) if case.model == "massless" else rows  # never slip across their axes
    return case.at_rest(np.vstack([rows, unit[places[stands]], unit[rollers_of(case)[stuck]]]))


def modes_as_numbers(sticks, stands, stuck):
    """As the kernels take them."""
    found = {"sticks": sticks, "axle_sticks": stands, "contact_sticks": stuck[:, 0], "free_sticks": stuck[:, 1:]}
    return {name: value.astype(float) for name, value in found.items()}


def where_wheels_stand(case, sticks, stands, stuck):
    """(N, 2) bool, along axles and rolling directions, and those directions as velocities by nu; what the kernels take
    of the motions that they leave."""
    where = sticks[:, None] & np.stack([stuck[:, 0], stands], axis=1)
    by_nu = [case.nu(case.q, unit).real for unit in np.eye(case.bodies.size)[:3]]
    rows = (case.rows(case.q).real[..., :3] @ np.linalg.inv(np.transpose(by_nu)))[where]
    directions = directions_allowed(rows, np.eye(3)) if len(rows) else np.eye(3)
    return where, rows, {"directions": directions.ravel(), "absent": (~directions.any(axis=0)).astype(float)}


def function_of(model, law, bearings):
    if law == "coulomb":
        return "standing_dynamics" if bearings == "axles" else "bearing_dynamics"
    return "disk_dynamics" if model == "free" and bearings != "axles" else "slip_dynamics"


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("law, model, bearings", [
    *((law, "free", bearings) for law in LAWS for bearings in BEARINGS), ("coulomb", "massless", "axles"),
])  # fmt: skip
def test_contacts_axles_and_rollers_that_stick_stay_at_rest(law, model, bearings, seed):
    """In modes by chance; of the forces on wheels that stand those of least norm are taken."""
    draw, count = np.random.default_rng([seed, len(law), len(bearings)]), (2, 3, 5)[seed]
    case, (force_of, constants) = moving("omni", seed, count, 5, model), LAWS[law]
    sticks = (draw.random(count) < 0.6) & (law == "coulomb")
    stands, stuck = (draw.random(count) < 0.6) & (bearings != "rollers"), draw.random((count, 5)) < 0.6
    stuck &= bearings != "axles"
    case = laid_down(case, sticks, stands, stuck)
    where, rows, directions = where_wheels_stand(case, sticks, stands, stuck)
    turning, spinning = draw.normal(size=count) * ~stands, 0.01 * draw.normal(size=(count, 5)) * ~stuck
    turning, spinning = turning * (bearings != "rollers"), spinning * (bearings != "axles")
    slip, torque = case.slip(case.q, case.rates).real, draw.normal(size=count)
    known = case.known() | directions | modes_as_numbers(sticks, stands, stuck)
    known |= {"torque": torque, "bearing_torque": turning, "contact_bearing": spinning[:, 0],
              "free_bearing": spinning[:, 1:], "ground_push": force_of(slip) * ~sticks[:, None]}  # fmt: skip
    bound = case.bound(("contact", f"contact_{law}", *BEARINGS[bearings]), **constants)
    found = named(bound, function_of(model, law, bearings), known)
    force = found.get("ground_force", named(bound, "slip_forces", known)["ground_force"])
    assert np.abs(force - force_of(slip))[~sticks].max(initial=0) <= CLOSE * np.abs(force).max()
    standing = np.zeros((count, 2))
    if len(rows):
        standing[where] = np.linalg.lstsq(rows.T, found["held_force"], rcond=None)[0]
        assert np.abs(rows.T @ standing[where] - found["held_force"]).max() <= CLOSE * np.abs(found["held_force"]).max()
    rho = case.vehicle.wheel_radius * np.cos(known["chi"]) - case.vehicle.roller_axis_radius
    on_wheels = torque + turning + found.get("axle_holding", 0) - case.vehicle.wheel_radius * standing[:, 1]
    held = np.concatenate([found.get("contact_holding", np.zeros(count))[:, None],
                           found.get("free_holding", np.zeros((count, 4)))], axis=1)  # fmt: skip
    held[:, 0] += rho * standing[:, 0]
    assert not held[~stuck].any()
    rests = [*np.array(case.wheels)[stands], *rollers_of(case)[stuck]]
    moved = case.second(force + standing, on_wheels, spinning + held)
    case.assert_moves(found, *moved, rests=rests, sticks=np.flatnonzero(sticks))


@pytest.mark.parametrize("axles", [False, True])
@pytest.mark.parametrize("law, rubs", [("viscous", False), ("viscous", True), ("regularised", True),
                                       ("regularised", False)])  # fmt: skip
def test_massless_rollers_slip_by_what_their_bearings_take(law, rubs, axles):
    """The ground's force at its slip, times its arm, is what the bearing takes: dry friction, which holds every second
    roller, and viscous friction beside it."""
    count, draw = 4, np.random.default_rng([21, rubs, axles])
    case, (force_of, constants) = moving("omni", 5 + rubs, count, 6, "massless"), LAWS[law]
    stands, stuck = (np.arange(count) < 2) & axles, np.arange(count) % 2 == 0
    case.rates[:] *= 0.1 if law == "viscous" else 0.01
    case.rates[np.array(case.wheels)[stands]] = 0
    case.rates[case.contacts] = 0
    rho = case.vehicle.wheel_radius * np.cos(case.q[case.wheels]) - case.vehicle.roller_axis_radius
    speed = case.slip(case.q, case.rates).real  # of wheels whose rollers all stand
    asked = rho * force_of(speed)[:, 0]
    damping = DAMPING[0] * rho**2 * 10 ** draw.uniform(-1, 1, count) * rubs
    effects = ("roller_sticking", *["roller_viscous"] * rubs, *["axle_sticking"] * axles)
    bound = case.bound(("contact", f"contact_{law}", *effects), **constants,
                       **({"roller_damping": tuple(damping)} if rubs else {}))  # fmt: skip
    known = case.known() | {"torque": draw.normal(size=count), "bearing_torque": np.zeros(count)}
    known |= {"contact_bearing": 0.4 * asked * ~stuck, "contact_sticks": stuck.astype(float)}
    known |= {"axle_sticks": stands.astype(float)}
    told, spins = (named(bound, name, known) for name in ("slip_forces", "slip_spins"))
    case.rates[case.contacts] = spins["contact_spin"]
    slip, force = case.slip(case.q, case.rates).real, told["ground_force"]
    assert np.abs(told["slip"] - slip).max() <= CLOSE * np.abs(speed).max()
    assert np.abs(force - force_of(slip)).max() <= CLOSE * np.abs(force).max()
    assert ((spins["contact_spin"] == 0) == stuck).all() and not spins["contact_holding"][~stuck].any()
    of_rollers = np.zeros((count, 6))
    of_rollers[:, 0] = known["contact_bearing"] + spins["contact_holding"] - damping * spins["contact_spin"]
    assert (of_rollers[:, 0] * spins["contact_spin"] <= 0).all()
    found = named(bound, "slip_dynamics", known)
    moved = case.second(force, known["torque"] + found.get("axle_holding", 0), of_rollers)
    case.assert_moves(found, *moved, rests=np.array(case.wheels)[stands])
    loss = call_named(bound, "slip_contact_loss", known) + np.sum(call_named(bound, "ground_power", known))
    lost = -(of_rollers[:, 0] * spins["contact_spin"]).sum() - (force * slip).sum()
    assert loss == pytest.approx(lost, rel=1e-11)


@pytest.mark.parametrize("count, axles", [(2, True), (3, False), (4, True)])
def test_massless_rollers_beside_contacts_that_stick(count, axles):
    """One contact sticks while its roller turns; one slips and takes a roller along that sticks; at the others both
    give way: a force on the ellipse, against its normal, of which the bearing takes its part."""
    case, draw = moving("omni", 9, count, 6, "massless"), np.random.default_rng([41, count])
    sticks, rigid = np.arange(count) == 1, np.arange(count) == 0
    stands = (np.arange(count) % 2 == 0) & axles
    both = ~sticks & ~rigid
    case.rates[np.array(case.wheels)[stands]] = 0
    case = case.rolling(sticks)
    case.rates[case.contacts] = 0
    rho = case.vehicle.wheel_radius * np.cos(case.q[case.wheels]) - case.vehicle.roller_axis_radius
    speed = case.slip(case.q, case.rates).real
    arc, load = coulomb(speed), np.full(count, LOAD)
    taken = np.where(rigid, 0.0, 0.4 * FRICTION[0] * rho * load * np.sign(arc[:, 0]))
    bound = case.bound(("contact", "contact_coulomb", "roller_sticking", *["axle_sticking"] * axles))
    known = case.known() | where_wheels_stand(case, sticks & False, stands, rigid[:, None])[2]
    known |= modes_as_numbers(sticks, stands, rigid[:, None])
    known |= {"torque": draw.normal(size=count), "load": load, "friction": np.tile(FRICTION, (count, 1)),
              "slip_direction": np.stack([0 * rho, np.sign(speed[:, 1] + 1e-300)], axis=1),
              "contact_bearing": taken, "bearing_torque": np.zeros(count)}  # fmt: skip
    corner = named(bound, "corner_forces", known)
    known["ground_yield"] = np.where(both, corner["corner_yield"], 0.0)
    push = np.where(rigid[:, None], arc, np.stack([0 * rho, corner["corner_force"]], axis=1))
    known["ground_push"] = push * ~sticks[:, None]
    found, told = (named(bound, name, known) for name in ("bearing_dynamics", "slip_forces"))
    case.rates[case.contacts] = found["contact_spin"]
    slip, force = case.slip(case.q, case.rates).real, found["ground_force"]
    assert np.abs(told["slip"] - slip).max() <= CLOSE * np.abs(speed).max()
    assert np.abs(force - coulomb(slip))[~sticks].max() <= CLOSE * LOAD
    assert not found["contact_spin"][rigid].any()
    of_rollers = np.zeros((count, 6))
    of_rollers[:, 0] = taken + found["contact_holding"]
    moved = case.second(force, known["torque"] + found.get("axle_holding", 0), of_rollers)
    case.assert_moves(found, *moved, rests=np.array(case.wheels)[stands], sticks=np.flatnonzero(sticks))


# ---- loads from springs ----------------------------------------------------------------------------------------------


def on_springs(seed, model):
    """A vehicle of four wheels that tilts, whose whole has no product of inertia about horizontal axes; its springs,
    whose numbers are entries of its kinetic energy; and its loads at rest."""
    case = moving("omni", seed, 4, 5, model, tilts=True)
    mass, center, tensor = case.bodies.platform
    level = mass_matrix(case.bodies, np.zeros(case.bodies.size)).real
    tensor = tensor - level[-2, -1] * (1 - np.eye(3)) * np.array([[1, 1, 0], [1, 1, 0], [0, 0, 0]])
    case = replace(case, bodies=replace(case.bodies, platform=(mass, center, tensor)))
    level, whole = mass_matrix(case.bodies, np.zeros(case.bodies.size)).real, case.bodies
    *beside, height = whole.center
    axles = np.stack([np.cos(whole.axles), np.sin(whole.axles)])
    springs = omniroll.Springs(
        height=height, deflection=2e-3, damping_ratio=0.4, normal_gravity=NORMAL,
        tilt_inertia=tuple(np.diag(level)[-2:] - whole.mass * height**2),
        products=tuple(-level[2, -2:] - whole.mass * height * np.array(beside)),
        spin_inertia=tuple((axles * level[-2:, case.wheels]).sum(axis=0)),
    )  # fmt: skip
    sums = np.vstack([np.ones(4), whole.places.T])
    return case, springs, np.linalg.pinv(sums) @ (whole.mass * NORMAL * np.array([1.0, *beside]))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("law", ["regularised", "coulomb"])
@pytest.mark.parametrize("seed", range(4))
def test_loads_of_springs_move_a_vehicle_that_heaves_and_tilts(seed, law, model):
    """Some contacts are off the ground; under Coulomb's law some of the others stick, and roll while it tilts."""
    case, springs, at_rest = on_springs(seed, model)
    draw = np.random.default_rng(seed)
    presses = draw.random(4) < 0.8
    sticks = presses & (draw.random(4) < 0.5) & (law == "coulomb")
    case = case.rolling(sticks)
    contact = omniroll.Contact(law=law, friction=tuple(FRICTION), normal_gravity=NORMAL,
                               speed=SPEED if law == "regularised" else None)  # fmt: skip
    effects = (omniroll.Torque(0.0), omniroll.Slope(ANGLE, DIRECTION, GRAVITY), contact, springs)
    bound = EffectSet.checked(effects, case.vehicle).kernel(case.vehicle, model, "python")
    stiffness = at_rest / springs.deflection
    damping = 2 * springs.damping_ratio * np.sqrt(stiffness * at_rest / NORMAL)

    margins = at_rest - stiffness * case.rises(case.q) - damping * along_motion(case.rises, case.q, case.rates)
    loads, torque, slip = presses * margins.real, draw.normal(size=4), case.slip(case.q, case.rates).real
    force = regularised(slip, loads) if law == "regularised" else coulomb(slip) * presses[:, None]
    known = case.known() | {"torque": torque, "presses": presses.astype(float), "sticks": sticks.astype(float)}
    known["ground_push"] = force * ~sticks[:, None]
    told, state = (named(bound, name, known) for name in ("slip_forces", "support_state"))
    found = named(bound, "sprung_dynamics" if law == "coulomb" else "spring_dynamics", known)
    own = found.get("ground_force", told["ground_force"])
    assert np.abs(told["slip"] - slip).max() <= CLOSE * np.abs(slip).max()
    assert np.abs(own - force)[~sticks].max() <= CLOSE * np.abs(force).max()
    for name, wanted in (("support_loads", loads), ("support_margins", margins.real)):
        assert np.abs(state[name] - wanted).max() <= CLOSE * np.abs(margins).max()
    moved = case.second(own, torque, loads=loads, gravity=PULL + [0, 0, NORMAL])
    case.assert_moves(found, *moved, sticks=np.flatnonzero(sticks))

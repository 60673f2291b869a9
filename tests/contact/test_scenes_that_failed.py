"""Scenes that once stopped, took steps without end or were wrong: each would fail again with its fault."""

import re
from dataclasses import replace

import numpy as np
import pytest
from corpus.replay import LAWS
from hard.ground_anywhere import SEED, missed_on_steep_ground
from hard.ground_laws import controlled, measured, stepped
from hard.manoeuvres import ordinary, outcome, scene
from sensitivities.costs import task as skid_of

from contact.laws import judged
from omniroll import Bearings, Contact, SimulationStopped, Slope, Torque, TorqueTable, Vehicle, simulate
from omniroll.engine.control import one_run
from omniroll.engine.simulate import checked_task
from omniroll.results.comparison import distance_at

PAPER = Vehicle.paper()


def assert_obeys_the_laws(run, *but):
    assert {law for law, residual in judged(run).items() if not residual.max() <= LAWS} <= set(but)


# ---- manoeuvres and ordinary scenes, by their numbers in hard/manoeuvres.py ------------------------------------------


ONCE = {
    26: "a wheel that either roller drove back passed its joint to and fro, 5e6 times a second",
    396: "the end of a stiff step was damped with the directions that slips have at its start: off by 1e-4",
    448: "the finer run stopped: a decision took the direction of a slip of 5e-10 m/s for better than the step's",
    470: "two wheels let go 1e-10 s apart, and the first one's slip was rounding until then",
    815: "a slip that misses its rest by 6e-11 m/s stuck there, at few digits: static friction held it",
    895: "the same of a wheel whose twin used its friction up an iteration's rest later",
    998: "three wheels on a torque ramp: a slip of 2e-12 m/s turned as its rounding did",
}


@pytest.mark.parametrize("number", ONCE)
def test_manoeuvre_ends_accurately_and_obeys_the_laws(number: int) -> None:
    assert outcome(number)[1] == "ends", ONCE[number]


@pytest.mark.long
def test_a_wheel_stands_on_its_joint_as_one_that_is_stepped_in_time_swings_there() -> None:
    _, robot, task = scene(26)
    swinging = [simulate(robot, **task | {"engine": "python", "accuracy": size}) for size in (1e-3, 3e-4)]
    del task["control"]  # as `omniroll run` does, which keeps what there is so far
    run = one_run(replace(checked_task(robot, **task), keep=lambda _: None), task["accuracy"])
    coarse, fine = (np.abs(one.nu[-1] - run.nu[-1]).max() for one in swinging)
    assert np.count_nonzero(run.times_on_joints()) == 1
    assert 2 < coarse / fine < 5 and fine < 1e-3 * np.abs(run.nu).max(), (coarse, fine)


STOPPED = {
    64: "loads on springs: an iterate slipped against its direction, and its directions never settled",
    257: "a roller came to rest, which turned the slip of its wheel by 1e-3 rad; its direction stayed",
    490: "an axle slower than 16 times what the iterations of all steps may leave was at rest, and passed zero unseen",
    1198: "the same on viscous ground: friction drove the axle on until the step's end, and the law was missed by 24",
    364: "the corrector of the solver swung a light roller from bound to bound: no mode was decided",
    1867: "of two wheels alike one broke away, as static friction is above sliding friction: beside axles that stick",
    1894: "rollers of a wheel let go together: the next one's instant was sought beyond the rounding of time",
}


@pytest.mark.parametrize("number", STOPPED)
def test_ordinary_scene_ends(number: int) -> None:
    assert outcome(number, ordinary)[1] == "ends", STOPPED[number]


def test_a_stop_names_the_wheel_the_time_the_cause_and_what_to_change() -> None:
    """It named no wheel. The session stops where the run of the same scene goes on: when, and how fast its friction is
    there, goes by the last bits, and so by the processor."""
    vehicle, task = controlled(2942)
    with pytest.raises(SimulationStopped) as stopped:
        stepped(vehicle, task, np.random.default_rng([SEED, 4, 2942]))
    assert stopped.value.wheel is not None
    assert re.match(
        r"stopped at t = \d\.\d+e-08, wheel [1-3]: the step became too small: \w+ changes faster than a step can "
        r"follow(: Contact has a time constant of .* s, .* times shorter than the motion's)?; change what acts on the "
        r"wheel, the start or the accuracy",
        str(stopped.value),
    )


@pytest.mark.parametrize("number", [401, 3884])
def test_session_ends_where_the_run_does(number: int) -> None:
    """Two slips of a vehicle that can only turn come to rest together, each with a rest across its direction: that
    of one counted as a slip where steps leave less than rounding."""
    found = measured(number)
    assert found["nu at the end of a session, relative"] <= 1e-8


@pytest.mark.parametrize("number", [778, 1337, 2144])
def test_an_iteration_whose_ratios_take_turns_goes_on_until_it_has_settled(number):
    """Slopes of friction turn within a step. In these scenes steps once seemed settled by their first ratio of changes:
    nu missed the accuracy by 4.7 to 14 times, the ledger by up to 4.4 times."""
    balance, apart = missed_on_steep_ground(number)
    assert balance <= 0.1 and apart <= 0.5


# ---- few digits, and nearly all --------------------------------------------------------------------------------------


def skid(number):
    """A skid: friction, duration and speeds by chance."""
    random = np.random.default_rng([7, number])
    friction, _ = float(10 ** random.uniform(-1.5, 0.3)), random.random()
    rates = 0 if random.random() < 0.5 else tuple(random.normal(size=3))
    ground = Contact(law="coulomb", friction=friction, wheel_rates=rates)
    nu = random.normal(size=3)
    return {"nu": nu, "duration": float(random.uniform(0.1, 1)), "effects": [ground], "control": False}


EARLY_RESTS = (11, 26, 27, 46)  # a step came to rest before the slip had turned, and missed 1e-5 by 2.6 to 6.5 times
STALLS = (78, 136, 386, 448)  # tries followed a rest that was none down to a length of 1e-119 s
LAST_ROUNDINGS = (698,)  # at 1e-11, a rest was located to less than the slip's rounding, in vain


@pytest.mark.long
@pytest.mark.parametrize("number", [*EARLY_RESTS, *STALLS, *LAST_ROUNDINGS])
def test_few_digits_are_kept_where_slips_come_to_rest(number):
    task = skid(number)
    exact = simulate(PAPER, **task, accuracy=1e-11)
    for accuracy in (1e-4, 1e-5, 1e-6):
        run = simulate(PAPER, **task, accuracy=accuracy)
        assert distance_at(run, exact, np.linspace(0, exact.t[-1], 41)) <= accuracy


@pytest.mark.long
@pytest.mark.parametrize("accuracy", [1e-8, 1e-10, 1e-12])
def test_rows_on_the_way_to_rest_are_as_exact_as_the_run(accuracy):
    """A try whose first sweep met the rest was once taken for settled: rows were wrong by 3e-8 at 1e-10."""
    leaning = PAPER.replace(
        wheel_angles=(0.20512541692260902, 2.4258725499814915, 4.228517664044771), mass=2.253203486363165,
        yaw_inertia=0.03192305245846796, wheel_inertia=0.0005499653416135746, roller_inertia=1.1279460564575829e-06,
        center_of_mass=(0.009851776627062608, 0.0075085761891942),
    )  # fmt: skip
    ground = Contact(
        law="coulomb", friction=(1.7176474708346172, 0.7624643958113255),
        static_friction=(2.2329417120850024, 0.7624643958113255),
    )  # fmt: skip
    task = {
        "nu": (2.266587839281799, -0.2082595438795858, 1.0723113347137125), "effects": (ground,), "duration": 0.9,
        "chi": (0.03710352240491652, 0.056299168588826276, -2.2529080199840124e-05), "control": False,
    }  # fmt: skip
    run = simulate(leaning, **task, accuracy=accuracy)
    exact = simulate(leaning, **task, accuracy=1e-12)
    slips = ~run.sticks.all(axis=1)
    times = np.concatenate([run.t, (run.t[1:] + run.t[:-1]) / 2])
    here, there = run.sample(times), exact.sample(times)
    apart = np.abs(here.nu - there.nu).max(axis=1) / np.linalg.norm(exact.nu, axis=1).max()
    assert slips.sum() > 30 and len(run.switches)
    assert apart.max() <= max(accuracy, 1e-11)


@pytest.mark.parametrize("accuracy, engine", [(1e-13, "compiled"), (1e-14, "specialised"), (1e-14, "compiled")])
def test_a_contact_lets_go_beside_one_that_sticks_and_one_that_slips(accuracy, engine):
    """The run stopped 5e-6 s later, where the slip was 2e-11 m/s: it would have needed 1e11 steps. At 1e-14, which is
    some 45 roundings, it takes short steps."""
    leaning = PAPER.replace(
        wheel_angles=(0.3498126015934843, 1.750243794903401, 4.523780221699875), mass=2.4448330391766775,
        yaw_inertia=0.02563993526711225, wheel_inertia=0.0021471597063558116, roller_inertia=1.3416110890954317e-06,
        center_of_mass=(0.004412102183072584, -0.0052526210786781324),
    )  # fmt: skip
    ground = Contact(
        law="coulomb", friction=0.06282421934356575, normal_gravity=9.6,
        wheel_rates=(-2.9817348368608037, -3.544164384744147, -0.9161293050260264),
    )  # fmt: skip
    torque = Torque((0.02439585785595215, 0.003667205981638463, 0.029491400039754957))
    bearings, slope = Bearings(wheel_viscous=1e-3, roller_viscous=1e-6), Slope(0.05108425726873547, 5.076391086471821)
    task = {
        "nu": (-1.7713223641678835, -3.1799250292790404, -3.0741329692511346),
        "chi": (0.13857034724641717, -0.04428413227405535, -0.07043604600154835),
        "spins": [[3.0, -0.8, -1.7, -0.6], [-5.0, -0.3, 2.3, 2.7], [-5.4, -5.4, -3.1, 5.2]],
        "duration": 0.8, "effects": [ground, torque, bearings, slope], "control": False,
    }  # fmt: skip
    run = simulate(leaning, **task, accuracy=accuracy, engine=engine)
    coarse = simulate(leaning, **task, accuracy=1e-9)
    assert run.stats["steps"] <= 8 * coarse.stats["steps"]
    assert np.abs(run.nu[-1] - coarse.nu[-1]).max() <= 1e-9 * np.linalg.norm(coarse.nu, axis=1).max()


# ---- bearings that stick beside contacts -----------------------------------------------------------------------------


def massless_rollers_stick(number):
    """A vehicle whose massless rollers stick beside contacts that do, in half of these beside its axles."""
    rng = np.random.default_rng([91, number])
    wheels = int(rng.choice((3, 4, 5)))
    vehicle = Vehicle.paper(wheels, int(rng.integers(4, 7)))
    share, reach = vehicle.mass * 9.80665 / wheels, vehicle.wheel_radius - vehicle.roller_axis_radius
    friction = 10 ** rng.uniform(-0.8, 0) * np.array([1.0, rng.choice((1.0, rng.uniform(0.6, 1.7)))])
    static = friction * rng.choice((1.0, 1.3))
    torques = friction[0] * share * reach * 10 ** rng.uniform(-1, 0.2) * rng.uniform(0.7, 1.3, wheels)
    given = {"roller_coulomb": torques, "roller_break_away": torques * rng.choice((1.0, 1.4))}
    size = friction[1] * share * vehicle.wheel_radius
    if number % 2:
        given["wheel_coulomb"] = size * 10 ** rng.uniform(-1, 0.3) * rng.uniform(0.7, 1.3, wheels)
    rates = tuple(5 * rng.normal(size=wheels)) if rng.random() < 0.5 else None
    acts = (Torque(size * rng.normal(size=wheels)),
            TorqueTable((0.0, 0.05, 0.2), 1.5 * size * rng.normal(size=(3, wheels))))  # fmt: skip
    ground = Contact(
        law="coulomb", friction=friction, static_friction=static, normal_gravity=9.80665, wheel_rates=rates
    )
    effects = [ground, Bearings(**given), acts[number // 4 % 2], Slope(rng.uniform(0, 0.3), 1.0)]
    nu = tuple(2 * rng.normal(size=3)) if rng.random() < 0.7 else (0.0, 0.0, 0.0)
    return vehicle, {"nu": nu, "effects": effects, "accuracy": 1e-10, "roller_model": "massless", "control": False}


def test_slips_that_keep_their_direction_come_to_rest_together():
    """Two contacts come to rest at once, each in the direction that it has kept: 4e-11 m/s are left of one where the
    other rests. In that row its direction was that of what is left, and a force 36 % beyond its ellipse."""
    vehicle, options = massless_rollers_stick(601)
    assert_obeys_the_laws(simulate(vehicle, duration=0.2, **options))


def test_a_scene_runs_however_its_start_is_rounded():
    """A contact gives way there that is pulled by next to nothing: of starts some roundings apart a quarter stopped, as
    no step was small enough."""
    vehicle, options = massless_rollers_stick(143)
    for number in range(8):
        roundings = np.random.default_rng([143, number]).integers(-3, 4, 3)
        nu = tuple(np.array(options["nu"]) * (1 + 4e-16 * roundings))
        assert_obeys_the_laws(simulate(vehicle, duration=0.2, **options | {"nu": nu}))


@pytest.mark.parametrize("accuracy", [1e-8, 1e-11])
def test_a_roller_stops_as_its_bearing_comes_to_take_all_of_the_friction(accuracy):
    """A wheel slips along its axle with 0.26 m/s and across it with 4e-6 m/s. As its contact moves to the middle of
    its roller, the bearing comes to take all friction but 2e-10 of it, and the spin passes zero by 1e12 rad/s^2. No
    instant is nearer to that than 2e-5 rad/s: the run stepped there on the spot."""
    options = skid_of("in series, coulomb, skid, torque") | {"duration": 1.9, "control": False}
    options.pop("sensitivities")
    run, finer = (simulate(**options | {"accuracy": given}) for given in (accuracy, 1e-12))
    before, after = np.searchsorted(run.t, (1.794, 1.79403))
    assert run.contact_spin[before, 2] < -20 and run.contact_spin[after, 2] == 0
    assert abs(run.slip[before, 2]).max() < 1e-3 and abs(run.slip[after, 2, 0]) > 0.2
    assert_obeys_the_laws(run, "roller in contact")  # such a spin is a difference over what is left of the friction
    assert distance_at(run, finer, np.linspace(0, 1.9, 7)) <= accuracy

"""Derivatives of runs against differences of runs: over switches, with each effect, and over every event of each kind
of friction. A row of CASES is a run, and the numbers by which it is differentiated."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll import Bearings, Contact, Controller, Motor, Slope, TorqueTable
from tests.sensitivities.differences import SPINS, VEHICLE, Case, derivative, differenced

DISKS = np.zeros_like(SPINS).tolist()  # spins of rollers that rest on their disks
REST = {"nu": (0.0, 0.0, 0.0)}
STILL = REST | {"spins": DISKS}
LEVEL = REST | {"pose": (0.0, 0.0, 0.0)}
SLOW = {"nu": (0.2, 0.1, 0.2)}
AT_A_JOINT = {"chi": (0.61, -0.2, -0.61)}
ALONG_AN_AXLE = {"nu": (0, 1.0, 0), "spins": DISKS, "chi": (0.1, 0.2, -0.2)}
SKIDDING = {"wheel_rates": (3.0, -2.0, 1.0)}


def ramp(*torques, end=1.0):
    return TorqueTable((0.0, end), ((0.0,) * len(torques), torques))


# ---- wheels that roll ------------------------------------------------------------------------------------------------

OF_VEHICLE = ("nu[0]", "chi[1]", "pose[2]", "mass", "yaw_inertia", "wheel_inertia", "roller_inertia", "wheel_radius",
              "roller_axis_radius", "platform_radius", "yaw_scale", "wheel_angles[1]")  # fmt: skip
MOTOR = Motor(voltage=(1, 2, 3), torque_constant=0.02, resistance=1.5, gear_ratio=4, rotor_inertia=1e-6)
FREE_RUNNING = replace(MOTOR, voltage=0)
LIMITED = replace(MOTOR, current_limit=1.0)
CONTROLLER = Controller(target=(1, 0, 0.5), proportional=1, integral=2, sample_time=0.05, output="voltage")
VISCOUS = Bearings(wheel_viscous=1e-3, roller_viscous=1e-5)
FADING = Bearings(roller_coulomb=1e-4, roller_speed=0.8)
TABLE = TorqueTable((0, 0.4, 0.8), ((0, 0, 0), (0.02, 0.01, 0.03), (0.01, 0.05, -0.02)))
HELD = replace(LIMITED, times=(0, 0.37, 0.7), voltage=((1, 2, 3), (3, 1, -1), (0, 0, 1)), interpolation="hold")
FOLLOWING = replace(CONTROLLER, times=(0, 0.52), target=((0, 0, 0), (1, 0, 0.5)))
ROLLING = {
    f"{model}, {law}": (Case(model, law), (*OF_VEHICLE, *["spins[1][2]"] * (model == "free")))
    for model in ("massless", "locked", "free") for law in ("smooth", "impact")
} | {
    "viscous bearings": (Case("free", effects=(VISCOUS,)), ("nu[0]", "wheel_viscous[1]", "roller_viscous")),
    "fading rollers": (Case("free", effects=(FADING,)), ("nu[0]", "roller_coulomb", "roller_speed")),
    "table": (Case("free", effects=(TABLE,)), ("torque[1][2]", "chi[1]", "times[1]", "times[2]")),
    "table, held": (Case("free", effects=(replace(TABLE, interpolation="hold"),)), ("times[1]", "torque[1][0]")),
    "voltages, held": (Case("locked", effects=(HELD,)), ("times[1]", "voltage[1][2]", "current_limit")),
    "motors": (Case("free", effects=(MOTOR,)), ("voltage[1]", "gear_ratio", "back_emf", "resistance")),
    "limits": (Case("free", effects=(LIMITED,)), ("torque_constant", "current_limit", "nu[0]")),
    "controller": (Case("free", effects=(FREE_RUNNING, CONTROLLER)),
                   ("target[0]", "proportional", "integral[1]", "voltage", "mass")),
    "controller's table": (Case("free", effects=(FREE_RUNNING, FOLLOWING)), ("times[1]", "target[1][0]")),
}  # fmt: skip

# ---- bearings that stick, of wheels that roll ------------------------------------------------------------------------

AXLES, AXLES_HELD_LONGER = Bearings(wheel_coulomb=0.002), Bearings(wheel_coulomb=0.01, wheel_break_away=0.016)
UP_AND_DOWN = TorqueTable((0, 1, 2, 3), ((0, 0, 0), (0.05, -0.02, 0.03), (-0.04, 0.05, -0.02), (0, 0.02, 0.03)))
BACK_AND_FORTH = TorqueTable((0, 0.5, 1), ((0, 0, 0), (0.3, 0.2, 0.3), (-0.1, 0.05, -0.2)))
RUBBING, RUBBING_LONGER = Bearings(roller_coulomb=2e-5), Bearings(roller_coulomb=2e-5, roller_break_away=4e-5)
ALL_HELD = Bearings(wheel_coulomb=1e-3, roller_coulomb=2e-3, roller_break_away=4e-3)
STICKING = {
    "axles rest one after the other": (
        Case("massless", effects=(AXLES,), duration=12.0), ("nu[0]", "mass", "wheel_angles[1]", "wheel_coulomb[1]")),
    "axles break away at their torque": (
        Case("locked", effects=(UP_AND_DOWN, Bearings(wheel_coulomb=0.01)), start=REST, duration=3.5),
        ("mass", "times[1]", "wheel_coulomb[0]")),
    "axles break away above it": (
        Case("free", effects=(UP_AND_DOWN, AXLES_HELD_LONGER), start=REST | {"spins": 0.0}, duration=3.5),
        ("torque[1][0]", "wheel_break_away[0]", "wheel_angles[1]")),
    "rollers in contact break away": (
        Case("massless", effects=(UP_AND_DOWN, ALL_HELD), start=REST, duration=3.5),
        ("mass", "roller_break_away", "wheel_radius", "roller_axis_radius")),
    "free rollers rest": (Case("free", effects=(RUBBING,), duration=3.0),
                          ("nu[0]", "spins[1][2]", "roller_coulomb", "roller_inertia", "roller_axis_radius")),
    "free rollers break away and pass rest": (
        Case("free", "smooth", effects=(BACK_AND_FORTH, RUBBING_LONGER), start=REST | {"spins": 0.0}, duration=0.6),
        ("mass", "torque[1][0]", "roller_break_away")),
    "axles and all rollers": (
        Case("free", effects=(UP_AND_DOWN, ALL_HELD), start=REST | {"spins": 0.0}, duration=2.5),
        ("mass", "wheel_coulomb[2]", "roller_break_away", "roller_axis_radius")),
    "all come to rest": (Case("free", effects=(Bearings(roller_coulomb=2e-5, wheel_coulomb=2e-3),), duration=12.0),
                         ("nu[0]", "wheel_coulomb")),
}  # fmt: skip

# ---- wheels that may slip, under smooth laws -------------------------------------------------------------------------

RUNNING = Contact((40.0, 30.0), **SKIDDING)

REGULARISED = Contact(law="regularised", friction=(0.3, 0.4), speed=0.05)
HELD_AXLES = Bearings(wheel_coulomb=0.02)
AXLES_HELD = Bearings(wheel_coulomb=0.02, wheel_break_away=0.03)
AXLE_RAMP, ROLLER_RAMP = ramp(0.1, -0.06, 0.04), ramp(0.3, -0.1, 0.2, end=0.3)
BESIDE_SMOOTH = {
    "viscous": (Case("massless", effects=(RUNNING,)),
                ("nu[0]", "wheel_radius", "wheel_angles[1]", "coefficient[0]", "coefficient", "wheel_rates[1]")),
    "regularised": (Case("free", effects=(REGULARISED,)),
                    ("chi[1]", "spins[1][2]", "roller_inertia", "friction[0]", "friction[1]", "speed")),
    "axles, stop": (Case("massless", effects=(Contact(20.0), HELD_AXLES), duration=0.9), ("nu[0]", "wheel_coulomb[1]")),
    "axles, break-aways": (
        Case("massless", effects=(Contact(5.0), AXLES_HELD, AXLE_RAMP), start=REST, duration=0.9),
        ("wheel_break_away", "mass"),
    ),
    "axles, regularised": (
        Case("massless", effects=(REGULARISED, AXLES_HELD, AXLE_RAMP), start=REST, duration=0.7),
        ("friction[1]", "wheel_coulomb"),
    ),
}  # fmt: skip

TURNING = Bearings(roller_coulomb=0.01)
HELD_ROLLERS = Bearings(roller_coulomb=0.001, roller_break_away=0.002)
STOPPING = Case("massless", effects=(Contact(5.0), TURNING), duration=0.6)
BREAKING_AWAY = Case("massless", effects=(Contact(5.0), HELD_ROLLERS, ROLLER_RAMP), start=REST, duration=0.3)
BRAKED = replace(BREAKING_AWAY, effects=(Contact(5.0), replace(HELD_ROLLERS, roller_viscous=2e-5), ROLLER_RAMP))
ALL_STICK = replace(HELD_ROLLERS, wheel_coulomb=0.02, wheel_break_away=0.03)
MASSLESS = {
    "massless, break-aways": (BREAKING_AWAY, ("mass", "roller_break_away")),
    "massless, regularised": (
        replace(BREAKING_AWAY, effects=(REGULARISED, HELD_ROLLERS, ROLLER_RAMP)), ("roller_break_away",)),
    "massless, braked": (
        replace(STOPPING, effects=(Contact(5.0), replace(TURNING, roller_viscous=2e-4))), ("roller_viscous", "mass")),
    "massless, braked on regularised": (
        replace(BRAKED, effects=(REGULARISED, *BRAKED.effects[1:])), ("roller_viscous",)),
    "massless beside axles, regularised": (
        replace(BREAKING_AWAY, effects=(REGULARISED, ALL_STICK, ROLLER_RAMP)), ("wheel_break_away", "speed")),
}  # fmt: skip

FREE_HELD = Bearings(roller_coulomb=0.003, roller_break_away=0.004)
FREE_STOPPING = Case("free", effects=(Contact(5.0), Bearings(roller_coulomb=2e-5)), duration=0.02)
FREE_BREAKING_AWAY = Case("free", effects=(Contact(20.0), FREE_HELD, ROLLER_RAMP), start=STILL, duration=0.1)
FREE = {
    "free rollers, stop": (FREE_STOPPING, ("nu[2]", "roller_coulomb[1]")),
    "free rollers, one enters sticking and lets go": (
        Case("free", effects=(Contact(20.0), FREE_HELD), start=AT_A_JOINT | {"spins": DISKS}, duration=0.015),
        ("mass",),
    ),
    "free rollers, break-aways": (FREE_BREAKING_AWAY, ("roller_break_away",)),
    "free rollers, with axles": (
        Case("free", effects=(REGULARISED, Bearings(roller_coulomb=0.001, wheel_coulomb=0.05)), duration=0.03),
        ("wheel_coulomb[0]", "roller_coulomb"),
    ),
}  # fmt: skip

# ---- contacts that stick, and bearings beside them -------------------------------------------------------------------

GROUND = Contact(law="coulomb", friction=0.1)
GRIPS = replace(GROUND, static_friction=0.15)
SKID = replace(GROUND, **SKIDDING)
LIGHT = Contact(law="coulomb", friction=0.3, static_friction=0.4, load=(12.0, 2.0, 2.0))
STRONG = ramp(0.9, -0.5, 0.4)
FLOOR = Contact(law="coulomb", friction=(0.3, 0.4))
LETS_GO = Contact(law="coulomb", friction=(0.3, 0.35), static_friction=(0.4, 0.45))
RISING = ramp(1.0, -0.6, 0.4)
TO_AND_FRO = TorqueTable((0.0, 0.2, 0.4, 1.0), ((1.0, -0.5, 0.6), (-1.0, 0.5, -0.6), (1.0, -0.6, 0.4), (1, 1, 1)))
KICK = TorqueTable((0.0, 0.1), ((0.0, 0.0, 0.0), (2.0, -1.5, 0.4)), interpolation="hold")
FOUR = VEHICLE.replace(wheels=4, wheel_angles=(0.7, 2.3, 3.9, 5.6), center_of_mass=(0.01, -0.005))
FOUR_START = {"chi": (0.1, -0.2, 0.15, 0.05), "spins": np.random.default_rng(0).normal(size=(4, SPINS.shape[1]))}
STANDS_STILL = Contact(law="coulomb", friction=0.4, wheel_rates=0.0)
CONTACTS = {
    "contacts, massless": (Case("massless", effects=(replace(FLOOR, **SKIDDING),)),
                           ("nu[0]", "mass", "wheel_radius", "platform_radius", "friction")),
    "contacts, free": (Case("free", effects=(FLOOR,)), ("chi[1]", "wheel_inertia", "spins[1][2]", "roller_inertia")),
    "contacts let go, massless": (Case("massless", effects=(LETS_GO, RISING), start=LEVEL, duration=0.6),
                                  ("mass", "friction", "static_friction", "static_friction[0]", "torque[1][0]")),
    "contacts let go, free": (Case("free", effects=(LETS_GO, RISING), start=LEVEL, duration=0.5),
                              ("static_friction", "times[1]")),
    "kicked": (Case("massless", effects=(Contact(law="coulomb", friction=0.05), KICK), start=LEVEL, duration=0.15),
               ("times[1]", "mass", "friction")),
    "turns back": (Case("massless", effects=(GROUND, TO_AND_FRO), duration=0.8), ("mass", "friction", "nu[1]")),
    "four wheels": (Case("free", vehicle=FOUR, effects=(STANDS_STILL,), start=FOUR_START, duration=0.4),
                    ("platform_radius", "wheel_angles[2]", "center_of_mass[0]")),
    "contacts on a slope": (
        Case("free", effects=(replace(FLOOR, friction=0.3, normal_gravity=9.6), Slope(0.1, 0.4)), duration=0.6),
        ("angle", "mass", "pose[2]")),
    "loads that are given": (
        Case("free", effects=(Contact(law="coulomb", friction=0.3, load=(10.0, 12.0, 9.0)),)), ("load[1]", "mass")),
}  # fmt: skip

STANDING = {
    "axles beside contacts, come to rest": (
        Case("massless", effects=(SKID, HELD_AXLES), duration=0.9), ("nu[0]", "mass")),
    "axles beside contacts, free": (
        Case("free", effects=(GROUND, Bearings(wheel_coulomb=0.05, wheel_break_away=0.06)), duration=0.36),
        ("mass", "wheel_coulomb"),
    ),
    "axles let go beside contacts": (
        Case("massless", effects=(GROUND, AXLES_HELD, ramp(0.2, -0.1, 0.05)), start=REST, duration=0.9),
        ("wheel_break_away", "wheel_radius"),
    ),
    "contacts let go beside axles": (
        Case("massless", effects=(GRIPS, Bearings(wheel_coulomb=0.2, wheel_break_away=0.3), STRONG), start=REST,
             duration=0.9), ("wheel_break_away", "mass")
    ),
    "a wheel that is pushed lets go": (
        Case("massless", effects=(LIGHT, Bearings(wheel_coulomb=(0.01, 0.5, 0.5)), ramp(0.4, 0.0, 0.0)), start=REST,
             duration=0.8), ("static_friction", "load[1]")
    ),
}  # fmt: skip

ROLLERS = Bearings(roller_coulomb=0.002)
BESIDE_CONTACTS = Case("free", effects=(SKID, ROLLERS), duration=0.002)
SIDEWAYS = Case("free", effects=(GRIPS, Bearings(roller_coulomb=0.002, roller_break_away=0.003),
                                 ramp(0, 0.3, -0.3, end=0.1)), start=ALONG_AN_AXLE, duration=0.04)  # fmt: skip
OF_BOTH = {
    "rollers beside contacts, stop": (BESIDE_CONTACTS, ("roller_coulomb",)),
    "rollers beside contacts, break away": (SIDEWAYS, ("wheel_radius",)),
}

FLAT = Contact(law="coulomb", friction=(0.3, 0.25))
SERIES_GRIPS = replace(FLAT, static_friction=(0.4, 0.35))
SERIES_SKID, SERIES_SKID_GRIPS = replace(FLAT, **SKIDDING), replace(SERIES_GRIPS, **SKIDDING)
SERIES_HELD = Bearings(roller_coulomb=0.02, roller_break_away=0.03)
ONE_TURNS = Bearings(roller_coulomb=(0.02, 0.025, 0.002), roller_break_away=(0.03, 0.035, 0.002))
RIGID = Bearings(roller_coulomb=(0.2, 0.25, 0.002))
PUSH = ramp(0.0, -0.9, 0.9, end=0.05)
SLIPPING = Case("massless", effects=(SERIES_SKID, Bearings(roller_coulomb=0.02)), duration=0.035)
JUMPING = Case("massless", effects=(SERIES_SKID_GRIPS, SERIES_HELD), start={"nu": (0.3, 0.1, 0.2)}, duration=0.04)
PUSHED = Case("massless", effects=(SERIES_GRIPS, ONE_TURNS, ramp(0.9, -0.5, 0.4, end=0.3)), start=REST, duration=0.1)
SERIES = {
    "in series, rollers let go and contacts come to rest": (SLIPPING, ("mass", "roller_coulomb[1]")),
    "in series, break-aways with a jump, and a wheel that stands": (JUMPING, ("mass", "roller_break_away")),
    "in series, a contact that stands lets go": (
        Case("massless", effects=(SERIES_GRIPS, ONE_TURNS, ramp(0.2, 0.9, -0.6, end=0.05)), start=SLOW,
             duration=0.018), ("mass", "static_friction[1]")),
    "in series, a roller that stands lets go, then its contact": (
        Case("massless", effects=(SERIES_GRIPS, ONE_TURNS, PUSH), start=SLOW, duration=0.023),
        ("roller_break_away[1]",)),
    "in series, switches": (
        replace(SLIPPING, effects=(SERIES_SKID, SERIES_HELD), start={"chi": (0.627, -0.2, -0.61)}, duration=0.03),
        ("mass",)),
    "in series, a roller that turns gives way to one that stands": (
        replace(JUMPING, start={"nu": (6.0, 2.0, 5.0), "chi": (0.1, 0.33, 0.1)}, effects=(SERIES_GRIPS, SERIES_HELD),
                duration=0.032), ("mass", "chi[1]")),
    "in series, axles stop and stick": (
        replace(JUMPING, effects=(SERIES_SKID, replace(SERIES_HELD, wheel_coulomb=0.05, wheel_break_away=0.07)),
                duration=0.0265), ("wheel_coulomb[0]",)),
}  # fmt: skip

CASES = ROLLING | STICKING | BESIDE_SMOOTH | MASSLESS | FREE | CONTACTS | STANDING | OF_BOTH | SERIES
QUICK = ("massless, impact", "locked, smooth", "free, impact", "limits", "axles break away above it", "viscous",
         "contacts let go, massless", "in series, rollers let go and contacts come to rest")  # fmt: skip


def size_of(case, name):
    """The size of a number, so that its change makes no other events."""
    number = name.split("[")[0]
    holders = [case.start, *(vars(one) for one in (*case.effects, case.vehicle) if hasattr(one, "__dict__"))]
    value = next((holder[number] for holder in holders if holder.get(number) is not None), 1.0)
    return min(1.0, np.abs(value).max()) or 1.0


def assert_is_differenced(case, names, t=None, tolerance=1e-8, part=1e-4):
    """Runs are exact to some 1e-13, which the difference divides by the change. Returns the run."""
    run = case.run(sensitivities=names, accuracy=1e-13)
    for name in names:
        change = part * size_of(case, name)
        wanted = differenced(case, name, change, t, accuracy=1e-13)
        apart = np.abs(derivative(run, name, t) - wanted).max()
        assert apart <= tolerance * np.abs(wanted).max() + 2e-13 / change, name
    return run


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.long) for name in CASES]
)
def test_they_are_differences_of_runs(name):
    run = assert_is_differenced(*CASES[name])
    changes = len(run.switches) if name in ROLLING else run.stats["phases"] - max(1, len(run.switches))
    assert changes > 0  # else nothing has happened; modes may change at a switch


@pytest.mark.long
@pytest.mark.parametrize("name, t", [("free, impact", 0.637), ("fading rollers", 0.637), ("regularised", 0.637),
                                     ("free rollers rest", 0.637), ("contacts, free", 0.3815)])  # fmt: skip
def test_between_rows(name, t):
    """At times in the middle of steps; of contacts while a slip falls and its direction turns."""
    case, names = CASES[name]
    assert_is_differenced(case, names, t)


def test_viscous_friction_that_is_zero_is_differentiated_as_where_there_is_next_to_none():
    cases = (Case("free", effects=(Bearings(roller_coulomb=2e-5, roller_viscous=x),)) for x in (0.0, 1e-15))
    none, little = (derivative(case.run(sensitivities=("roller_viscous",)), "roller_viscous") for case in cases)
    assert np.abs(none - little).max() <= 1e-6 * np.abs(little).max()


@pytest.mark.parametrize("rollers, bearings", [("massless", ()), ("massless", (
    Bearings(wheel_coulomb=0.02, wheel_break_away=0.05),)), ("free", ())])  # fmt: skip
def test_behind_a_let_go_on_a_slope_they_are_differences_of_runs(rollers, bearings):
    """What holds rises there also because gravity's direction turns with the heading."""
    rng, let_go = np.random.default_rng(5), 0
    ground = Contact(law="coulomb", friction=0.25, static_friction=0.35, normal_gravity=9.6)
    for _ in range(4):
        nu, torque = rng.normal(size=3) * (0.5, 0.5, 2), rng.normal(size=3) * 0.4
        case = Case(rollers, effects=(ground, Slope(0.2, 0.3), ramp(*torque, end=0.4), *bearings), duration=0.4,
                    start={"nu": tuple(nu), "chi": (0, 0, 0), "pose": (0, 0, 0), "spins": DISKS})  # fmt: skip
        found = case.run(sensitivities=("mass", "nu[2]"), accuracy=1e-12)
        let_go += np.count_nonzero(found.sticks[1:] < found.sticks[:-1])
        for name, change in (("mass", 5e-6 * VEHICLE.mass), ("nu[2]", 5e-6)):
            ends = [case.changed(name, side * change).run(accuracy=1e-12).nu[-1] for side in (1, -1)]
            wanted = (ends[0] - ends[1]) / (2 * change)
            assert np.abs(found.sensitivity(name).nu[-1] - wanted).max() <= 3e-8 * np.abs(wanted).max()
    assert let_go >= 2

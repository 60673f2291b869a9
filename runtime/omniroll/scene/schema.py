"""What a scene file may say: its tables and their keys, with units, defaults and bounds.

N is the number of wheels, n of rollers per wheel, K the number of rows of a table over time.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from omniroll.kernels import ROLLER_MODELS
from omniroll.scene.kinds import Choice, Numbers, Whole
from omniroll.simulate import ENGINES
from omniroll.switching import LAWS

NUMBER = Numbers()
POSITIVE = Numbers(above=0)
NOT_NEGATIVE = Numbers(least=0)
PER_WHEEL = Numbers(shapes=(("N",),))
FRICTION = Numbers(shapes=((), ("N",)), least=0)
REGULARISATION = Numbers(above=0)
SPEEDS = Numbers(shapes=((3,),))
TIMES = Numbers(shapes=(("K",),), increasing=True)
MOST_WHEELS, MOST_ROLLERS = 1000, 10_000


@dataclass(frozen=True)
class Key:
    """A key of a table. `default` is in words; `needed` where there is none and the key must be given."""

    name: str
    kind: Any
    unit: str
    meaning: str
    default: str = ""
    needed: bool = False


@dataclass(frozen=True)
class Table:
    """A table: its keys, and what its presence does."""

    name: str
    meaning: str
    keys: tuple[Key, ...]
    needed: bool = False

    def key(self, name: str) -> Key:
        """The key of that name. KeyError where there is none."""
        return {key.name: key for key in self.keys}[name]


# [vehicle] has three ways of saying what the vehicle is; the first keys go with each of them.
SIZES = (
    Key("wheels", Whole(1, MOST_WHEELS), "", "N", "3 of a preset"),
    Key("rollers_per_wheel", Whole(3, MOST_ROLLERS), "", "n; at least 4 where r is not given", "5 of a preset"),
)
SHARED = (
    Key("wheel_angles", PER_WHEEL, "rad", "directions of the axles", "evenly spaced, the first 0"),
    Key("platform_radius", POSITIVE, "m", "R, centre of the vehicle to the wheels' centres"),
    Key("wheel_radius", POSITIVE, "m", "l, wheel centre to the ground"),
    Key("roller_axis_radius", POSITIVE, "m", "r, wheel centre to a roller's axis", "truncated rollers, section 4"),
    Key("yaw_scale", POSITIVE, "1", "Lambda, nu_3 = Lambda theta'", "1; that of a preset"),
)
PRESET = (Key("preset", Choice(("paper",)), "", "a vehicle by name; the other keys replace its numbers"),)
NUMBERS = (
    Key("mass", POSITIVE, "kg", "M, of the whole"),
    Key("yaw_inertia", POSITIVE, "kg m^2", "I_S, of the whole about the vertical through S"),
    Key("wheel_inertia", POSITIVE, "kg m^2", "J, of a wheel with its rollers about its axle"),
    Key("roller_inertia", POSITIVE, "kg m^2", "B, of a roller about its own axis"),
)
PARTS = (
    Key("platform_mass", NOT_NEGATIVE, "kg", "the vehicle without wheels"),
    Key("platform_inertia", NOT_NEGATIVE, "kg m^2", "its yaw inertia about S; or give its size"),
    Key("platform_disk_radius", POSITIVE, "m", "its size: a solid disk's"),
    Key("hub_mass", NOT_NEGATIVE, "kg", "a wheel without its rollers"),
    Key("hub_axial_inertia", NOT_NEGATIVE, "kg m^2", "about the axle; or give its size"),
    Key("hub_transverse_inertia", NOT_NEGATIVE, "kg m^2", "across the axle"),
    Key("hub_radius", POSITIVE, "m", "its size: a solid cylinder's"),
    Key("hub_width", POSITIVE, "m", "along the axle"),
    Key("roller_mass", POSITIVE, "kg", "a roller"),
    Key("roller_axial_inertia", POSITIVE, "kg m^2", "about its own axis; or give its size"),
    Key("roller_transverse_inertia", POSITIVE, "kg m^2", "across its axis"),
    Key("roller_radius", POSITIVE, "m", "its size: a solid cylinder's"),
    Key("roller_length", POSITIVE, "m", "along its axis"),
    Key("rotor_mass", NOT_NEGATIVE, "kg", "a motor's rotor behind its gear", "0"),
    Key("rotor_axial_inertia", NOT_NEGATIVE, "kg m^2", "about its axis, which is parallel to the axle", "0"),
    Key("rotor_transverse_inertia", NOT_NEGATIVE, "kg m^2", "across its axis", "0"),
    Key("rotor_distance", NOT_NEGATIVE, "m", "S to the rotor's centre", "0"),
    Key("gear_ratio", NUMBER, "1", "turns of the rotor per turn of the wheel", "1"),
)

SCENE = (
    Table(
        "vehicle",
        "The vehicle: a preset, or numbers, or the parts whose masses and sizes make the numbers.",
        PRESET + SIZES + SHARED + NUMBERS + PARTS,
        needed=True,
    ),
    Table(
        "start",
        "The state at the start; the first roller of every wheel has contact.",
        (
            Key("nu", SPEEDS, "1/s", "v_S = R (nu_1, nu_2), yaw rate = nu_3/Lambda", needed=True),
            Key("chi", Numbers(((), ("N",))), "rad", "wheel angles within +-pi/n; one number for all wheels", "0"),
            Key("spins", Numbers(((), ("N", "n-1"))), "rad/s", "of free rollers relative to their disks", "0"),
            Key("pose", SPEEDS, "m, m, rad", "x, y and heading", "[0, 0, 0]"),
        ),
        needed=True,
    ),
    Table(
        "run",
        "What is wanted back.",
        (
            Key("duration", NOT_NEGATIVE, "s", "simulated time", needed=True),
            Key("accuracy", Numbers(above=0, below=1), "1", "error in ((x, y)/R, theta, nu/abs(nu(0)))", "1e-9"),
            Key("start_time", NUMBER, "s", "time at the start", "0"),
            Key("step", POSITIVE, "s", "samples.csv has a row at every multiple of it", "no samples"),
            Key("times", TIMES, "s", "samples.csv has rows at these times, in place of step", "no samples"),
            Key("engine", Choice(ENGINES), "", "C kernels, or Python's", "compiled"),
        ),
        needed=True,
    ),
    Table(
        "rollers",
        "How the rollers are modelled.",
        (Key("model", Choice(ROLLER_MODELS), "", "without inertia; fixed to their disk off the ground; free", "free"),),
    ),
    Table(
        "switching",
        "What happens where the contact passes to the next roller.",
        (Key("law", Choice(LAWS), "", "nu passes unchanged; or a perfectly inelastic impact", "impact"),),
    ),
    Table(
        "drive",
        "Torques at the wheels' axles: given (torque), or of DC motors (voltage and the motor's numbers).",
        (
            Key("torque", Numbers((("N",), ("K", "N"))), "N m", "per wheel; with times, a row for each time"),
            Key(
                "voltage", Numbers((("N",), ("K", "N"))), "V", "of each wheel's motor; with times, a row for each time"
            ),
            Key("times", TIMES, "s", "of the rows; before the first and after the last the nearest row holds"),
            Key("interpolation", Choice(("linear", "hold")), "", "between the rows", "linear"),
            Key("torque_constant", POSITIVE, "N m/A", "of the motor"),
            Key("resistance", POSITIVE, "ohm", "of the motor"),
            Key("gear_ratio", NUMBER, "1", "turns of the rotor per turn of the wheel", "1"),
            Key("back_emf", NOT_NEGATIVE, "V s", "voltage per rotor speed", "torque_constant"),
            Key("current_limit", POSITIVE, "A", "the current stays within +-this", "no limit"),
            Key("rotor_inertia", NOT_NEGATIVE, "kg m^2", "of the rotor about its axis", "0"),
        ),
    ),
    Table(
        "controller",
        "A controller that tracks speeds by the drive; sampled, its output held between samples.",
        (
            Key(
                "target", Numbers(((3,), ("K", 3))), "1/s", "nu that is wanted; with times, a row for each", needed=True
            ),
            Key("times", TIMES, "s", "of the rows"),
            Key("gain", FRICTION, "N m s", "torque per error of a wheel's speed", needed=True),
            Key("integral_gain", FRICTION, "N m", "torque per error of a wheel's angle", "0"),
            Key("sample_time", POSITIVE, "s", "between samples", needed=True),
            Key("torque_limit", POSITIVE, "N m", "the torque stays within +-this", "no limit"),
        ),
    ),
    Table(
        "bearings",
        "Friction in the axles of wheels and rollers; one number for all wheels, or one for each.",
        (
            Key("wheel_viscous", FRICTION, "N m s", "torque per speed of a wheel", "0"),
            Key("wheel_coulomb", FRICTION, "N m", "torque against the motion of a wheel", "0"),
            Key("wheel_speed", REGULARISATION, "rad/s", "named speed of the regularisation; needed by wheel_coulomb"),
            Key("roller_viscous", FRICTION, "N m s", "torque per spin of a roller on its disk", "0"),
            Key("roller_coulomb", FRICTION, "N m", "torque against the spin of a roller on its disk", "0"),
            Key("roller_speed", REGULARISATION, "rad/s", "named speed of the regularisation; needed by roller_coulomb"),
        ),
    ),
    Table(
        "slope",
        "Gravity on an inclined plane.",
        (
            Key("angle", Numbers(least=0, below=math.pi / 2), "rad", "of the plane with the horizontal", needed=True),
            Key("direction", NUMBER, "rad", "of steepest descent, in the x, y plane", "0"),
            Key("gravity", POSITIVE, "m/s^2", "", "9.80665"),
        ),
    ),
    Table(
        "layout",
        "Wheels at places of their own, and a centre of mass that is not S.",
        (
            Key(
                "wheel_places",
                Numbers((("N", 2),)),
                "m",
                "x, y of the wheels' centres in the vehicle, from S",
                "on rays",
            ),
            Key("wheel_angles", PER_WHEEL, "rad", "directions of the axles", "those of [vehicle]"),
            Key("center_of_mass", Numbers(((2,),)), "m", "x, y in the vehicle, from S", "[0, 0]"),
        ),
    ),
    Table(
        "reactions",
        "Contact forces and loads, beside the motion.",
        (Key("friction", POSITIVE, "1", "coefficient of friction: the margin to slipping", "no margin"),),
    ),
)
TABLES = {table.name: table for table in SCENE}


def keys() -> Iterator[tuple[Table, Key]]:
    """Every key with its table."""
    return ((table, key) for table in SCENE for key in table.keys)

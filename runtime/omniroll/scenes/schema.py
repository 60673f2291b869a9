"""What a scene file may say: its tables and their keys, with units, defaults and bounds.

N is the number of wheels, n of rollers per wheel, K the number of rows of a table over time.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from omniroll.engine.simulate import ENGINES
from omniroll.engine.switching import LAWS
from omniroll.kernels.kernel import ROLLER_MODELS
from omniroll.scenes.kinds import Choice, Numbers, Whole

NUMBER = Numbers()
POSITIVE = Numbers(above=0)
NOT_NEGATIVE = Numbers(least=0)
PER_WHEEL = Numbers(shapes=(("N",),))
FRICTION = Numbers(shapes=((), ("N",)), least=0)
SPEEDS = Numbers(shapes=((3,),))
SPEEDS_OVER_TIME = Numbers(shapes=((3,), ("K", 3)))
OVER_TIME = Numbers(shapes=((), ("N",), ("K", "N")))
PLACE = Numbers(shapes=((2,),))
PLACES = Numbers(shapes=(("N", 2),))
SPIN_INERTIA = Numbers(shapes=((), ("N",)), above=0)
OUTPUT = Choice(("torque", "voltage"))
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

# [drive] is one of two things; the first keys go with both.
DRIVE = (
    Key("times", TIMES, "s", "of the rows; before the first and after the last the nearest row holds"),
    Key("interpolation", Choice(("linear", "hold")), "", "between the rows", "linear"),
)
TORQUE = (Key("torque", OVER_TIME, "N m", "for all wheels, or each; with times, a row for each time"),)
MOTOR = (
    Key("voltage", OVER_TIME, "V", "for all motors, or each; with times, a row for each time"),
    Key("torque_constant", POSITIVE, "N m/A", "of a motor; needed with voltage"),
    Key("resistance", POSITIVE, "ohm", "of a motor; needed with voltage"),
    Key("gear_ratio", NUMBER, "1", "turns of the rotor per turn of the wheel; negative: the other way", "1"),
    Key("back_emf", NOT_NEGATIVE, "V s", "voltage per rotor speed", "torque_constant"),
    Key("current_limit", POSITIVE, "A", "the current stays within +-this", "no limit"),
    Key("rotor_inertia", NOT_NEGATIVE, "kg m^2", "of the rotor about its axis; added to the wheel's by the gear", "0"),
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
        "Torques at the wheels' axles: given (`torque`), or of DC motors (`voltage` and the motor's numbers).",
        DRIVE + TORQUE + MOTOR,
    ),
    Table(
        "controller",
        "A sampled controller that tracks speeds, one loop a wheel; its output is held between samples.",
        (
            Key("target", SPEEDS_OVER_TIME, "1/s", "nu that is wanted; with times, a row for each", needed=True),
            Key("times", TIMES, "s", "of the rows; linear in between"),
            Key("proportional", FRICTION, "N m s, V s", "output per error of a wheel's speed", needed=True),
            Key("integral", FRICTION, "N m, V", "output per error of a wheel's angle", "0"),
            Key("sample_time", POSITIVE, "s", "between samples, the first at the start", needed=True),
            Key("output", OUTPUT, "", "at the axle; voltage is added to that of [drive]", "torque"),
            Key("limit", POSITIVE, "N m, V", "the output stays within +-this", "no limit"),
        ),
    ),
    Table(
        "bearings",
        "Friction in the axles of wheels and rollers. Coulomb's is torque * speed/sqrt(speed^2 + named speed^2): it "
        "does not stick, and a small named speed is stiff.",
        (
            Key("wheel_viscous", FRICTION, "N m s", "torque per speed of a wheel", "none"),
            Key("wheel_coulomb", FRICTION, "N m", "torque against the motion of a wheel", "none"),
            Key("wheel_speed", POSITIVE, "rad/s", "below it wheel_coulomb gives way; needed with that"),
            Key("roller_viscous", FRICTION, "N m s", "torque per spin of a roller on its disk", "none"),
            Key("roller_coulomb", FRICTION, "N m", "torque against the spin of a roller on its disk", "none"),
            Key("roller_speed", POSITIVE, "rad/s", "below it roller_coulomb gives way; needed with that"),
        ),
    ),
    Table(
        "slope",
        "Gravity on an inclined plane.",
        (
            Key("angle", Numbers(least=0, below=math.pi / 2), "rad", "of the plane with the horizontal", needed=True),
            Key("direction", NUMBER, "rad", "of steepest descent, in the x, y plane", "0"),
            Key("gravity", NOT_NEGATIVE, "m/s^2", "its strength", "9.80665"),
        ),
    ),
    Table(
        "layout",
        "Wheels at places of their own, and a centre of mass that is not S.",
        (
            Key("wheel_places", PLACES, "m", "x, y of the wheels' centres from S in the vehicle", "on rays"),
            Key("wheel_angles", PER_WHEEL, "rad", "directions of the axles", "those of [vehicle]"),
            Key("center_of_mass", PLACE, "m", "x, y from S in the vehicle; yaw_inertia stays about S", "[0, 0]"),
        ),
    ),
    Table(
        "reactions",
        "Contact forces, loads, and the margins to slipping and tipping, worked out after the motion.",
        (
            Key("height", POSITIVE, "m", "of the centre of mass above the ground", needed=True),
            Key("friction", POSITIVE, "1", "coefficient between rollers and ground", "no margin to slipping"),
            Key("gravity", POSITIVE, "m/s^2", "its strength", "that of [slope], 9.80665"),
            Key(
                "wheel_mass", POSITIVE, "kg", "of a wheel; needed where the wheels' centroid is not the centre of mass"
            ),
            Key("platform_products", PLACE, "kg m^2", "integrals of z x and z y over the platform", "[0, 0]"),
            Key("spin_inertia", SPIN_INERTIA, "kg m^2", "spin of a wheel about its axle, per rate", "wheel_inertia"),
        ),
    ),
)
TABLES = {table.name: table for table in SCENE}


def keys() -> Iterator[tuple[Table, Key]]:
    """Every key with its table."""
    return ((table, key) for table in SCENE for key in table.keys)

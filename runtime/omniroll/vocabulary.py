"""Every number and every choice that a user gives: its name, its unit, what it means, its bounds, its default.

This is the one table. The classes Vehicle and of the effects, the functions simulate and reactions, the scene schema
and docs/scenes.md take what they say from here. What the derivation knows, an argument of a generated function or a
symbol of the paper, has its unit and meaning from maxima/vocabulary.mac by way of generated/data, as the C headers do;
`derived` adds only what a user must know besides.

N is the number of wheels, n of rollers per wheel, K the number of rows of a table over time, W of tracking wheels.
"""

import math
import textwrap
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from omniroll import generated_data
from omniroll.kinds import Choice, Flag, Flags, Names, Numbers, Tables, Whole, Word

ROLLER_MODELS = ("massless", "locked", "free")
LAWS = ("smooth", "impact")
GROUND_LAWS = ("viscous", "regularised", "coulomb")
LOADS = ("static", "dynamic")
ENGINES = ("compiled", "specialised", "python")
OUTPUTS = ("torque", "voltage")
INTERPOLATIONS = ("linear", "hold")
STANDARD_GRAVITY = 9.80665  # m/s^2

MOST_OF_A_KIND = 1_000_000  # wheels of a vehicle, rollers of a wheel

NUMBER = Numbers()
POSITIVE = Numbers(above=0)
NOT_NEGATIVE = Numbers(least=0)
PER_WHEEL = Numbers(shapes=(("N",),))
ONE_OR_PER_WHEEL = Numbers(shapes=((), ("N",)))
EACH = ONE_OR_PER_WHEEL.shapes
COEFFICIENT = Numbers(EACH, least=0)
ROWS = Numbers(shapes=(("K", "N"),))
OVER_TIME = Numbers(shapes=((), ("N",), ("K", "N")))
THREE = Numbers(shapes=((3,),))
THREE_OVER_TIME = Numbers(shapes=((3,), ("K", 3)))
PLACE = Numbers(shapes=((2,),))
TIMES = Numbers(shapes=(("K",),), increasing=True)
PER_TRACKING_WHEEL = Numbers(shapes=(("W",),))

WIDTH = 116  # of a docstring's lines
Documented = TypeVar("Documented", bound=Callable[..., Any])


@dataclass(frozen=True)
class Entry:
    """One number or choice.

    meaning   a phrase that the unit can follow
    note      what to know besides, as a sentence without its full stop
    default   in words; empty where there is none to name
    optional  None stands for it where it is not given
    needed    it has no default and must be given
    """

    name: str
    kind: Choice | Flags | Names | Numbers | Tables | Whole | Word
    unit: str
    meaning: str
    default: str = ""
    optional: bool = False
    needed: bool = False
    note: str = ""

    def checked(self, value: Any) -> Any:
        """`value` as the package keeps it. Raises InvalidValueError with the name, the value and the bound."""
        return None if value is None and self.optional else self.kind.checked(self.name, value)

    def described(self) -> str:
        """Meaning, unit, values, default and note as text for a docstring."""
        text = self.meaning + (f", in {self.unit}" if self.unit not in ("", "1") else "")
        text += "" if self.kind == NUMBER else f": {self.kind.in_python()}"
        text += f"; default: {self.default}" if self.default else ""
        return text + (f". {self.note}" if self.note else "")


def bounded(name: str, shapes: tuple = ((),)) -> Numbers:
    """Real numbers with the bound that the derivation sets to each by itself."""
    for bound in generated_data.load("bounds")["bounds"]:
        if bound["field"] == name and isinstance(bound.get("positive"), str):
            return Numbers(shapes, above=0)
        if bound["field"] == name and isinstance(bound.get("not_negative"), str):
            return Numbers(shapes, least=0)
    return Numbers(shapes)


def derived(name: str, kind: Any, *, argument: str = "", **options: Any) -> Entry:
    """An entry that the derivation knows, under the name `argument` if that is another one."""
    about = generated_data.described(argument or name)
    unit = "" if isinstance(kind, Whole) else about.unit  # counts have none
    return Entry(name, kind, unit, about.text, **options)


def by_name(*tables: Iterable[Entry]) -> dict[str, Entry]:
    """The entries of some tables by their names."""
    return {entry.name: entry for table in tables for entry in table}


# The vehicle

WHEELS = derived("wheels", Whole(1, MOST_OF_A_KIND))
ROLLERS_PER_WHEEL = derived(
    "rollers_per_wheel", Whole(3, MOST_OF_A_KIND), note="At least 4 where roller_axis_radius is not given"
)
LENGTHS = (
    derived("platform_radius", bounded("platform_radius")),
    derived("wheel_radius", bounded("wheel_radius")),
    derived(
        "roller_axis_radius",
        bounded("roller_axis_radius"),
        default="wheel_radius less roller_radius; or that of truncated rollers, section 4; or that of mecanum rollers "
        "that touch their neighbours",
    ),  # fmt: skip
)
WHEEL_ANGLES = derived("wheel_angles", PER_WHEEL, default="evenly spaced, the first 0")
INERTIAS = (
    derived("mass", bounded("mass")),
    derived("yaw_inertia", bounded("yaw_inertia")),
    derived("wheel_inertia", bounded("wheel_inertia")),
    derived("roller_inertia", bounded("roller_inertia")),
)
YAW_SCALE = derived("yaw_scale", bounded("yaw_scale"), default="1")
LAYOUT = (
    derived(
        "wheel_places",
        Numbers(shapes=(("N", 2),)),
        note="Where they are given, wheel_angles are only the directions of the axles, and platform_radius is only "
        "the scale of nu",
        default="on the rays of wheel_angles at platform_radius",
    ),
    derived("center_of_mass", PLACE, note="yaw_inertia stays that about S", default="(0, 0)"),
)
WHEEL_KIND = (  # the paper's wheels have the defaults
    Entry(
        "roller_angle",
        Numbers(EACH, above=-math.pi / 2, below=math.pi / 2),
        "rad",
        "psi, angle between the rollers' axes and the plane of their wheel",
        default="0: omni-wheels",
        note="Mecanum wheels have some 45 degrees. Its sign is the hand of the wheel: positive where the "
        "roller on the ground is turned clockwise out of the wheel's plane, as seen from above. One number is for all "
        "wheels",
    ),
    Entry(
        "rows",
        Whole(1, 2),
        "",
        "rows of rollers of each wheel",
        default="1",
        note="rollers_per_wheel counts both rows together, is even then, and they take the ground by turns",
    ),
    Entry(
        "row_offset",
        NUMBER,
        "m",
        "distance of a row of rollers from the middle of its wheel, along the axle",
        default="0",
        note="Needed with two rows. Positive where the row of roller 0 is the outward one",
    ),
    Entry(
        "meridian_radius",
        POSITIVE,
        "m",
        "radius of the arc that is a roller's meridian",
        optional=True,
        default="none: the wheel stays round",
        note="With it the wheel rises and falls while it rolls. wheel_radius - roller_axis_radius makes the rollers "
        "spheres, more makes them barrels",
    ),
    Entry(
        "roller_profile",
        Numbers(shapes=(("several", 3),)),
        "m",
        "a roller's meridian where it has several arcs, from one end to the other: of each where its centre is along "
        "the roller's axis, from the middle, and from the axis, and its radius, 0 for an edge",
        optional=True,
        default="none: meridian_radius says it, or the wheel stays round",
        note="Each arc must touch its neighbours' circles or have a tangent with them. A cylinder of length L and "
        "radius a is [[-L/2, a, 0], [L/2, a, 0]]; points by themselves are edges",
    ),
)
OF_THE_VEHICLE = "that of the vehicle"
KIND = (  # what a kind of wheels may have otherwise
    replace(LENGTHS[1], default=OF_THE_VEHICLE),
    replace(
        LENGTHS[2],
        default=f"{OF_THE_VEHICLE}; where the kind has wheel_radius or rollers_per_wheel, as of a vehicle with these",
    ),
    replace(ROLLERS_PER_WHEEL, default=OF_THE_VEHICLE, note="At most that of the vehicle"),
    replace(INERTIAS[2], default=OF_THE_VEHICLE),
    replace(
        INERTIAS[3],
        kind=NOT_NEGATIVE,
        default=OF_THE_VEHICLE,
        note="0: rollers without inertia beside others that have one",
    ),
    replace(WHEEL_KIND[1], default=OF_THE_VEHICLE, note="1 for wheels with one row on a vehicle with two"),
    replace(WHEEL_KIND[2], default=f"{OF_THE_VEHICLE}, 0 with one row", note=""),
    Entry(
        "driven",
        Flag(),
        "",
        "whether the wheels have a drive",
        default="true",
        note="Without one a wheel tracks: no torque acts at its axle but friction",
    ),
)
KINDS = (
    Entry(
        "wheel_kinds",
        Names(),
        "",
        "kind of each wheel, by name",
        default="wheels that are all alike",
        optional=True,
        note="Each has the numbers of its kind, and the vehicle's where its kind says nothing",
    ),
    Entry(
        "kinds",
        Tables(),
        "",
        "numbers of the kinds of wheels, by name: "
        "wheel_radius, roller_axis_radius, rollers_per_wheel, wheel_inertia, roller_inertia, rows, row_offset, driven",
        default="none",
        note="The inertias of the whole vehicle stay what they are said to be",
    ),
)
VEHICLE = (WHEELS, ROLLERS_PER_WHEEL, WHEEL_ANGLES, *LENGTHS, *INERTIAS, YAW_SCALE, *LAYOUT, *WHEEL_KIND, *KINDS)
PARTS = (
    derived("platform_mass", NOT_NEGATIVE, note="The platform is all that is not wheels and rotors"),
    derived("platform_inertia", NOT_NEGATIVE),
    derived("hub_mass", NOT_NEGATIVE, note="A hub is a wheel without its rollers"),
    derived("hub_axial_inertia", NOT_NEGATIVE),
    derived("hub_transverse_inertia", NOT_NEGATIVE),
    derived("roller_mass", POSITIVE),
    derived("roller_axial_inertia", POSITIVE),
    derived("roller_transverse_inertia", POSITIVE),
    derived("rotor_mass", NOT_NEGATIVE, note="There is one motor for each wheel", default="0"),
    derived("rotor_axial_inertia", NOT_NEGATIVE, note="The rotor's axis is parallel to the axle", default="0"),
    derived("rotor_transverse_inertia", NOT_NEGATIVE, default="0"),
    derived("rotor_distance", NOT_NEGATIVE, default="0"),
    derived("gear_ratio", NUMBER, note="Negative where the rotor turns the other way", default="1"),
)

SOLIDS = (  # sizes of solid bodies, which stand for their inertias
    Entry("platform_disk_radius", POSITIVE, "m", "radius of the platform as a solid disk"),
    Entry("hub_radius", POSITIVE, "m", "radius of a hub as a solid cylinder"),
    Entry("hub_width", POSITIVE, "m", "width of a hub, along the axle"),
    derived(
        "roller_radius",
        POSITIVE,
        note="Where roller_axis_radius is not given, it is wheel_radius less this",
    ),
    derived("roller_length", POSITIVE),
)
DATA_SHEET = (  # what data sheets print besides; mass is that of the whole vehicle
    Entry("wheel_diameter", POSITIVE, "m", "diameter of a wheel", note="It stands for wheel_radius"),
    Entry("roller_diameter", POSITIVE, "m", "diameter of a roller in its middle", note="It stands for roller_radius"),
    Entry("wheel_width", POSITIVE, "m", "width of a wheel, along its axle", note="It stands for hub_width"),
    derived("wheel_mass", POSITIVE, note="With mass, it stands for hub_mass"),
)

# The state at the start, and what a run is asked for

STATE = (
    derived(
        "nu",
        THREE,
        note="The centre moves at R nu_1 forward and R nu_2 to the left; the yaw rate is nu_3/Lambda",
        needed=True,
    ),
    derived("chi", ONE_OR_PER_WHEEL, note="Each lies within +-pi/n. One number is for all wheels", default="0"),
    derived(
        "spins",
        Numbers(shapes=((), ("N", "n-1"))),
        note="One number is for all rollers. Locked and massless rollers have 0",
        default="0",
    ),
    derived("pose", THREE, note="theta is the heading", default="(0, 0, 0)"),
)
RUN = (
    Entry("duration", NOT_NEGATIVE, "s", "time that is simulated", needed=True),
    Entry(
        "accuracy",
        Numbers(above=0, below=1),
        "1",
        "largest error of the run, in the max-norm of ((x, y)/R, theta, nu/abs(nu(0)))",
        "1e-9",
        note="With effects nu is taken over the largest abs(nu) of the run",
    ),
    Entry("start_time", NUMBER, "s", "time at the start", "0"),
    Entry("engine", Choice(ENGINES), "", "the engine that integrates", "compiled"),
    Entry(
        "memory",
        POSITIVE,
        "bytes",
        "memory that the steps of a run may take",
        "2^30",
        note="A run that would need far more is stopped while it is young; its trajectory, once it is read, takes some "
        "four times as much. A scene may lower it; who runs it may raise it, too",
    ),
)
ROLLER_MODEL = Entry(
    "roller_model",
    Choice(ROLLER_MODELS),
    "",
    "how the rollers are modelled",
    "free",
    note="Massless rollers have no inertia; locked ones do not spin on their disk while they are off the ground; free "
    "ones spin",
)
SWITCHING = Entry(
    "switching",
    Choice(LAWS),
    "",
    "the law of a switch",
    "impact",
    note="smooth: nu passes a switch unchanged; impact: the new constraints are imposed perfectly inelastically",
)

# The effects

ROW_TIMES = Entry(
    "times",
    TIMES,
    "s",
    "times of the rows, on the clock of the run",
    optional=True,
    note="Before the first and after the last of them the nearest row holds",
)
INTERPOLATION = Entry("interpolation", Choice(INTERPOLATIONS), "", "what holds between the rows", "linear")
TORQUE = derived(
    "torque",
    OVER_TIME,
    note="A positive torque raises chi. One number is for all wheels; with times there is a row for each time",
)
MOTOR = (
    Entry(
        "voltage",
        OVER_TIME,
        "V",
        "voltages of the motors",
        note="A positive voltage, with a positive gear_ratio, gives a torque that raises chi. One number is for all "
        "motors; with times there is a row for each time",
    ),
    Entry("torque_constant", POSITIVE, "N m/A", "torque of a rotor per current", needed=True),
    Entry("resistance", POSITIVE, "ohm", "resistance of a motor", needed=True),
    by_name(PARTS)["gear_ratio"],
    Entry("back_emf", NOT_NEGATIVE, "V s", "voltage that a motor induces per rate of its rotor", "torque_constant"),
    Entry("current_limit", POSITIVE, "A", "largest size of a motor's current", "no limit", optional=True),
    derived(
        "rotor_inertia",
        NOT_NEGATIVE,
        argument="rotor_axial_inertia",
        note="gear_ratio^2 times it is added to wheel_inertia, so that it is 0 where that holds the rotor already",
        default="0",
    ),
)
MOTOR_SHEET = (
    derived("rated_voltage", POSITIVE),
    derived("stall_torque", POSITIVE),
    derived("free_speed", POSITIVE, note="1 rpm is 0.10472 rad/s"),
)
CONTROLLER = (
    Entry(
        "target",
        THREE_OVER_TIME,
        "1/s",
        "nu that is wanted",
        needed=True,
        note="With times there is a row for each time",
    ),
    Entry(
        "proportional",
        COEFFICIENT,
        "N m s or V s",
        "output per error of a wheel's rate",
        needed=True,
        note="The error is the rate that target asks for less the rate that the wheel has",
    ),
    Entry(
        "sample_time",
        POSITIVE,
        "s",
        "time from one sample to the next",
        needed=True,
        note="The first sample is at the start",
    ),
    Entry(
        "integral",
        COEFFICIENT,
        "N m or V",
        "output per integral of the error of a wheel's rate",
        "0",
        note="A sample at which the output of a wheel is cut off at limit leaves the integral of that wheel as it was",
    ),
    Entry(
        "output",
        Choice(OUTPUTS),
        "",
        "what the controller gives",
        "torque",
        note="Torques act at the axles, and a positive one raises chi. Voltages are added to those of the motors",
    ),
    Entry("limit", POSITIVE, "N m or V", "largest size of a wheel's output", "no limit", optional=True),
    Entry(
        "times",
        TIMES,
        "s",
        "times of the rows of target, on the clock of the run",
        optional=True,
    ),
    INTERPOLATION,
)
FUNCTION_CONTROLLER = (
    Entry("function", Word(), "", "name of a registered function, or of a class of such functions", needed=True),
    by_name(CONTROLLER)["sample_time"],
    by_name(CONTROLLER)["output"],
)
PATH = (
    Entry("times", TIMES, "s", "times of the rows of poses, on the clock of the run", needed=True),
    Entry(
        "poses",
        Numbers(shapes=(("K", 3),)),
        "m, m, rad",
        "x, y, theta that are wanted",
        needed=True,
        note="Between the times they lie on a cubic spline, which begins and ends at rest; before the first and after "
        "the last time the nearest row holds. theta counts turns: it goes on beyond pi",
    ),
    by_name(CONTROLLER)["sample_time"],
    Entry(
        "bandwidth",
        Numbers(above=0, most=1e9),
        "rad/s",
        "how fast errors of the pose fade",
        needed=True,
        note="Each error fades as if its equation had the root -bandwidth three times: 3 bandwidth times its rate, "
        "3 bandwidth^2 times itself and bandwidth^3 times its integral are added to the path's acceleration",
    ),
    by_name(CONTROLLER)["output"],
    by_name(CONTROLLER)["limit"],
)
BEARINGS = (
    derived("wheel_viscous", bounded("axle_damping", EACH), argument="axle_damping", default="none", optional=True),
    derived("wheel_coulomb", bounded("axle_torque", EACH), argument="axle_torque", default="none", optional=True),
    derived(
        "wheel_speed",
        bounded("axle_fade_speed"),
        argument="axle_fade_speed",
        note="With it the torque is smooth and nothing sticks; without it an axle at rest sticks",
        default="none: axles stick",
        optional=True,
    ),
    Entry(
        "wheel_break_away",
        COEFFICIENT,
        "N m",
        "largest torque that the bearings of an axle at rest take",
        "wheel_coulomb",
        optional=True,
        note="At least wheel_coulomb, which an axle that turns takes. Only without wheel_speed",
    ),
    Entry(
        "wheel_locked",
        Flags(),
        "",
        "which axles are locked and never turn",
        "none",
        optional=True,
        note="They take any torque up to 1000 times the vehicle's weight at the wheel's radius, far above what"
        " drives and the ground give. Only without wheel_speed",
    ),
    derived(
        "roller_viscous", bounded("roller_damping", EACH), argument="roller_damping", default="none", optional=True
    ),
    derived("roller_coulomb", bounded("roller_torque", EACH), argument="roller_torque", default="none", optional=True),
    derived(
        "roller_speed",
        bounded("roller_fade_speed"),
        argument="roller_fade_speed",
        default="none: rollers stick",
        note="Only with roller_coulomb",
        optional=True,
    ),
    Entry(
        "roller_break_away",
        COEFFICIENT,
        "N m",
        "largest torque that the bearings of a roller at rest on its disk take",
        "roller_coulomb",
        optional=True,
        note="At least roller_coulomb, which a roller that spins takes. Only without roller_speed",
    ),
)
SLOPE = (
    derived("angle", Numbers(least=0, below=math.pi / 2), argument="slope_angle", needed=True),
    derived("direction", NUMBER, argument="slope_direction", default="0"),
    derived("gravity", NOT_NEGATIVE, default=f"{STANDARD_GRAVITY}"),
)

WEIGHT = (derived("gravity", NOT_NEGATIVE, default=f"{STANDARD_GRAVITY}"),)

# Numbers of the loads' balance that a vehicle does not have, beside height

BALANCE = (
    derived(
        "wheel_mass",
        POSITIVE,
        note="It is needed where the wheels' centroid is not the centre of mass; elsewhere it has no influence",
        optional=True,
    ),
    derived(
        "platform_products",
        PLACE,
        note="(0, 0) is exact where what is not wheels has a vertical axis or a horizontal plane of symmetry",
        default="(0, 0)",
    ),
    derived(
        "spin_inertia",
        Numbers(shapes=((), ("N",)), above=0),
        note="The default is exact unless wheel_inertia itself holds a rotor behind a gear; then it is wheel_inertia "
        "less gear (gear - 1) times the rotor's inertia",
        default="wheel_inertia, with the rotors of the run's motors",
        optional=True,
    ),
)
# The springs at the contacts, on which the platform heaves and tilts

SPRINGS = (
    derived("height", POSITIVE, needed=True),
    Entry("deflection", POSITIVE, "m", "how far each spring gives way under its load at rest", "1e-4"),
    Entry(
        "damping_ratio",
        NOT_NEGATIVE,
        "1",
        "damping of a load's mass on its spring and damper, over that at which it ceases to swing",
        "0.3",
    ),
    Entry(
        "tilt_inertia",
        Numbers(shapes=((), (2,)), above=0),
        "kg m^2",
        "inertia of the whole vehicle about the horizontal axes xi and eta through its centre of mass",
        "from the vehicle's size",
        optional=True,
        note="From its size: that of a cylinder over the wheels' circle, from the ground to twice the height",
    ),
    Entry(
        "products",
        PLACE,
        "kg m^2",
        "products of inertia of the whole vehicle about its centre of mass: vertical with xi, vertical with eta",
        "(0, 0)",
    ),
    replace(BALANCE[2], default="wheel_inertia", note="It must be given beside a motor whose rotor has inertia"),
    derived("normal_gravity", POSITIVE, default=f"{STANDARD_GRAVITY}", note="That of the contacts"),
    Entry("tilt", THREE, "m, rad, rad", "heave at the centre of mass, and turns about xi and eta at the start", "0"),
    Entry("tilt_rate", THREE, "m/s, rad/s, rad/s", "their rates at the start", "0"),
    Entry("most_tilt", POSITIVE, "rad", "turn about xi or eta at which the vehicle has tipped: the run ends", "0.2"),
)
TWO = ((), (2,))
CONTACT = (
    Entry(
        "law",
        Choice(GROUND_LAWS),
        "",
        "the law of the ground's friction",
        "viscous",
        note="viscous: in proportion to the slip; coulomb: Coulomb's friction, under which contacts stick and slip; "
        "regularised: the same, made smooth: it fades below a named speed",
    ),
    Entry(
        "coefficient",
        Numbers(shapes=TWO, least=0),
        "N s/m",
        "force of the ground per slip velocity",
        optional=True,
        note="Of the law viscous. Two numbers are along the wheels' axles and along their rolling directions",
    ),
    Entry(
        "friction",
        Numbers(shapes=TWO, above=0),
        "1",
        "coefficient of friction between rollers and ground",
        optional=True,
        note="Of the laws coulomb and regularised. Two numbers are along the axles and along the rolling directions: "
        "an ellipse",
    ),
    Entry(
        "static_friction",
        Numbers(shapes=TWO, above=0),
        "1",
        "coefficient of friction where a contact sticks",
        "friction",
        optional=True,
        note="Of the law coulomb; at least friction, in each direction",
    ),
    Entry(
        "speed",
        POSITIVE,
        "m/s",
        "slip velocity below which friction fades",
        optional=True,
        note="Of the law regularised: friction * load * slip/sqrt(slip^2 + speed^2)",
    ),
    Entry(
        "loads",
        Choice(LOADS),
        "",
        "how the loads of the contacts are found",
        "static",
        note="static: those at rest, or `load`. Of more than three wheels they are the loads of least norm that "
        "nowhere pull. dynamic is refused: loads of rigid bodies, coupled to friction, may be several or none",
    ),
    Entry(
        "load",
        COEFFICIENT,
        "N",
        "load of each contact",
        "those at rest",
        optional=True,
        note="Where loads are static. At rest they follow from weight, layout and centre of mass",
    ),
    derived(
        "normal_gravity",
        POSITIVE,
        default=f"{STANDARD_GRAVITY}",
        optional=True,
        note="It must be given on a slope where load is not",
    ),
    Entry(
        "joints",
        Flag(),
        "",
        "whether a wheel may stand on the joint of two rollers that both drive it back",
        "false",
        note="Such a wheel passes its joint to and fro else, ever faster. A run in which one does is made again with "
        "this, which costs about twice as much. Mecanum wheels and two rows always have it",
    ),
    Entry("wheel_rates", ONE_OR_PER_WHEEL, "rad/s", "wheel rates at the start", "they roll", optional=True),
    Entry(
        "contact_spins",
        ONE_OR_PER_WHEEL,
        "rad/s",
        "spins at the start of the rollers in contact, relative to their disks",
        "they roll",
        optional=True,
        note="Only of free rollers",
    ),
)

# What reactions asks for

REACTIONS = (
    derived("height", POSITIVE, needed=True),
    Entry(
        "friction", POSITIVE, "1", "coefficient of friction between rollers and ground", "no margin to slipping",
        optional=True,
    ),
    derived("gravity", POSITIVE, default=f"that of the run's slope, or {STANDARD_GRAVITY}", optional=True),
    *BALANCE,
)  # fmt: skip

# What instruments on a robot read

MEASUREMENTS = (
    Entry("wheel_angle", PER_WHEEL, "rad", "angle of a wheel since the start, with the joints that it has passed"),
    Entry("encoder_count", PER_WHEEL, "1", "whole counts of an encoder on a wheel's axle since the start"),
    Entry("wheel_rate", PER_WHEEL, "rad/s", "rate of a wheel"),
    Entry("net_torque", PER_WHEEL, "N m", "torque of drive, motor and bearings together at an axle"),
    Entry("motor_current", PER_WHEEL, "A", "current of a motor", note="Where a Motor is the only drive"),
    Entry("motor_voltage", PER_WHEEL, "V", "voltage at a motor's winding", note="Where a Motor is the only drive"),
    Entry("gyro", NUMBER, "rad/s", "rate of the heading"),
    Entry("accelerometer", PLACE, "m/s^2", "acceleration less gravity's in the plane, along the platform's axes"),
    Entry("odometry", THREE, "m, m, rad", "pose by dead reckoning from the encoders' counts"),
    Entry("contact_roller", PER_WHEEL, "1", "number of the roller in contact"),
    Entry("tracking_angle", PER_TRACKING_WHEEL, "rad", "angle of a tracking wheel since the start"),
    Entry("tracking_count", PER_TRACKING_WHEEL, "1", "whole counts of a tracking wheel's encoder since the start"),
    Entry("tracking_rate", PER_TRACKING_WHEEL, "rad/s", "rate of a tracking wheel"),
    Entry("tracking_odometry", THREE, "m, m, rad", "pose by dead reckoning from tracking wheels' counts"),
)
WITH_ERRORS = ("wheel_rate", "tracking_rate", "net_torque", "motor_current", "motor_voltage", "gyro", "accelerometer")
INSTRUMENTS = (
    Entry("counts_per_turn", POSITIVE, "1", "counts of an encoder in one turn of the wheel", "4096"),
    Entry("place", PLACE, "m", "place of the accelerometer in the platform's frame", "(0, 0)"),
    Entry("seed", Whole(0), "", "of the noise", "0", note="The same seed gives the same noise"),
    Entry(
        "tracking_places",
        Numbers(shapes=(("W", 2),)),
        "m",
        "places of tracking wheels in the platform's frame",
        "there are none",
        optional=True,
    ),
    Entry(
        "tracking_directions",
        PER_TRACKING_WHEEL,
        "rad",
        "directions in which tracking wheels roll, from x",
        optional=True,
        note="The rate is positive where the place moves that way",
    ),
    derived("tracking_radius", POSITIVE, optional=True),
    Entry("tracking_counts_per_turn", POSITIVE, "1", "counts of an encoder in one turn of a tracking wheel", "2000"),
    Entry(
        "place_height",
        NOT_NEGATIVE,
        "m",
        "height of the accelerometer above the ground",
        "that of the centre of mass",
        optional=True,
        note="It matters on springs, where the platform tilts",
    ),
)

KINDS_OF_ERROR = {
    "resolution": (NOT_NEGATIVE, "step of the readings of"),
    "noise": (NOT_NEGATIVE, "standard deviation of the noise of"),
    "bias": (NUMBER, "what is added to"),
}
ERRORS = tuple(  # of readings, by their names
    Entry(f"{entry.name}_{error}", kind, entry.unit, f"{meaning} {entry.name}", "0")
    for entry in MEASUREMENTS
    if entry.name in WITH_ERRORS
    for error, (kind, meaning) in KINDS_OF_ERROR.items()
)

# What the methods of a kernel take; a leading ... stands for any axes, which broadcast.

KERNEL_ARGUMENTS = tuple(
    derived(name, Numbers(shapes=(("...", *generated_data.load("arguments")["arguments"][name]["shape"]),)))
    for name in (
        "nu", "chi", "spins", "axial", "momenta", "pose", "theta", "heading", "chi_dot", "contact_spin", "force",
        "torque", "damping", "roller_drag", "entering", "leaving", "roller_energy", "momenta_after", "elapsed",
    )
)  # fmt: skip


def documented(*entries: Entry) -> Callable[[Documented], Documented]:
    """A decorator for classes and functions: lines for the entries take the place of {entries} in the docstring.

    A line has the name of an entry, then what it is.
    """

    def filled(thing: Documented) -> Documented:
        if thing.__doc__:  # python -OO takes docstrings away
            (line,) = [line for line in thing.__doc__.splitlines() if line.strip() == "{entries}"]
            thing.__doc__ = thing.__doc__.replace(line, lines(entries, line[: line.index("{")]))
        return thing

    return filled


def lines(entries: Iterable[Entry], indent: str = "") -> str:
    """One paragraph an entry, behind its name."""
    entries = tuple(entries)
    column = max(len(entry.name) for entry in entries) + 2
    return "\n".join(
        textwrap.fill(
            entry.described(),
            WIDTH,
            initial_indent=indent + entry.name.ljust(column),
            subsequent_indent=indent + " " * column,
            break_long_words=False,
            break_on_hyphens=False,
        )
        for entry in entries
    )

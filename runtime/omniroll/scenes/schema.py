"""What a scene file may say: its tables and their keys. The keys are entries of omniroll.vocabulary.

Added here are the keys that only a scene has, and what is another way in a scene: a default that a table gives, a
name that is shorter inside its table, the most wheels and rollers that a file may ask for.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from omniroll import vocabulary
from omniroll.kinds import Choice, Numbers, Whole, Word
from omniroll.robots.catalogue import ROBOTS
from omniroll.vehicles.data_sheet import BODIES
from omniroll.vocabulary import Entry

MOST_WHEELS, MOST_ROLLERS = 1000, 10_000


@dataclass(frozen=True)
class Table:
    """A table: its keys, and what its presence does."""

    name: str
    meaning: str
    keys: tuple[Entry, ...]
    needed: bool = False

    def key(self, name: str) -> Entry:
        """The key of that name. KeyError where there is none."""
        return {key.name: key for key in self.keys}[name]


# [vehicle] has three ways of saying what the vehicle is; the first keys go with each of them.
SIZES = (
    replace(vocabulary.WHEELS, kind=Whole(1, MOST_WHEELS), default="3 of the preset paper"),
    replace(vocabulary.ROLLERS_PER_WHEEL, kind=Whole(3, MOST_ROLLERS), default="5 of the preset paper"),
)
SHARED = (
    vocabulary.WHEEL_ANGLES,
    *vocabulary.LENGTHS,
    replace(vocabulary.YAW_SCALE, default="1; that of a preset"),
)
HANDEDNESS = Entry(
    "handedness",
    Numbers(shapes=(("N",),), least=-1, most=1),
    "1",
    "signs of roller_angle by wheel",
    default="1 for each wheel",
    note="Each is 1 or -1. [1, -1, -1, 1] for wheels front left, front right, rear left, rear right, whose axles point "
    "outward, is the usual arrangement: the rollers on top of the wheels make an X, seen from above",
)
KIND_OF_WHEELS = (vocabulary.WHEEL_KIND[0], HANDEDNESS, *vocabulary.WHEEL_KIND[1:])
WHEEL_KINDS = (
    replace(vocabulary.KINDS[0], note=f"{vocabulary.KINDS[0].note}. Each name has a table [vehicle.kinds.NAME]"),
)
KINDS = "kinds"  # in [vehicle]: a table for each kind of wheel
PRESET = (
    Entry(
        "preset",
        Choice(("paper", *ROBOTS)),
        "",
        "the paper's vehicle, or a robot of docs/robots.md",
        note="The other keys replace its numbers",
    ),
)
NUMBERS = (
    replace(vocabulary.INERTIAS[0], note="Beside parts it stands for platform_mass"),
    *vocabulary.INERTIAS[1:],
)


def _parts() -> Iterator[Entry]:
    """The parts, each body's sizes behind its inertias."""
    solids = vocabulary.by_name(vocabulary.SOLIDS)
    behind = {inertias[-1]: sizes for inertias, sizes in BODIES.values()}
    for entry in vocabulary.PARTS:
        follows = any(entry.name in inertias for inertias, _ in BODIES.values())
        yield replace(entry, note="It follows from the sizes where it is not given") if follows else entry
        yield from (solids[name] for name in behind.get(entry.name, ()))


PARTS = tuple(_parts())
SHEET = vocabulary.DATA_SHEET

# [drive] is one of two things; the first keys go with both.
DRIVE = (vocabulary.ROW_TIMES, vocabulary.INTERPOLATION)
# A log of commands stands for the rows of a table over time, and for their times.
TWIST_UNITS = "m/s, m/s, rad/s"
LOG = Entry(
    "log",
    Word(),
    "",
    "name of a CSV file or a bag beside the scene, with commands over time",
    note="Its rows hold until the next unless interpolation says otherwise; docs/conventions.md has the columns",
)
LOG_COLUMNS = Entry(
    "log_columns",
    Word(),
    "",
    "names of the log's columns, where they are others",
    note='As in "time=clock [ms], vx=/base/forward"',
)
# What people call a speed, in place of nu.
TWIST = Entry(
    "twist", vocabulary.THREE, TWIST_UNITS, "speed ahead, speed to the left and yaw rate", note="In place of nu"
)
TWISTS = replace(TWIST, kind=vocabulary.THREE_OVER_TIME, note="In place of target; with times a row for each time")
WHEEL_RATE = Entry(
    "wheel_rate",
    Numbers(shapes=(("N",), ("K", "N"))),
    "rad/s",
    "rates of the wheels, those of chi, that are wanted",
    note="In place of target; with times a row for each time",
)
INSTEAD = {("start", "nu"): ("twist",), ("controller", "target"): ("twist", "wheel_rate")}
MOTOR_PRESET = Entry(
    "preset",
    Choice(tuple(name for name, robot in ROBOTS.items() if robot.motor_numbers)),
    "",
    "the paper's vehicle, or a robot of docs/robots.md",
    note="Its motors, where they are known; the other keys replace their numbers",
)
OF_LOG = {"drive": ("times", "torque", "voltage"), "controller": ("times", "target", "twist", "wheel_rate")}
TORQUE = (vocabulary.TORQUE,)
MOTOR = tuple(
    replace(entry, needed=False, note="It, or the three numbers of a data sheet, is needed with voltage")
    if entry.needed
    else entry
    for entry in vocabulary.MOTOR
) + tuple(replace(entry, needed=False) for entry in vocabulary.MOTOR_SHEET)
SAMPLES = (
    Entry(
        "step", vocabulary.POSITIVE, "s", "time between the rows of samples.csv, the first at the start", "no samples"
    ),
    Entry("times", vocabulary.TIMES, "s", "times of the rows of samples.csv, in place of step", "no samples"),
)

SCENE = (
    Table(
        "vehicle",
        "The vehicle: a preset, or numbers, or the parts whose masses and sizes make the numbers. Of what data sheets "
        "print, `mass`, `wheel_diameter`, `roller_diameter` and `roller_length` are enough: beside `mass` what is not "
        "given of the parts is assumed, and `omniroll explain` says so.",
        PRESET + SIZES + SHARED + KIND_OF_WHEELS + WHEEL_KINDS + NUMBERS + PARTS + SHEET,
        needed=True,
    ),
    Table(
        "start",
        "The state at the start; the first roller of every wheel has contact.",
        (vocabulary.STATE[0], TWIST, *vocabulary.STATE[1:]),
        needed=True,
    ),
    Table("run", "What is wanted back.", vocabulary.RUN + SAMPLES, needed=True),
    Table("rollers", "How the rollers are modelled.", (replace(vocabulary.ROLLER_MODEL, name="model"),)),
    Table(
        "switching",
        "What happens where the contact passes to the next roller.",
        (replace(vocabulary.SWITCHING, name="law"),),
    ),
    Table(
        "drive",
        "Torques at the wheels' axles: given (`torque`), or of DC motors (`voltage` and the motor's numbers). A "
        "positive torque raises `chi`. By (2.2) a wheel whose `chi` grows rolls against its direction of rolling, "
        "which is the axle's, pointing outwards, turned by a right angle against the clock seen from above; so equal "
        "positive torques on evenly spaced wheels turn the vehicle clockwise.",
        (*DRIVE, LOG, LOG_COLUMNS, *TORQUE, MOTOR_PRESET, *MOTOR),
    ),
    Table(
        "controller",
        "A sampled controller that tracks speeds, one proportional and integral loop for each wheel. Its output is "
        "held between samples.",
        (vocabulary.CONTROLLER[0], TWISTS, WHEEL_RATE, *vocabulary.CONTROLLER[1:], LOG, LOG_COLUMNS),
    ),
    Table(
        "function_controller",
        "A controller that is a Python function, registered under a name with `omniroll.register_controller` before "
        "the scene is read. Its output is held between its calls, and is added to that of `[controller]`.",
        vocabulary.FUNCTION_CONTROLLER,
    ),
    Table(
        "path",
        "A sampled controller that takes the vehicle along a path: inverse dynamics of the path's accelerations, and "
        "feedback of the pose. Its output is held between samples, and is added to that of the other controllers.",
        vocabulary.PATH,
    ),
    Table(
        "bearings",
        "Friction in the axles of wheels and rollers. Coulomb's friction sticks: an axle that turns takes "
        "`wheel_coulomb`, one at rest what holds it, up to `wheel_break_away`; rollers on their disks do the same. "
        "With a named speed it is torque * speed/sqrt(speed^2 + named speed^2): it does not stick, and a small named "
        "speed is stiff.",
        vocabulary.BEARINGS,
    ),
    Table("slope", "Gravity on an inclined plane.", vocabulary.SLOPE),
    Table(
        "weight",
        "The work of the weight on wheels that rise and fall, those with a `meridian_radius`: each carries its load at "
        "rest up and down.",
        vocabulary.WEIGHT,
    ),
    Table(
        "contact",
        "Wheels that may slip on the ground. Without this table they roll. A switch then changes no speed, and "
        "`[switching]` has no part: the roller that comes into contact has the spin that it has, and the ground spins "
        "it up. Rollers cannot be `locked`.",
        vocabulary.CONTACT,
    ),
    Table(
        "springs",
        "Loads from springs and dampers at the contacts, on which the platform heaves and tilts; beside `[contact]` "
        "with the law coulomb or regularised. A contact may leave the ground and come back.",
        vocabulary.SPRINGS,
    ),
    Table(
        "layout",
        "Wheels at places of their own, and a centre of mass that is not S.",
        (vocabulary.LAYOUT[0], replace(vocabulary.WHEEL_ANGLES, default="those of [vehicle]"), *vocabulary.LAYOUT[1:]),
    ),
    Table(
        "measurements",
        "What instruments on the robot read, as further columns of samples.csv, which `[run]` must ask for: angles and "
        "rates of the wheels, counts of encoders, net torques, currents and voltages of motors, gyro, accelerometer, "
        "odometry.",
        vocabulary.INSTRUMENTS + vocabulary.ERRORS,
    ),
    Table(
        "reactions",
        "Contact forces, loads, and the margins to slipping and tipping, worked out after the motion.",
        vocabulary.REACTIONS,
    ),
)
TABLES = {table.name: table for table in SCENE}
KIND_OF_WHEEL = Table(
    "vehicle.kinds.NAME",
    "What wheels of the kind NAME have otherwise than `[vehicle]` says for all. It may be empty. The mass and the yaw "
    "inertia of the vehicle hold all wheels, whatever their kinds.",
    vocabulary.KIND,
)


def keys() -> Iterator[tuple[Table, Entry]]:
    """Every key with its table."""
    return ((table, key) for table in SCENE for key in table.keys)

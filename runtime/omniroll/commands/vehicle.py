"""omniroll vehicle FILE: the vehicle of a URDF or MJCF file as tables of a scene."""

import argparse
import json
import math
import re
from pathlib import Path
from typing import Any

from shtab import FILE

from omniroll.errors import InvalidValueError
from omniroll.exchange.importing import Imported, import_vehicle
from omniroll.robots.wheels import WHEEL_NAMES

SUMMARY = "read a vehicle from a URDF or MJCF file; print it as tables of a scene, with what was assumed"
EXAMPLES = (
    ("omniroll vehicle robot.urdf > robot.toml", "needs pip install 'omniroll[mujoco]'"),
    ("omniroll vehicle robot.urdf --rollers 10 --roller-radius 0.006", "wheels that are one body each in the file"),
    ("omniroll vehicle robot.urdf --wheel robot-soccer-kit", "the same, with the rollers of a known wheel"),
)
HIDDEN = ("yaw_scale",)
OPTIONS = (  # option, argument of import_vehicle, unit, help
    ("--wheel-radius", "wheel_radius", "M", "in m, where the file does not say it"),
    ("--wheel-inertia", "wheel_inertia", "KG_M2", "in kg m^2, of a wheel with its rollers about its axle"),
    ("--rollers", "rollers_per_wheel", "N", "rollers of a wheel, where wheels are one body each, as what follows"),
    ("--roller-radius", "roller_radius", "M", "in m, in the middle of a roller"),
    ("--roller-length", "roller_length", "M", "in m; assumed up to the neighbours where it is not given"),
    ("--roller-mass", "roller_mass", "KG", "in kg; assumed of polyurethane where it is not given"),
    ("--roller-inertia", "roller_inertia", "KG_M2", "in kg m^2, about a roller's axis, in place of mass and length"),
)
ANGLE = re.compile(r"([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(deg|rad)?")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="a URDF or MJCF file").complete = FILE
    for option, name, unit, text in OPTIONS:
        kind = int if unit == "N" else float
        parser.add_argument(option, dest=name, type=kind, metavar=unit, help=text)
    text = "between rollers' axes and the wheel's plane, such as 45deg, of wheels that are one body each"
    parser.add_argument("--roller-angle", type=_angle, metavar="ANGLE", help=text)
    parser.add_argument("--rows", type=int, choices=(1, 2), help="1: take two rows of rollers as one in the middle")
    parser.add_argument("--wheel", choices=WHEEL_NAMES, help="a wheel on sale, or a robot that has these wheels")
    parser.add_argument("--wheel-names", metavar="A,B,C", help="names of the bodies that are wheels")
    parser.add_argument("--robot", metavar="NAME", help="the robot's first body, of a file with several robots")


def run(arguments: argparse.Namespace) -> int:
    """0 where it was read. Raises InvalidValueError, MissingPackageError."""
    names = [name for _, name, *_ in OPTIONS] + ["wheel", "robot", "roller_angle", "rows"]
    given = {name: getattr(arguments, name) for name in names if getattr(arguments, name) is not None}
    if arguments.wheel_names is not None:
        given["wheel_names"] = arguments.wheel_names.split(",")
    try:
        found = import_vehicle(arguments.file, **given)
    except InvalidValueError as error:
        raise _named(error) from None
    print(text(found, arguments.file.name))
    return 0


def _named(error: InvalidValueError) -> InvalidValueError:
    """The error with the options that its text asks for."""
    options = {name: option for option, name, *_ in OPTIONS} | {"wheel_names": "--wheel-names"}
    return InvalidValueError(options.get(error.field, error.field), error.value, error.bound)


def _angle(text: str) -> float:
    """In rad. Raises ArgumentTypeError."""
    found = ANGLE.fullmatch(text.strip())
    try:
        value = float(found[1]) if found else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError("must be an angle such as 45deg or 0.785rad")
    return math.radians(value) if found and found[2] == "deg" else value


def text(found: Imported, name: str) -> str:
    """The tables [vehicle], [layout] and [bearings] of a scene."""
    vehicle = found.vehicle.as_dict()
    layout = {}
    if found.vehicle.has_layout:
        layout = {key: vehicle[key] for key in ("wheel_places", "center_of_mass") if vehicle[key] is not None}
    plain = {key: value for key, value in vehicle.items() if key not in ("wheel_places", "center_of_mass", *HIDDEN)}
    lines = [f"# From {name}; assumed or left out:", *(f"# - {words}" for words in found.assumed)]
    for table, keys in {"vehicle": plain, "layout": layout}.items():
        lines += ["", f"[{table}]", *(f"{key} = {_toml(value)}" for key, value in keys.items())] if keys else []
    if found.friction:
        keys = [f"{key} = {value!r}" for key, value in found.friction.items()]
        lines += ["", "# Friction of its joints, for [bearings]; it sticks unless a speed is named:"]
        lines += [f"# {key}" for key in keys]
    return "\n".join(lines)


def _toml(value: Any) -> str:
    return json.dumps(value)

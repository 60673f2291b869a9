"""omniroll vehicle FILE: the vehicle of a URDF or MJCF file as tables of a scene."""

import argparse
import json
from pathlib import Path
from typing import Any

from shtab import FILE

from omniroll.exchange.importing import Imported, import_vehicle

SUMMARY = "read a vehicle from a URDF or MJCF file; print it as tables of a scene, with what was assumed"
EXAMPLES = (("omniroll vehicle robot.urdf > robot.toml", "needs pip install 'omniroll[mujoco]'"),)
HIDDEN = ("yaw_scale",)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="a URDF or MJCF file").complete = FILE
    parser.add_argument("--wheel-radius", type=float, metavar="M", help="in m, where the file does not say it")


def run(arguments: argparse.Namespace) -> int:
    """0 where it was read. Raises InvalidValueError, MissingPackageError."""
    given = {} if arguments.wheel_radius is None else {"wheel_radius": arguments.wheel_radius}
    print(text(import_vehicle(arguments.file, **given), arguments.file.name))
    return 0


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

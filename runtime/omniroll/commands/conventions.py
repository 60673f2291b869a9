"""omniroll conventions ROBOT: which wheel is which, and which way it turns, here and in other programs."""

import argparse
import json
from pathlib import Path
from typing import Any

from shtab import FILE

from omniroll.conventions.shown import facts
from omniroll.robots.catalogue import ROBOTS, robot
from omniroll.vehicles.vehicle import Vehicle

SUMMARY = "print which wheel is which, on which side, and which way it turns for +x, +y and +yaw, here and in ROS 2 ..."
EXAMPLES = (
    ("omniroll conventions robot-soccer-kit", "a robot of the catalogue"),
    ("omniroll conventions scenes/driven.toml", "the vehicle of a scene; also of a URDF or MJCF file"),
)
FORMATS = (".urdf", ".xml", ".mjcf")
HEAD = f"{'for 1 m/s ahead':>16}{'1 m/s to the left':>19}{'1 rad/s counterclockwise':>26}"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    text = "a robot that presets name, or a scene, URDF or MJCF file"
    parser.add_argument("robot", metavar="ROBOT", help=text).complete = FILE
    parser.add_argument("--json", action="store_true", help="print JSON in place of text")


def run(arguments: argparse.Namespace) -> int:
    """0 where it was shown. Raises SceneError, InvalidValueError, MissingPackageError."""
    found = facts(vehicle_of(arguments.robot))
    print(json.dumps(found, indent=1, allow_nan=False) if arguments.json else text(found))
    return 0


def vehicle_of(name: str) -> Vehicle:
    """The vehicle of a preset or of a file."""
    if name == "paper":
        return Vehicle.paper()
    if name in ROBOTS or not Path(name).suffix:
        return robot(name).vehicle
    if Path(name).suffix.lower() in FORMATS:
        from omniroll.exchange.importing import import_vehicle

        return import_vehicle(name).vehicle
    from omniroll.scenes import load_scene

    return load_scene(name).vehicle


def text(found: dict[str, Any]) -> str:
    """The facts for people."""
    lines = [
        "x is forward, y to the left, seen from above. A wheel's positive rate is about its axle, outward, by the",
        "right-hand rule: equal positive rates turn the vehicle clockwise.",
        "",
        f"{'wheel':<7}{'side':<13}{'x, m':>9}{'y, m':>9}{'axle, deg':>11}  rad/s {HEAD}",
    ]
    for wheel in found["wheels"]:
        where = f"{wheel['wheel']:<7}{wheel['side']:<13}{wheel['x']:>9.4f}{wheel['y']:>9.4f}{wheel['axle']:>11.2f}"
        lines.append(f"{where}{_moves(wheel, 8)}")
    if "drawing" in found:
        lines += ["", "From above, x upward and y to the left: the wheels with the rollers on top of them.", ""]
        lines += found["drawing"]
    for program in found["programs"].values():
        lines += ["", program["title"]]
        if "refused" in program:
            lines.append(f"  does not drive this vehicle: {program['refused']}")
            continue
        lines.append(f"  {'its wheel':<18}{'wheel':<7}{program['unit']:>6} {HEAD}")
        lines += [f"  {w['name']:<18}{w['wheel']:<7}{_moves(w, 7)}" for w in program["wheels"]]
        if "parameters" in program:
            lines.append("  " + ", ".join(f"{name}: {_plain(value)}" for name, value in program["parameters"].items()))
    return "\n".join(lines)


def _moves(wheel: dict[str, Any], indent: int) -> str:
    return f"{'':<{indent}}{wheel['for_x']:>+16.5g}{wheel['for_y']:>+19.5g}{wheel['for_yaw']:>+26.5g}"


def _plain(value: Any) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value).replace("'", "")

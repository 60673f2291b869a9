"""omniroll new [FILE]: a commented scene to start from."""

import argparse
from pathlib import Path

from shtab import FILE

from omniroll.errors import OmnirollError
from omniroll.robots.wheels import WHEEL_NAMES
from omniroll.scenes.template import template

SUMMARY = "write a commented scene to start from: every table and key, with units and defaults"
EXAMPLES = (
    ("omniroll new my-robot.toml", "then: omniroll run my-robot.toml --view"),
    ("omniroll new my-robot.toml --wheel robot-soccer-kit", "with the wheels of a robot of the catalogue, as assumed"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "file", nargs="?", type=Path, default=Path("scene.toml"), metavar="FILE", help="default: %(default)s"
    ).complete = FILE
    text = "a wheel on sale, or a robot of the catalogue whose wheels are assumed: radii, rollers and inertias"
    parser.add_argument("--wheel", choices=WHEEL_NAMES, help=text)


def run(arguments: argparse.Namespace) -> int:
    """0 where the file was written. Raises OmnirollError where there is such a file already, OSError where it cannot
    be written."""
    try:
        with arguments.file.open("x", encoding="utf-8") as file:
            file.write(template(str(arguments.file), arguments.wheel))
    except FileExistsError:
        raise OmnirollError(f"{arguments.file} is there already; give another name, or remove it") from None
    print(arguments.file)
    return 0

"""omniroll mjcf SCENE: the vehicle of a scene as an MJCF file."""

import argparse
import sys
from pathlib import Path

from shtab import FILE

from omniroll.durable import whole_file
from omniroll.exchange.mjcf import to_mjcf
from omniroll.exchange.urdf import to_urdf
from omniroll.scenes import load_scene

SUMMARY = "write the vehicle of a scene as an MJCF file for MuJoCo, or as a URDF file, with a body for each roller"
EXAMPLES = (("omniroll mjcf scenes/robot-soccer-kit.toml --output out/kit.xml", "then open it in MuJoCo's viewer"),)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a TOML file, see docs/scenes.md").complete = FILE
    parser.add_argument("--urdf", action="store_true", help="write URDF, which has no motors and no ground")
    parser.add_argument("--output", type=Path, metavar="FILE", help="default: standard output").complete = FILE


def run(arguments: argparse.Namespace) -> int:
    """0 where it was written. Raises SceneError, InvalidValueError, OSError."""
    text = (to_urdf if arguments.urdf else to_mjcf)(load_scene(arguments.scene).vehicle)
    if arguments.output is None:
        sys.stdout.write(text)
        return 0
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    with whole_file(arguments.output) as file:
        file.write(text)
    print(arguments.output)
    return 0

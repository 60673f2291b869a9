"""omniroll fit SCENE LOG: the numbers of a scene from what a robot has recorded."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from shtab import DIRECTORY, FILE

from omniroll import extras
from omniroll.commands import NOT_THIS_MODEL
from omniroll.errors import InvalidValueError
from omniroll.interruption import Interruption
from omniroll.scenes import load_scene

if TYPE_CHECKING:
    from omniroll.identification.model import Number

SUMMARY = "fit numbers of a scene to logs; write the scene with the fitted numbers, and pictures of what is left over"

EXAMPLES = (("omniroll fit robot.toml drive.csv --free mass,wheel_viscous --plot", "numbers and their intervals"),)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a TOML file, see docs/scenes.md").complete = FILE
    parser.add_argument(
        "logs", type=Path, nargs="+", metavar="LOG", help="a CSV or Parquet file, or a bag of ROS, see docs/fitting.md"
    ).complete = FILE
    parser.add_argument(
        "--free", required=True, metavar="NAMES", help="the numbers that are sought: mass,wheel_viscous,gyro_bias"
    )
    parser.add_argument(
        "--bounds", nargs="*", default=[], metavar="NAME=LEAST:MOST",
        help="of numbers that are sought, each end may be left out: mass=2:2.6 yaw_inertia=0.01:",
    )  # fmt: skip
    parser.add_argument(
        "--priors", nargs="*", default=[], metavar="NAME=MEAN:DEVIATION",
        help="what is known of numbers besides the logs: mass=2.4:0.05",
    )  # fmt: skip
    parser.add_argument(
        "--noise", nargs="*", default=[], metavar="NAME=X",
        help="standard deviation of a reading's noise: gyro=0.01; default: the scene's, or what the fit leaves over",
    )  # fmt: skip
    parser.add_argument(
        "--drive", choices=("motor_voltage", "motor_current", "torque", "net_torque"),
        help="what the log says drives the model, not the scene",
    )  # fmt: skip
    parser.add_argument(
        "--readings", metavar="NAMES", help="the columns that are taken: wheel_rate,gyro; default: all must be readings"
    )
    parser.add_argument(
        "--columns", default="", metavar="NAME=COLUMN,...",
        help="names of the logs' columns, where they are others: 'time=clock [ms],gyro=/imu/z'",
    )  # fmt: skip
    parser.add_argument("--loss", default="linear", help="for logs with outliers: soft_l1, huber, cauchy or arctan")
    parser.add_argument(
        "--output", type=Path, metavar="DIR", help="default: out/fit/ and the scene's name"
    ).complete = DIRECTORY
    parser.add_argument("--plot", action="store_true", help="draw what the fit leaves over into residuals.png")
    parser.add_argument(
        "--experiments", action="store_true", help="say which drive would tell most about the numbers, and how much"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 where the numbers were fitted; 128 and the number of a signal that has ended the fit; 4 where the
    residuals say that the model is none of the logs'.

    Raises SceneError, LogError, InvalidValueError, SimulationStopped, OSError.
    """
    from omniroll.conventions.log_files import columns_of_text
    from omniroll.identification.fitting import fit
    from omniroll.identification.log import Log

    if arguments.plot:
        extras.needed("matplotlib", "plots", "--plot")
    scene = load_scene(arguments.scene)
    noise = dict(map(_named, arguments.noise))
    readings = None if arguments.readings is None else _names(arguments.readings)
    columns = columns_of_text(arguments.columns)
    logs = [Log.read(path, columns, noise=noise, drive=arguments.drive, readings=readings) for path in arguments.logs]
    for log in logs:
        for words in log.said:
            _say(f"{log.name}: {words}")
    with Interruption() as interruption:
        found = fit(scene, logs, _numbers(arguments), loss=arguments.loss, report=_say, interrupted=interruption)
    folder = arguments.output or Path("out/fit") / scene.name
    folder.mkdir(parents=True, exist_ok=True)
    files = [found.save(folder / "fitted.toml")]
    if arguments.plot:
        files.append(found.picture(folder / "residuals.png"))
    print(found)
    for experiment in found.experiments() if arguments.experiments else ():
        print(f"\n{experiment}")
    print(f"\n{folder}: {', '.join(path.name for path in files)}")
    if found.is_ended:
        return interruption.exit_code
    return NOT_THIS_MODEL if found.misses else 0


def _say(words: str) -> None:
    print(f"omniroll: {words}", file=sys.stderr)


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def _numbers(arguments: argparse.Namespace) -> "list[Number]":
    """The numbers that are sought, with their bounds and priors."""
    from omniroll.identification.model import Number

    names = _names(arguments.free)
    bounds = dict(_pair("--bounds", text, "LEAST:MOST") for text in arguments.bounds)
    priors = dict(_pair("--priors", text, "MEAN:DEVIATION") for text in arguments.priors)
    for option, given in (("--bounds", bounds), ("--priors", priors)):
        for name in given:
            if name not in names:
                raise InvalidValueError(option, name, "must be of a number that --free has")
    if lacking := [name for name, prior in priors.items() if None in prior]:
        raise InvalidValueError("--priors", lacking[0], "must have a mean and a deviation")
    return [
        Number(name, least=least, most=most, prior=priors.get(name))
        for name, (least, most) in ((name, bounds.get(name, (None, None))) for name in names)
    ]


def _pair(option: str, text: str, form: str) -> tuple[str, tuple[float | None, float | None]]:
    name, _, ends = text.partition("=")
    first, colon, second = ends.partition(":")
    try:
        if colon:
            return name, (float(first) if first else None, float(second) if second else None)
    except ValueError:
        pass
    raise InvalidValueError(option, text, f"must be NAME={form}, in numbers")


def _named(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise InvalidValueError("--noise", text, "must be the name of a reading, =, and a number") from None

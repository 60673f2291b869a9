"""omniroll robots [NAME]: robots whose numbers are known."""

import argparse
import json
from typing import Any

from omniroll.robots.catalogue import ROBOTS, robot
from omniroll.robots.page import axes_of, line, summary
from omniroll.robots.wheels import sold_wheels, summary_of_wheel

SUMMARY = "list the robots that presets name; with a name, every number with its source or what was assumed"
EXAMPLES = (
    ("omniroll robots", "all of them"),
    ("omniroll robots --wheels", "wheels on sale, for --wheel of omniroll new and omniroll vehicle"),
    ("omniroll robots tigers-2020", "one of them: vehicle, motors, friction, and what the model leaves out"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", nargs="?", metavar="NAME", help="a robot; default: a table of all")
    parser.add_argument(
        "--wheels", action="store_true", help="list wheels on sale, which `--wheel` names, in their place"
    )
    parser.add_argument("--json", action="store_true", help="print JSON in place of text")


def run(arguments: argparse.Namespace) -> int:
    """0 where they were shown. Raises InvalidValueError for an unknown name."""
    if arguments.wheels:
        found = list(map(summary_of_wheel, sold_wheels().values()))
        print(json.dumps(found, indent=1, allow_nan=False) if arguments.json else "\n\n".join(map(of_wheel, found)))
        return 0
    chosen = list(ROBOTS.values()) if arguments.name is None else [robot(arguments.name)]
    summaries = [summary(one) for one in chosen]
    if arguments.json:
        print(json.dumps(summaries if arguments.name is None else summaries[0], indent=1, allow_nan=False))
    else:
        print(text(summaries[0]) if arguments.name else table(summaries))
    return 0


def of_wheel(one: dict[str, Any]) -> str:
    """A wheel on sale, with its numbers."""
    lines = [f"{one['name']}: {one['title']}, {one['rollers']} rollers at {one['roller_angle_in_degrees']:g} degrees"]
    return "\n".join(lines + [_number(number) for number in one["numbers"]])


def _number(number: dict[str, Any]) -> str:
    kind = f"{number['kind']}: {number['reason']}"
    return f"  {number['name']:<28}{number['value']:>12.6g} {number['unit']:<7} {kind}"


def table(summaries: list[dict[str, Any]]) -> str:
    """One line a robot."""
    head = f"{'name':<22}{'wheels':>8}{'rollers':>9}{'mass, kg':>10}{'R, m':>8}{'l, m':>8}  {'motor':<7}stated/assumed"
    return "\n".join([head, *map(line, summaries)])


def text(one: dict[str, Any]) -> str:
    """Everything that is known of one robot."""
    numbers = map(_number, one["numbers"])
    lines = [f"{one['name']}: {one['title']}", one["source"], ""]
    lines += [f"  {one['wheels']} wheels of {one['rollers_per_wheel']} rollers, {axes_of(one)}", *numbers]
    return "\n".join([*lines, "", "Left out, or not agreed on", *(f"  {remark}" for remark in one["remarks"])])

"""The robots' numbers as data and as the tables of docs/robots.md: python -m omniroll.robots.page docs/robots.md"""

import math
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from omniroll.robots.catalogue import ROBOTS
from omniroll.robots.robot import Robot
from omniroll.vehicles.data_sheet import ASSUMED

BEGIN, END = "<!-- written from the catalogue -->", "<!-- up to here -->"


def summary(robot: Robot) -> dict[str, Any]:
    """Everything that is known of a robot, in plain Python types."""
    vehicle, numbers = robot.vehicle, [asdict(origin) for origin in robot.origins()]
    remarks = list(robot.remarks)
    if robot.row_offset:
        remarks.insert(0, _of_rows(robot))
    return {
        "name": robot.name,
        "title": robot.title,
        "source": robot.source,
        "wheels": vehicle.wheels,
        "rollers_per_wheel": vehicle.rollers_per_wheel,
        "wheel_angles_in_degrees": [round(math.degrees(angle), 9) for angle in vehicle.wheel_angles],
        "roller_angles_in_degrees": [round(math.degrees(angle), 9) for angle in vehicle.roller_angle],
        "vehicle": vehicle.as_dict(),
        "has_motor": bool(robot.motor_numbers),
        "assumed": sum(number["kind"] == ASSUMED for number in numbers),
        "numbers": numbers,
        "remarks": remarks,
    }


def _of_rows(robot: Robot) -> str:
    return (
        f"Two rows of rollers, {1e3 * robot.row_offset:g} mm to each side, count as one at their mean distance: the "
        f"lever of yaw alternates by {100 * robot.lever_change:.2g} % from contact to contact. `rows = 2` and "
        f"`row_offset = {robot.row_offset:g}` beside the preset have both; the inertias are the same."
    )


def line(one: dict[str, Any]) -> str:
    """A robot on one line of a terminal."""
    vehicle, motor = one["vehicle"], "yes" if one["has_motor"] else "no"
    counts = f"{len(one['numbers']) - one['assumed']}/{one['assumed']}"
    sizes = f"{vehicle['mass']:>10.4g}{vehicle['platform_radius']:>8.4g}{vehicle['wheel_radius']:>8.4g}"
    return f"{one['name']:<22}{one['wheels']:>8}{one['rollers_per_wheel']:>9}{sizes}  {motor:<7}{counts}"


def axes_of(one: dict[str, Any]) -> str:
    """Where axles point, and how rollers stand on their wheels, in words."""
    angles, slants = (one[f"{name}_angles_in_degrees"] for name in ("wheel", "roller"))
    words = f"axles at {', '.join(f'{angle:g}' for angle in angles)}"
    if not any(slants):
        return f"{words} degrees"
    return f"{words} and rollers at {', '.join(f'{slant:g}' for slant in slants)} degrees"


def tables() -> str:
    """The section of each robot as Markdown."""
    return "\n\n".join(_section(summary(robot)) for robot in ROBOTS.values())


def _section(one: dict[str, Any]) -> str:
    lines = [
        f"### {one['title']}",
        "",
        f'`preset = "{one["name"]}"`: {one["wheels"]} wheels of {one["rollers_per_wheel"]} rollers, '
        f"{axes_of(one)}. {one['source']}.",
        "",
        "| number | value | unit | | |",
        "| --- | --- | --- | --- | --- |",
        *(
            f"| `{o['name']}` | {o['value']:.6g} | {o['unit'] or '1'} | {o['kind']} | {o['reason']} |"
            for o in one["numbers"]
        ),
        "",
        *(f"- {remark}" for remark in one["remarks"]),
    ]
    return "\n".join(lines)


def _row(number: dict[str, Any]) -> str:
    cells = f"{number['value']:.6g}", number["unit"] or "1", number["kind"], number["reason"]
    return f"| `{number['name']}` | {' | '.join(cells)} |"


def page(text: str) -> str:
    """The page's text with its tables written anew."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}\n\n{tables()}\n\n{END}{rest.split(END)[1]}"


if __name__ == "__main__":
    file = Path(sys.argv[1])
    file.write_text(page(file.read_text(encoding="utf-8")), encoding="utf-8")

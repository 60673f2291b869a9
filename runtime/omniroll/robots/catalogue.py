"""The robots by name."""

from omniroll.errors import InvalidValueError
from omniroll.robots import (
    mecanum_trio,
    open_base,
    robomaster,
    robomaster_hero,
    robot_soccer_kit,
    strafer,
    tigers,
    youbot,
)
from omniroll.robots.robot import Robot

OMNI = (robot_soccer_kit, open_base, robomaster, tigers)
MECANUM = (youbot, robomaster_hero, strafer, mecanum_trio)
ROBOTS = {module.ROBOT.name: module.ROBOT for module in OMNI + MECANUM}


def robot(name: str) -> Robot:
    """A robot by its name.

    name  one of omniroll.robots.catalogue.ROBOTS

    Raises InvalidValueError for another name.
    """
    if not isinstance(name, str) or name not in ROBOTS:
        raise InvalidValueError("name", name, "must be one of " + ", ".join(ROBOTS))
    return ROBOTS[name]

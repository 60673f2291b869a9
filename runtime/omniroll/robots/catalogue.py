"""The robots by name."""

from omniroll.errors import InvalidValueError
from omniroll.robots import open_base, robomaster, robot_soccer_kit, tigers
from omniroll.robots.robot import Robot

ROBOTS = {module.ROBOT.name: module.ROBOT for module in (robot_soccer_kit, open_base, robomaster, tigers)}


def robot(name: str) -> Robot:
    """A robot by its name.

    name  one of omniroll.robots.catalogue.ROBOTS

    Raises InvalidValueError for another name.
    """
    if not isinstance(name, str) or name not in ROBOTS:
        raise InvalidValueError("name", name, "must be one of " + ", ".join(ROBOTS))
    return ROBOTS[name]

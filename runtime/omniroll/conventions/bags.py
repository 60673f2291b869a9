"""Bags of ROS as tables: twists, joint states, inertial units and odometry, read by rosbags."""

from collections.abc import Callable, Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

from omniroll import extras
from omniroll.errors import LogError

EXTRA = "bags"
FILES = (".bag", ".mcap", ".db3")
METADATA = "metadata.yaml"
Values = Mapping[str, float]


def _vector(name: str, value: Any) -> Values:
    return {f"{name}.{axis}": float(getattr(value, axis)) for axis in "xyz"}


def _twist(message: Any) -> Values:
    return _vector("linear", message.linear) | _vector("angular", message.angular)


def _inertial(message: Any) -> Values:
    turning = _vector("angular_velocity", message.angular_velocity)
    return turning | _vector("linear_acceleration", message.linear_acceleration)


def _odometry(message: Any) -> Values:
    pose, quaternion = message.pose.pose, message.pose.pose.orientation
    turned = {f"pose.orientation.{part}": float(getattr(quaternion, part)) for part in "xyzw"}
    return _vector("pose.position", pose.position) | turned | _prefixed("twist", _twist(message.twist.twist))


def _joints(message: Any) -> Values:
    found = {}
    for what in ("position", "velocity", "effort"):
        for name, value in zip(message.name, getattr(message, what), strict=False):
            found[f"{name}.{what}"] = float(value)
    return found


def _prefixed(prefix: str, values: Values) -> Values:
    return {f"{prefix}.{name}": value for name, value in values.items()}


READERS: dict[str, Callable[[Any], Values]] = {
    "geometry_msgs/msg/Twist": _twist,
    "geometry_msgs/msg/TwistStamped": lambda message: _twist(message.twist),
    "sensor_msgs/msg/Imu": _inertial,
    "sensor_msgs/msg/JointState": _joints,
    "nav_msgs/msg/Odometry": _odometry,
}


def is_bag(path: Path) -> bool:
    """Whether a path is that of a bag: a file by the end of its name, a folder by what is in it."""
    return path.suffix.lower() in FILES or (path / METADATA).is_file()


def rows_of(path: Path) -> tuple[list[str], list[list[Any]], list[int], list[str]]:
    """Names, rows, their numbers, and what was recognised, of all messages of the kinds that are known.

    A row stands at the time at which its message was recorded. Columns are named topic.field; those of other topics
    hold what came last, and rows before the first message of each topic are left out.

    Raises LogError where there is no such message or the bag is none, MissingPackageError without the extra `bags`.
    """
    extras.needed("rosbags", EXTRA, f"a log in a bag, {path.name}")
    from rosbags.highlevel import AnyReader, AnyReaderError
    from rosbags.typesys import Stores, get_typestore

    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            known = [connection for connection in reader.connections if connection.msgtype in READERS]
            others = sorted({c.topic for c in reader.connections if c.msgtype not in READERS})
            messages = []
            for connection, stamp, raw in reader.messages(connections=known):
                values = READERS[connection.msgtype](reader.deserialize(raw, connection.msgtype))
                messages.append((stamp, _prefixed(connection.topic.strip("/").replace("/", "."), values)))
    except (AnyReaderError, OSError) as error:
        raise LogError(path.name, None, None, None, f"must be a bag that rosbags reads; it says: {error}") from None
    if not messages:
        raise LogError(path.name, None, None, None, f"must have messages of {', '.join(READERS)}")
    said = [f"topics that were not read: {', '.join(others)}"] if others else []
    return _joined(messages, said)


def _joined(
    messages: list[tuple[int, Values]], said: list[str]
) -> tuple[list[str], list[list[Any]], list[int], list[str]]:
    names = list(dict.fromkeys(name for _, values in messages for name in values))
    last: dict[str, float] = {}
    rows, numbers = [], []
    for number, (stamp, values) in enumerate(messages):
        last |= values
        if len(last) == len(names):
            rows.append([Decimal(stamp).scaleb(-9), *(last[name] for name in names)])
            numbers.append(number)
    if len(rows) < len(messages):
        said.append(f"{len(messages) - len(rows)} messages came before the first of every topic")
    return ["t", *names], rows, numbers, said

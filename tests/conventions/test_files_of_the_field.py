"""Logs as other programs write them: each is read to the same commands, and a clean one's times."""

from decimal import Decimal

import numpy as np
import pytest

import omniroll
from omniroll.conventions.logs import read_log

TIMES = [Decimal(k) / 50 for k in range(60)]  # s: 50 Hz
TWISTS = [(0.1 + k / 300, -0.05 * (k % 3), 0.4 - k / 200) for k in range(60)]
EPOCH = Decimal("1732809600.123456789")
NAMES = ["linear.x", "linear.y", "linear.z", "angular.x", "angular.y", "angular.z"]


def table(names, times, rows, separator=",", before=(), after=(), point="."):
    lines = [*before, separator.join(names), *after]
    for time, row in zip(times, rows, strict=True):
        cells = (str(cell) for cell in (time, *row))
        lines.append(separator.join(cell if point == "." else cell.replace(".", point) for cell in cells))
    return "\n".join(lines) + "\n"


def full(rows):
    return [(x, y, 0.0, 0.0, 0.0, w) for x, y, w in rows]


def repeated():
    """A simulated clock: rows of the same time, of which the last holds."""
    times = [time for time in TIMES for _ in range(2)]
    rows = [row for twist in TWISTS for row in ((9.0, 9.0, 9.0), twist)]
    return table(["t", "vx", "vy", "wz"], times, rows)


def scaled(power, names, digits=0):
    times = [round(time.scaleb(power), digits) if digits else int(time.scaleb(power)) for time in TIMES]
    return table(names, times, TWISTS)


FILES = {
    "clean": table(["t", "vx", "vy", "wz"], TIMES, TWISTS),
    "repeated times": repeated(),
    "since 1970": table(["time", *NAMES], [EPOCH + time for time in TIMES], full(TWISTS)),
    "rostopic echo -p": table(
        ["%time", *(f"field.{name}" for name in NAMES)], [int((EPOCH + t).scaleb(9)) for t in TIMES], full(TWISTS)
    ),
    "rostopic echo -p, stamped": table(
        ["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id"]
        + [f"field.twist.{name}" for name in NAMES],
        [int((EPOCH + t).scaleb(9)) for t in TIMES],
        [(k, 1, "base_link", *row) for k, row in enumerate(full(TWISTS))],
    ),
    "PlotJuggler": table(
        ["__time", *(f"/cmd_vel/{name.replace('.', '/')}" for name in NAMES)],
        [EPOCH + time for time in TIMES],
        full(TWISTS),
    ),
    "PlotJuggler beside odometry": table(
        ["__time", *(f"/{topic}/{n.replace('.', '/')}" for topic in ("odom/twist", "cmd_vel/twist") for n in NAMES)],
        [EPOCH + time for time in TIMES],
        [(*[5.0] * 6, *row) for row in full(TWISTS)],
    ),
    "timestamp": table(["timestamp", "vx", "vy", "wz"], TIMES, TWISTS),
    "ISO 8601": table(
        ["timestamp", "vx", "vy", "wz"],
        [f"2026-11-28 15:00:{int(t):02d}.{int(t % 1 * 1000000):06d}" for t in TIMES],
        TWISTS,
    ),
    "ms in the name": scaled(3, ["time_ms", "vx", "vy", "wz"]),
    "ms in brackets": scaled(3, ["t [ms]", "vx", "vy", "wz"]),
    "ms unsaid": scaled(3, ["t", "vx", "vy", "wz"]),
    "us unsaid": scaled(6, ["t", "vx", "vy", "wz"]),
    "ms since 1970": table(["time", "vx", "vy", "wz"], [int((t + 1732809600).scaleb(3)) for t in TIMES], TWISTS),
    "semicolons": table(["t", "vx", "vy", "wz"], TIMES, TWISTS, ";"),
    "decimal commas": table(["t", "vx", "vy", "wz"], TIMES, TWISTS, ";", point=","),
    "tabulators": table(["t", "vx", "vy", "wz"], TIMES, TWISTS, "\t"),
    "blanks": table(["t", "vx", "vy", "wz"], TIMES, TWISTS, " "),
    "numpy's names": table(["# t", "vx", "vy", "wz"], TIMES, TWISTS),
    "lines before": table(["t", "vx", "vy", "wz"], TIMES, TWISTS, before=["robot log", "rate,50", "run 7, 3 wheels"]),
    "a line of units": table(["t", "vx", "vy", "wz"], TIMES, TWISTS, after=["s,m/s,m/s,rad/s"]),
    "byte order mark": "\ufeff" + table(["t", "vx", "vy", "wz"], TIMES, TWISTS),
    "quoted": table(['"t"', '"vx"', '"vy"', '"wz"'], TIMES, TWISTS),
}  # fmt: skip


def read(tmp_path, text, **options):
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    return read_log(tmp_path / "log.csv", **options)


@pytest.mark.parametrize("kind", FILES)
def test_every_kind_is_read_as_the_clean_one(tmp_path, kind):
    log = read(tmp_path, FILES[kind])
    assert np.abs(log.times - np.array([float(time) for time in TIMES])).max() <= 1e-12
    assert (log.commands["twist"] == np.array(TWISTS)).all()


@pytest.mark.parametrize("kind, words", [
    ("repeated times", "60 rows have the time of the next row, which holds"),
    ("since 1970", "times since 1970 count from the first row, 2024-11-28 16:00:00 UTC"),
    ("ms unsaid", "times are taken for ms: the first two are 0, 20"),
    ("decimal commas", "decimal commas"),
    ("lines before", "3 lines before the names"),
])  # fmt: skip
def test_what_was_recognised_is_said(tmp_path, kind, words):
    assert any(words in said for said in read(tmp_path, FILES[kind]).said)
    assert read(tmp_path, FILES["clean"]).said == ()


def test_units_behind_names(tmp_path):
    names = ["t", "vx [mm/s]", "vy [cm/s]", "wz (deg/s)"]
    rows = [(1000 * x, 100 * y, np.degrees(w)) for x, y, w in TWISTS]
    log = read(tmp_path, table(names, TIMES, rows))
    np.testing.assert_allclose(log.commands["twist"], TWISTS, rtol=1e-14)
    assert "wz is in deg/s: times 0.0174532925, in rad/s" in log.said
    with pytest.raises(omniroll.InvalidValueError, match="vx: must be in m/s; it is in furlongs"):
        read(tmp_path, table(["t", "vx [furlongs]", "vy", "wz"], TIMES, TWISTS))


def test_columns_by_name(tmp_path):
    text = table(["clock", "ahead", "left", "turn"], [int(time.scaleb(3)) for time in TIMES], TWISTS)
    names = {"time": "clock [ms]", "vx": "ahead", "vy": "left", "wz": "turn"}
    log = read(tmp_path, text, columns=names)
    assert log.times[-1] == 1.18 and (log.commands["twist"] == np.array(TWISTS)).all() and not log.said
    with pytest.raises(omniroll.InvalidValueError, match="clock: is no column|nothing: is no column"):
        read(tmp_path, text, columns={"time": "nothing"})


def test_several_topics_are_named(tmp_path):
    names = ["t", *(f"{topic}.{name}" for topic in ("a", "b") for name in NAMES)]
    with pytest.raises(omniroll.InvalidValueError, match="has twists of a, b: choose"):
        read(tmp_path, table(names, TIMES, [(*row, *row) for row in full(TWISTS)]))


def test_messages_are_short_and_name_line_and_column(tmp_path):
    text = FILES["decimal commas"].replace("0,1;", "zero;", 1)
    with pytest.raises(omniroll.InvalidValueError, match="2: vx = 'zero': must be a number") as refused:
        read(tmp_path, text)
    assert len(str(refused.value)) < 300


def written_bag(folder, storage):
    """A bag of twists, inertial units and joint states, written by rosbags."""
    rosbags = pytest.importorskip("rosbags.rosbag2", reason="rosbags is not installed: the extra bags")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    vector, joints = kinds["geometry_msgs/msg/Vector3"], kinds["sensor_msgs/msg/JointState"]
    stamp = kinds["builtin_interfaces/msg/Time"](0, 0)
    header = kinds["std_msgs/msg/Header"](stamp, "base_link")
    with rosbags.Writer(folder, version=9, storage_plugin=getattr(rosbags.StoragePlugin, storage)) as writer:
        topics = {
            "/cmd_vel": "geometry_msgs/msg/Twist", "/joint_states": "sensor_msgs/msg/JointState",
            "/chatter": "std_msgs/msg/String",
        }  # fmt: skip
        open_ = {name: writer.add_connection(name, kind, typestore=store) for name, kind in topics.items()}
        for time, (x, y, w) in zip(TIMES, TWISTS, strict=True):
            moment = int((EPOCH + time).scaleb(9))
            rates, none = np.array([x, y, w]), np.array([])
            for topic, message in {
                "/chatter": kinds["std_msgs/msg/String"]("hello"),
                "/joint_states": joints(header, ["a", "b", "c"], none, 10 * rates, none),
                "/cmd_vel": kinds["geometry_msgs/msg/Twist"](vector(x, y, 0.0), vector(0.0, 0.0, w)),
            }.items():
                writer.write(open_[topic], moment, store.serialize_cdr(message, topics[topic]))
    return folder


@pytest.mark.parametrize("storage, ending", [("SQLITE3", "*.db3"), ("MCAP", "*.mcap")])
def test_bags(tmp_path, storage, ending):
    folder = written_bag(tmp_path / "bag", storage)
    for path in (folder, next(folder.glob(ending))):
        log = read_log(path)
        assert np.abs(log.times - np.array([float(time) for time in TIMES])).max() <= 1e-12
        assert (log.commands["twist"] == np.array(TWISTS)).all()
        assert "topics that were not read: /chatter" in log.said
    rates = {f"wheel_rate_{k}": f"joint_states.{name}.velocity" for k, name in enumerate("abc", 1)}
    fitted = omniroll.Log.read(folder, columns=rates)
    assert (fitted.data["wheel_rate"] == 10 * np.array(TWISTS)).all() and fitted.channels == ("wheel_rate",)


def test_fits_read_what_commands_read(tmp_path):
    rows = [(x, y, w, np.degrees(w)) for x, y, w in TWISTS]
    names = ["__time", "wheel_rate_1", "wheel_rate_2", "wheel_rate_3", "/imu/angular_velocity/z [deg/s]"]
    times = [EPOCH + time for time in TIMES]
    (tmp_path / "log.csv").write_text(table(names, [*times[:1], *times], [*rows[:1], *rows], ";", point=","))
    log = omniroll.Log.read(tmp_path / "log.csv")
    assert (log.data["wheel_rate"] == np.array(TWISTS)).all() and log.t[-1] == 1.18
    np.testing.assert_allclose(log.data["gyro"], np.array(TWISTS)[:, 2], rtol=1e-14)
    assert len(log.said) == 4 and any("deg/s" in words for words in log.said)

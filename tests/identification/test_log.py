"""Logs: every wrong one gets one message that names line and column."""

import pickle

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.errors import LogError

GOOD = ["t,wheel_rate_1,wheel_rate_2,wheel_rate_3,gyro", "0,1,2,3,0.1", "0.01,1,2,3,0.2", "0.02,1,2,3,0.3"]


def written(tmp_path, lines):
    path = tmp_path / "drive.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def changed(line, text):
    return [text if k == line else old for k, old in enumerate(GOOD, 1)]


def test_a_file_and_arrays_are_the_same(tmp_path):
    log = omniroll.Log.read(written(tmp_path, GOOD), noise={"gyro": 0.1})
    rates = np.tile([1.0, 2.0, 3.0], (3, 1))
    same = omniroll.Log({"t": [0, 0.01, 0.02], "wheel_rate": rates, "gyro": [0.1, 0.2, 0.3]})
    assert log.channels == same.channels == ("wheel_rate", "gyro")
    assert all((log.data[name] == same.data[name]).all() for name in log.data)
    units = ["t [s],wheel_rate_1 (rad/s),wheel_rate_2,wheel_rate_3,gyro [rad/s]", *GOOD[1:]]
    assert (omniroll.Log.read(written(tmp_path, units)).data["gyro"] == log.data["gyro"]).all()


@pytest.mark.parametrize("lines, line, column, words", [
    (changed(3, "0.01,1,2,3"), 3, None, "the line of names has 5"),
    (changed(3, "0.01,1,,3,4"), 3, "wheel_rate_2", "is empty"),
    (changed(3, "0.01,1,x,3,4"), 3, "wheel_rate_2", "must be a number"),
    (changed(4, "0.02,1,2,3,nan"), 4, "gyro", "must be finite"),
    (changed(3, "-0.01,1,2,3,4"), 3, "t", "must come after 0.0"),
    ([*GOOD, "5,1,2,3,4"], 5, "t", "0.01 s are usual"),
    (changed(1, "t,wheel_rate_1,wheel_rate_2,wheel_rate_3,compass"), 1, "compass", "no such reading"),
    (changed(1, "t,wheel_rate_1,wheel_rate_2,wheel_rate_4,gyro"), 1, "wheel_rate_3", "is missing"),
    (changed(1, "t,wheel_rate_1,wheel_rate_2,wheel_rate_3,wheel_rate_3"), 1, "wheel_rate_3", "twice"),
    (changed(1, "t,wheel_rate_1,wheel_rate_2,wheel_rate_3,gyro [m]"), 1, "gyro [m]", "must be in rad/s"),
    (GOOD[:1], None, None, "lines of numbers"),
])  # fmt: skip
def test_a_wrong_file_is_named_by_line_and_column(tmp_path, lines, line, column, words):
    with pytest.raises(LogError, match=words) as refused:
        omniroll.Log.read(written(tmp_path, lines))
    error = refused.value
    assert (error.source, error.line, error.field) == ("drive.csv", line, column)
    assert str(error).startswith("drive.csv:" + (f"{line}: " if line else " ")) and (column or "") in str(error)
    assert str(pickle.loads(pickle.dumps(error))) == str(error) and "\n" not in str(error)


@pytest.mark.parametrize("data, line, column, words", [
    ({"gyro": [1, 2]}, None, "t", "is missing"),
    ({"t": [0, 1]}, None, None, "no reading.*--columns"),
    ({"t": [0, 1], "gyro": [1, 2, 3]}, None, "gyro", "must have 2 rows"),
    ({"t": [0, 1, 2], "gyro": [1, np.inf, 3]}, 1, "gyro", "finite"),
    ({"t": [0, 1, 1], "gyro": [1, 2, 3]}, 2, "t", "must come after"),
    ({"t": [0], "gyro": [1]}, None, "t", "two times"),
])  # fmt: skip
def test_wrong_arrays_are_named_by_row_and_column(data, line, column, words):
    with pytest.raises(LogError, match=words) as refused:
        omniroll.Log(data)
    assert (refused.value.line, refused.value.field) == (line, column)


@pytest.mark.parametrize("options, field", [
    ({"noise": {"compass": 1}}, "noise"),
    ({"noise": {"gyro": 0}}, "noise of gyro"),
    ({"drive": "gyro"}, "drive"),
    ({"drive": "motor_voltage"}, "drive"),
])  # fmt: skip
def test_options_that_cannot_be(options, field):
    with pytest.raises(omniroll.InvalidValueError) as refused:
        omniroll.Log({"t": [0, 1], "gyro": [1, 2]}, **options)
    assert refused.value.field == field


@pytest.mark.parametrize("scale, unit", [(1000.0, "ms"), (1e-3, "s")])
def test_a_clock_in_another_unit_is_doubted(scale, unit):
    times = scale * (0.01 * np.arange(60) + 0.0003)  # no whole numbers
    (said,) = omniroll.Log({"t": times, "gyro": np.zeros(60)}).said
    assert f"is the clock in {unit}? t [{unit}] says so" in said
    assert omniroll.Log({"t": times / scale, "gyro": np.zeros(60)}).said == []


def test_a_log_that_is_not_there_is_named(capsys):
    assert cli.main(["fit", "scenes/motion-3.toml", "no-such-log.csv", "--free", "mass"]) == 1
    assert capsys.readouterr().err == "omniroll: no-such-log.csv: No such file or directory\n"

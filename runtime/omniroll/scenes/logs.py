"""Logs of commands that a scene replays: their rows take the place of a table's own."""

from pathlib import Path
from typing import Any

from omniroll.conventions.log_files import columns_of_text
from omniroll.conventions.logs import Log, read_log
from omniroll.errors import InvalidValueError, MissingPackageError
from omniroll.scenes.checking import Findings
from omniroll.scenes.problems import shown
from omniroll.scenes.schema import MOTOR, OF_LOG

OF_FILE = ("log", "log_columns")
MOST_BYTES = 50_000_000  # of a file that a scene names
MOTOR_NAMES = {"preset", *(key.name for key in MOTOR)}


def replay_logs(tables: dict[str, dict[str, Any]], folder: Path, findings: Findings) -> list[tuple[str, str, str]]:
    """Put what their logs hold into [drive] and [controller]; what is wrong goes into `findings`.

    Gives what was recognised in the files: the table, the key, and a sentence.
    """
    said: list[tuple[str, str, str]] = []
    for name, given in OF_LOG.items():
        table = tables.get(name, {})
        if "log" not in table:
            if "log_columns" in table:
                findings.add(name, "log_columns", "needs log, whose columns it names")
            continue
        for key in given:
            if key in table:
                findings.add(name, key, "cannot stand beside log, which gives it", shown(table[key]))
        if findings.keys_in(name):
            continue
        try:
            log = read_log(_beside(folder, table["log"]), columns_of_text(table.get("log_columns", "")))
            rows = _of_drive(table, log) if name == "drive" else _of_controller(log)
        except InvalidValueError as error:
            findings.add(name, "log", error.bound, shown(table["log"]))
        except OSError as error:
            findings.add(name, "log", error.strerror or str(error), shown(table["log"]))
        except MissingPackageError as error:
            findings.add(name, "log", str(error))
        else:
            said += [(name, "log", words) for words in (*log.said, *_beside_the_run(log, tables.get("run", {})))]
            replayed = {"times": log.times.tolist(), "interpolation": "hold"} | rows
            tables[name] = replayed | {key: value for key, value in table.items() if key not in OF_FILE}
    return said


def _beside_the_run(log: Log, run: dict[str, Any]) -> list[str]:
    """What looks wrong in a log that has no command during the run."""
    begin = run.get("start_time", 0.0)
    end = begin + run.get("duration", 0.0)
    if log.times[0] > end:
        return [f"begins at {log.times[0]:.6g} s, when the run is over: its first command holds all the time"]
    if len(log.times) > 1 and log.times[-1] < begin:
        return [f"ends at {log.times[-1]:.6g} s, before the run: its last command holds all the time"]
    return []


def _beside(folder: Path, name: str) -> Path:
    """The file in the folder of the scene. Raises InvalidValueError: a scene reads no file elsewhere."""
    path = folder / name
    if Path(name).name != name or path.resolve().parent != folder.resolve():
        raise InvalidValueError("log", name, "must be the name of a file in the scene's own folder")
    if path.is_dir():  # the index of a bag in a folder may name files elsewhere
        raise InvalidValueError("log", name, "must be one file; of a bag in a folder name its .mcap or .db3")
    if path.stat().st_size > MOST_BYTES:
        raise InvalidValueError("log", name, f"must be of at most {MOST_BYTES} bytes")
    return path


def _of_drive(table: dict[str, Any], log: Log) -> dict[str, Any]:
    """Voltages where the table has numbers of a motor, torques otherwise."""
    kind = "voltage" if MOTOR_NAMES & set(table) else "torque"
    if kind not in log.commands:
        others = ", ".join(log.commands)
        why = "; with numbers of a motor they are voltages" if kind == "voltage" else ""
        hint = "; a log of twists belongs to [controller]" if "twist" in log.commands else ""
        raise InvalidValueError("log", None, f"must have columns {kind}_1 and so on{why}; it has {others}{hint}")
    return {kind: log.commands[kind].tolist()}


def _of_controller(log: Log) -> dict[str, Any]:
    """Twists, or rates of the wheels."""
    for kind in ("twist", "wheel_rate"):
        if kind in log.commands:
            return {kind: log.commands[kind].tolist()}
    others = ", ".join(log.commands)
    bound = f"must have columns vx, vy, wz, or wheel_rate_1 and so on; it has {others}, which belong to [drive]"
    raise InvalidValueError("log", None, bound)

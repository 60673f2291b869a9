"""The folder that a run keeps its results in. It holds the results before, or the new ones, whatever ends the writing.

1. The new files are written into the folder `.new` and synced. An error removes them: the results before stand.
2. `.new` becomes `.complete` by one rename. From here on the new results stand.
3. The files move from `.complete` to their places, each by a rename, summary.json last. What is cut off here is
   finished by whoever writes next; a reader takes from `.complete` what has not moved.

Files that are made of the results, such as pictures, are added in the same way when the results stand.

summary.json names the other files with their checksums, so that a mix of two runs does not pass for one of them. While
a long run goes on, what it has done so far stands in the folder `unfinished`, in parts. Of a run that goes to the disk
part by part these are the results: summary.json names them, too, and in step 3 the folder becomes `parts`.
"""

import json
import math
import os
import shutil
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from omniroll import durable, json_texts, validation
from omniroll.engine.runs import Partial
from omniroll.errors import OmnirollError
from omniroll.results.trajectory import Trajectory

SUMMARY, TRAJECTORY = "summary.json", "trajectory.npz"
NEW, COMPLETE, UNFINISHED, PARTS, LOCK = ".new", ".complete", "unfinished", "parts", ".lock"


class DamagedResultsError(OmnirollError):
    """A folder whose files are not those of one whole run."""


class ResultFolder:
    """A folder for results, for `with`: one run at a time.

    path   of the folder, which is made where it is not there
    names  of all files that a run may leave, summary.json among them

    Raises OSError where the folder takes no files, OmnirollError where another run writes there.
    """

    def __init__(self, path: Path, names: Iterable[str]):
        self.path, self.names = path, tuple(names)
        self.new, self.complete = path / NEW, path / COMPLETE
        self.unfinished, self.parts = path / UNFINISHED, path / PARTS

    def __enter__(self) -> "ResultFolder":
        self.path.mkdir(parents=True, exist_ok=True)
        self.lock = FileLock(self.path / LOCK)
        try:
            self.lock.acquire(timeout=0)
        except Timeout:
            text = f"another run is writing its results into {self.path}; --output names another folder"
            raise OmnirollError(text) from None
        try:
            self._finish()
            self._try()
        except BaseException:
            self.lock.release()
            raise
        return self

    def __exit__(self, *_: Any) -> None:
        self.lock.release()

    def keep(self, write: Callable[[Path], None], summary: dict[str, Any]) -> dict[str, Any]:
        """Keep what `write` writes into the folder that it is given, in place of the results before.

        Returns the summary, with `files`: the checksum of each file by its name. An error leaves the results before.
        """
        return self._keep(write, summary, {})

    def add(self, write: Callable[[Path], None], summary: dict[str, Any]) -> dict[str, Any]:
        """Add what `write` writes to the results that `keep` has kept, whose summary this one replaces: `files` are
        those before. An error leaves the results without it."""
        return self._keep(write, summary, summary["files"])

    def _keep(self, write: Callable[[Path], None], summary: dict[str, Any], before: dict[str, str]) -> dict[str, Any]:
        self._begin()
        try:
            with durable.naming(self.path):
                write(self.new)
            files = {name: durable.digest(self.new / name) for name in self.names if (self.new / name).exists()}
            for name in files:
                durable.sync(self.new / name)
            whole = summary | {"files": before | files}
            with durable.whole_file(self.new / SUMMARY) as file:
                file.write(as_json(whole) + "\n")
            os.rename(self.new, self.complete)
        except BaseException:
            shutil.rmtree(self.new, ignore_errors=True)
            raise
        durable.sync(self.path)
        self._finish()
        return whole

    def _finish(self) -> None:
        """Move complete results to their places; also those of a run that was killed while it did this."""
        if (self.complete / SUMMARY).exists():
            summary = _read_summary(self.complete / SUMMARY)
            files = summary["files"]
            for name in self.names:
                if (self.complete / name).exists() and name != SUMMARY:
                    os.replace(self.complete / name, self.path / name)
                elif name not in files and name != SUMMARY:
                    (self.path / name).unlink(missing_ok=True)
            self._place_parts(bool(summary.get(PARTS)))
            durable.sync(self.path)
            os.replace(self.complete / SUMMARY, self.path / SUMMARY)
            durable.sync(self.path)
        if self.complete.is_dir():
            self.complete.rmdir()

    def _place_parts(self, wanted: bool) -> None:
        """Those of the new results, if they have any, in place of those before."""
        if wanted and self.unfinished.is_dir():
            shutil.rmtree(self.parts, ignore_errors=True)
            os.rename(self.unfinished, self.parts)
        elif not wanted:
            shutil.rmtree(self.parts, ignore_errors=True)
            shutil.rmtree(self.unfinished, ignore_errors=True)

    def _begin(self) -> None:
        with suppress(FileNotFoundError):
            shutil.rmtree(self.new)  # of a run that was killed
        self.new.mkdir()

    def _try(self) -> None:
        """Write something, so that a folder that takes nothing is known before the run and not after it."""
        for name in self.names:
            if (self.path / name).is_dir():
                raise IsADirectoryError(f"{self.path / name} is a folder, and a file of the results has its name")
        self._begin()
        try:
            with durable.whole_file(self.new / SUMMARY) as file:
                file.write("{}\n")
        finally:
            shutil.rmtree(self.new, ignore_errors=True)


class Parts:
    """Writes what a run has done so far, part by part.

    folder   of the parts; made with the first one
    seconds  between two parts
    clock    gives the time in s

    A run that is made again at a tighter tolerance begins a new series. Where a part cannot be written there is a
    warning and no further part: the run itself goes on.
    """

    def __init__(self, folder: Path, seconds: float, clock: Callable[[], float]):
        self.folder, self.seconds, self.clock = folder, seconds, clock
        self.last, self.series, self.number, self.rows = clock(), 0, 0, 0
        self.run: Partial | None = None

    def look(self, run: Partial) -> None:
        """Called now and then during a run."""
        if self.run is not run:
            self.run, self.series, self.number, self.rows = run, self.series + 1, 0, 0
        if self.seconds <= self.clock() - self.last and self.rows < run.row_count - 1:
            self._write(run)
            self.last = self.clock()

    def _write(self, run: Partial) -> None:
        try:
            if self.series == 1 and self.number == 0:
                shutil.rmtree(self.folder, ignore_errors=True)  # of an earlier run
            self.folder.mkdir(exist_ok=True)
            run.part(self.rows).save(self.folder / part_name(self.series, self.number + 1))
        except OSError as error:
            warnings.warn(f"the run so far is not kept: {error}", RuntimeWarning, stacklevel=2)
            self.seconds = float("inf")
            return
        self.number, self.rows = self.number + 1, run.row_count - 1


def part_name(series: int, number: int) -> str:
    """The file of a part; names stand in the order of the parts."""
    return f"series-{series:02}-part-{number:06}.npz"


@dataclass(frozen=True)
class Results:
    """What a folder holds of one run.

    summary      what summary.json says; None of a run that was killed
    places       each file by its name
    """

    summary: dict[str, Any] | None
    places: dict[str, Path]

    def trajectory(self) -> Trajectory:
        """The motion; of a run that was killed as far as it was kept. Raises InvalidValueError for a damaged file."""
        parts = list(self.parts())
        return parts[0] if len(parts) == 1 else Trajectory.joined(parts)

    def parts(self, start: float | None = None, end: float | None = None) -> Iterator[Trajectory]:
        """The motion part by part, each one read when its turn comes: only one of them is in memory.

        start, end  times in s on the run's clock, None: those of the run. Parts that lie outside are not read

        The first row of a part is the last one of the part before it. Of a run that was not kept in parts it is the one
        trajectory. Raises InvalidValueError for what is no time and for a damaged file, DamagedResultsError for one of
        another run.
        """
        start = -math.inf if start is None else validation.real("start", start)
        end = math.inf if end is None else validation.real("end", end)
        if self.summary is None:
            times = dict.fromkeys(self.places, (-math.inf, math.inf))
        elif self.summary.get(PARTS):
            times = {part["file"]: part["t"] for part in self.summary[PARTS]}
        else:
            times = {TRAJECTORY: self.summary["t"]}
        for name, (first, last) in times.items():
            if first <= end and start <= last:
                yield self._read(name)

    def _read(self, name: str) -> Trajectory:
        path = self.places[name]
        wanted = {part["file"]: part["checksum"] for part in (self.summary or {}).get(PARTS) or ()}
        if name in wanted and durable.digest(path) != wanted[name]:
            raise DamagedResultsError(f"{path} is not the file that {SUMMARY} was written with")
        return Trajectory.load(path)


def load_results(folder: str | os.PathLike) -> Results:
    """The results that `omniroll run` has left in a folder, or the parts of a run that was killed in its first run.

    folder  str or path

    Raises DamagedResultsError where files are missing, or are not those that summary.json was written with (parts are
    verified when they are read, since they may be many);
    FileNotFoundError where there are no results; InvalidValueError for what is no path.
    """
    path = validation.file_path("folder", folder)
    summary_file = next((p for p in (path / COMPLETE / SUMMARY, path / SUMMARY) if p.exists()), None)
    if summary_file is None:
        return Results(None, _farthest_series(path))
    summary = _read_summary(summary_file)
    places = {}
    for name, checksum in summary["files"].items():
        places[name] = next((p for p in (summary_file.parent / name, path / name) if p.exists()), path / name)
        if not places[name].exists():
            raise DamagedResultsError(f"{places[name]} is missing, which {summary_file} names")
        if durable.digest(places[name]) != checksum:
            raise DamagedResultsError(f"{places[name]} is not the file that {summary_file} was written with")
    for part in summary.get(PARTS) or ():
        found = (path / folder / part["file"] for folder in (UNFINISHED, PARTS))
        places[part["file"]] = next((p for p in found if p.exists()), path / PARTS / part["file"])
        if not places[part["file"]].exists():
            raise DamagedResultsError(f"{places[part['file']]} is missing, which {summary_file} names")
    return Results(summary, places)


def unfinished(folder: str | os.PathLike) -> Results:
    """The parts of the last run into a folder, where that was killed; beside results of an earlier run, perhaps.

    folder  str or path

    Raises FileNotFoundError where there are none, InvalidValueError for what is no path.
    """
    return Results(None, _farthest_series(validation.file_path("folder", folder)))


def _farthest_series(folder: Path) -> dict[str, Path]:
    """The parts of the run that came farthest, of those that tried to reach the accuracy."""
    series: dict[str, list[Path]] = {}
    for part in sorted((folder / UNFINISHED).glob("series-*-part-*.npz")):
        series.setdefault(part.name.split("-part-")[0], []).append(part)
    if not series:
        raise FileNotFoundError(f"{folder} holds no results of a run")
    finest_first = reversed(series.values())
    best = max(finest_first, key=lambda parts: Trajectory.load(parts[-1]).elapsed[-1])
    return {part.name: part for part in best}


def _check_summary(summary: dict[str, Any]) -> None:
    """Raise ValueError for a summary that does not name the files and times of a run."""
    _check_times(summary)
    files = dict(json_texts.part(summary, "files", dict))
    for part in json_texts.part(summary, PARTS, list, []):
        if not isinstance(part, dict):
            raise ValueError(f"{PARTS} are no objects")
        _check_times(part)
        files[json_texts.part(part, "file", str)] = json_texts.part(part, "checksum", str)
    for name, checksum in files.items():
        if Path(name).name != name or not name.strip(".") or "\0" in name or not isinstance(checksum, str):
            raise ValueError(f"{name!r} is no file of a run, or has no checksum")


def _check_times(found: dict[str, Any]) -> None:
    times = json_texts.part(found, "t", list)
    plain = len(times) == 2 and all(isinstance(time, (int, float)) and not isinstance(time, bool) for time in times)
    if not (plain and times[0] <= times[1]):
        raise ValueError("'t' is no start and end")


def as_json(summary: dict[str, Any]) -> str:
    """The summary as JSON, which has no infinity: what is not finite becomes null."""

    def plain(value: Any) -> Any:
        if isinstance(value, dict):
            return {name: plain(part) for name, part in value.items()}
        if isinstance(value, (list, tuple)):
            return [plain(part) for part in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    return json.dumps(plain(summary), indent=1, allow_nan=False)


def _read_summary(path: Path) -> dict[str, Any]:
    try:
        summary = json_texts.read_object(path.read_text(encoding="utf-8"))
        _check_summary(summary)
    except ValueError as error:
        raise DamagedResultsError(f"{path} is not a whole summary of a run: {error}") from None
    return summary

"""Runs that were kept in files, as the page shows them."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.results.trajectory import Trajectory
from omniroll.scenes.result_folder import load_results
from omniroll.viewer.shown import Shown

REACTIONS = "reactions.csv"  # in a folder that `omniroll run` has written


def shown_runs(paths: Sequence[Path]) -> list[Shown]:
    """The runs in folders or files, with the forces that stand in a folder beside them.

    Of a run that was killed as far as it was kept. Raises InvalidValueError for a path that holds no run,
    DamagedResultsError for a folder with files of more than one run, OSError where a file cannot be read.
    """
    names = [path.resolve().name if path.is_dir() else path.stem for path in paths]
    unlike = len(set(names)) == len(names)
    return [_shown(path, name if unlike else str(path)) for path, name in zip(paths, names, strict=True)]


def _shown(path: Path, label: str) -> Shown:
    if path.suffix == ".toml":
        raise InvalidValueError("RUN", str(path), "is a scene: `omniroll run SCENE --view` simulates and shows it")
    if not path.exists():
        raise InvalidValueError("RUN", str(path), "is not there; name a folder that `omniroll run` wrote")
    if not path.is_dir():
        return Shown(Trajectory.load(path), label)
    try:
        results = load_results(path)
    except FileNotFoundError:
        raise InvalidValueError("RUN", str(path), "is not a folder that `omniroll run` wrote") from None
    run, table = results.trajectory(), results.places.get(REACTIONS)
    return Shown(run, label, None if table is None else _forces(table, run))


def _forces(path: Path, run: Trajectory) -> np.ndarray:
    """(T, N, 3) in N from the table of reactions."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    names = [
        f"{name}_{wheel}"
        for wheel in range(1, run.vehicle.wheels + 1)
        for name in ("along_axle", "along_rolling", "load")
    ]
    return np.array([[float(row[name]) for name in names] for row in rows]).reshape(len(run), -1, 3)

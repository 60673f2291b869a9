"""Runs that were kept in files, as the page shows them."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.results.trajectory import Trajectory
from omniroll.viewer.shown import Shown

TRAJECTORY, REACTIONS = "trajectory.npz", "reactions.csv"  # in a folder that `omniroll run` has written


def shown_runs(paths: Sequence[Path]) -> list[Shown]:
    """The runs in folders or files, with the forces that stand in a folder beside them.

    Raises InvalidValueError for a path that holds no run, OSError where a file cannot be read.
    """
    names = [path.resolve().name if path.is_dir() else path.stem for path in paths]
    unlike = len(set(names)) == len(names)
    return [_shown(path, name if unlike else str(path)) for path, name in zip(paths, names, strict=True)]


def _shown(path: Path, label: str) -> Shown:
    if path.suffix == ".toml":
        raise InvalidValueError("RUN", str(path), "is a scene: `omniroll run SCENE --view` simulates and shows it")
    if not path.is_dir():
        return Shown(Trajectory.load(path), label)
    if not (path / TRAJECTORY).exists():
        raise InvalidValueError("RUN", str(path), f"has no {TRAJECTORY}: it is not a folder that `omniroll run` wrote")
    run = Trajectory.load(path / TRAJECTORY)
    return Shown(run, label, _forces(path / REACTIONS, run) if (path / REACTIONS).exists() else None)


def _forces(path: Path, run: Trajectory) -> np.ndarray:
    """(T, N, 3) in N from the table of reactions."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    names = [
        f"{name}_{wheel}"
        for wheel in range(1, run.vehicle.wheels + 1)
        for name in ("along_axle", "along_rolling", "load")
    ]
    if len(rows) != len(run) or not set(names) <= rows[0].keys():
        raise InvalidValueError("RUN", str(path), "does not belong to the trajectory beside it")
    return np.array([[float(row[name]) for name in names] for row in rows]).reshape(len(run), -1, 3)

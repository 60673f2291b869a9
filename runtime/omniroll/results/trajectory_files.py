"""Trajectories in files: .npz (everything, binary) and .csv (everything, as text that any program reads).

A CSV file opens with lines that start with "#": the format, then the description as JSON. Then come a line of
names and the rows. Numbers are written so that reading gives the same bits. The columns dense_k_... hold the
inner coefficients of the polynomial from that row to the next; its outer ones are the rows themselves.

The functions here read and write Stored, the plain content of a file; omniroll.results.trajectory makes trajectories
of it.
"""

import csv
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain
from os import PathLike
from pathlib import Path
from typing import Any, TextIO
from zipfile import BadZipFile

import numpy as np

from omniroll import durable
from omniroll.effects.effect_set import DRIVES
from omniroll.errors import InvalidValueError

FORMAT = "omniroll trajectory 1"
SWITCH_FIELDS = np.dtype([("t", float), ("wheel", np.int64), ("direction", np.int64), ("energy_jump", float)])
ARRAYS = (
    "t",
    "elapsed",
    "nu",
    "chi",
    "contact",
    "contact_spin",
    "spins",
    "pose",
    "energy",
    "dense",
    "step_rows",
    "added",
    "drive",
)
COLUMNS = ("t", "elapsed", "nu", "chi", "pose", "contact", "contact_spin", "energy")  # of every CSV file, in this order


@dataclass(frozen=True)
class Stored:
    """What a file holds of a trajectory.

    description  plain data that JSON can hold; description["vehicle"] has the fields of the vehicle
    arrays       the arrays of ARRAYS by name; None for those that the trajectory lacks
    switches     (K,) records of SWITCH_FIELDS
    """

    description: dict[str, Any]
    arrays: dict[str, np.ndarray | None]
    switches: np.ndarray

    @property
    def wheels(self) -> int:
        """N, the number of wheels."""
        return self.description["vehicle"]["wheels"]

    @property
    def rollers_per_wheel(self) -> int:
        """n, the number of rollers of a wheel."""
        return self.description["vehicle"]["rollers_per_wheel"]


def write(stored: Stored, path: str | PathLike) -> None:
    """Write a .npz or .csv file. Raises InvalidValueError for a name with another ending."""
    stored = replace(stored, description={"format": FORMAT} | stored.description)
    if _ending(path) == ".npz":
        _write_npz(stored, path)
    else:
        with durable.whole_file(path) as file:
            _write_csv(stored, file)


def read(path: str | PathLike) -> Stored:
    """Read a .npz or .csv file. Raises InvalidValueError for a file of another kind, or one that is damaged."""
    ending = _ending(path)
    with refusing_damage(path):
        if ending == ".npz":
            stored = _read_npz(path)
        else:
            with open(path, encoding="utf-8", newline="") as file:
                stored = _read_csv(file)
        if stored.description.get("format") != FORMAT:
            raise ValueError(f"format {stored.description.get('format')!r}")
        return stored


@contextmanager
def refusing_damage(path: str | PathLike) -> Iterator[None]:
    """Turns the errors that the content of a damaged file causes into an InvalidValueError that names the file."""
    try:
        yield
    except InvalidValueError:
        raise
    except (KeyError, ValueError, TypeError, IndexError, StopIteration, BadZipFile, EOFError) as error:
        raise InvalidValueError("path", str(path), f"is not a whole {FORMAT} file ({error})") from error


def _ending(path: str | PathLike) -> str:
    ending = Path(path).suffix.lower()
    if ending not in (".npz", ".csv"):
        raise InvalidValueError("path", str(path), "must end in .npz or .csv")
    return ending


def _write_npz(stored: Stored, path: str | PathLike) -> None:
    arrays = {name: array for name, array in stored.arrays.items() if array is not None}
    with durable.whole_file(path, "wb") as file:
        np.savez(
            file,
            description=json.dumps(stored.description),
            switches=np.asarray(stored.switches, SWITCH_FIELDS),
            **arrays,
        )


def _read_npz(path: str | PathLike) -> Stored:
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] if name in file.files else None for name in ARRAYS}
        return Stored(json.loads(str(file["description"])), arrays, file["switches"])


def _names(stored: Stored, spins: bool, drives: int, added: int) -> list[str]:
    """The names of the columns without those of the polynomials; wheels and rollers are counted from 1."""
    wheels, rollers = range(1, stored.wheels + 1), range(2, stored.rollers_per_wheel + 1)
    names = [
        "t",
        "elapsed",
        "nu_1",
        "nu_2",
        "nu_3",
        *(f"chi_{i}" for i in wheels),
        "x",
        "y",
        "theta",
        *(f"contact_{i}" for i in wheels),
        *(f"contact_spin_{i}" for i in wheels),
        "energy",
    ]
    names += [f"spin_{i}_{j}" for i in wheels for j in rollers] if spins else []
    inputs = stored.description.get("drive_names", DRIVES)[:drives]
    names += [f"{name}_{i}" for name in inputs for i in wheels]
    return names + [f"added_{k}" for k in range(1, added + 1)]


def _write_csv(stored: Stored, file: TextIO) -> None:
    arrays = stored.arrays
    rows, end = len(arrays["t"]), 5 + stored.wheels + 3
    optional = [arrays[name] for name in ("spins", "drive", "added") if arrays[name] is not None]
    added = 0 if arrays["added"] is None else arrays["added"].shape[1]
    drives = 0 if arrays["drive"] is None else arrays["drive"].shape[1]
    names = _names(stored, arrays["spins"] is not None, drives, added)
    columns = [arrays[name] for name in COLUMNS] + [array.reshape(rows, -1) for array in optional]
    # tolist() gives Python's numbers: contacts stay integers, floats print to the bit.
    table = [list(chain.from_iterable(_listed(column[k]) for column in columns)) for k in range(rows)]
    description = stored.description | {"switches": [list(row) for row in stored.switches.tolist()]}
    description["dense"] = arrays["dense"] is not None
    if description["dense"]:
        degree = arrays["dense"].shape[1] - 1
        integrated = names[2:end] + names[len(names) - added :]
        names += [f"dense_{k}_{name}" for k in range(1, degree) for name in integrated]
        for row, coefficients in zip(arrays["step_rows"], arrays["dense"], strict=True):
            table[row] += coefficients[1:-1].ravel().tolist()
    description["step_rows"] = arrays["step_rows"].tolist()
    description["added"] = added if arrays["added"] is not None else None
    description["drives"] = drives
    file.write(f"# {FORMAT}\n# {json.dumps(description)}\n")
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(row + [""] * (len(names) - len(row)) for row in table)


def _listed(entry: np.ndarray | np.number) -> list:
    return entry.tolist() if np.ndim(entry) else [entry.item()]


def _read_csv(file: TextIO) -> Stored:
    if file.readline().strip() != f"# {FORMAT}":
        raise ValueError("the first line does not say so")
    description = json.loads(file.readline().removeprefix("#"))
    reader = csv.reader(file)
    names = next(reader)
    table = list(reader)
    switches = np.array([tuple(row) for row in description["switches"]], SWITCH_FIELDS)
    stored = Stored(description, {}, switches)
    return replace(stored, arrays=_arrays(stored, names, table))


def _arrays(stored: Stored, names: list[str], table: list[list[str]]) -> dict[str, Any]:
    """The arrays from the rows of a CSV file, as texts."""
    wheels, rollers, rows, description = stored.wheels, stored.rollers_per_wheel, len(table), stored.description
    with_spins = "spin_1_2" in names
    added, drives = description.get("added"), description.get("drives", 0)
    plain = _names(stored, with_spins, drives, added or 0)
    if names[: len(plain)] != plain or any(len(row) != len(names) for row in table):
        raise ValueError("columns are missing")
    numbers = np.array([[float(text) for text in row[: len(plain)]] for row in table])
    widths = dict(zip(COLUMNS, (0, 0, 3, wheels, 3, wheels, wheels, 0), strict=True))  # 0: one column, no axis
    arrays: dict[str, Any] = {
        "spins": None,
        "dense": None,
        "step_rows": np.array(description["step_rows"], int),
        "added": None,
        "drive": None,
    }
    place = 0
    for name, width in widths.items():
        arrays[name] = numbers[:, place : place + width].copy() if width else numbers[:, place].copy()
        place += max(width, 1)
    arrays["contact"] = arrays["contact"].astype(int)
    if with_spins:
        width = wheels * (rollers - 1)
        arrays["spins"] = numbers[:, place : place + width].reshape(rows, wheels, rollers - 1)
        place += width
    if drives:
        width = wheels * drives
        arrays["drive"] = numbers[:, place : place + width].reshape(rows, drives, wheels)
        place += width
    if added is not None:
        arrays["added"] = numbers[:, place:].copy()
    if description["dense"]:
        inner = np.array([[float(text) for text in table[row][len(plain) :]] for row in arrays["step_rows"]])
        arrays["dense"] = _dense(inner, arrays)
    return arrays


def _dense(inner: np.ndarray, arrays: dict[str, Any]) -> np.ndarray:
    """All coefficients from the inner ones and the rows at both ends."""
    rows = arrays["step_rows"]
    names = ("nu", "chi", "pose", "added")
    states = np.concatenate([arrays[name] for name in names if arrays[name] is not None], axis=1)
    inner = inner.reshape(len(rows), -1, states.shape[1])
    return np.concatenate([states[rows][:, None], inner, states[rows + 1][:, None]], axis=1)

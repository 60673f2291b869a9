"""Trajectories in files: .npz (everything, binary) and .csv (everything, as text that any program reads).

A CSV file opens with lines that start with "#": the format, then the description as JSON. Then come a line of
names and the rows. Numbers are written so that reading gives the same bits. The columns dense_k_... hold the
inner coefficients of the polynomial from that row to the next; its outer ones are the rows themselves.

The functions here read and write Stored, the plain content of a file; omniroll.results.trajectory makes trajectories
of it.
"""

import csv
import errno
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from os import PathLike
from pathlib import Path
from typing import Any, TextIO
from zipfile import ZIP_STORED, ZipFile

import numpy as np

from omniroll import durable, json_texts
from omniroll.effects.effect_set import DRIVES
from omniroll.errors import InvalidValueError
from omniroll.results.trajectory_content import ARRAYS, AXES, SWITCH_FIELDS, Stored, check
from omniroll.vehicles.checks import rollers_there

FORMAT = "omniroll trajectory 2"
LAYOUT = ("switches", "dense", "step_rows", "added", "drives")  # what the description of a CSV file has besides, and
# how many "modes" there are, which older files lack
COLUMNS = ("t", "elapsed", "nu", "chi", "pose", "contact", "contact_spin", "energy")  # of every CSV file, in this order


def write(stored: Stored, path: str | PathLike) -> None:
    """Write a .npz or .csv file. Raises InvalidValueError for a name with another ending."""
    stored = replace(stored, description={"format": FORMAT} | stored.description)
    try:
        checksums = stored.checksums()
    except (TypeError, ValueError) as error:  # an effect whose fields are not plain data
        raise InvalidValueError(
            "effects", stored.description["effects"], f"cannot be kept in a file: {error}"
        ) from error
    stored = replace(stored, description=stored.description | {"checksums": checksums})
    if _ending(path) == ".npz":
        _write_npz(stored, path)
    else:
        with durable.whole_file(path) as file:
            _write_csv(stored, file)


def read(path: str | PathLike) -> Stored:
    """Read a .npz or .csv file. Raises InvalidValueError for a file of another kind or version, or one that is damaged;
    it says which array is wrong."""
    ending = _ending(path)
    with refusing_damage(path):
        if ending == ".npz":
            stored = _read_npz(path)
        else:
            with open(path, encoding="utf-8", newline="") as file:
                stored = _read_csv(file)
        checksums = stored.description.pop("checksums", {})
        check(stored, checksums)
        return stored


@contextmanager
def refusing_damage(path: str | PathLike) -> Iterator[None]:
    """Turns the errors that the content of a damaged file causes into an InvalidValueError that names the file.

    numpy, zipfile and json raise errors of a dozen kinds, SyntaxError among them. An OSError is one of reading, except
    for a place before the file's beginning.
    """
    try:
        yield
    except InvalidValueError:
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno != errno.EINVAL:
            raise
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
    with ZipFile(path) as archive:
        members = archive.infolist()
    # Files are written as they are, not compressed: what is read is no larger than the file.
    if any(member.compress_type != ZIP_STORED or member.file_size != member.compress_size for member in members):
        raise ValueError("its arrays are compressed")
    unknown = {member.filename.removesuffix(".npy") for member in members} - {*AXES, "description"}
    if unknown or len(members) != len({member.filename for member in members}):
        raise ValueError(f"arrays that a trajectory does not have: {', '.join(sorted(unknown)) or 'one of them twice'}")
    with np.load(path, allow_pickle=False) as file:
        description = _read_description(str(file["description"]))
        arrays = {name: file[name] if name in file.files else None for name in ARRAYS}
        return Stored(description, arrays, file["switches"])


def _read_description(text: str) -> dict[str, Any]:
    """The description of a file. Raises ValueError for that of another version."""
    description = json_texts.read_object(text)
    found = description.get("format")
    if found != FORMAT:
        raise ValueError(f"it says that it is {found!r}; simulate again")
    return description


def _names(stored: Stored, spins: bool, modes: int, drives: int, added: int) -> list[str]:
    """The names of the columns without those of the polynomials; wheels and rollers are counted from 1."""
    wheels = range(1, stored.wheels + 1)
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
    names += [f"spin_{i}_{j}" for i in wheels for j in range(2, stored.rollers[i - 1] + 1)] if spins else []
    names += [f"pivot_{i}" for i in wheels] if stored.has_joints else []
    names += [f"mode_{k}" for k in range(1, modes + 1)]
    inputs = stored.description.get("drive_names", DRIVES)[:drives]
    names += [f"{name}_{i}" for name in inputs for i in wheels]
    return names + [f"added_{k}" for k in range(1, added + 1)]


def _write_csv(stored: Stored, file: TextIO) -> None:
    arrays = stored.arrays
    rows, end = len(arrays["t"]), 5 + stored.wheels + 3
    optional = [arrays[name] for name in ("spins", "pivots", "modes", "drive", "added") if arrays[name] is not None]
    if arrays["spins"] is not None:
        optional[0] = arrays["spins"][:, rollers_there(stored)]
    counted = (arrays[name] for name in ("modes", "drive", "added"))
    modes, drives, added = (0 if array is None else array.shape[1] for array in counted)
    names = _names(stored, arrays["spins"] is not None, modes, drives, added)
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
    description["drives"], description["modes"] = drives, modes
    file.write(f"# {FORMAT}\n# {json.dumps(description)}\n")
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(row + [""] * (len(names) - len(row)) for row in table)


def _listed(entry: np.ndarray | np.number) -> list:
    return entry.tolist() if np.ndim(entry) else [entry.item()]


def _read_csv(file: TextIO) -> Stored:
    first = file.readline().strip()
    if first != f"# {FORMAT}":
        raise ValueError(f"its first line is {first[:40]!r}")
    described = _read_description(file.readline().removeprefix("#"))
    layout = {name: described.pop(name) for name in LAYOUT} | {"modes": described.pop("modes", 0)}
    reader = csv.reader(file)
    names = next(reader)
    table = list(reader)
    switches = np.array([tuple(row) for row in layout["switches"]], SWITCH_FIELDS)
    stored = Stored(described, {}, switches)
    if not stored.wheels <= len(names):
        raise ValueError("columns are missing")
    return replace(stored, arrays=_arrays(stored, layout, names, table))


def _arrays(stored: Stored, layout: dict[str, Any], names: list[str], table: list[list[str]]) -> dict[str, Any]:
    """The arrays from the rows of a CSV file, as texts."""
    wheels, rollers, rows = stored.wheels, stored.rollers_per_wheel, len(table)
    with_spins = "spin_1_2" in names
    added, drives, modes = layout["added"], layout["drives"], layout["modes"]
    plain = _names(stored, with_spins, modes, drives, added or 0)
    if names[: len(plain)] != plain or any(len(row) != len(names) for row in table):
        raise ValueError("columns are missing")
    numbers = np.array([[float(text) for text in row[: len(plain)]] for row in table])
    widths = dict(zip(COLUMNS, (0, 0, 3, wheels, 3, wheels, wheels, 0), strict=True))  # 0: one column, no axis
    arrays: dict[str, Any] = {
        "spins": None,
        "pivots": None,
        "modes": None,
        "dense": None,
        "step_rows": np.array(layout["step_rows"], int),
        "added": None,
        "drive": None,
    }
    place = 0
    for name, width in widths.items():
        arrays[name] = numbers[:, place : place + width].copy() if width else numbers[:, place].copy()
        place += max(width, 1)
    arrays["contact"] = arrays["contact"].astype(int)
    if with_spins:
        there = rollers_there(stored)
        width, arrays["spins"] = there.sum(), np.zeros((rows, wheels, rollers - 1))
        arrays["spins"][:, there] = numbers[:, place : place + width]
        place += width
    if stored.has_joints:
        arrays["pivots"] = numbers[:, place : place + wheels].astype(int)
        place += wheels
    if modes:
        arrays["modes"] = numbers[:, place : place + modes].astype(int)
        place += modes
    if drives:
        width = wheels * drives
        arrays["drive"] = numbers[:, place : place + width].reshape(rows, drives, wheels)
        place += width
    if added is not None:
        arrays["added"] = numbers[:, place:].copy()
    if layout["dense"]:
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

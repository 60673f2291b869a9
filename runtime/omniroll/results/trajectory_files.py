"""Trajectories in files: .npz (everything, binary) and .csv (everything, as text that any program reads).

A CSV file opens with lines that start with "#": the format, then the description as JSON. Then come a line of
names and the rows. Numbers are written so that reading gives the same bits. The columns dense_k_... hold the
inner coefficients of the polynomial from that row to the next; its outer ones are the rows themselves.
"""

import csv
import json
from itertools import chain
from os import PathLike
from pathlib import Path
from typing import Any, TextIO
from zipfile import BadZipFile

import numpy as np

from omniroll.effects import KINDS
from omniroll.effects.effect_set import DRIVES, EffectSet
from omniroll.errors import InvalidValueError
from omniroll.results.trajectory import SWITCH_FIELDS, Trajectory
from omniroll.vehicles.vehicle import Vehicle

FORMAT = "omniroll trajectory 1"
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
DESCRIPTION = ("roller_model", "switching", "accuracy", "engine", "start_time", "stats")


def save(trajectory: Trajectory, path: str | PathLike, *, dense: bool) -> None:
    """Write a .npz or .csv file."""
    ending = _ending(path)
    if ending == ".npz":
        _save_npz(trajectory, path, dense)
    else:
        with open(path, "w", encoding="utf-8", newline="") as file:
            _write_csv(trajectory, file, dense)


def load(path: str | PathLike) -> Trajectory:
    """Read a .npz or .csv file."""
    ending = _ending(path)
    try:
        if ending == ".npz":
            return _load_npz(path)
        with open(path, encoding="utf-8", newline="") as file:
            return _read_csv(file)
    except InvalidValueError:
        raise
    except (KeyError, ValueError, TypeError, IndexError, StopIteration, BadZipFile, EOFError) as error:
        raise InvalidValueError("path", str(path), f"is not a whole {FORMAT} file ({error})") from error


def _ending(path: str | PathLike) -> str:
    ending = Path(path).suffix.lower()
    if ending not in (".npz", ".csv"):
        raise InvalidValueError("path", str(path), "must end in .npz or .csv")
    return ending


def _description(trajectory: Trajectory) -> dict[str, Any]:
    description = {name: getattr(trajectory, name) for name in DESCRIPTION}
    effects = [effect.as_dict() for effect in trajectory.effects.effects]
    return {"format": FORMAT, "vehicle": trajectory.vehicle.as_dict(), "effects": effects, **description}


def _trajectory(description: dict[str, Any], arrays: dict[str, Any], switches: np.ndarray) -> Trajectory:
    if description.get("format") != FORMAT:
        raise ValueError(f"format {description.get('format')!r}")
    given = {name: description[name] for name in DESCRIPTION}
    vehicle = Vehicle(**description["vehicle"])
    effects = _effects(vehicle, description.get("effects", []))
    return Trajectory(vehicle=vehicle, switches=switches.view(np.recarray), effects=effects, **given, **arrays)


def _effects(vehicle: Vehicle, described: list[dict[str, Any]]) -> EffectSet:
    made = []
    for fields in described:
        fields = dict(fields)
        made.append(KINDS[fields.pop("kind")](**fields))
    return EffectSet.checked(made, vehicle)


def _save_npz(trajectory: Trajectory, path: str | PathLike, dense: bool) -> None:
    arrays = {name: getattr(trajectory, name) for name in ARRAYS}
    if not dense:
        arrays["dense"] = None
    arrays = {name: array for name, array in arrays.items() if array is not None}
    with open(path, "wb") as file:
        np.savez(
            file,
            description=json.dumps(_description(trajectory)),
            switches=np.asarray(trajectory.switches, SWITCH_FIELDS),
            **arrays,
        )


def _load_npz(path: str | PathLike) -> Trajectory:
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] if name in file.files else None for name in ARRAYS}
        return _trajectory(json.loads(str(file["description"])), arrays, file["switches"])


def _names(vehicle: Vehicle, spins: bool, drives: int, added: int) -> list[str]:
    wheels, rollers = range(1, vehicle.wheels + 1), range(2, vehicle.rollers_per_wheel + 1)
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
    names += [f"{name}_{i}" for name in DRIVES[:drives] for i in wheels]
    return names + [f"added_{k}" for k in range(1, added + 1)]


def _write_csv(trajectory: Trajectory, file: TextIO, dense: bool) -> None:
    vehicle, rows, end = trajectory.vehicle, len(trajectory), 5 + trajectory.vehicle.wheels + 3
    added = 0 if trajectory.added is None else trajectory.added.shape[1]
    drives = 0 if trajectory.drive is None else trajectory.drive.shape[1]
    names = _names(vehicle, trajectory.spins is not None, drives, added)
    columns = [
        trajectory.t,
        trajectory.elapsed,
        trajectory.nu,
        trajectory.chi,
        trajectory.pose,
        trajectory.contact,
        trajectory.contact_spin,
        trajectory.energy,
    ]
    if trajectory.spins is not None:
        columns.append(trajectory.spins.reshape(rows, -1))
    if trajectory.drive is not None:
        columns.append(trajectory.drive.reshape(rows, -1))
    if trajectory.added is not None:
        columns.append(trajectory.added)
    # tolist() gives Python's numbers: contacts stay integers, floats print to the bit.
    table = [list(chain.from_iterable(_listed(column[k]) for column in columns)) for k in range(rows)]
    description = _description(trajectory) | {"switches": [list(row) for row in trajectory.switches.tolist()]}
    description["dense"] = dense and trajectory.dense is not None
    if description["dense"]:
        degree = trajectory.dense.shape[1] - 1
        integrated = names[2:end] + names[len(names) - added :]
        names += [f"dense_{k}_{name}" for k in range(1, degree) for name in integrated]
        for row, coefficients in zip(trajectory.step_rows, trajectory.dense, strict=True):
            table[row] += coefficients[1:-1].ravel().tolist()
    description["step_rows"] = trajectory.step_rows.tolist()
    description["added"] = added if trajectory.added is not None else None
    description["drives"] = drives
    file.write(f"# {FORMAT}\n# {json.dumps(description)}\n")
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(row + [""] * (len(names) - len(row)) for row in table)


def _listed(entry: np.ndarray | np.number) -> list:
    return entry.tolist() if np.ndim(entry) else [entry.item()]


def _read_csv(file: TextIO) -> Trajectory:
    if file.readline().strip() != f"# {FORMAT}":
        raise ValueError("the first line does not say so")
    description = json.loads(file.readline().removeprefix("#"))
    vehicle = Vehicle(**description["vehicle"])
    reader = csv.reader(file)
    names = next(reader)
    table = list(reader)
    arrays = _arrays(vehicle, names, table, description)
    switches = np.array([tuple(row) for row in description["switches"]], SWITCH_FIELDS)
    return _trajectory(description, arrays, switches)


def _arrays(vehicle: Vehicle, names: list[str], table: list[list[str]], description: dict) -> dict[str, Any]:
    wheels, rollers, rows = vehicle.wheels, vehicle.rollers_per_wheel, len(table)
    with_spins = "spin_1_2" in names
    added, drives = description.get("added"), description.get("drives", 0)
    plain = _names(vehicle, with_spins, drives, added or 0)
    if names[: len(plain)] != plain or any(len(row) != len(names) for row in table):
        raise ValueError("columns are missing")
    numbers = np.array([[float(text) for text in row[: len(plain)]] for row in table])
    widths = {
        "t": 0,
        "elapsed": 0,
        "nu": 3,
        "chi": wheels,
        "pose": 3,
        "contact": wheels,
        "contact_spin": wheels,
        "energy": 0,
    }
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

"""The corpus on disk: a compressed file of each kind."""

from dataclasses import fields
from pathlib import Path

import numpy as np

from corpus.kinds import name_of
from corpus.record import Record

FOLDER = Path(__file__).resolve().parents[1] / "data/corpus"
NAMES = [field.name for field in fields(Record)]


def file_of(kind: tuple[str, str, str]) -> Path:
    return FOLDER / f"{name_of(kind).replace(', ', '-').replace(' ', '-')}.npz"


def write(kind: tuple[str, str, str], records: dict[int, Record]) -> None:
    """records: by the numbers of their scenes."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    given = {"numbers": np.array(list(records), np.int16)}
    for name in NAMES:
        arrays = [getattr(record, name) for record in records.values()]
        given[name] = np.concatenate([array.ravel() for array in arrays])
        given[f"{name}_shapes"] = np.array([(*array.shape, 1)[:2] for array in arrays], np.int16)
    given["changes"] = given["changes"].astype(np.int16)
    np.savez_compressed(file_of(kind), **given)


def read(kind: tuple[str, str, str]) -> dict[int, Record]:
    with np.load(file_of(kind)) as file:
        kept = {name: file[name] for name in file.files}
    found: dict[int, dict[str, np.ndarray]] = {int(number): {} for number in kept["numbers"]}
    for name in NAMES:
        shapes = kept[f"{name}_shapes"].astype(int)
        ends = np.cumsum(shapes.prod(axis=1))
        flat = name in ("instants", "spins", "energy")
        for parts, end, shape in zip(found.values(), ends, shapes, strict=True):
            values = kept[name][end - shape.prod() : end]
            parts[name] = values if flat else values.reshape(shape)
    return {number: Record(**parts) for number, parts in found.items()}

"""Motions as tables of other libraries: pandas, xarray, Parquet. The libraries are imported when they are used.

A motion is given as arrays by name, whose first axis is time; omniroll.results.trajectory makes them. What the
derivation knows by these names has its unit and its meaning from there, what instruments read from omniroll.vocabulary.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from omniroll import durable, extras, generated_data, vocabulary
from omniroll.results.ledger import WORDS

if TYPE_CHECKING:  # only an extra brings them
    import pandas
    import xarray

EXTRA = "tables"
READINGS = {entry.name: entry for entry in vocabulary.MEASUREMENTS}
POSE = ("x", "y", "theta")
# The axes behind time, and what counts along them. N wheels, n - 1 places of free rollers.
AXES: Mapping[str, tuple[str, ...]] = {
    "nu": ("component",),
    "chi": ("wheel",),
    "contact": ("wheel",),
    "contact_spin": ("wheel",),
    "spins": ("wheel", "place"),
    "slip": ("wheel", "direction"),
    "ground_force": ("wheel", "direction"),
    "ground_load": ("wheel",),
    "torque": ("wheel",),
    "damping": ("wheel",),
    "bearing_torque": ("wheel",),
    "accelerometer": ("axis",),
    "odometry": ("coordinate",),
    "tracking_angle": ("tracking_wheel",),
    "tracking_count": ("tracking_wheel",),
    "tracking_rate": ("tracking_wheel",),
    "tracking_odometry": ("coordinate",),
}
OF_ROWS = {  # what rows keep besides, and the derivation does not name
    "ground_load": ("N", "load of a contact; 0 where it is off the ground"),
    "slip_heading": ("rad", "direction in which a contact slips, from its axle; where it sticks that of its last slip"),
}
LABELS = {"direction": ("along_axle", "along_rolling")}
FIRST = {"place": 2}  # places of free rollers are j = 2..n; all other numbers begin with 1


def about(name: str) -> dict[str, str]:
    """Unit and meaning of one of the arrays, as attributes with the names of the CF conventions."""
    if name in READINGS:
        return {"units": READINGS[name].unit, "long_name": READINGS[name].meaning}
    if name in ("t", *POSE):
        units = dict(zip(POSE, generated_data.described("pose").unit.split(", "), strict=True)) | {"t": "s"}
        return {"units": units[name], "long_name": {"t": "time", "theta": "heading"}.get(name, f"{name} of S")}
    if name == "contact":
        return {"units": "1", "long_name": "number of the roller in contact, from 0"}
    if name in WORDS:  # integrals since the start, also where the derivation describes their rate by that name
        return {"units": "J", "long_name": f"energy gained since the start: {WORDS[name]}"}
    if name in OF_ROWS:
        return dict(zip(("units", "long_name"), OF_ROWS[name], strict=True))
    described = generated_data.described(name)
    return {"units": described.unit, "long_name": described.meaning}


def axes_of(name: str, values: np.ndarray) -> tuple[str, ...]:
    """Names of the axes of an array behind time."""
    return AXES.get(name, ("wheel",) if values.ndim == 2 else ())


def columns(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """(T,) columns of a flat table, in the arrays' order: nu_1, chi_3, spins_1_2, slip_1_along_axle, ..."""
    return {label: column for name, values in arrays.items() for label, column in _split(name, values)}


def _split(name: str, values: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    axes = axes_of(name, values)
    for place in np.ndindex(values.shape[1:]):
        ends = (str(numbers_along(axis, size)[k]) for axis, size, k in zip(axes, values.shape[1:], place, strict=True))
        yield "_".join((name, *ends)), values[:, *place]


def numbers_along(axis: str, size: int) -> tuple[str, ...] | range:
    """What stands along an axis."""
    first = FIRST.get(axis, 1)
    return LABELS.get(axis, range(first, first + size))


def to_pandas(arrays: Mapping[str, np.ndarray]) -> "pandas.DataFrame":
    """A DataFrame over `t`, a column for each number; its attrs["units"] has the units of the columns."""
    pandas = extras.needed("pandas", EXTRA, "to_pandas")
    units = {label: about(name)["units"] for name, values in arrays.items() for label, _ in _split(name, values)}
    frame = pandas.DataFrame(columns(arrays)).set_index("t")
    frame.attrs["units"] = units
    return frame


def to_xarray(arrays: Mapping[str, np.ndarray], attributes: Mapping[str, Any]) -> "xarray.Dataset":
    """A Dataset over `t`, whose variables have named dimensions, and units as attributes.

    attributes  of the whole, in plain types
    """
    xarray = extras.needed("xarray", EXTRA, "to_xarray")
    data, coordinates = {}, {"t": ("t", arrays["t"], about("t"))}
    for name, values in arrays.items():
        axes = axes_of(name, values)
        sizes = zip(axes, values.shape[1:], strict=True)
        coordinates |= {axis: list(numbers_along(axis, size)) for axis, size in sizes}
        data[name] = (("t", *axes), values, about(name))
    del data["t"]
    return xarray.Dataset(data, coordinates, dict(attributes))


def to_parquet(arrays: Mapping[str, np.ndarray], path: Path) -> None:
    """Write the table of to_pandas, units included. OSError where the file cannot be written."""
    extras.needed("pyarrow", EXTRA, "to_parquet")
    frame = to_pandas(arrays)
    with durable.whole_file(path, "wb") as file:
        frame.to_parquet(file)

"""The ends of many runs as tables of pandas and xarray. The libraries are imported when they are used.

Runs stand along named axes, each with the values that were varied along it; results/tables.py has the names, the units
and the axes of what each run leaves.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import extras, validation
from omniroll.errors import InvalidValueError
from omniroll.results import tables

if TYPE_CHECKING:  # only an extra brings them
    import pandas
    import xarray

Many = Any  # omniroll.sweeps.ends.Many, whose methods come here

AT_ENDS = ("nu", "chi", "contact", "contact_spin", "spins", "energy")
OF_RUNS = {  # what is known of a run beside its end
    "energy_start": ("J", "kinetic energy at the start"),
    "switches": ("1", "wheels that switched"),
    "steps": ("1", "steps of the run"),
    "evaluations": ("1", "evaluations of the equations of motion"),
    "error_estimate": ("1", "estimated error of (x, y)/R, theta and nu over the largest |nu|"),
    "stopped": ("1", "whether the run could not go on, or failed"),
}
REASON = "reason"
SAMPLES = "samples_"  # before the names of what samples have
RUN, SAMPLE = "run", "sample"


def axes_of(shape: tuple[int, ...], axes: Mapping[str, ArrayLike] | None) -> dict[str, np.ndarray]:
    """The names of the axes of runs and the values along them, checked; numbers from 0 where none are given."""
    if axes is None:
        names = [RUN] if len(shape) == 1 else [f"{RUN}_{k}" for k in range(1, len(shape) + 1)]
        return {name: np.arange(size) for name, size in zip(names, shape, strict=True)}
    if not isinstance(axes, Mapping) or not all(isinstance(name, str) for name in axes):
        raise InvalidValueError("axes", axes, "must be a mapping of names to the values along each axis")
    found = {name: validation.real_array(f"axes[{name!r}]", values) for name, values in axes.items()}
    sizes = [values.shape for values in found.values()]
    if sizes != [(size,) for size in shape]:
        raise InvalidValueError("axes", sizes, f"must be {len(shape)} axes with as many values as the runs, {shape}")
    taken = {"t", *tables.POSE, *AT_ENDS, *OF_RUNS, REASON, SAMPLE, *_inner_axes()} & set(found)
    if taken:
        raise InvalidValueError("axes", sorted(taken), "must be other names: results have these")
    return found


def _inner_axes() -> set[str]:
    return {axis for axes in tables.AXES.values() for axis in axes} | {"wheel"}


def _arrays(many: Many) -> dict[str, np.ndarray]:
    """(..., ...) what there is of each run."""
    found = {"t": many.end.t} | dict(zip(tables.POSE, np.moveaxis(many.end.pose, -1, 0), strict=True))
    found |= {name: getattr(many.end, name) for name in AT_ENDS}
    found |= {name: getattr(many, name) for name in OF_RUNS}
    return {name: values for name, values in found.items() if values is not None}


def _reasons(many: Many) -> np.ndarray:
    """(...) why runs stopped, "" of the others."""
    reasons = np.full(many.shape, "", object)
    for place, reason in many.reasons.items():
        reasons[place] = reason
    return reasons


def _about(name: str) -> dict[str, str]:
    if name in OF_RUNS:
        return dict(zip(("units", "long_name"), OF_RUNS[name], strict=True))
    return tables.about(name)


def to_pandas(many: Many, axes: Mapping[str, ArrayLike] | None) -> "pandas.DataFrame":
    """A row for each run in C order, first the columns of the axes; attrs["units"] has the units."""
    pandas = extras.needed("pandas", tables.EXTRA, "to_pandas")
    along, count = axes_of(many.shape, axes), many.stopped.size
    grid = np.meshgrid(*along.values(), indexing="ij") if along else ()
    columns = {name: values.ravel() for name, values in zip(along, grid, strict=True)}
    units = {}
    for name, values in _arrays(many).items():
        split = tables.columns({name: values.reshape(count, *values.shape[len(many.shape) :])})
        columns |= split
        units |= dict.fromkeys(split, _about(name)["units"])
    frame = pandas.DataFrame(columns | {REASON: _reasons(many).ravel()})
    frame.attrs["units"] = units
    return frame


def to_xarray(many: Many, axes: Mapping[str, ArrayLike] | None) -> "xarray.Dataset":
    """A Dataset over the axes of runs; samples behind a further dimension, with `samples_` before their names."""
    xarray = extras.needed("xarray", tables.EXTRA, "to_xarray")
    along = axes_of(many.shape, axes)
    coordinates: dict[str, Any] = {name: (name, values) for name, values in along.items()}
    data: dict[str, Any] = {REASON: (tuple(along), _reasons(many).astype(str))}

    def keep(label: str, name: str, values: np.ndarray, lead: tuple[str, ...]) -> None:
        flat = values.reshape(-1, *values.shape[len(lead) :])
        inner = tables.axes_of(name, flat)
        for axis, size in zip(inner, flat.shape[1:], strict=True):
            coordinates[axis] = list(tables.numbers_along(axis, size))
        data[label] = ((*lead, *inner), values, _about(name))

    for name, values in _arrays(many).items():
        keep(name, name, values, tuple(along))
    if many.samples is not None:
        lead = (*along, SAMPLE)
        keep(f"{SAMPLES}t", "t", many.samples.t, lead)
        for place, name in enumerate(tables.POSE):
            keep(f"{SAMPLES}{name}", name, many.samples.pose[..., place], lead)
        for name in AT_ENDS:
            if getattr(many.samples, name) is not None:
                keep(f"{SAMPLES}{name}", name, getattr(many.samples, name), lead)
    return xarray.Dataset(data, coordinates)

"""What the file of a trajectory must hold: which arrays, of which shapes and types, and their checksums."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

SWITCH_FIELDS = np.dtype([("t", float), ("wheel", np.int64), ("direction", np.int64), ("energy_jump", float)])
# The axes of each array: T rows, N wheels, n - 1 = "places", S steps, d + 1 coefficients, W numbers of a row, E of the
# effects, D inputs of the drives, B bearings that may stick, K switches.
AXES: Mapping[str, tuple[str | int, ...]] = {
    "t": ("T",),
    "elapsed": ("T",),
    "nu": ("T", 3),
    "chi": ("T", "N"),
    "contact": ("T", "N"),
    "pivots": ("T", "N"),
    "modes": ("T", "B"),
    "contact_spin": ("T", "N"),
    "spins": ("T", "N", "places"),
    "pose": ("T", 3),
    "energy": ("T",),
    "dense": ("S", "d + 1", "W"),
    "step_rows": ("S",),
    "added": ("T", "E"),
    "drive": ("T", "D", "N"),
    "switches": ("K",),
}
ARRAYS = tuple(name for name in AXES if name != "switches")
WHOLE = ("contact", "pivots", "modes", "step_rows")
OPTIONAL = ("pivots", "modes", "spins", "dense", "added", "drive")
DESCRIBED = {
    "roller_model": str,
    "switching": str,
    "accuracy": float,
    "engine": str,
    "start_time": (int, float),
    "stats": dict,
    "vehicle": dict,
    "effects": list,
    "drive_names": list,
}


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

    @property
    def rollers(self) -> list[int]:
        """(N,) the number of rollers of each wheel."""
        vehicle, most = self.description["vehicle"], self.rollers_per_wheel
        kinds = vehicle.get("kinds", {})
        own = [kinds[name].get("rollers_per_wheel", most) for name in vehicle.get("wheel_kinds", ())]
        return own or [most] * self.wheels

    @property
    def has_joints(self) -> bool:
        """Whether its wheels have two rows of rollers, or rollers at an angle: they may stand on their joints."""
        vehicle = self.description["vehicle"]
        return vehicle.get("rows", 1) > 1 or bool(np.any(vehicle.get("roller_angle", 0)))

    def checksums(self) -> dict[str, str]:
        """SHA-256 of the description and of each array that there is, by name."""
        text = json.dumps(self.description, sort_keys=True).encode()
        every = self.arrays | {"switches": self.switches}
        found = {name: _digest(array) for name, array in every.items() if array is not None}
        return found | {"description": hashlib.sha256(text).hexdigest()}


def _digest(array: np.ndarray) -> str:
    head = f"{array.dtype.str} {array.shape} ".encode()
    return hashlib.sha256(head + np.ascontiguousarray(array).tobytes()).hexdigest()


def check(stored: Stored, checksums: Mapping[str, str]) -> None:
    """Raise ValueError, which names what is wrong, unless a file holds what it was written with, and all of it."""
    _check_description(stored)
    found = stored.checksums()
    for name in {**checksums, **found}:
        if name not in found:
            raise ValueError(f"{name} is missing")
        if found[name] != checksums.get(name):
            raise ValueError(f"the checksum of {name} does not fit: it is damaged")
    _check_arrays(stored)


def _check_description(stored: Stored) -> None:
    for name, kind in DESCRIBED.items():
        if not isinstance(stored.description.get(name), kind):
            raise ValueError(f"{name} is missing, or of a wrong type")
    for name in ("wheels", "rollers_per_wheel"):
        if type(stored.description["vehicle"].get(name)) is not int:
            raise ValueError(f"{name} of the vehicle is not a whole number")


def _check_arrays(stored: Stored) -> None:
    """Names, types and shapes, that each number is finite, and that places are places."""
    sizes: dict[str, int] = {"N": stored.wheels, "places": stored.rollers_per_wheel - 1}
    every = stored.arrays | {"switches": stored.switches}
    for name, axes in AXES.items():
        array = every.get(name)
        if array is None:
            if name not in OPTIONAL:
                raise ValueError(f"{name} is missing")
            continue
        wanted = SWITCH_FIELDS if name == "switches" else np.dtype(np.int64 if name in WHOLE else float)
        if array.dtype != wanted:
            raise ValueError(f"{name} has the type {array.dtype}, not {wanted}")
        if name == "dense":
            sizes["W"] = 6 + stored.wheels + (0 if every["added"] is None else every["added"].shape[-1])
        if array.ndim != len(axes):
            raise ValueError(f"{name} has {array.ndim} axes, not {len(axes)}")
        for axis, size in zip(axes, array.shape, strict=True):
            expected = axis if isinstance(axis, int) else sizes.setdefault(axis, size)
            if size != expected:
                raise ValueError(f"{name} has the shape {array.shape}, and {axis} is {expected}")
        numbers = [array[field] for field in array.dtype.names] if array.dtype.names else [array]
        if not all(np.isfinite(part).all() for part in numbers):
            raise ValueError(f"{name} is not finite everywhere")
    _check_places(stored, sizes)


def _check_places(stored: Stored, sizes: Mapping[str, int]) -> None:
    rows, arrays = sizes["T"], stored.arrays
    if rows == 0:
        raise ValueError("t has no rows")
    for name, most in (("contact", sizes["places"]), ("step_rows", rows - 2)):
        if arrays[name].size and not 0 <= arrays[name].min() <= arrays[name].max() <= most:
            raise ValueError(f"{name} has numbers beyond 0 ... {most}")
    for name, least in (("elapsed", 0), ("t", 0), ("step_rows", 1)):
        if (np.diff(arrays[name]) < least).any():
            raise ValueError(f"{name} does not increase")
    wheel = stored.switches["wheel"]
    if wheel.size and not 0 <= wheel.min() <= wheel.max() < sizes["N"]:
        raise ValueError(f"switches names wheels beyond 0 ... {sizes['N'] - 1}")
    if (stored.description["roller_model"] == "free") != (arrays["spins"] is not None):
        raise ValueError("spins belong to free rollers, and to no others")
    if stored.has_joints != (arrays["pivots"] is not None):
        raise ValueError("pivots belong to mecanum wheels and to wheels with two rows of rollers, and to no others")
    for name, described in (("drive", "drive_names"), ("added", "effects")):
        if (arrays[name] is None) != (not stored.description[described]):
            raise ValueError(f"{name} does not fit the effects")

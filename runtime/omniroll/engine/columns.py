"""The numbers on which a run may depend, by name, and what each of them moves.

    nu[0]  chi[2]  pose[1]  spins[0][3]                   of the start
    mass  wheel_radius  wheel_angles[1]                   of the vehicle, the other numbers staying as they are
    wheel_viscous  roller_coulomb[1]  torque_constant     of an effect: a field of it that the kernel knows
    torque[1]  voltage[0]  torque[2][1]                   what a drive gives; of a table row 2, wheel 1
    proportional  integral[0]  target[2]                  of a controller

A name without a place moves all entries of the number together.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from omniroll.effects.effect import Effect
from omniroll.errors import InvalidValueError
from omniroll.generated.python import parts
from omniroll.kernels.kernel import OF_THE_VEHICLE, VEHICLE_SCALARS, Kernel
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent

NAME = re.compile(r"(\w+?)((?:\[\d+\])*)")
START = ("nu", "chi", "pose", "spins")


@dataclass(frozen=True)
class Column:
    """A number and what it moves.

    name       as it was asked for
    start      tangents of nu, chi, pose and spins at the start, by name
    constants  tangents of the arguments of `prepare`, by name
    signals    tangents of fields of effects that are no constants of the kernel: by place of the effect and field
    """

    name: str
    start: Mapping[str, np.ndarray] = field(default_factory=dict)
    constants: Mapping[str, np.ndarray] = field(default_factory=dict)
    signals: Mapping[tuple[int, str], np.ndarray] = field(default_factory=dict)


def columns_of(names: Sequence[str], plain: Kernel, effects: Sequence[Effect]) -> tuple[Column, ...]:
    """The columns of these names. Raises InvalidValueError for a name that stands for no number of the run."""
    if isinstance(names, str) or not isinstance(names, Sequence) or not all(isinstance(n, str) for n in names):
        raise InvalidValueError("sensitivities", names, "must be a sequence of names")
    if len(set(names)) < len(names):
        raise InvalidValueError("sensitivities", names, "must name each number once")
    return tuple(_column(name, plain, effects) for name in names)


def _column(name: str, plain: Kernel, effects: Sequence[Effect]) -> Column:
    match = NAME.fullmatch(name)
    number, place = ("", ()) if match is None else (match[1], tuple(map(int, re.findall(r"\d+", match[2]))))
    shapes = {"nu": (3,), "chi": (plain.wheels,), "pose": (3,)}
    if plain.has_spins:
        shapes["spins"] = (plain.wheels, plain.rollers_per_wheel - 1)
    if number in shapes:
        return Column(name, start={number: _moved(name, shapes[number], place)})
    values = dict(zip(plain.constant_names, plain.constants, strict=True))
    if number in VEHICLE_SCALARS and number not in values:
        return Column(name)  # massless rollers do not feel their inertia
    if number in values and number in (*VEHICLE_SCALARS, "wheel_angles", *OF_THE_VEHICLE):
        return Column(name, constants=_with_places(number, _moved(name, values[number].shape, place), plain))
    for k, effect in enumerate(effects):
        if number in effect.numbers:
            argument = effect.numbers[number]
            if argument in values:
                return Column(name, constants={argument: _moved(name, values[argument].shape, place)})
        if number in effect.signals and getattr(effect, number) is not None:
            return Column(name, signals={(k, number): _moved(name, effect.shape_of(number, plain.wheels), place)})
    known = [*shapes, *VEHICLE_SCALARS, "wheel_angles"]
    for effect in effects:
        known += [n for n in effect.numbers if effect.numbers[n] in values]
        known += [n for n in effect.signals if getattr(effect, n) is not None]
    raise InvalidValueError("sensitivities", name, f"is no number of this run; there are {', '.join(known)}")


def _moved(name: str, shape: tuple[int, ...], place: tuple[int, ...]) -> np.ndarray:
    """1 at a place, or everywhere where none is given."""
    moved = np.zeros(shape)
    try:
        if len(place) > len(shape):
            raise IndexError
        moved[place] = 1.0
    except IndexError:
        raise InvalidValueError("sensitivities", name, f"its places go with the shape {shape}") from None
    return moved


def _with_places(number: str, moved: np.ndarray, plain: Kernel) -> dict[str, np.ndarray]:
    """With the wheels' places, where the kernel takes them and they follow from the radius and the directions."""
    follow = "wheel_places" in plain.constant_names and plain.vehicle.wheel_places is None
    if not follow or number not in ("platform_radius", "wheel_angles"):
        return {number: moved}
    vehicle, zero = plain.vehicle, np.zeros(plain.wheels)
    radius = with_tangent(vehicle.platform_radius, moved if number == "platform_radius" else 0.0)
    angles = with_tangent(vehicle.wheel_angles, moved if number == "wheel_angles" else zero)
    places = parts.places_on_rays(plain.wheels, plain.rollers_per_wheel, radius, angles)
    return {number: moved, "wheel_places": tangent_of(np.array(places))}


def stacked(columns: Sequence[Column], tangents: Callable[[Column], Mapping], shapes: Mapping) -> dict:
    """(P, ...) tangents by key, 0 in the columns that have none; `shapes` of all keys."""
    found = {key for column in columns for key in tangents(column)}
    return {
        key: np.stack([np.asarray(tangents(column).get(key, np.zeros(shapes[key]))) for column in columns])
        for key in found
    }

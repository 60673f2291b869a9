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
from numpy.typing import ArrayLike

from omniroll.effects.effect import Effect
from omniroll.errors import InvalidValueError
from omniroll.generated.python import parts
from omniroll.kernels.kernel import OF_THE_VEHICLE, VEHICLE_SCALARS, Kernel
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent

NAME = re.compile(r"(\w+?)((?:\[\d+\])*)")
ROTOR = "rotor_inertia"  # a motor's number that the kernel knows as a part of the wheels' inertia


@dataclass(frozen=True)
class Column:
    """A number and what it moves.

    name       as it was asked for
    size       of the number; 1 where it is 0, or stands for a length, an angle or a speed of the start
    start      tangents of nu, chi, pose and spins at the start, by name
    constants  tangents of the arguments of `prepare`, and of the numbers of contacts that may stick, by name
    signals    tangents of fields of effects that are no constants of the kernel: by place of the effect and field
    """

    name: str
    size: float = 1.0
    start: Mapping[str, np.ndarray] = field(default_factory=dict)
    constants: Mapping[str, np.ndarray] = field(default_factory=dict)
    signals: Mapping[tuple[int, str], np.ndarray] = field(default_factory=dict)


def columns_of(names: Sequence[str], plain: Kernel, effects: Sequence[Effect]) -> tuple[Column, ...]:
    """The columns of these names. Raises InvalidValueError for a name that stands for no number of the run."""
    if len(set(names)) < len(names):
        raise InvalidValueError("sensitivities", names, "must name each number once")
    of_vehicle = values_of(plain, ())
    return tuple(_Asked(name, plain, effects).column(of_vehicle) for name in names)


def start_shapes(plain: Kernel) -> dict[str, tuple[int, ...]]:
    """The shapes of what a run starts with, by name."""
    spins = {"spins": (plain.wheels, plain.rollers_per_wheel - 1)} if plain.has_spins else {}
    return {"nu": (3,), "chi": (plain.wheels,), "pose": (3,)} | spins


def _known(plain: Kernel, effects: Sequence[Effect]) -> str:
    names = [*start_shapes(plain), *VEHICLE_SCALARS, "wheel_angles"]
    values = values_of(plain, effects)
    for effect in effects:
        names += [n for n, argument in effect.numbers.items() if argument in values]
        names += [ROTOR] if hasattr(effect, ROTOR) else []
        names += [n for n in effect.signals if getattr(effect, n) is not None]
    return ", ".join(names)


class _Asked:
    """A name that was asked for, of a run with this kernel and these effects: the number and the place in it."""

    def __init__(self, name: str, plain: Kernel, effects: Sequence[Effect]):
        self.name, self.plain, self.effects = name, plain, effects
        match = NAME.fullmatch(name)
        self.number, self.place = (
            ("", ()) if match is None else (match[1], tuple(map(int, re.findall(r"\d+", match[2]))))
        )

    def column(self, of_vehicle: Mapping[str, np.ndarray]) -> Column:
        """What the number moves. Raises InvalidValueError for a name that stands for no number of the run."""
        shapes = start_shapes(self.plain)
        found = self._of_vehicle(of_vehicle)
        if self.number in shapes:
            found = Column(self.name, start={self.number: self._moved(shapes[self.number])})
        for k in range(len(self.effects)):
            found = found or self._of_effect(k)
        if found is None:
            bound = f"is no number of this run; there are {_known(self.plain, self.effects)}"
            raise InvalidValueError("sensitivities", self.name, bound)
        return found

    def _moved(self, shape: tuple[int, ...]) -> np.ndarray:
        """1 at the place, or everywhere where none is given."""
        moved = np.zeros(shape)
        try:
            if len(self.place) > len(shape):
                raise IndexError
            moved[self.place] = 1.0
        except IndexError:
            raise InvalidValueError("sensitivities", self.name, f"its places go with the shape {shape}") from None
        return moved

    def _of_vehicle(self, values: Mapping[str, np.ndarray]) -> Column | None:
        number = self.number
        if number in VEHICLE_SCALARS and number not in values:
            self._moved(())
            return Column(self.name)  # massless rollers do not feel their inertia
        if number not in values or number not in (*VEHICLE_SCALARS, "wheel_angles", *OF_THE_VEHICLE):
            return None
        constants = _with_places(number, self._moved(values[number].shape), self.plain)
        for effect in self.effects:
            constants |= effect.constants_along(self.plain.vehicle, constants)
        return Column(self.name, _size(values[number]), constants=constants)

    def _of_effect(self, k: int) -> Column | None:
        name, number, effect = self.name, self.number, self.effects[k]
        values, argument = values_of(self.plain, (effect,)), effect.numbers.get(number)
        if argument in values:
            shape = values[argument].shape
            moved = np.broadcast_to(self._moved(effect.number_shape(number, shape)), shape)
            rotor = _rotor(number, self.plain, k, self.effects)
            constants = {argument: moved} | rotor | _static(number, moved, values, effect)
            return Column(name, _size(values[argument]), constants=constants)
        if number == ROTOR and hasattr(effect, ROTOR):
            self._moved(())
            return Column(name, _size(effect.rotor_inertia), constants=_rotor(number, self.plain, k, self.effects))
        if number in effect.signals and getattr(effect, number) is not None:
            moved = self._moved(effect.shape_of(number, self.plain.wheels))
            return Column(name, _size(getattr(effect, number)), signals={(k, number): moved})
        return None


def values_of(plain: Kernel, effects: Sequence[Effect]) -> dict[str, np.ndarray]:
    """The arguments of `prepare`, and the numbers of contacts that may stick, which kernels are given as they run."""
    found = dict(zip(plain.constant_names, plain.constants, strict=True))
    for effect in effects:
        if (grip := effect.grip(plain.vehicle)) is not None:
            found |= {"ground_friction": grip.sliding, "ground_static_friction": grip.static}
            found |= {"contact_load": grip.loads}
    return {name: np.asarray(value, float) for name, value in found.items()}


def _size(value: ArrayLike) -> float:
    return float(np.abs(value).max()) or 1.0


def _rotor(number: str, plain: Kernel, k: int, effects: Sequence[Effect]) -> dict[str, np.ndarray]:
    """What a gear or its rotor does to the inertia of a wheel, where the motor brings that of its rotor."""
    motor = effects[k]
    if number not in ("gear_ratio", ROTOR) or not hasattr(motor, ROTOR) or not (motor.rotor_inertia or number == ROTOR):
        return {}
    counts = plain.wheels, plain.rollers_per_wheel
    rotor = [complex(with_tangent(getattr(motor, name), float(name == number))) for name in ("gear_ratio", ROTOR)]
    return {"wheel_inertia": tangent_of(parts.geared_inertia(*counts, 0.0, *rotor))}


def _static(number: str, moved: np.ndarray, values: Mapping, effect: Effect) -> dict[str, np.ndarray]:
    """What friction does to the static friction of contacts that stick, where that is not given."""
    follows = number == "friction" and "ground_static_friction" in values
    return {"ground_static_friction": moved} if follows and getattr(effect, "static_friction", 0) is None else {}


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
    """(P, ...) tangents by key, 0 in the columns that have none, for reading alone; `shapes` of all keys."""
    found: dict = {}
    for place, column in enumerate(columns):
        for key, tangent in tangents(column).items():
            if key not in found:
                found[key] = np.zeros((len(columns), *shapes[key]))
            found[key][place] = tangent
    for array in found.values():
        array.flags.writeable = False
    return found

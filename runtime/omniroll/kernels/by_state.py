"""Calls for many states, of which each has a kernel of its own: of a phase, or of the arcs that carry its wheels."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll.vehicles import profiles

OF_ARCS = ("arc_alongs", "arc_asides", "arc_radii")  # constants of the arcs that carry, as an Arc has them


def call_by_patterns(
    bound: Any, name: str, values: Sequence[ArrayLike], numbers: np.ndarray, own: Callable[[np.ndarray], Any]
) -> Any:
    """A generated function of states, each by the kernel `own` of its numbers (..., K); these have all leading axes."""
    lead, signature = numbers.shape[:-1], bound.signatures[name]
    pairs = zip(values, signature.inputs, strict=True)
    flat = [np.broadcast_to(value, (*lead, *a.shape)).reshape(-1, *a.shape) for value, a in pairs]
    patterns, which = np.unique(numbers.reshape(-1, numbers.shape[-1]), axis=0, return_inverse=True)
    found: list[np.ndarray] = []
    for k, pattern in enumerate(patterns):
        parts = own(pattern).call(name, *(value[which == k] for value in flat))
        parts = parts if isinstance(parts, tuple) else (parts,)
        found = found or [np.empty((len(which), *part.shape[1:]), part.dtype) for part in parts]
        for whole, part in zip(found, parts, strict=True):
            whole[which == k] = part
    shaped = tuple(whole.reshape((*lead, *whole.shape[1:])) for whole in found)
    return shaped if len(shaped) > 1 else shaped[0]


def has_pieces(vehicle: Any) -> bool:
    """Whether more than one arc of a roller carries the vehicle's wheels."""
    return vehicle.roller_profile is not None and len(pieces_of(vehicle)) > 1


def pieces_of(vehicle: Any) -> tuple[profiles.Piece, ...]:
    """The pieces of all wheels, or those of the first where a roller has one arc."""
    return profiles.pieces(vehicle, vehicle.roller_angle[0])


def piece_numbers(vehicle: Any, chi: ArrayLike) -> np.ndarray:
    """(..., N) int, which piece carries each wheel; on a border the one ahead."""
    return np.searchsorted([piece.first for piece in pieces_of(vehicle)[1:]], np.real(chi), side="right")


def arc_constants(vehicle: Any, numbers: Sequence[int] | np.ndarray) -> dict[str, tuple[float, ...]]:
    """The constants of wheels of which each stands on the piece of its number; of one arc by the wheel's angle."""
    if vehicle.roller_profile is None:
        found = [profiles.arcs_of(vehicle)[0]] * vehicle.wheels
    else:
        found = [pieces_of(vehicle)[k].arc for k in np.asarray(numbers).tolist()]
    return dict(zip(OF_ARCS, zip(*found, strict=True), strict=True))


@lru_cache(maxsize=512)
def kernel_on_pieces(bound: Any, numbers: tuple[int, ...]) -> Any:
    """The kernel with its wheels on these pieces."""
    return bound.with_constants(arc_constants(bound.vehicle, numbers))


def call_on_pieces(bound: Any, name: str, *values: ArrayLike) -> Any:
    """A generated function of states, whose angles say which arcs carry."""
    inputs = [argument.name for argument in bound.checked_inputs(name, values)]
    if "chi" not in inputs:
        return type(bound).call(bound, name, *values)
    numbers = piece_numbers(bound.vehicle, values[inputs.index("chi")])
    if numbers.ndim == 1:
        return kernel_on_pieces(bound, tuple(numbers.tolist())).call(name, *values)
    shapes = [argument.shape for argument in bound.signatures[name].inputs]
    leads = [np.shape(value)[: np.ndim(value) - len(shape)] for value, shape in zip(values, shapes, strict=True)]
    numbers = np.broadcast_to(numbers, (*np.broadcast_shapes(*leads), bound.wheels))
    return call_by_patterns(bound, name, values, numbers, lambda own: kernel_on_pieces(bound, tuple(own.tolist())))


def flow_by_calls(bound: Any, momenta: np.ndarray | None) -> Callable[[float, np.ndarray], np.ndarray]:
    """The right-hand side f(time, y) -> y' of Kernel.flow, by calls of functions that know which arcs carry."""
    constants = () if momenta is None else (momenta,)

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        nu, chi = y[:3], y[3 : 3 + bound.wheels]
        nu_dot = bound.forward_dynamics(nu, chi, *constants)
        return np.concatenate([nu_dot, bound.wheel_speeds(nu, chi), bound.pose_rates(nu, y[-1])])

    return rates

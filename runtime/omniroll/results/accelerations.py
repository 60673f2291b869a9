"""Accelerations of states in which something acts, by the generated functions."""

from typing import Any

import numpy as np

from omniroll.effects.effect_set import EffectSet
from omniroll.effects.guards import EPS
from omniroll.kernels.kernel import Kernel

AT_REST = 16  # a spin is zero within this many of its roundings


def call_named(bound: Kernel, name: str, values: dict[str, Any]) -> Any:
    """A generated function on the values of the names of its inputs."""
    return bound.call(name, *(values[argument.name] for argument in bound.signatures[name].inputs))


def turning(yaw_scale: float, nu: np.ndarray, spins: np.ndarray) -> np.ndarray:
    """(..., N, n-1) the signs of free rollers' spins, 0 where they are rounding beside the largest nu (..., 3)."""
    yaw = np.abs(nu).max() / yaw_scale
    return np.where(np.abs(spins) <= AT_REST * EPS * (np.abs(spins) + yaw), 0.0, np.sign(spins))


def torques_of_free_rollers(
    bound: Kernel, effects: EffectSet, values: dict[str, Any], modes: np.ndarray
) -> dict[str, np.ndarray]:
    """The torques (..., N, n-1) of free rollers' bearings that stick, as free_bearing; none where they do not.

    values  as of with_accelerations
    modes   (..., N, n-1) 0 where a roller sticks, else the sign of its rate
    """
    rollers = effects.bearings(bound).get("roller")
    if rollers is None or bound.slips or not bound.has_spins:
        return {}
    sliding, holding = rollers.sliding[:, None], rollers.holding[:, None]
    asked = values | {"free_bearing": -modes * sliding, "free_sticks": (modes == 0).astype(float)}
    asked |= {"directions": np.eye(3).ravel(), "absent": np.zeros(3)}  # the other bearings' torques are known
    held = call_named(bound, f"stuck_{bound.of_every_roller}", asked)[-1]
    return {"free_bearing": asked["free_bearing"] + np.clip(held, -holding, holding)}


def with_accelerations(bound: Kernel, values: dict[str, Any]) -> dict[str, Any]:
    """`values` of states (...) by name, with nu_dot (..., 3) in 1/s^2 and what it was computed from.

    bound   the kernel with all effects
    values  nu, chi, heading, spins (None but for free rollers), the drives' inputs; free_bearing where rollers stick
    """
    values = dict(values)
    if bound.has_spins:
        values["axial"] = call_named(bound, "axial_speeds", values)
        values["momenta"] = call_named(bound, "momenta", values)
    if "coulomb_momenta" in bound.signatures:
        values["coulomb_momenta_dot"] = call_named(bound, "coulomb_momenta", values)
    if "bearing_momenta" in bound.signatures:
        values["bearing_momenta_dot"] = call_named(bound, "bearing_momenta", values)
    rates = call_named(bound, bound.of_every_roller, values)
    values["nu_dot"] = rates[0] if bound.has_spins else rates
    return values

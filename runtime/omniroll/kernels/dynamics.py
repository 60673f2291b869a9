"""Accelerations of a vehicle in a given state, equation (3.4) solved for nu'."""

import numpy as np
from numpy.typing import ArrayLike

from omniroll.errors import InvalidValueError
from omniroll.kernels.neutral_kernel import best_backend, kernel_by
from omniroll.validation import choice
from omniroll.vehicles import checks
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import ROLLER_MODELS


def accelerations(
    vehicle: Vehicle,
    nu: ArrayLike,
    chi: ArrayLike,
    spins: ArrayLike | None = None,
    *,
    roller_model: str = "free",
) -> tuple[np.ndarray, np.ndarray | None]:
    """nu' and the free rollers' spins', equation (3.4).

    vehicle       Vehicle with N wheels of n rollers
    nu            (..., 3) in 1/s
    chi           (..., N) in rad, |chi| <= pi/n, or one angle for all wheels
    spins         (..., N, n-1) in rad/s, free rollers j = 2..n relative to their disks; None: at rest
    roller_model  "free", "locked" or "massless"; the last two have no spins

    Leading axes broadcast. Returns nu_dot (..., 3) in 1/s^2 and spins_dot (..., N, n-1) in rad/s^2, which is
    None but for free rollers.

    Raises InvalidValueError (a ValueError) with the field, its value and the bound.
    """
    if not isinstance(vehicle, Vehicle):
        raise InvalidValueError("vehicle", vehicle, "must be a Vehicle")
    choice("roller_model", roller_model, ROLLER_MODELS)
    bound = kernel_by(best_backend(roller_model), vehicle, roller_model)
    state = checks.plain_state(vehicle, roller_model, nu, chi, spins)
    if state is not None:
        found = bound.accelerations(*state)
        outputs = found if bound.has_spins else (found,)
        if checks.seem_finite(*outputs):
            return found if bound.has_spins else (found, None)
    return _checked(vehicle, nu, chi, spins, roller_model)


def _checked(
    vehicle: Vehicle, nu: ArrayLike, chi: ArrayLike, spins: ArrayLike | None, roller_model: str
) -> tuple[np.ndarray, np.ndarray | None]:
    nu = checks.speeds(nu)
    chi = checks.wheel_angles_in_contact(chi, vehicle)
    spins = checks.free_spins(spins, vehicle, roller_model)
    _check_leading_axes(nu, chi, spins)
    bound = kernel_by(best_backend(roller_model), vehicle, roller_model)
    found = bound.accelerations(nu, chi, *bound.spins_or_nothing(spins))
    nu_dot, spins_dot = found if spins is not None else (found, None)
    checks.refuse_unless_finite("accelerations", nu, nu_dot, *(() if spins_dot is None else (spins_dot,)))
    return nu_dot, spins_dot


def _check_leading_axes(nu: np.ndarray, chi: np.ndarray, spins: np.ndarray | None) -> None:
    lead = nu.shape[:-1]
    others = {"chi": chi.shape[:-1]} | ({} if spins is None else {"spins": spins.shape[:-2]})
    for field, other in others.items():
        try:
            lead = np.broadcast_shapes(lead, other)
        except ValueError:
            raise InvalidValueError(field, other, f"leading axes must broadcast with {lead}") from None

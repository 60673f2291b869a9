"""The state of a vehicle between switches, and the two ways of counting the rollers of a wheel.

By place: j = 1..n, where j = 1 is the roller in contact. By physical roller: 0..n-1, numbers that are fixed to the
rollers. `contact`, the physical number of the roller in contact, ties the two (rule 2 of omniroll.engine.switching).
"""

from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True)
class State:
    """State of a vehicle between switches.

    nu       (3,) in 1/s
    chi      (N,) in rad
    pose     (3,) x, y, theta
    contact  (N,) int, the physical roller in contact
    axial    (N, n) in rad/s by physical roller: the absolute axial speeds of free rollers, constant between
             switches. The number of the roller in contact has no meaning where it rolls. None but for the roller
             model "free".
    rates    (N,) in rad/s, the wheels' rates where they may slip, or do not follow from nu alone; None else

    nu, chi, pose and axial may have leading axes: the states of several motions that touch the ground with the same
    rollers. Where contact has as many leading axes, which broadcast with theirs, each motion has its own.
    """

    nu: np.ndarray
    chi: np.ndarray
    pose: np.ndarray
    contact: np.ndarray
    axial: np.ndarray | None = None
    rates: np.ndarray | None = None

    def free_axial(self) -> np.ndarray | None:
        """The axial speeds of the rollers j = 2..n, (N, n-1)."""
        if self.axial is None:
            return None
        if self.contact.ndim > 1:
            return by_place(self.axial, self.contact)[..., 1:]
        if not self.contact.any():
            return self.axial[..., 1:]
        rollers = self.axial.shape[-1]
        places = (self.contact[:, None] + np.arange(1, rollers)) % rollers
        return self.axial[..., np.arange(len(places))[:, None], places]

    def with_free_axial(self, free: np.ndarray) -> "State":
        """The state with other axial speeds of the rollers j = 2..n, (N, n-1)."""
        places = np.concatenate([np.zeros_like(free[..., :1]), free], axis=-1)
        return replace(self, axial=by_roller(places, self.contact))

    def contact_axial(self) -> np.ndarray:
        """(N,) the axial speeds of the rollers in contact, where they may slip."""
        if self.axial.ndim > 2 or self.contact.ndim > 1:
            return by_place(self.axial, self.contact)[..., 0]
        return self.axial[np.arange(len(self.contact)), self.contact]

    def with_contact_axial(self, axial: np.ndarray) -> "State":
        """The state with other axial speeds of the rollers in contact, (N,)."""
        if self.axial.ndim > 2 or self.contact.ndim > 1:
            free = by_place(self.axial, self.contact)[..., 1:]
            both = np.concatenate([np.broadcast_to(axial, free.shape[:-1])[..., None], free], axis=-1)
            return replace(self, axial=by_roller(both, self.contact))
        changed = self.axial.copy()
        changed[np.arange(len(self.contact)), self.contact] = axial
        return replace(self, axial=changed)


def physical_roller(contact: np.ndarray, j: np.ndarray | int, rollers_per_wheel: np.ndarray | int) -> np.ndarray:
    """The physical number of roller j = 1..n where `contact` is the one in contact (rule 2). Places beyond the rollers
    of a wheel keep their numbers."""
    return np.where(j <= rollers_per_wheel, (np.asarray(contact) + j - 1) % rollers_per_wheel, j - 1)


def place_of_roller(contact: np.ndarray, roller: np.ndarray | int, rollers_per_wheel: np.ndarray | int) -> np.ndarray:
    """j = 1..n of a physical roller; the inverse of physical_roller."""
    own = (np.asarray(roller) - contact) % rollers_per_wheel
    return np.where(np.asarray(roller) < rollers_per_wheel, own, roller) + 1


def by_place(values: np.ndarray, contact: np.ndarray, counts: np.ndarray | None = None) -> np.ndarray:
    """Reorder the last axis (n) from physical rollers to j = 1..n; `contact` has the axes before it.

    counts  (N,) rollers of each wheel; None: n
    """
    rollers = values.shape[-1]
    own = rollers if counts is None else counts[:, None]
    places = physical_roller(np.asarray(contact)[..., None], np.arange(1, rollers + 1), own)
    return np.take_along_axis(values, places, axis=-1)


def by_roller(values: np.ndarray, contact: np.ndarray, counts: np.ndarray | None = None) -> np.ndarray:
    """Reorder the last axis (n) from j = 1..n to physical rollers; the inverse of by_place."""
    rollers = values.shape[-1]
    own = rollers if counts is None else counts[:, None]
    places = place_of_roller(np.asarray(contact)[..., None], np.arange(rollers), own)
    return np.take_along_axis(values, np.broadcast_to(places - 1, values.shape), axis=-1)

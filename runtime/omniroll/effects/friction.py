"""What friction of a set-valued law can hold: numbers of contacts on the ground, and of bearings.

A law is set-valued where a force at rest may be any of a set: contacts under Coulomb's friction, and bearings with
Coulomb's friction without a speed at which it fades. They stick, break away and come to rest. Here are their numbers
alone; an engine decides.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Bearing:
    """Bearings (N,), of the wheels' axles or of their rollers: torques in N m where they turn, and the largest at
    rest."""

    sliding: np.ndarray
    holding: np.ndarray


@dataclass(frozen=True)
class Grip:
    """The friction of contacts: loads (N,) in N, and coefficients (N, 2) where they slip and where they stick."""

    loads: np.ndarray
    sliding: np.ndarray
    static: np.ndarray

    @property
    def largest(self) -> float:
        """In N, the largest force on a contact that slips."""
        return float((self.loads[:, None] * self.sliding).max())

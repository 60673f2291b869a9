"""Bearings that may stick where wheels may slip, as what follows deviations in C takes them
(runtime/csrc/deviations/own_rests.c)."""

from dataclasses import dataclass

import numpy as np

from omniroll.engine.axle_deviations import AxleDeviations
from omniroll.engine.motion import Motion
from omniroll.engine.roller_deviations import RollerDeviations


@dataclass(frozen=True)
class OwnBearings:
    """The bearings (B,) of a run in P columns: of axles (N,), if these may stick, then of rollers (N n,), if these may.

    modes    (T, B) in each row 0 where one sticks, else the sign of its rate
    turns    (T,) 1 where a step begins with other modes than the one before it had, until that is passed
    sliding  (B,) in N m, torques of those that turn
    most     (B,) in N m, the largest torques of those at rest
    moved    (P, B) how these deviate
    inertia  (B,) in kg m^2
    """

    modes: np.ndarray
    turns: np.ndarray
    sliding: np.ndarray
    most: np.ndarray
    moved: np.ndarray
    inertia: np.ndarray

    @classmethod
    def of(cls, motion: Motion, axles: AxleDeviations | None, rollers: RollerDeviations | None) -> "OwnBearings | None":
        """Those of a run; None where none may stick."""
        if axles is None and rollers is None:
            return None
        vehicle, parts = motion.plain.vehicle, []
        turns = np.zeros(len(motion.y), bool)
        if axles is not None:
            own = motion.axles
            parts.append((own.modes, own.sliding, own.holding, axles.torques[1], vehicle.wheel_inertia))
        if rollers is not None:
            own, turns = motion.rollers, rollers.turns_alone
            parts.append((own.modes, own.sliding, own.holding, rollers.torques[1], vehicle.roller_inertia))
        lead = [(part[0].reshape(len(turns), -1), part[3].reshape(len(part[3]), -1)) for part in parts]
        modes, moved = (np.concatenate(own, axis=1) for own in zip(*lead, strict=True))
        sliding, most = (np.concatenate([part[k].ravel() for part in parts]) for k in (1, 2))
        inertia = np.concatenate([np.full(part[1].size, part[4]) for part in parts])
        return cls(modes, turns.astype(np.int32), sliding, most, moved, inertia)

    @property
    def numbers(self) -> dict[str, np.ndarray]:
        """What C takes of them, by name."""
        return {
            "own_sliding": self.sliding, "own_most": self.most, "own_most_moved": self.moved,
            "own_inertia": self.inertia,
        }  # fmt: skip

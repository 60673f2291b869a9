"""Which bearings stick in the rows of a run, and which way the others turn there, as the compiled engine says."""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from omniroll.effects.effect_set import BEARINGS
from omniroll.effects.friction import Bearing
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.state import by_place, by_roller

TORQUE, IN_CONTACT = BEARINGS  # what generated functions take of the bearings of axles, of rollers in contact
FREE = "free_bearing"  # and of free rollers


class BearingModes:
    """The bearings (B,) of a run that may stick: of axles (N,), if these may, then of rollers, if these may, wheel by
    wheel (N, m): m = n by place of a free model, else 1, that in contact.

    places   of their effects among those of the run, by "axle" and "roller"
    axles    how many are of axles: N or 0
    shape    (N, m) of those of rollers; m = 0 where these may not stick
    sliding  (B,) in N m, torques of those that turn
    holding  (B,) in N m, the largest torques of those at rest
    modes    (T, B) in each row 0 where one sticks, else the sign of its rate: in a row where a step starts those of the
             step, in others those with which a phase ends
    """

    def __init__(self, trajectory: Trajectory, plain: Kernel):
        """Raises InvalidValueError for a run of the Python engine, which has no modes."""
        if trajectory.modes is None:
            bound = "steps friction that sticks in time, and its runs have no derivatives: choose engine='compiled'"
            raise InvalidValueError("engine", trajectory.engine, bound)
        self.trajectory, self.modes, self.slips = trajectory, trajectory.modes, plain.slips
        found: dict[str, Bearing] = {}
        self.places: dict[str, int] = {}
        for place, effect in enumerate(trajectory.effects.effects):
            own = effect.bearings(plain)
            found |= own
            self.places |= dict.fromkeys(own, place)
        each = 0 if "roller" not in found else plain.rollers_per_wheel if plain.has_spins else 1
        self.axles, self.shape = plain.wheels if "axle" in found else 0, (plain.wheels, each)
        self.sliding = self.of_wheels({name: own.sliding for name, own in found.items()})
        self.holding = self.of_wheels({name: own.holding for name, own in found.items()})

    def joined(self, of_axles: np.ndarray | None, of_rollers: np.ndarray | None) -> np.ndarray:
        """(..., B) of values of axles (..., N) and of rollers (..., N, m); those that may not stick do not count."""
        parts = [of_axles] if self.axles else []
        if self.shape[1]:
            parts.append(of_rollers.reshape(*of_rollers.shape[:-2], -1))
        return np.concatenate(parts, axis=-1)

    def split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The inverse: (..., N) of axles, (..., 0) where these may not stick, and (..., N, m) of rollers."""
        of_rollers = values[..., self.axles :]
        return values[..., : self.axles], of_rollers.reshape(*of_rollers.shape[:-1], *self.shape)

    def of_wheels(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """(..., B) of values (..., N), by "axle" and "roller", that all rollers of a wheel have."""
        of_rollers = None
        if self.shape[1]:
            of_rollers = np.repeat(values["roller"][..., None], self.shape[1], axis=-1)
        return self.joined(values.get("axle"), of_rollers)

    @property
    def torques(self) -> np.ndarray:
        """(T, B) in N m, what generated functions take of the bearings: of those that turn, 0 where one sticks."""
        return -self.modes * self.sliding

    def given(self, values: np.ndarray) -> dict[str, np.ndarray]:
        """Values (..., B) by the inputs of generated functions that are torques of these bearings."""
        of_axles, of_rollers = self.split(values)
        found = {TORQUE: of_axles} if self.axles else {}
        if self.shape[1]:
            found[IN_CONTACT] = of_rollers[..., 0]
        return found if self.shape[1] < 2 else found | {FREE: of_rollers[..., 1:]}

    def where(self, sticks: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take of the modes where bearings (..., B) bool stick, by name."""
        names = {TORQUE: "axle_sticks", IN_CONTACT: "contact_sticks", FREE: "free_sticks"}
        return {names[torque]: part.astype(float) for torque, part in self.given(sticks).items()}

    def at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """The same in rows (...)."""
        return self.where(self.modes[rows] == 0)

    @cached_property
    def alone(self) -> np.ndarray:
        """(T,) bool: rows in which a step ends and the next one starts, with other modes of rollers that have speeds of
        their own: nothing else jumps there, so that no row stands on each side."""
        found, first = np.zeros(len(self.modes), bool), self.trajectory.step_rows
        if self.shape[1] < 2:
            return found
        own = self.split(self.modes)[1][..., 0 if self.slips else 1 :]
        changed = (own[first[1:]] != own[first[:-1]]).any(axis=(1, 2))
        found[first[1:][(first[1:] == first[:-1] + 1) & changed]] = True
        return found

    def before_switch(self, row: int) -> np.ndarray:
        """(B,) the modes of the row behind one after which wheels switch, each roller at its place before. Of massless
        rollers another one comes into contact, which stands on its disk."""
        of_axles, of_rollers = self.split(self.modes[row + 1])
        if self.shape[1] > 1:
            contact = self.trajectory.contact
            of_rollers = by_place(by_roller(of_rollers, contact[row + 1]), contact[row])
        return self.joined(of_axles, of_rollers)

"""The rates of a phase in which contacts stick and slip under Coulomb's friction, and their slopes."""

import numpy as np

from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.ground import Ground, slip_says
from omniroll.kernels.kernel import Flow

MOVED = 1e-7  # of a component, for slopes by differences


class GroundFlow:
    """The rates f(time, y) -> y' of a phase in the modes of its contacts, and what of them a step asks beside.

    After a call `force` and `slip_dot` (N, 2) are those of the state.
    """

    def __init__(self, ground: Ground, rates: BoundRates, plain: Flow):
        self.ground, self.plain = ground, plain
        kernel, buffers = ground.kernel, rates.buffers
        for name in ("slip_forces", "sliding_forces"):
            signature = kernel.signatures[name]
            for argument in (*signature.inputs, *signature.outputs):
                buffers.setdefault(argument.name, np.zeros(argument.shape))
        buffers["load"][:], buffers["friction"][:] = ground.load, ground.grip.sliding
        self.buffers, self.y = buffers, rates.y
        aside = {"ground_force": np.zeros_like(buffers["ground_force"])}  # what slips takes no part in what holds
        self._slip = kernel.bind("slip_forces", buffers | aside)
        self._slide = kernel.bind("sliding_forces", buffers)
        self.slides = ~ground.sticks & ~ground.off
        self.turning = np.flatnonzero(self.slides) if ground.directions.start == 0 else np.zeros(0, int)
        self.force, self.slip_dot = buffers["ground_force"], buffers["slip_dot"]

    def slip(self, y: np.ndarray) -> np.ndarray:
        """(N, 2) in m/s, in the state y."""
        self.y[:] = y
        self._slip()
        return self.buffers["slip"].copy()

    def rounding(self) -> np.ndarray:
        """(N,) of the slip in the last state."""
        buffers = self.buffers
        return self.ground.roundings(buffers["nu"], buffers["rates"], buffers.get("contact_omega"))

    def __call__(self, time: float, y: np.ndarray) -> np.ndarray:
        self._push(y)
        return self._rates(time, y)

    def _rates(self, time: float, y: np.ndarray) -> np.ndarray:
        """y' under the forces that are given now."""
        return self.plain(time, y)

    def headings(self, y: np.ndarray) -> np.ndarray:
        """(N,) in rad, where contacts go, as a row keeps it."""
        return self.ground.headings(self.slip(y), self.rounding())

    def in_row(self, time: float, y: np.ndarray) -> None:
        """Evaluates the rates under the forces that a row says, whose headings have been asked for: a slip that comes
        to rest may have turned since the phase began."""
        if self.ground.directions.start:
            self(time, y)
            return
        slip, seen = self.slip(y), self.ground.seen
        self._push_along(np.where(slip_says(slip, seen, self.rounding())[:, None], slip, seen))
        self._rates(time, y)

    def _push(self, y: np.ndarray) -> None:
        self._push_along(self.ground.direction(self.slip(y), self.rounding()))

    def _push_along(self, directions: np.ndarray) -> None:
        """The forces of slips along directions (N, 2)."""
        self.buffers["slip_direction"][:] = directions
        self._slide()
        self.buffers["ground_push"][:] = np.where(self.slides[:, None], self.buffers["sliding_force"], 0.0)

    # The polar form: the directions of the forces are unknowns of their own, which the slips must follow

    def angles(self, y: np.ndarray) -> np.ndarray:
        """(m,) in rad, the directions in which the contacts `turning` slip."""
        towards = self.ground.direction(self.slip(y), self.rounding())[self.turning]
        return np.arctan2(towards[:, 1], towards[:, 0])

    def directed(self, time: float, y: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """y' where the forces are those of slips in these directions (m,), whatever the slips are."""
        self._aim(angles)
        return self._rates(time, y)

    def _aim(self, angles: np.ndarray) -> None:
        self.buffers["slip_direction"][self.turning] = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self._slide()
        self.buffers["ground_push"][self.turning] = self.buffers["sliding_force"][self.turning]

    def along_and_across(self, y: np.ndarray, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(m,) in m/s, the parts of the slips along these directions, and across them."""
        slip, cos, sin = self.slip(y)[self.turning], np.cos(angles), np.sin(angles)
        return slip[:, 0] * cos + slip[:, 1] * sin, slip[:, 1] * cos - slip[:, 0] * sin

    def are_ahead(self, places: np.ndarray, angles: np.ndarray, along: np.ndarray) -> bool:
        """Whether slips in states (s, d) go along their directions (s, m), of which they have the parts `along`."""
        return bool((along >= 0).all())

    def slopes(self, time: float, y: np.ndarray, angles: np.ndarray) -> "tuple[np.ndarray, ...]":
        """(d, d) of y' in y, (d, m) of y' in the directions, (m, d) of the slips across them in y; by differences, but
        how the forces turn."""
        rates, (_, across) = self.directed(time, y, angles), self.along_and_across(y, angles)
        by_state, across_by_state = np.empty((len(y), len(y))), np.empty((len(angles), len(y)))
        for k, value in enumerate(y):
            moved = y.copy()
            moved[k] += MOVED * max(1.0, abs(value))
            step = moved[k] - value
            by_state[:, k] = (self._moved(time, moved, angles) - rates) / step
            across_by_state[:, k] = (self.along_and_across(moved, angles)[1] - across) / step
        return by_state, self._by_angles(time, y, angles, rates), across_by_state

    def _moved(self, time: float, y: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """y' in a state beside the one that directed() has just been asked for, in the same directions."""
        return self.plain(time, y)  # the forces stay: they know the directions alone

    def _by_angles(self, time: float, y: np.ndarray, angles: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """(d, m) of y' in the directions; rates are y' in these."""
        by_angle = np.empty((len(y), len(angles)))
        push, slope = self.buffers["ground_push"].copy(), self.buffers["sliding_slope"].reshape(-1, 2, 2)
        for k, contact in enumerate(self.turning):
            self.buffers["ground_push"][contact] += slope[contact] @ [-np.sin(angles[k]), np.cos(angles[k])]
            by_angle[:, k] = self.plain(time, y) - rates  # linear in the forces
            self.buffers["ground_push"][:] = push
        return by_angle

    def _by_turned_angles(self, time: float, y: np.ndarray, angles: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """The same by differences, where more than the forces themselves turns with a direction."""
        by_angle = np.empty((len(y), len(angles)))
        for k in range(len(angles)):
            turned = angles.copy()
            turned[k] += MOVED
            by_angle[:, k] = (self.directed(time, y, turned) - rates) / MOVED
        return by_angle

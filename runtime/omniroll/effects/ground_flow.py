"""The rates of a phase in which contacts stick and slip under Coulomb's friction, and their slopes."""

import numpy as np

from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.ground import Ground
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
        buffers["load"][:], buffers["friction"][:] = ground.grip.loads, ground.grip.sliding
        self.buffers, self.y = buffers, rates.y
        self._slip = kernel.bind("slip_forces", buffers)
        self._slide = kernel.bind("sliding_forces", buffers)
        self.slides = ~ground.sticks & ~ground.off
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
        return self.plain(time, y)

    def _push(self, y: np.ndarray) -> None:
        self.buffers["slip_direction"][:] = self.ground.direction(self.slip(y), self.rounding())
        self._slide()
        self.buffers["ground_push"][:] = np.where(self.slides[:, None], self.buffers["sliding_force"], 0.0)

    def slopes(self, time: float, y: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """(d, d) of the rates in y. Near rest the forces turn over a slip that no difference of rates could resolve:
        the rates by the state and by the forces, the slip by the state, and the forces by the slip are taken one by one.
        """
        slip = self.slip(y)
        self._push(y)
        turns, push = self.buffers["sliding_slope"].reshape(-1, 2, 2).copy(), self.buffers["ground_push"].copy()
        by_state, slip_by_state = np.empty((len(y), len(y))), np.empty((*slip.shape, len(y)))
        for k, value in enumerate(y):
            moved = y.copy()
            moved[k] += MOVED * max(1.0, abs(value))
            step = moved[k] - value
            slip_by_state[..., k] = (self.slip(moved) - slip) / step
            by_state[:, k] = (self.plain(time, moved) - rates) / step
        for contact in np.flatnonzero(self.slides) if self.ground.directions.start == 0 else ():
            for c in range(2):
                unit = float(self.ground.grip.loads[contact] * self.ground.grip.sliding[contact, c])
                self.buffers["ground_push"][contact, c] = push[contact, c] + unit
                by_force = (self.plain(time, y) - rates) / unit
                self.buffers["ground_push"][:] = push
                by_state += np.outer(by_force, turns[contact, c] @ slip_by_state[contact])
        return by_state

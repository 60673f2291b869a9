"""Rollers that stick, and axles, on a ground under a smooth law whose loads follow the motion.

The rules of loaded_axles.py hold for all bearings, those of slipping_rollers.py for each roller. A roller that begins
to turn changes theta'', and with it the loads and what they ask of others. Whether the coupled matrix has a positive
determinant whichever bearings turn is looked at for those of axles and of rollers in contact; rollers that do not touch
the ground have a part in it through the inertia in yaw alone.
"""

import numpy as np

from omniroll.effects.guards import Guard
from omniroll.effects.loaded_axles import GroundBesideAxles
from omniroll.effects.slipping_bearings import SlippingBearings


class GroundBesideBearings(GroundBesideAxles):
    """Contacts and bearings in one run.

    axles  all bearings (B,), with their modes
    """

    axles: SlippingBearings

    def switched(self, directions: np.ndarray) -> None:
        """Wheels have passed to their next rollers, directions (N,)."""
        self.axles.switched(directions)

    def pass_guards(self, passed: np.ndarray) -> None:
        """Guards that have ended the phase: of loads with the coupled matrix, and of bearings."""
        of_loads, of_bearings = np.split(passed, [len(self.off) + 1])
        self.loads.pass_guards(of_loads[:-1])
        self.axles.pass_guards(of_bearings, self.holding)

    @property
    def holding(self) -> np.ndarray:
        """(B,) in N m, what holds the bearings that stick, as the rates that were computed last have it."""
        return self.axles.asked_in(self.buffers)

    def gains(self) -> np.ndarray:
        """(B,) in N m, the bearings' accelerations times their inertia, as the rates that were computed last say."""
        vehicle = self.kernel.vehicle
        return self.axles.accelerations_in(self.buffers) * self.axles.by_kind(
            vehicle.wheel_inertia, vehicle.roller_inertia
        )

    def inputs(self, modes: np.ndarray, bounds: np.ndarray) -> dict[str, np.ndarray]:
        """What the rates take, by name, of bearings with modes (B,) that take torques (B,) where they turn."""
        return self.axles.inputs(modes == 0, -modes * bounds)

    def turning_guards(self, nu: np.ndarray, rates: np.ndarray) -> list[Guard]:
        """None: what turns is among excess()."""
        return []

    def excess(self) -> tuple[np.ndarray, np.ndarray]:
        """(B,) how far each bearing is beyond the end of its mode, and the rounding; the rates have been computed."""
        return self.axles.excess(self.holding, self.buffers)

    def torques_in_rows(self) -> dict[str, np.ndarray]:
        """What rows keep of the bearings (N,), by name."""
        return self.axles.in_rows(self.axles.torques() + self.holding)

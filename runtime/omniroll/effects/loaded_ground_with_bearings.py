"""Contacts, axles and rollers that may all stick in a run whose loads follow the motion.

The rules of ground_with_bearings.py hold for contacts and bearings, those of loaded_ground_with_axles.py for the loads.
Beside them:

1. What a contact can take falls to nothing with its load, and what standing wheels are asked for need not. So the least
   use measures forces of the ground by one load for all contacts, and adds what a contact's own load lacks of that one.
2. Whether loads and bearings determine each other is looked at for axles and for rollers in contact. Rollers that do
   not touch the ground have a part in it through the inertia in yaw alone.
3. Forces at an instant are sought from inside what can be taken: directions that are still off would turn the loads
   that are found for them, and these the directions.
"""

import numpy as np

from omniroll.effects.ground_with_bearings import GroundWithBearings
from omniroll.effects.loaded_ground_with_axles import LoadedGroundWithAxles


class LoadedGroundWithBearings(LoadedGroundWithAxles, GroundWithBearings):
    """Contacts, axles and rollers in one run whose loads follow the motion."""

    from_inside = True  # rule 3

    def _of_ground(self) -> tuple[np.ndarray, np.ndarray]:
        largest = self.grip.loads.max()
        return largest * self.grip.static, 1 - self.pressing / largest

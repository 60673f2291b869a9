"""Loads that follow the motion, in 40 digits: those of equal springs under a platform that sinks and tilts, by three
unknown numbers."""

from typing import Any

from flint import arb

import omniroll
from hard.constrained import Row

UNKNOWN = 3


class OnSprings:
    """What a vehicle on springs adds to its formulas; it has `constants` and the number of `wheels`."""

    constants: dict[str, Any]
    wheels: int

    def stand_on_springs(self, contact: omniroll.Contact, name: str, change: Any) -> None:
        """Where the springs stand, and the numbers of the balance, of which that of this name is larger by `change`."""
        height = arb(float(contact.height)) + (change if name == "height" else 0)
        gravity = contact.normal_gravity or omniroll.vocabulary.STANDARD_GRAVITY
        self.balance_numbers = {"normal_gravity": arb(float(gravity)), "height": height, "wheel_mass": arb(0)}
        self.balance_numbers["platform_products"] = [arb(0)] * 2
        self.balance_numbers["spin_inertia"] = [self.constants["wheel_inertia"]] * self.wheels
        radius, angles = self.constants["platform_radius"], self.constants["wheel_angles"]
        self.places = [[radius * a.cos(), radius * a.sin()] for a in angles]

    def loads(self, springs: Row) -> Row:
        """What springs at all places would have."""
        return [springs[0] + springs[1] * x + springs[2] * y for x, y in self.places]

    def beyond(self, sums: Row, loads: Row) -> Row:
        """The sums (3,) of the loads and of their moments, beyond what loads (N,) have."""
        own = [(load, load * x, load * y) for load, (x, y) in zip(loads, self.places, strict=True)]
        return [a - sum(column) for a, column in zip(sums, zip(*own, strict=True), strict=True)]

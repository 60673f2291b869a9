"""The numbers of friction in 40 digits, one of which may be moved: of the ground, and of bearings that stick."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb

import omniroll
from hard.constrained import Row
from hard.moving import larger, split


@dataclass
class Friction:
    """The law of the ground."""

    law: str
    numbers: dict[str, Any]

    @classmethod
    def of(cls, contact: omniroll.Contact, wheels: int) -> "Friction":
        found = {"normal_gravity": arb(omniroll.vocabulary.STANDARD_GRAVITY)}
        for name in ("coefficient", "friction", "static_friction"):
            if getattr(contact, name) is not None:
                found[name] = [arb(float(v)) for v in np.broadcast_to(getattr(contact, name), 2)]
        for name in ("speed", "normal_gravity"):
            if getattr(contact, name) is not None:
                found[name] = arb(float(getattr(contact, name)))
        if contact.load is not None:
            found["load"] = [arb(float(v)) for v in np.broadcast_to(contact.load, wheels)]
        return cls(contact.law, found)

    def move(self, name: str, place: tuple[int, ...], change: Any) -> bool:
        """Whether it has a number of this name, which is larger from now on."""
        if name not in self.numbers:
            return False
        self.numbers[name] = larger(self.numbers[name], place, change)
        return True

    def sliding(self, towards: Row, along_axle: bool) -> Row:
        """The force per load (regularised, coulomb), or the force (viscous), on a contact that slips `towards`."""
        axle, rolling = towards if along_axle else (arb(0), towards[1])
        if self.law == "viscous":
            first, second = self.numbers["coefficient"]
            return [-first * axle, -second * rolling]
        first, second = self.numbers["friction"]
        square = first * first * axle * axle + second * second * rolling * rolling
        if self.law == "regularised":
            square += first * second * self.numbers["speed"] ** 2
        size = square.sqrt()
        return [-(first**2) * axle / size, -(second**2) * rolling / size]

    def used_up(self, force: Row, load: Any, along_axle: bool) -> Any:
        """How much more than the load, in squares of N, a force asks for at this static friction."""
        first, second = self.numbers.get("static_friction", self.numbers.get("friction"))
        along, across = force[0] / first, force[1] / second
        return across * across - load * load + (along * along if along_axle else 0)


@dataclass
class Torques:
    """Of the bearings of axles, if these may stick, then of all rollers in contact and of free ones, if these may (B,):
    of those that turn, and the largest of those at rest.

    axles  how many of them are those of axles
    """

    sliding: Row
    holding: Row
    axles: int

    @classmethod
    def of(cls, effects: list, wheels: int, rollers: int, name: str, change: Any) -> "tuple[Torques | None, bool]":
        """Those of the effects, with the number of this name larger, and whether they have it."""
        own = next((e for e in effects if isinstance(e, omniroll.Bearings)), None)
        number, place = split(name)
        sliding, holding, has = [], [], False
        for body, count in (("wheel", 1), ("roller", rollers)):
            found = []
            for kind in ("coulomb", "break_away"):
                given = getattr(own, f"{body}_{kind}", None)
                if given is None:
                    continue
                torques = [arb(float(v)) for v in np.broadcast_to(given, wheels)]
                if number == f"{body}_{kind}":
                    torques, has = larger(torques, place, change), True
                found.append(torques + [torque for torque in torques for _ in range(count - 1)])
            if found:
                sliding, holding = sliding + found[0], holding + found[-1]
        if not sliding:
            return None, False
        return cls(sliding, holding, wheels if own.wheel_coulomb is not None else 0), has

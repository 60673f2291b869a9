"""Effects: what acts on a vehicle besides its rolling. Each kind has its own file; effect.py says what an effect is."""

from omniroll.effects.bearings import Bearings
from omniroll.effects.contact import Contact
from omniroll.effects.controller import Controller
from omniroll.effects.effect import Effect
from omniroll.effects.function_controller import FunctionController
from omniroll.effects.motor import Motor
from omniroll.effects.named import KINDS, register_effect
from omniroll.effects.path_follower import PathFollower
from omniroll.effects.slope import Slope
from omniroll.effects.springs import Springs
from omniroll.effects.torque import Torque, TorqueTable
from omniroll.effects.weight import Weight

EFFECTS = (
    Torque, TorqueTable, Motor, Controller, FunctionController, PathFollower, Bearings, Slope, Weight, Contact, Springs,
)  # fmt: skip
for kind in EFFECTS:
    register_effect(kind.__name__)(kind)

__all__ = ["KINDS", "Effect", *KINDS]

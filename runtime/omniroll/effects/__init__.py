"""Effects: what acts on a vehicle besides its rolling. Each kind has its own file; effect.py says what an effect is."""

from omniroll.effects.bearings import Bearings
from omniroll.effects.controller import Controller
from omniroll.effects.effect import Effect
from omniroll.effects.motor import Motor
from omniroll.effects.slope import Slope
from omniroll.effects.torque import Torque, TorqueTable

KINDS = {kind.__name__: kind for kind in (Torque, TorqueTable, Motor, Controller, Bearings, Slope)}

__all__ = ["KINDS", "Effect", *KINDS]

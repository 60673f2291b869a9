"""omniroll: vehicles on omni-wheels whose rollers have mass.

vehicle = omniroll.Vehicle.paper()
run = omniroll.simulate(vehicle, nu=(1, 0, 1), duration=20)
run.pose[-1]
"""

from omniroll.batch import Batch
from omniroll.dynamics import accelerations
from omniroll.effects import Bearings, Controller, Motor, Slope, Torque, TorqueTable
from omniroll.errors import (
    AccuracyWarning,
    InvalidValueError,
    KernelsMissingError,
    OmnirollError,
    RollingWarning,
    SimulationStopped,
    UnstableControllerWarning,
)
from omniroll.impulses import Impulses, impulses
from omniroll.kernels import Kernel, kernel
from omniroll.ledger import Ledger
from omniroll.many import Many, simulate_many
from omniroll.parts import cylinder
from omniroll.reactions import Doubt, Reactions, reactions
from omniroll.scene import Scene, SceneError, load_scene, run
from omniroll.simulate import simulate
from omniroll.switching import tau
from omniroll.trajectory import Samples, Trajectory
from omniroll.vehicle import Vehicle

__version__ = "0.1.0"

__all__ = [
    "AccuracyWarning",
    "Batch",
    "Bearings",
    "Controller",
    "Doubt",
    "Impulses",
    "InvalidValueError",
    "Kernel",
    "KernelsMissingError",
    "Ledger",
    "Many",
    "Motor",
    "OmnirollError",
    "Reactions",
    "RollingWarning",
    "Samples",
    "Scene",
    "SceneError",
    "SimulationStopped",
    "Slope",
    "Torque",
    "TorqueTable",
    "Trajectory",
    "UnstableControllerWarning",
    "Vehicle",
    "accelerations",
    "cylinder",
    "impulses",
    "kernel",
    "load_scene",
    "reactions",
    "run",
    "simulate",
    "simulate_many",
    "tau",
]

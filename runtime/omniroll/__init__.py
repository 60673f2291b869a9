"""omniroll: vehicles on omni-wheels whose rollers have mass.

vehicle = omniroll.Vehicle.paper()
run = omniroll.simulate(vehicle, nu=(1, 0, 1), duration=20)
run.pose[-1]
"""

from omniroll.effects import Bearings, Controller, Motor, Slope, Torque, TorqueTable
from omniroll.engine.batch import Batch
from omniroll.engine.many import Many, simulate_many
from omniroll.engine.simulate import simulate
from omniroll.engine.switching import tau
from omniroll.errors import (
    AccuracyWarning,
    InvalidValueError,
    KernelsMissingError,
    OmnirollError,
    RollingWarning,
    SimulationStopped,
    UnstableControllerWarning,
)
from omniroll.kernels.dynamics import accelerations
from omniroll.kernels.kernel import Kernel, kernel
from omniroll.results.impulses import Impulses, impulses
from omniroll.results.ledger import Ledger
from omniroll.results.reactions import Doubt, Reactions, reactions
from omniroll.results.trajectory import Samples, Trajectory
from omniroll.scenes import Scene, SceneError, load_scene, run
from omniroll.vehicles.parts import cylinder
from omniroll.vehicles.vehicle import Vehicle

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

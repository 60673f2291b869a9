"""What acts on a vehicle without what controls it: the plant of a linear model, of an FMU, of a solver's function."""

from collections.abc import Sequence

from omniroll.effects.controller import Controller
from omniroll.effects.effect import Effect
from omniroll.effects.function_controller import FunctionController
from omniroll.effects.path_follower import PathFollower
from omniroll.effects.torque import Drive, with_torque


def without_controllers(effects: Sequence[Effect]) -> Sequence[Effect]:
    """The effects without controllers, whose outputs are inputs of the plant; with torques where nothing drives."""
    if not isinstance(effects, Sequence):
        return effects  # refused where effects are checked
    rest = [effect for effect in effects if not isinstance(effect, Controller | FunctionController | PathFollower)]
    return rest if any(isinstance(effect, Drive) for effect in rest) else with_torque(rest)

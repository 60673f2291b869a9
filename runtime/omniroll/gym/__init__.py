"""Environments of Gymnasium: a vehicle by itself, and many vehicles that step together.

gymnasium.make("omniroll/Twist-v0") and gymnasium.make_vec("omniroll/Twist-v0", num_envs=256) know them once this module
is imported. It needs the extra `gymnasium`.
"""

from omniroll import extras

extras.needed("gymnasium", "gymnasium", "omniroll.gym")

from gymnasium import register, registry  # noqa: E402

from omniroll.gym.task import TwistTask  # noqa: E402
from omniroll.gym.twist import TwistEnv, TwistVectorEnv  # noqa: E402

TWIST = "omniroll/Twist-v0"
if TWIST not in registry:
    register(
        TWIST,
        entry_point="omniroll.gym:TwistEnv",
        vector_entry_point="omniroll.gym:TwistVectorEnv",
        max_episode_steps=None,
    )

__all__ = ["TWIST", "TwistEnv", "TwistTask", "TwistVectorEnv"]

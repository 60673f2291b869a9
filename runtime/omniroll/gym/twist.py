"""The task as environments: one vehicle, and many."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from omniroll.engine.session import Session
from omniroll.engine.sessions import Sessions
from omniroll.errors import SimulationStopped
from omniroll.gym.task import TwistTask


def spaces(task: TwistTask) -> tuple[Box, Box]:
    """Of observations and of actions."""
    return Box(*task.bounds(), dtype=np.float64), Box(-1.0, 1.0, (task.vehicle.wheels,), np.float64)


class TwistEnv(gymnasium.Env):
    """One vehicle.

    task     TwistTask, which says what observations, actions and rewards are; None: that of the paper's vehicle
    options  fields of TwistTask in the place of that

    `info` of reset and step has the target, nu and the pose. Raises InvalidValueError for numbers that make no sense,
    actions that are not finite among them.
    """

    metadata = {"render_modes": []}

    def __init__(self, task: TwistTask | None = None, **options: Any):
        self.task = TwistTask(**options) if task is None else task
        self.observation_space, self.action_space = spaces(self.task)
        self.session = Session(self.task.vehicle, driven=False, **self.task.options)
        self.target, self.count = np.zeros(3), 0

    def reset(self, *, seed: int | None = None, options: dict | None = None) -> tuple[np.ndarray, dict]:
        """A new episode.

        seed     of the draws, None: they go on
        options  dict, which may give the "target" (3,) in 1/s
        """
        super().reset(seed=seed)
        (target,), (chi,) = self.task.starts(self.np_random, 1)
        self.target = self.task.targets((options or {}).get("target", target))
        self.session.reset(chi=chi)
        self.count = 0
        return self._observation(), self._info()

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict]:
        """Observation, reward, terminated, truncated, info after a step; info has the "reason" where it is terminated.

        action  (N,) in [-1, 1]
        """
        action, terminated, reason = self.task.actions(action), False, {}
        try:
            self.session.step(self.task.step, voltage=self.task.volts(action))
        except SimulationStopped as stopped:
            terminated, reason = True, {"reason": stopped.reason}
        self.count += 1
        reward = float(self.task.reward(self.session.nu, self.target, action))
        return self._observation(), reward, terminated, self.count >= self.task.steps, self._info() | reason

    def _observation(self) -> np.ndarray:
        return self.task.observation(self.session.nu, self.target, self.session.chi)

    def _info(self) -> dict[str, np.ndarray]:
        return {"target": self.target.copy(), "nu": self.session.nu.copy(), "pose": self.session.pose.copy()}


class TwistVectorEnv(VectorEnv):
    """Many vehicles that step together.

    num_envs  how many
    task      TwistTask; None: that of the paper's vehicle
    options   fields of TwistTask in the place of that

    A vehicle whose episode is over begins a new one in the next step, whose action it does not take (Gymnasium's
    NEXT_STEP). `info` is empty. Raises InvalidValueError for numbers that make no sense, actions that are not finite
    among them.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(self, num_envs: int = 1, task: TwistTask | None = None, **options: Any):
        self.task = TwistTask(**options) if task is None else task
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = spaces(self.task)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.sessions = Sessions(self.task.vehicle, num_envs, **self.task.options)
        self.target = np.zeros((num_envs, 3))
        self.count = np.zeros(num_envs, int)
        self.over = np.zeros(num_envs, bool)

    def reset(self, *, seed: int | None = None, options: dict | None = None) -> tuple[np.ndarray, dict]:
        """New episodes of all.

        seed     int of the draws of all, None: they go on
        options  dict, which may give the "target" (num_envs, 3) in 1/s
        """
        super().reset(seed=seed)
        self._begin(np.arange(self.num_envs))
        if options and "target" in options:
            self.target[:] = self.task.targets(options["target"], self.num_envs)
        return self._observation(), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict]:
        """Observations, rewards, terminated, truncated, info after a step.

        actions  (num_envs, N) in [-1, 1]
        """
        actions = self.task.actions(actions, self.num_envs)
        new = self.over.nonzero()[0]
        running = (~self.over).nonzero()[0]
        terminated = np.zeros(self.num_envs, bool)
        terminated[self.sessions.step(self.task.step, self.task.volts(actions), running)] = True
        self.count += 1
        if len(new):
            self._begin(new)
        rewards = self.task.reward(self.sessions.nu, self.target, actions)
        rewards[new] = 0.0
        truncated = self.count >= self.task.steps
        self.over = terminated | truncated
        return self._observation(), rewards, terminated, truncated, {}

    def _begin(self, which: np.ndarray) -> None:
        self.target[which], chi = self.task.starts(self.np_random, len(which))
        self.sessions.reset(which, chi)
        self.count[which] = 0

    def _observation(self) -> np.ndarray:
        return self.task.observation(self.sessions.nu, self.target, self.sessions.chi)

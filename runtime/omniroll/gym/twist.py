"""The task as environments: one vehicle, and many."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from omniroll import validation
from omniroll.engine.session import Session
from omniroll.errors import SimulationStopped
from omniroll.gym import raster
from omniroll.gym.sessions import Sessions
from omniroll.gym.task import TwistTask

MODES = ("rgb_array",)


def spaces(task: TwistTask) -> tuple[Box, Box]:
    """Of observations and of actions."""
    return Box(*task.bounds(), dtype=np.float64), Box(-1.0, 1.0, (task.vehicle.wheels,), np.float64)


def checked_mode(given: str | None) -> str | None:
    """How `render` shows the vehicle: "rgb_array", or None, not at all. Raises InvalidValueError for another one."""
    return None if given is None else validation.choice("render_mode", given, MODES)


def drawn(task: TwistTask, pose: np.ndarray, chi: np.ndarray, contact: np.ndarray, *twists: np.ndarray) -> np.ndarray:
    """(256, 256, 3) uint8, the picture of a vehicle whose nu and target (3,) are the twists."""
    shown = [(np.asarray(nu) / task.largest_nu)[:2] for nu in twists]
    return raster.picture(task.vehicle, pose, chi, contact, *shown)


class TwistEnv(gymnasium.Env):
    """One vehicle.

    task         TwistTask, which says what observations, actions and rewards are; None: that of the paper's vehicle
    render_mode  "rgb_array": render() gives the vehicle from above, (256, 256, 3) uint8; None: it gives None
    options      fields of TwistTask in the place of that

    `info` of reset and step has the target, nu and the pose. Raises InvalidValueError for numbers that make no sense,
    actions that are not finite among them.
    """

    metadata = {"render_modes": list(MODES), "render_fps": 100}

    def __init__(self, task: TwistTask | None = None, *, render_mode: str | None = None, **options: Any):
        self.task = TwistTask(**options) if task is None else task
        self.render_mode = checked_mode(render_mode)
        self.metadata = self.metadata | {"render_fps": round(1 / self.task.step, 6)}
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

    def render(self) -> np.ndarray | None:
        """(256, 256, 3) uint8: the vehicle from above, its speed in blue and its target's in green."""
        if self.render_mode is None:
            return None
        session = self.session
        return drawn(self.task, session.pose, session.chi, session.contact, session.nu, self.target)

    def _observation(self) -> np.ndarray:
        return self.task.observation(self.session.nu, self.target, self.session.chi)

    def _info(self) -> dict[str, np.ndarray]:
        return {"target": self.target.copy(), "nu": self.session.nu.copy(), "pose": self.session.pose.copy()}


class TwistVectorEnv(VectorEnv):
    """Many vehicles that step together.

    num_envs     how many
    task         TwistTask; None: that of the paper's vehicle
    render_mode  "rgb_array": render() gives a picture of each, as that of TwistEnv; None: it gives None
    options      fields of TwistTask in the place of that

    A vehicle whose episode is over begins a new one in the next step, whose action it does not take (Gymnasium's
    NEXT_STEP). `info` is empty but for the "reason" of episodes that are terminated, with the mask "_reason". Raises
    InvalidValueError for numbers that make no sense, actions that are not finite among them.
    """

    metadata = {"render_modes": list(MODES), "render_fps": 100, "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self, num_envs: int = 1, task: TwistTask | None = None, *, render_mode: str | None = None, **options: Any
    ):
        self.task = TwistTask(**options) if task is None else task
        self.render_mode = checked_mode(render_mode)
        self.metadata = self.metadata | {"render_fps": round(1 / self.task.step, 6)}
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
        stopped = self.sessions.step(self.task.step, self.task.volts(actions), running)
        terminated[list(stopped)] = True
        self.count += 1
        if len(new):
            self._begin(new)
        rewards = self.task.reward(self.sessions.nu, self.target, actions)
        rewards[new] = 0.0
        truncated = self.count >= self.task.steps
        self.over = terminated | truncated
        return self._observation(), rewards, terminated, truncated, self._reasons(stopped)

    def _reasons(self, stopped: dict[int, str]) -> dict[str, np.ndarray]:
        """Why some could not go on, as Gymnasium has it: an array for all, and a mask of those that it is of."""
        if not stopped:
            return {}
        reasons, of = np.full(self.num_envs, None, object), np.zeros(self.num_envs, bool)
        for k, reason in stopped.items():
            reasons[k], of[k] = reason, True
        return {"reason": reasons, "_reason": of}

    def render(self) -> tuple[np.ndarray, ...] | None:
        """A picture (256, 256, 3) uint8 of each vehicle."""
        if self.render_mode is None:
            return None
        return tuple(
            drawn(self.task, run.pose, run.chi, run.contact, run.nu, target)
            for run, target in zip(self.sessions.runs, self.target, strict=True)
        )

    def _begin(self, which: np.ndarray) -> None:
        self.target[which], chi = self.task.starts(self.np_random, len(which))
        self.sessions.reset(which, chi)
        self.count[which] = 0

    def _observation(self) -> np.ndarray:
        return self.task.observation(self.sessions.nu, self.target, self.sessions.chi)

"""Trains an agent of Stable-Baselines3 for a minute, and compares it with none: what gymnasium.md shows.

    pip install 'omniroll[training]'; python training.py [SECONDS]

`make test-extras EXTRAS=training` runs it.
"""

import sys
import time

import gymnasium
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

import omniroll.gym  # noqa: F401  (makes the environment known)

EPISODES = range(20)  # seeds


class Until(BaseCallback):
    """Ends the training after some seconds."""

    def __init__(self, seconds: float):
        super().__init__()
        self.end = time.monotonic() + seconds

    def _on_step(self) -> bool:
        return time.monotonic() < self.end


def reward(env: gymnasium.Env, agent: PPO | None) -> float:
    """The mean over episodes; without an agent the motors get no voltage."""
    totals = []
    for seed in EPISODES:
        seen, _ = env.reset(seed=seed)
        total, over = 0.0, False
        while not over:
            action = np.zeros(3) if agent is None else agent.predict(seen, deterministic=True)[0]
            seen, gained, terminated, truncated, _ = env.step(action)
            total, over = total + gained, terminated or truncated
        totals.append(total)
    return float(np.mean(totals))


def main(seconds: float) -> None:
    env = gymnasium.make("omniroll/Twist-v0", steps=100)
    agent = PPO("MlpPolicy", env, n_steps=1000, batch_size=250, gamma=0.95, learning_rate=1e-3, seed=1, device="cpu")
    agent.learn(10**9, callback=Until(seconds))
    before, after = reward(env, None), reward(env, agent)
    print(f"{agent.num_timesteps} steps in {seconds:g} s: reward of an episode {after:.1f}, of none {before:.1f}")
    assert after > before / 2


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0)

"""Question 7: environments for learning, many vehicles that step together on one core."""

import numpy as np

from omniroll.gym import TwistVectorEnv

from .common import Answer, Target, repeated

ENVIRONMENTS, STEPS, REPEATS = 256, 40, 25
CHECKED = 20  # steps after which the error is taken


class Agents:
    """The vehicles under random actions, from random starts."""

    def __init__(self, accuracy):
        self.env = TwistVectorEnv(ENVIRONMENTS, accuracy=accuracy)
        self.env.reset(seed=1)
        self.actions = np.random.default_rng(2).uniform(-1, 1, (STEPS, ENVIRONMENTS, self.env.task.vehicle.wheels))

    def __call__(self):
        for action in self.actions:
            self.env.step(action)

    def observed(self):
        for action in self.actions[:CHECKED]:
            seen, *_ = self.env.step(action)
        return seen[:, :3]


def answer() -> Answer:
    agents = Agents(1e-6)
    error = np.abs(agents.observed() - Agents(1e-11).observed()).max()
    took = repeated(agents, REPEATS)
    least, median = ((STEPS * ENVIRONMENTS) / time for time in (took.least, took.median))
    task, each = agents.env.task, took.in_unit(1e6 / (STEPS * ENVIRONMENTS))
    return Answer(
        title="7. Environments for learning",
        text=(
            f"{ENVIRONMENTS} vehicles of omniroll.gym with free rollers and motors step together in one thread, "
            f"{task.step:g} s a step, under random actions: engine, rewards, observations, new episodes. The error is "
            f"that of nu over its largest target after {CHECKED} steps, against runs with an accuracy of 1e-11."
        ),
        headings=["environments", "microseconds a step of one", "steps a second", "error"],
        rows=[[str(ENVIRONMENTS), each, f"{least:.3g} ({median:.3g})", f"{error:.0e}"]],
        targets=[
            Target("environments: >= 1e5 steps a second on one core, by the median", f"{median:.3g}", median >= 1e5)
        ],
    )

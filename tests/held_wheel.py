"""A wheel that is held on its joint: torques that push it outwards on both sides, since M* differs between them."""

import numpy as np

from omniroll import Vehicle
from omniroll.kernels.kernel import kernel

PAPER = Vehicle.paper()
CHI = np.array([np.pi / PAPER.rollers_per_wheel, 0.2, -0.1])  # wheel 0 is the one


def torques_that_hold(roller_model):
    """(3,) in N m, of the paper's vehicle at rest at CHI."""
    bound = kernel(PAPER, roller_model, "python")
    wheels = bound.wheel_speeds(np.eye(3)).T
    pushes = [wheels @ np.linalg.solve(bound.mass_matrix([side, *CHI[1:]]), wheels[0]) for side in (CHI[0], -CHI[0])]
    a, b = (push / np.linalg.norm(push) for push in pushes)
    torques = (a - b) / np.abs(a - b).max() * 0.02
    assert pushes[0] @ torques > 0 > pushes[1] @ torques
    return torques

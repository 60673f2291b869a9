"""How far an outcome is from a reference: at its end, over the trajectory, in the times of switches, in the energy."""

import math
from typing import Any

import numpy as np

from omniroll.engine.runs import Task


def deviation(outcome: Any, reference: Any, task: Task) -> dict[str, float]:
    """Four distances of an Outcome, or a second Reference, from a Reference.

    end, trajectory  in the norm of `accuracy`, max over ((x, y)/R, theta, nu/|nu|), at the last and at all samples;
                     nu jumps at switches, and is compared where both have the same rollers in contact
    switch_times     s, nan where the switches are not the same
    energy           relative to the largest
    """
    rows = reference.y if task.effects else reference.y[:1]  # |nu| is that of the start; with effects the largest
    radius, speed = task.kernel.vehicle.platform_radius, float(np.linalg.norm(rows[:, :3], axis=1).max()) or 1.0
    pose = np.abs(outcome.y[:, -3:] - reference.y[:, -3:]) / [radius, radius, 1.0]
    nu = np.abs(outcome.y[:, :3] - reference.y[:, :3]) / speed
    same = (outcome.contact == reference.contact).all(axis=1)
    each = np.maximum(pose.max(axis=1), np.where(same[:, None], nu, 0.0).max(axis=1))
    scale = max(abs(reference.energy).max(), np.finfo(float).tiny)
    return {
        "end": float(each[-1]),
        "trajectory": float(each.max()),
        "switch_times": _switch_times(outcome.switches, reference.switches),
        "energy": float(np.abs(outcome.energy - reference.energy)[same].max(initial=0.0) / scale),
    }


def _switch_times(switches: list, wanted: list) -> float:
    """The largest error of a switch's time, wheel by wheel; nan where the switches are not the same."""
    worst = 0.0
    for wheel in {wheel for _, wheel, _ in wanted} | {wheel for _, wheel, _ in switches}:
        one = [(t, d) for t, i, d in switches if i == wheel]
        other = [(t, d) for t, i, d in wanted if i == wheel]
        if [d for _, d in one] != [d for _, d in other]:
            return math.nan
        worst = max([worst, *(float(abs(a - b)) for (a, _), (b, _) in zip(one, other, strict=True))])
    return worst

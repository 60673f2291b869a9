"""Readings that come late, each by the delay of its instrument."""

from collections.abc import Mapping

import numpy as np

from omniroll.identification.log import Log
from omniroll.identification.model import Model
from omniroll.results.trajectory import Trajectory


def by_delay(model: Model, log: Log) -> Mapping[tuple[str, ...], float]:
    """The readings that are late by the same time, together."""
    delays = {name: model.correction(name, "delay") for name in log.fitted}
    return {tuple(name for name in delays if delays[name] == delay): delay for delay in set(delays.values())}


def read_times(log: Log, delay: float, run: Trajectory) -> np.ndarray:
    """(T,) the times within the run of what is read late."""
    return np.clip(log.t - delay, run.t[0], run.t[-1])

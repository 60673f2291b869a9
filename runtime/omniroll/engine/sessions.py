"""Many sessions of one vehicle that step together, for learning: arrays in, arrays out.

Each has a run of the compiled engine of its own, so that its motion is that of a Session. Each step is an event: what a
Session checks at each step is not checked here.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from omniroll import validation
from omniroll.engine.session import Session
from omniroll.engine.simulate import checked_task
from omniroll.engine.stepped_run import SteppedRun
from omniroll.errors import InvalidValueError, SimulationStopped
from omniroll.vehicles.vehicle import Vehicle


class Sessions:
    """V sessions of a vehicle with motors.

    vehicle  Vehicle with N wheels
    count    V
    options  arguments of Session; among the effects is a Motor

    nu (V, 3) in 1/s and chi (V, N) in rad are the state of all, new after each step.

    Raises as Session does, and InvalidValueError for a count that is not positive, or effects that take no voltage.
    """

    def __init__(self, vehicle: Vehicle, count: int, **options: Any):
        validation.integer("count", count, 1)
        Session(vehicle, driven=False, **options)  # raises what there is to raise
        task = replace(checked_task(vehicle, nu=(0, 0, 0), **options, duration=0), engine="compiled")
        self.runs = [SteppedRun(task, task.accuracy) for _ in range(count)]
        if any(len(run.held.get("voltage", ())) != 1 for run in self.runs):
            raise InvalidValueError("effects", options.get("effects"), "must have one Motor with a constant voltage")
        self.volts = [run.held["voltage"][0] for run in self.runs]
        self.elapsed = np.zeros(count)
        self._nu, self._chi = [run.nu for run in self.runs], [run.chi for run in self.runs]
        self._read()

    def step(self, duration: float, voltage: np.ndarray, which: np.ndarray) -> list[int]:
        """Go on for a time; the numbers of those that could not.

        duration  in s
        voltage   (V, N) in V of the motors, from now on
        which     (K,) numbers of the sessions that go on
        """
        stopped = []
        self.elapsed[which] += duration
        ends = self.elapsed.tolist()
        for k, own in zip(which.tolist(), voltage[which], strict=True):
            run = self.runs[k]
            self.volts[k][:] = own
            run.change_what_acts()
            try:
                run.go_on(ends[k])
            except SimulationStopped:
                stopped.append(k)
        self._read()
        return stopped

    def reset(self, which: np.ndarray, chi: np.ndarray) -> None:
        """Back to the start, at rest.

        which  (K,) numbers of sessions
        chi    (K, N) in rad, |chi| <= pi/n
        """
        self.elapsed[which] = 0.0
        for k, own in zip(which.tolist(), chi, strict=True):
            self.runs[k].go_to_start()
            self.runs[k].chi[:] = own
        self._read()

    def _read(self) -> None:
        """Take the state of all, once for those who read it more often."""
        self.nu, self.chi = np.array(self._nu), np.array(self._chi)

"""Many sessions of one vehicle that step together, for learning: arrays in, arrays out.

Each has a run of the compiled engine of its own, so that its motion is that of a Session. One call of the engine takes
all of them through a step; what a Session checks at each step is not checked here. Each step is an event.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from omniroll import validation
from omniroll.engine.compiled_engine import DONE
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
        self.module, self.model = self.runs[0].module, self.runs[0].model
        self.members = self.module.ffi.new("omniroll_member_t[]", count)
        for k in range(count):
            self._point_to(k)
        self.elapsed = np.zeros(count)
        self.nu, self.chi = np.empty((count, 3)), np.empty((count, vehicle.wheels))
        self._read()

    def step(self, duration: float, voltage: np.ndarray, which: np.ndarray) -> dict[int, str]:
        """Go on for a time; the numbers of those that could not, and why.

        duration  in s
        voltage   (V, N) in V of the motors, from now on
        which     (K,) numbers of the sessions that go on
        """
        self.elapsed[which] += duration
        count, statuses = len(which), np.empty(len(which), np.intc)
        which, voltage = np.ascontiguousarray(which, np.int64), np.ascontiguousarray(voltage, float)
        self.module.lib.omniroll_run_members(
            count, self._of("long long", which), self.members, self.model, self._of("double", self.elapsed),
            self._of("double", voltage), self._of("int", statuses),
        )  # fmt: skip
        stopped: dict[int, str] = {}
        for k in np.flatnonzero(statuses != DONE).tolist():
            run = self.runs[which[k]]
            try:
                run.go_on_from(int(statuses[k]), run.run.state.elapsed, run.run.record.step_count)
            except SimulationStopped as error:
                stopped[int(which[k])] = error.reason
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
            self.runs[k].put_angles(own)
            self._point_to(k)
        self._read()

    def _point_to(self, k: int) -> None:
        """Where the engine finds a session: its voltages may stand elsewhere after a new start."""
        (volts,) = self.runs[k].held["voltage"]
        self.members[k].run, self.members[k].volts = self.runs[k].struct, self._of("double", volts)

    def _of(self, kind: str, array: np.ndarray) -> Any:
        """Pointer to the numbers of an array, which must stay."""
        return self.module.ffi.cast(f"{kind} *", array.ctypes.data)

    def _read(self) -> None:
        """Take the state of all."""
        self.nu, self.chi = np.empty_like(self.nu), np.empty_like(self.chi)
        nu, chi = self._of("double", self.nu), self._of("double", self.chi)
        self.module.lib.omniroll_read_members(len(self.runs), self.members, nu, chi)

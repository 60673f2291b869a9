"""What the two engines in Python share: the rows that a run collects, and the methods that the compiled engine's runs
have. Neither takes a rule, a tolerance or a decision from here."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np

from omniroll.effects.effect_set import EffectRun
from omniroll.engine.runs import Rows, Task, assembled, shown_state
from omniroll.engine.works import Work, result_of
from omniroll.errors import SimulationStopped
from omniroll.results.comparison import difference
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.state import State

NUMBER = 15  # bytes of memory of a number in a row, with its share of the objects around it


@dataclass
class Record:
    """What is collected during a run: a row at each time, and where among them steps and switches are."""

    elapsed: list[float] = field(default_factory=list)
    y: list[np.ndarray] = field(default_factory=list)
    contact: list[np.ndarray] = field(default_factory=list)
    axial: list[np.ndarray | None] = field(default_factory=list)
    drive: list[np.ndarray] = field(default_factory=list)
    dense: list[np.ndarray] = field(default_factory=list)
    step_rows: list[int] = field(default_factory=list)
    directions: list[np.ndarray] = field(default_factory=list)
    switch_rows: list[int] = field(default_factory=list)
    steps_before: int = 0  # in rows that are forgotten
    switches_before: int = 0
    wheels_before: int = 0

    @property
    def step_count(self) -> int:
        """Since the start of the run."""
        return self.steps_before + len(self.dense)

    @property
    def switch_count(self) -> int:
        """Since the start of the run."""
        return self.switches_before + len(self.directions)

    @property
    def wheel_count(self) -> int:
        """How many wheels have switched since the start of the run."""
        return self.wheels_before + int(np.count_nonzero(self.directions))

    def last(self) -> "Record":
        """The last row alone, with what must be known of the others."""
        kept = {name: getattr(self, name)[-1:] for name in ("elapsed", "y", "contact", "axial", "drive")}
        before = {"steps_before": self.step_count, "switches_before": self.switch_count}
        return Record(**kept, **before, wheels_before=self.wheel_count)

    def add(
        self, elapsed: float, y: np.ndarray, contact: np.ndarray, axial: np.ndarray | None, drive: np.ndarray
    ) -> None:
        row = {"elapsed": elapsed, "y": y, "contact": contact, "axial": axial, "drive": drive}
        for name, value in row.items():
            getattr(self, name).append(value)

    def switch(self, directions: np.ndarray) -> None:
        """Wheels with directions +1 or -1 (N,) switch before the next row."""
        self.switch_rows.append(len(self.y))
        self.directions.append(directions)

    def since(self, first: int, has_drives: bool) -> Rows:
        """The rows from `first` on."""
        step, switch = bisect_left(self.step_rows, first), bisect_right(self.switch_rows, first) if first else 0
        y, directions = np.array(self.y[first:]), np.array(self.directions[switch:], int)
        dense = self.dense[step:]
        return Rows(
            elapsed=np.array(self.elapsed[first:]), y=y, contact=np.array(self.contact[first:]),
            axial=lambda some: np.array(self.axial[first:])[some],
            dense=lambda some: np.array(dense).reshape(len(dense), -1, y.shape[1])[some],
            step_rows=np.array(self.step_rows[step:], int) - first,
            directions=directions.reshape(len(directions), len(self.contact[0])),
            switch_rows=np.array(self.switch_rows[switch:], int) - first,
            drive=np.array(self.drive[first:]) if has_drives else None,
        )  # fmt: skip


class PythonRun:
    """One simulation with one tolerance. It has the methods of a CompiledRun.

    bytes_per_row  about what a row, and the step behind it, take of memory
    """

    bytes_per_row: float

    def __init__(self, task: Task, tolerance: float):
        self.task, self.kernel, self.state, self.tolerance = task, task.kernel, task.state, tolerance
        self.acting = EffectRun(task.effects, task.kernel, task.start_time)
        self.rows, self.elapsed = Record(), 0.0
        self.found: Trajectory | None = None  # once it has ended
        self.stop: SimulationStopped | None = None

    def simulate(self) -> None:
        """Fill the rows up to the end. Raises SimulationStopped."""
        raise NotImplementedError

    def figures(self) -> tuple[int, int, int, float]:
        """How many steps, evaluations and phases there were, and what the steps' local errors add up to."""
        raise NotImplementedError

    def _at_end(self) -> State:
        """The state where the run has come, with the speeds of wheels that may slip."""
        return self.state

    def advancing(self) -> Work[None]:
        """Simulate, up to the duration or to where the run cannot go on."""
        yield from ()  # it calls no compiled engine
        try:
            self.simulate()
            self.found = self.part()
        except SimulationStopped as stopped:
            self.found, self.stop = stopped.trajectory, stopped

    def trajectory(self) -> Trajectory:
        """The result, which is simulated now if it has not been. Raises SimulationStopped."""
        if self.found is None:
            result_of(self.advancing())
        if self.stop is not None:
            raise self.stop
        return self.found

    @property
    def done(self) -> bool:
        return self.stop is None

    def end(self) -> dict[str, Any]:
        found, is_free = self.found, self.kernel.roller_model == "free"
        end = {name: getattr(found, name)[-1] for name in ("t", "nu", "chi", "contact", "pose")}
        speeds = self.task.effects.own_speeds(self.kernel, self._at_end())
        if speeds and found.roller_model == "massless":
            speeds["contact_spin"] = found.contact_spin[-1]
        return end | {"axial": self.rows.axial[-1] if is_free else None, "speeds": speeds}

    def stats(self) -> dict:
        return self.found.stats

    def distance_from(self, coarse: "PythonRun") -> float:
        return difference(coarse.found, self.found)

    def largest_pose(self) -> np.ndarray:
        return np.abs(self.found.pose).max(axis=0)

    def release(self) -> None:
        pass

    @property
    def row_count(self) -> int:
        return len(self.rows.y)

    @property
    def bytes_held(self) -> float:
        return self.row_count * self.bytes_per_row

    def forget(self) -> None:
        self.rows = self.rows.last()

    def part(self, first: int = 0) -> Trajectory:
        """The motion from row `first` to the last one."""
        steps, evaluations, phases, errors = self.figures()
        stats = {
            "engine": "python", "kernel": self.kernel.set_name, "steps": steps, "evaluations": evaluations,
            "phases": phases, "tolerance": self.tolerance, "local_errors": errors, "switches": self.rows.wheel_count,
        }  # fmt: skip
        return assembled(self.task, self.rows.since(first, bool(self.acting.drives)), stats)

    def _interruption(self) -> str:
        """Why somebody wishes that the run ends here; empty where nobody does."""
        return self.task.interrupted() if self.task.interrupted is not None else ""

    def _show(self) -> None:
        """Show the run to those who look at it now and then."""
        if self.task.keep is not None:
            self.task.keep(self)
        if self.task.progress is not None:
            self.task.progress(self.elapsed, self.task.duration)

    def _stop(self, reason: str, wheel: int | None = None) -> NoReturn:
        t = float(self.task.start_time + self.elapsed)
        raise SimulationStopped(reason, t=t, wheel=wheel, state=shown_state(self.state), trajectory=self.part())

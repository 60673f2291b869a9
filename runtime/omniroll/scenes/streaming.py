"""A run that goes to the disk part by part, so that memory holds one part, however long the run is.

It has no error estimate, since that needs two runs at once.
"""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from omniroll import durable
from omniroll.engine.runs import Partial
from omniroll.errors import InvalidValueError
from omniroll.results.trajectory import Trajectory
from omniroll.scenes.loading import Scene
from omniroll.scenes.result_folder import part_name

SHARE = 1 / 8  # of the memory that the rows of one part may take: their trajectory takes some four times that
NEED_THE_WHOLE = ("measurements", "reactions")  # tables of a scene


class Stream:
    """Writes the parts of one run.

    folder  of the parts; those of an earlier run are removed
    memory  bytes that the run may take at once

    `look` and `add` raise OSError where a part cannot be written; those before it stay.
    """

    def __init__(self, folder: Path, memory: float):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        self.folder, self.most, self.room = folder, SHARE * memory, float(shutil.disk_usage(folder).free)
        self.parts: list[dict[str, Any]] = []
        self.start, self.gains = 0.0, {}

    def look(self, run: Partial) -> None:
        """Called now and then during the run."""
        if run.bytes_held >= self.most:
            self.add(run.part(0))
            run.forget()

    def add(self, part: Trajectory) -> None:
        """Write the part that follows those before."""
        name = part_name(1, len(self.parts) + 1)
        part.save(self.folder / name)
        self._sum_up(part)
        self.parts.append({
            "file": name, "rows": len(part), "t": [float(part.t[0]), float(part.t[-1])],
            "checksum": durable.digest(self.folder / name),
        })  # fmt: skip

    def written(self) -> Iterator[Trajectory]:
        """The parts, each read when its turn comes."""
        return (Trajectory.load(self.folder / part["file"]) for part in self.parts)

    def _sum_up(self, part: Trajectory) -> None:
        if not self.parts:
            self.start = float(part.energy[0])
        gained = {name: float(values[-1] - values[0]) for name, values in part.contributions().items()}
        gained["switches"] = float(part.switches["energy_jump"].sum())
        self.gains = {name: self.gains.get(name, 0.0) + joules for name, joules in gained.items()}
        self.end = float(part.energy[-1])

    def ledger(self) -> dict[str, float]:
        """Where the kinetic energy of the whole run went, in J."""
        residual = self.end - self.start - sum(self.gains.values())
        return {"start": self.start, "end": self.end} | self.gains | {"residual": residual}


def refuse_unless_streamable(scene: Scene, *, plot: bool, view: bool) -> None:
    """Raise InvalidValueError where something is asked for that needs the whole run at once."""
    asked = [f"[{table}]" for table in NEED_THE_WHOLE if table in scene.tables]
    asked += [option for option, given in (("--plot", plot), ("--view", view)) if given]
    for name in asked:
        raise InvalidValueError("--stream", True, f"cannot stand beside {name}, which needs the whole run at once")

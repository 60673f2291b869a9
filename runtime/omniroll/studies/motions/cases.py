"""The motions of section 5 and the settings under which they are run."""

from collections.abc import Callable
from dataclasses import dataclass

from omniroll.engine.simulate import simulate
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.vehicle import Vehicle

LONG = 200.0  # s: the massless vehicle's centre closes its circle in motion 3
ACCURACY = 1e-9


@dataclass(frozen=True)
class Motion:
    """One start: the motion's number in the paper and nu(0), in 1/s; chi = 0, rollers at rest."""

    number: int
    title: str
    nu: tuple[float, float, float]


@dataclass(frozen=True)
class Setting:
    """A roller model with a switching law."""

    roller_model: str
    switching: str

    @property
    def key(self) -> str:
        """A name for files; the law makes no difference to massless rollers."""
        return "massless" if self.roller_model == "massless" else f"{self.roller_model}-{self.switching}"

    @property
    def label(self) -> str:
        return self.key.replace("-", ", ")


MOTIONS = (
    Motion(1, "rotation about the vertical axis", (0.0, 0.0, 1.0)),
    Motion(2, "straight ahead, along the axle of wheel 1", (1.0, 0.0, 0.0)),
    Motion(3, "straight ahead with a twist", (1.0, 0.0, 1.0)),
)
MASSLESS = Setting("massless", "smooth")  # either law: a massless roller changes nothing
PAPER = Setting("locked", "smooth")  # the setting of the paper's own numerics
SETTINGS = (
    MASSLESS,
    PAPER,
    Setting("free", "smooth"),
    Setting("locked", "impact"),
    Setting("free", "impact"),
)
Runs = dict[tuple[int, str], Trajectory]


def run_all(report: Callable[[Motion, Setting, Trajectory], None]) -> Runs:
    """Every motion under every setting, as {(motion number, setting key): Trajectory}.

    `report` is called after each run.
    """
    vehicle = Vehicle.paper()
    runs: Runs = {}
    for motion in MOTIONS:
        for setting in SETTINGS:
            trajectory = simulate(
                vehicle,
                nu=motion.nu,
                duration=LONG,
                roller_model=setting.roller_model,
                switching=setting.switching,
                accuracy=ACCURACY,
            )
            runs[motion.number, setting.key] = trajectory
            report(motion, setting, trajectory)
    return runs

"""A scene beside MuJoCo: how far the two motions are apart, as numbers and as a picture."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from omniroll import extras
from omniroll.exchange.run_in_mujoco import FINE_SPHERES, STEP, MujocoRun, friction_of, left_out, run_in_mujoco
from omniroll.results import pictures
from omniroll.results.trajectory import Trajectory
from omniroll.scenes.loading import Scene, run

ROWS = 401  # times at which the motions are compared
SHOWN = 6  # of them in the table
FINER = 2  # the second run's step is smaller by this factor, and shows what the step does
NO_HEIGHT = "the scene has no height of the centre of mass, MuJoCo's is as high as the axles"
COLUMNS = ("t", "place", "heading", "speed")


@dataclass(frozen=True, eq=False)
class Beside:
    """A scene's run, and MuJoCo's of it.

    scene       its name
    trajectory  of this project
    others      MuJoCo's, the larger step first
    friction    coefficient between rollers and ground in MuJoCo
    height      of the centre of mass there, in m; None: as high as the axles
    """

    scene: str
    trajectory: Trajectory
    others: tuple[MujocoRun, ...]
    friction: float
    height: float | None

    def distances(self, other: MujocoRun) -> np.ndarray:
        """(K, 4) times in s, and how far apart are the places of S in m, the headings in rad, its speeds in m/s."""
        scale, own = self.trajectory.vehicle.platform_radius, self.trajectory.sample(other.t)
        places = np.linalg.norm(other.pose[:, :2] - own.pose[:, :2], axis=1)
        speeds = scale * np.linalg.norm(other.nu[:, :2] - own.nu[:, :2], axis=1)
        return np.column_stack([other.t, places, np.abs(other.pose[:, 2] - own.pose[:, 2]), speeds])

    def summary(self) -> dict[str, Any]:
        """All of it in plain Python types."""
        pose = self.trajectory.pose
        return {
            "scene": self.scene,
            "roller_model": self.trajectory.roller_model,
            "switches": len(self.trajectory.switches),
            "way": float(np.linalg.norm(np.diff(pose[:, :2], axis=0), axis=1).sum()),
            "friction": self.friction,
            "height": self.height,
            "left_out": left_out(self.trajectory) + ([] if self.height is not None else [NO_HEIGHT]),
            "runs": [self._summary_of(other) for other in self.others],
        }

    def _summary_of(self, other: MujocoRun) -> dict[str, Any]:
        rows = np.unique(np.linspace(0, len(other.t) - 1, SHOWN).round().astype(int))
        columns = dict(zip(COLUMNS, self.distances(other)[rows].T.tolist(), strict=True))
        return {"step": other.step, "seconds": other.seconds, "off_ground": other.off_ground} | columns

    def draw(self, path: Path) -> None:
        """Path, heading, speeds, and the distance over time, as PNG. Raises MissingPackageError without matplotlib."""
        extras.needed("matplotlib", "plots", "a picture")
        import matplotlib
        from matplotlib.figure import Figure

        with matplotlib.rc_context(pictures.STYLE):
            figure = Figure(figsize=(11, 6.5), layout="constrained")
            path_axis, heading, forward, apart = figure.subplots(2, 2).flat
            fine = self.others[-1]
            own = self.trajectory.sample(fine.t)
            mine, theirs = (
                {"color": "#d1651a", "label": "omniroll"},
                {"color": "#1f5fa8", "label": "MuJoCo", "ls": "--"},
            )
            for style, pose, nu in ((mine, own.pose, own.nu), (theirs, fine.pose, fine.nu)):
                path_axis.plot(pose[:, 0], pose[:, 1], **style)
                heading.plot(fine.t, pose[:, 2], **style)
                speed = self.trajectory.vehicle.platform_radius * np.linalg.norm(nu[:, :2], axis=1)
                forward.plot(fine.t, speed, **style)
            for other, shade in zip(self.others, ("#9db8d6", "#1f5fa8"), strict=True):
                label = f"MuJoCo, step {1e3 * other.step:g} ms"
                apart.plot(other.t, 1e3 * self.distances(other)[:, 1], color=shade, label=label)
            path_axis.set(
                title="path of the centre $S$", xlabel="x, m", ylabel="y, m", aspect="equal", adjustable="datalim"
            )
            heading.set(title="heading", xlabel="t, s", ylabel="rad")
            forward.set(title="speed of $S$", xlabel="t, s", ylabel="m/s")
            apart.set(title="distance from omniroll's place", xlabel="t, s", ylabel="mm")
            path_axis.legend()
            apart.legend()
            pictures.save(figure, path)


def beside_mujoco(
    scene: Scene,
    *,
    step: float = STEP,
    friction: float | None = None,
    spheres: int = FINE_SPHERES,
    duration: float | None = None,
) -> Beside:
    """A scene's run, and MuJoCo's with two steps.

    scene     Scene
    step      in s, MuJoCo's larger step
    friction  coefficient between rollers and ground; None: that of the scene's [contact], or 1
    spheres   number of spheres that stand for a roller in MuJoCo's model
    duration  in s, in place of the scene's

    Raises as omniroll.simulate and run_in_mujoco do.
    """
    own = run(scene, **({} if duration is None else {"duration": duration}))
    times = np.linspace(own.t[0], own.t[-1], ROWS)
    friction = friction_of(own) if friction is None else friction
    height = scene.tables.get("contact", {}).get("height", scene.tables.get("reactions", {}).get("height"))
    others = (run_in_mujoco(own, times, size, friction, spheres, height) for size in (step, step / FINER))
    return Beside(scene.name, own, tuple(others), friction, height)

"""Motions as nav_msgs/Odometry has them: the pose in the frame odom, the twist in the frame of the robot."""

import math
from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.conventions.twists import nu_of_twist, twist_of_nu
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.vehicle import Vehicle

COLUMNS = (
    "t", "pose.position.x", "pose.position.y", "pose.orientation.z", "pose.orientation.w", "twist.linear.x",
    "twist.linear.y", "twist.angular.z",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Odometry:
    """Messages of nav_msgs/Odometry at K times; what a planar motion leaves at 0 is not kept.

    t            (K,) in s
    position     (K, 2) x, y in m, in the frame odom
    orientation  (K, 2) z and w of the quaternion (0, 0, z, w) that turns the robot's frame into odom
    twist        (K, 3) linear x, y in m/s and angular z in rad/s, in the robot's frame
    """

    t: np.ndarray
    position: np.ndarray
    orientation: np.ndarray
    twist: np.ndarray

    @classmethod
    def of(cls, trajectory: Trajectory, times: ArrayLike) -> "Odometry":
        """The true motion of a run, as a perfect odometry would tell it.

        trajectory  Trajectory
        times       (K,) in s, within the run

        Raises InvalidValueError for times outside the run.
        """
        seen = trajectory.sample(times)
        half = seen.pose[..., 2] / 2
        orientation = np.stack([np.sin(half), np.cos(half)], axis=-1)
        return cls(seen.t, seen.pose[..., :2], orientation, twist_of_nu(trajectory.vehicle, seen.nu))

    def pose(self) -> np.ndarray:
        """(K, 3) x, y in m and the heading in rad; it goes on over a turn, from between -pi and pi at first."""
        heading = 2 * np.arctan2(self.orientation[:, 0], self.orientation[:, 1])
        return np.column_stack([self.position, np.unwrap((heading + math.pi) % (2 * math.pi) - math.pi)])

    def nu(self, vehicle: Vehicle) -> np.ndarray:
        """(K, 3) in 1/s.

        vehicle  Vehicle
        """
        return nu_of_twist(vehicle, self.twist)

    def save(self, path: str | PathLike) -> None:
        """Write a CSV file whose columns are named after the fields of the message.

        path  of the file, str or path

        Raises InvalidValueError for what is no path, OSError where it cannot be written.
        """
        rows = np.column_stack([self.t, self.position, self.orientation, self.twist])
        path = validation.file_path("path", path)
        np.savetxt(path, rows, fmt="%.17g", delimiter=",", header=",".join(COLUMNS), comments="")

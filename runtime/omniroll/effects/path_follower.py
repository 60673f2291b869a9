"""A controller that takes a vehicle along a path: inverse dynamics of its accelerations, and feedback of the pose.

At each sample the wanted acceleration of the pose is that of the path and what makes the errors fade. Inverse dynamics
give the torques that bring it; they, or the voltages that make them, are held until the next sample. The controller
knows pose, nu and the wheels' angles, as a robot does; the rollers that are off the ground it takes for locked.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from omniroll.effects.effect import Effect
from omniroll.effects.motor import voltages_of
from omniroll.effects.sampled import Sampled, SampledDrive, doubts_of_growth
from omniroll.errors import InvalidValueError
from omniroll.generated.python import parts
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.kernel import kernel as kernel_of
from omniroll.kernels.neutral_kernel import best_backend, kernel_by
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import PATH, documented

FASTEST = 1e3  # rad per sample: errors of the path grow at this bandwidth and above it


@documented(*PATH)
@dataclass(frozen=True)
class PathFollower(SampledDrive):
    """Takes the vehicle along a path, by torques or voltages of the wheels, in samples.

    {entries}

    A bandwidth that is too large for the sample time gives an UnstableControllerWarning. Raises InvalidValueError for
    numbers out of their bounds; simulate raises it for wheels that cannot drive the vehicle in every direction, and for
    an output of voltages without a Motor.
    """

    times: ArrayLike
    poses: ArrayLike
    sample_time: float
    bandwidth: float
    output: str = "torque"
    limit: float | None = None

    def __post_init__(self) -> None:
        self._keep_checked(entry for entry in PATH if entry.name not in ("times", "poses"))
        self._keep_table("poses", width=3)

    def check(self, vehicle: Vehicle, others: Sequence[Effect]) -> None:
        rank = np.linalg.matrix_rank(kernel_of(vehicle, "massless", "python").wheel_speeds(np.eye(3)))
        if rank < 3:
            raise InvalidValueError("poses", self.poses, "needs wheels that can drive the vehicle in every direction")
        super().check(vehicle, others)

    def doubts(self, vehicle: Vehicle, others: Sequence[Effect]) -> tuple[UserWarning, ...]:
        times = growth(min(self.bandwidth * self.sample_time, FASTEST))
        return doubts_of_growth(times, "the errors of the path", "a linear test", "sample_time or bandwidth")

    def events(self) -> tuple[str, ...]:
        return (f"samples of the path's controller, every {self.sample_time:g} s",)

    def process(self, kernel: Kernel, start_time: float) -> "PathTracking":
        return PathTracking(self, kernel, start_time)


def growth(bandwidth: float) -> float:
    """The factor by which an error grows from one sample to the next, in the long run; up to 1 it does not.

    bandwidth  in rad per sample

    An error, its rate and its sum, under an acceleration that is held: times are in samples.
    """
    gains = np.array([3 * bandwidth**2, 3 * bandwidth, bandwidth**3])
    summed = np.array([[1, 0, 0], [0, 1, 0], [1, 0, 1]])  # the sum takes the error of the sample first
    free, forced = np.array([[1, 1, 0], [0, 1, 0], [0, 0, 1]]), np.array([0.5, 1, 0])
    return float(np.abs(np.linalg.eigvals((free - np.outer(forced, gains)) @ summed)).max())


class Path:
    """A path over the time since the start of the run: poses (K, 3), a cubic spline that begins and ends at rest."""

    def __init__(self, times: np.ndarray, poses: np.ndarray):
        from scipy.interpolate import CubicSpline  # SciPy is large; only a path needs it here

        self.first, self.last = times[0], times[-1]
        self.ends = poses[0], poses[-1]
        self.spline = CubicSpline(times, poses, bc_type="clamped") if len(times) > 1 else None

    def at(self, time: float, order: int = 0) -> np.ndarray:
        """(3,) the pose, or its derivative of this order by time."""
        if self.spline is not None and self.first < time < self.last:
            return self.spline(time, order)
        return np.zeros(3) if order else self.ends[int(time >= self.last)]


class PathTracking(Sampled):
    """The controller in one run, with the sums of the errors."""

    def __init__(self, follower: PathFollower, kernel: Kernel, start_time: float):
        super().__init__(follower, kernel)
        self.follower = follower
        self.path = Path(np.array(follower.times) - start_time, np.array(follower.poses))
        self.limit = math.inf if follower.limit is None else follower.limit
        model = "massless" if kernel.roller_model == "massless" else "locked"
        self.plant = kernel_by(best_backend(model), kernel.vehicle, model)  # what the controller takes the vehicle for
        self.sum = np.zeros(3)

    def pass_time(self, state: State) -> None:
        acceleration, summed = self._wanted(state)
        # What is held for a sample is right in the middle of it, where heading and nu are other ones.
        half = self.follower.sample_time / 2
        nu = state.nu + half * nu_dot_of(self.plant, acceleration, state.nu, state.pose[2])
        heading = state.pose[2] + half * self.plant.pose_rates(state.nu, state.pose[2])[2]
        output = self._output(nu, state.chi, nu_dot_of(self.plant, acceleration, nu, heading))
        self.output = np.clip(output, -self.limit, self.limit)
        self.sum = summed if (self.output == output).all() else self.sum
        self.samples += 1

    def _wanted(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """(3,) the acceleration that the pose is to have, and the sums of the errors with this sample's."""
        time, step, gain = self.next_time(), self.follower.sample_time, self.follower.bandwidth
        error = self.path.at(time) - state.pose
        error_rate = self.path.at(time, 1) - self.plant.pose_rates(state.nu, state.pose[2])
        summed = self.sum + step * error
        fading = 3 * gain * error_rate + 3 * gain**2 * error + gain**3 * summed
        return self.path.at(time + step / 2, 2) + fading, summed

    def _output(self, nu: np.ndarray, chi: np.ndarray, nu_dot: np.ndarray) -> np.ndarray:
        """(N,) torques of least norm, or the voltages that make them."""
        torque = self.plant.wheel_torques(self.plant.inverse_dynamics(nu, chi, nu_dot), chi)
        if self.follower.output == "torque":
            return torque
        return voltages_of(self.kernel, torque, self.plant.wheel_speeds(nu, chi))


def nu_dot_of(bound: Kernel, acceleration: np.ndarray, nu: np.ndarray, heading: float) -> np.ndarray:
    """(3,) the rates of nu that give the pose an acceleration (3,).

    The pose's rates are V(theta) nu: their rates are V nu' and what an accelerometer at S feels where nu' is 0.
    """
    vehicle = bound.vehicle
    rest = [0.0, 0.0, 0.0]
    turning = parts.accelerometer(
        vehicle.wheels, vehicle.rollers_per_wheel, vehicle.platform_radius, vehicle.yaw_scale, nu.tolist(), rest,
        rest[:2], float(heading), 0.0, 0.0, 0.0,
    )  # fmt: skip
    return nu_of_rates(bound, acceleration, heading) - np.array([*turning, 0.0]) / vehicle.platform_radius


def nu_of_rates(bound: Kernel, rates: np.ndarray, heading: float) -> np.ndarray:
    """nu (3,) of the pose's rates (3,) at a heading: (2.3) solved."""
    return np.linalg.solve(bound.pose_rates(np.eye(3), np.full(3, heading)).T, rates)

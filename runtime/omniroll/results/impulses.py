"""Impulses of the ground on the wheels at the switches of a run under the impact law."""

from dataclasses import dataclass

import numpy as np

from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import kernel
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.checks import refuse_kinds


@dataclass(frozen=True, eq=False)
class Impulses:
    """Impulses at the K switches of a run; a joint switch of several wheels is one. Arrays are read-only.

    t        (K,) times of the switches
    row      (K,) rows of the trajectory after them
    contact  (K, N, 2) in N s, of the ground on each wheel: along its axle, and along its rolling direction, which is
             the axle turned by a right angle against the clock seen from above

    An impact changes the speeds of all wheels, so that those that do not switch have impulses too. Normal impulses
    are not among them: the switching model keeps every wheel on the ground.
    """

    t: np.ndarray
    row: np.ndarray
    contact: np.ndarray

    def __post_init__(self) -> None:
        for array in (self.t, self.row, self.contact):
            array.flags.writeable = False


def impulses(trajectory: Trajectory) -> Impulses:
    """The impulses at the contacts at every switch of a trajectory.

    Raises InvalidValueError for what is not a trajectory, and for the law "smooth": there speeds pass a switch as the
    law says, and no impulses of the ground make them do so.
    """
    if not isinstance(trajectory, Trajectory):
        raise InvalidValueError("trajectory", trajectory, "must be a Trajectory")
    if trajectory.switching != "impact":
        raise InvalidValueError("switching", trajectory.switching, 'must be "impact": this law has no impulses')
    refuse_kinds(trajectory.vehicle, "trajectory", "impulses", "take wheels that are all alike")
    switched = (trajectory.contact[1:] != trajectory.contact[:-1]).any(axis=1)
    row = np.flatnonzero(switched) + 1
    entering = trajectory.contact[row][..., None]
    spins = trajectory.spins_by_roller()[row - 1]
    spin_before = np.take_along_axis(spins, entering, axis=-1)[..., 0]
    vehicle = trajectory.effects.equipped(trajectory.vehicle)
    bound = kernel(vehicle, trajectory.roller_model, "python", effects=("reactions",))
    contact = bound.call(
        "contact_impulses", trajectory.nu[row], trajectory.chi[row], trajectory.nu[row - 1], spin_before
    )
    return Impulses(trajectory.t[row], row, contact)

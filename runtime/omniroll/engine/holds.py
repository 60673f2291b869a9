"""Which bearings stick in the rows of a run, and what they leave to nu.

Bearings are those whose rates follow from nu: of the axles, then of the rollers in contact, where these may stick. The
direction of such a rate in nu never changes. So where some stick, nu has the directions that are
the columns of A with G A = 0, whatever the state is. Those of free rollers are in spin_holds.py.
"""

import numpy as np

from omniroll.effects.effect_set import BEARINGS, EffectSet
from omniroll.engine.axle_modes import bearing_of
from omniroll.engine.spin_holds import SpinHolds
from omniroll.kernels.kernel import Kernel
from omniroll.results.trajectory import Trajectory

PARALLEL = 1e-12  # sine of the angle below which rows are parallel, and a row lies in the span of others
AT_REST = 1e-11  # of the fastest that nu has been: rates of what sticks are rounding


def bearings_that_stick(effects: EffectSet) -> tuple[str, ...]:
    """The inputs of the kernel that are torques of bearings which may stick: of axles, of rollers in contact."""
    return tuple(name for name in BEARINGS if name in effects.drives())


class Holds:
    """The bearings (B,) of a run that may stick.

    names     the kernel's inputs that are their torques, N bearings each
    place     of their effect among those of the run
    rows      (B, 3) their rates for each of nu, where chi is 0
    sliding   (B,) in N m, torques of those that turn
    holding   (B,) in N m, the largest torques of those at rest
    modes     (T, B) in each row 0 where one sticks, else the sign of its rate: in a row where a step starts those of
              the step, in others those with which a phase ends
    sets      (H, B) bool: those that stick together
    which     (T,) the place of each row's set
    allowed   (H, 3, 3) A of each set, columns; 0 where there are fewer
    absent    (H, 3) 1 for each column that is 0, else 0
    spins     the bearings of free rollers, where these may stick; else None
    """

    def __init__(self, trajectory: Trajectory, plain: Kernel, names: tuple[str, ...]):
        self.names = names
        found = trajectory.effects.bearings(plain)
        self.place, _ = bearing_of(trajectory.effects, plain, next(iter(found)))
        contacts = plain.wheel_rates(np.eye(3), np.zeros(plain.wheels))[1].T
        rows = {"axle": plain.wheel_rows, "roller": contacts}
        self.rows = np.concatenate([rows[name] for name in found])
        self.sliding = np.concatenate([own.sliding for own in found.values()])
        self.holding = np.concatenate([own.holding for own in found.values()])
        self.spins = None
        if "roller" in found and plain.has_spins:
            self.spins = SpinHolds(trajectory, found["roller"], trajectory.effects.state_vector(plain).slices["spins"])
        self.modes = self._modes(trajectory)
        sticks = [row.tobytes() for row in self.modes == 0]
        places = {own: k for k, own in enumerate(dict.fromkeys(sticks))}
        self.which = np.array([places[own] for own in sticks])
        self.sets = np.array([np.frombuffer(own, bool) for own in places])
        self.allowed = np.array([directions_left(self.rows[sticking]) for sticking in self.sets])
        self.absent = (~self.allowed.any(axis=1)).astype(float)

    def _modes(self, trajectory: Trajectory) -> np.ndarray:
        lengths, wheels = np.linalg.norm(self.rows, axis=1), trajectory.vehicle.wheels
        rest = AT_REST * lengths * np.maximum.accumulate(np.linalg.norm(trajectory.nu, axis=1))[:, None]
        rates, first = trajectory.nu @ self.rows.T, trajectory.step_rows
        torques = trajectory.drive[:, [trajectory.effects.drives().index(name) for name in self.names]]
        taken = torques.reshape(len(trajectory), -1)
        at_rest = np.where(np.abs(taken) == self.sliding, -np.sign(taken), 0)
        modes = np.where(np.abs(rates) > rest, np.sign(rates), at_rest)  # of rows between two transitions
        if not len(first):
            return modes.astype(int)
        values = np.ascontiguousarray(trajectory.dense[:, :, : 3 + wheels].swapaxes(0, 1))
        inside = values[:, :, :3] @ self.rows.T
        sticks = np.abs(inside).max(axis=0) <= rest[first + 1]
        if "bearing_torque" in self.names:  # an angle that is held does not change at all
            sticks[:, :wheels] &= ~np.ptp(values[:, :, 3:], axis=0).astype(bool)
        of_steps = np.where(sticks, 0, np.sign(inside.mean(axis=0)))
        modes[first + 1] = of_steps
        modes[first] = of_steps
        return modes.astype(int)

    def at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take of what sticks in rows (...), by name: directions (..., 9), absent (..., 3);
        free_sticks (..., N, n-1) where free rollers may stick."""
        sets = self.which[rows]
        found = {"directions": self.allowed[sets].reshape(*sets.shape, 9), "absent": self.absent[sets]}
        return found if self.spins is None else found | {"free_sticks": (self.spins.modes[rows] == 0).astype(float)}


def tables_of(allowed: np.ndarray, absent: np.ndarray, turning: np.ndarray) -> np.ndarray:
    """(H, 12 + 9 Q) for C: directions (H, 3, 3) and which are absent (H, 3) in each set, and the slopes of the
    directions by Q numbers (H, Q, 3, 3)."""
    return np.concatenate([own.reshape(len(allowed), -1) for own in (allowed, absent, turning)], axis=1)


def unit_rows(rows: np.ndarray) -> np.ndarray:
    """The rows (m, 3) of length 1; rows of zeros stay."""
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(lengths > 0, lengths, 1.0)


def directions_left(rows: np.ndarray) -> np.ndarray:
    """(3, 3) orthonormal columns that span the nu which leave all rates `rows` nu at zero; 0 where there are fewer."""
    if not len(rows):
        return np.eye(3)
    _, sizes, basis = np.linalg.svd(unit_rows(rows))
    rank = np.count_nonzero(sizes > PARALLEL)
    columns = np.zeros((3, 3))
    columns[:, : 3 - rank] = basis[rank:].T
    return columns

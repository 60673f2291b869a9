"""Bearings that may stick in a run whose wheels roll: what C takes of them to follow deviations.

The bearings are those of the axles (N,), if these may stick, then those of the rollers, if these may, wheel by wheel:
that in contact, and where there are free ones these by place. How deviations pass what happens to them is computed in C
alone (csrc/deviations/saltations.c).
"""

from functools import cached_property

import numpy as np

from omniroll.engine.axle_modes import TORQUE
from omniroll.engine.events_beside import LETS_GO_ONLY_JUST, no_derivative
from omniroll.engine.holds import tables_of
from omniroll.engine.motion import Columns, Motion, first_with_modes
from omniroll.engine.roller_modes import FREE, IN_CONTACT
from omniroll.engine.standing import turned
from omniroll.engine.sticking import torques_of
from omniroll.errors import NoDerivativeError
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of

FIELDS = {TORQUE: "wheel", IN_CONTACT: "roller"}  # how the effect's numbers begin


class HoldDeviations:
    """The bearings (B,) of one run in P columns; of these (R,) have rates that follow from nu."""

    def __init__(self, motion: Motion, columns: Columns):
        self.motion, self.columns, self.holds = motion, columns, motion.holds
        self.plain, self.wheels = motion.plain, motion.plain.wheels

    def _all(self, of_nu: np.ndarray, of_free: np.ndarray | None) -> np.ndarray:
        """(..., B) of values of bearings whose rates follow from nu (..., R), and of free rollers (..., N, n-1)."""
        if IN_CONTACT not in self.holds.names:
            return of_nu
        of_axles, rollers = np.split(of_nu, [of_nu.shape[-1] - self.wheels], axis=-1)
        if of_free is not None:
            rollers = np.concatenate([rollers[..., None], of_free], axis=-1).reshape(*rollers.shape[:-1], -1)
        return np.concatenate([of_axles, rollers], axis=-1)

    def _of_modes(self, name: str) -> np.ndarray:
        """(..., B) what the modes call so."""
        return self._all(*(None if own is None else getattr(own, name) for own in (self.holds, self.holds.spins)))

    @cached_property
    def modes(self) -> np.ndarray:
        """(T, B) in each row 0 where one sticks, else the sign of its rate."""
        return self._of_modes("modes")

    @cached_property
    def sliding(self) -> np.ndarray:
        """(B,) in N m, torques of those that turn."""
        return self._of_modes("sliding")

    @cached_property
    def holding(self) -> np.ndarray:
        """(B,) in N m, the largest torques of those at rest."""
        return self._of_modes("holding")

    @cached_property
    def inertias(self) -> np.ndarray:
        """(B,) in kg m^2, which a torque moves: the vehicle's mass by the ground, or a free roller."""
        vehicle, spins = self.plain.vehicle, self.holds.spins
        of_nu = np.full(len(self.holds.sliding), vehicle.mass * vehicle.wheel_radius**2)
        return self._all(of_nu, None if spins is None else np.full(spins.sliding.shape, vehicle.roller_inertia))

    @cached_property
    def torques(self) -> tuple[np.ndarray, np.ndarray]:
        """(P, R) deviations of the torques of bearings that turn, and of the largest at rest."""
        moved = [torques_of(self.columns, FIELDS[name], self.holds.place) for name in self.holds.names]
        sliding, holding = (np.concatenate(own, axis=1) for own in zip(*moved, strict=True))
        return sliding, holding

    def _of_free(self, moved: np.ndarray) -> np.ndarray | None:
        """(P, N, n-1) the deviations (P, R) of the free rollers' bearings, which are those of rollers in contact."""
        if self.holds.spins is None:
            return None
        return np.repeat(moved[:, -self.wheels :, None], self.plain.rollers_per_wheel - 1, axis=2)

    @cached_property
    def most_moved(self) -> np.ndarray:
        """(P, B) deviations of the largest torques at rest."""
        return self._all(self.torques[1], self._of_free(self.torques[1]))

    def given(self, rows: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Deviations of value and slope (S, P, N) of the bearings' torques in the steps from rows (S,), by the input's
        name."""
        moved = -self.holds.modes[rows][:, None] * self.torques[0]
        parts = dict(zip(self.holds.names, np.split(moved, len(self.holds.names), axis=2), strict=True))
        if self.holds.spins is not None:
            parts[FREE] = -self.holds.spins.modes[rows][:, None] * self._of_free(self.torques[0])
        return {name: (part, np.zeros_like(part)) for name, part in parts.items()}

    def drive(self, name: str) -> np.ndarray:
        """(T, N) in N m, what generated functions take of the bearings: of those that turn, 0 where one sticks."""
        first = self.holds.names.index(name) * self.wheels
        own = slice(first, first + self.wheels)
        return -self.holds.modes[:, own] * self.holds.sliding[own]

    # What sticks leaves to nu

    @cached_property
    def turning_rows(self) -> np.ndarray:
        """(P, R, 3) how the numbers turn the rates for each of nu, where chi is 0."""
        kernel: TangentKernel = self.columns.kernel
        given = {
            TORQUE: lambda unit: kernel.call("wheel_speeds", unit),
            IN_CONTACT: lambda unit: kernel.call("wheel_rates", unit, np.zeros(self.wheels))[1],
        }
        found = np.zeros((len(self.columns), len(self.holds.rows), 3))
        for d, unit in enumerate(np.eye(3)):
            for k, name in enumerate(self.holds.names):
                found[:, k * self.wheels : (k + 1) * self.wheels, d] = tangent_of(given[name](unit))
        return found

    @cached_property
    def turning(self) -> np.ndarray:
        """(H, P, 3, 3) dA. Raises NoDerivativeError for a number by which what sticks would leave less to nu."""
        holds, lengths = self.holds, np.linalg.norm(self.holds.rows, axis=1)[:, None]
        rows, turning = holds.rows / lengths, self.turning_rows / lengths
        found = np.zeros((len(holds.sets), len(self.columns), 3, 3))
        for k, sticks in enumerate(holds.sets):
            found[k], left = turned(rows[sticks], turning[:, sticks], holds.allowed[k])
            if left.any():
                row = int(np.flatnonzero(holds.which == k)[0])
                names = ", ".join(np.array(self.columns.names)[left])
                reason = f"what sticks together would leave other directions; by {names}"
                raise self._none(row, reason, np.flatnonzero(sticks) % self.wheels)
        return found

    @cached_property
    def tables(self) -> np.ndarray:
        """(H, 12 + 9 Q) what C takes of the sets."""
        return tables_of(self.holds.allowed, self.holds.absent, self.turning[:, self.columns.numbered])

    # What happens

    @property
    def alone(self) -> np.ndarray:
        """(T,) bool: rows in which a step ends and the next one starts, with other modes."""
        spins = self.holds.spins
        return np.zeros(len(self.modes), bool) if spins is None else spins.alone

    rests_at_switches = np.zeros(0, int)  # what comes to rest just as a wheel switches leaves deviations as they are

    def refuse_rests(self, row: int) -> None:
        """There is none."""

    def refuse_orders(self, row: int, wheels: np.ndarray) -> None:
        """There is none."""

    def refuse(self, row: int, reason: str) -> None:
        """Raises NoDerivativeError: something changes its mode in a row, which C does not pass for this reason."""
        before, after = (row - 1, row) if self.alone[row] else (row, row + 1)
        if reason == LETS_GO_ONLY_JUST and first_with_modes(self.modes, before) == 0:
            elapsed = self.motion.trajectory.elapsed
            reason += (
                f"; or too little of its rise is seen, since the run, or this step of a session, began only "
                f"{elapsed[row] - elapsed[0]:.2g} s before: let it begin earlier, or behind the break-away"
            )
        raise self._none(row, reason, self._wheels_of(np.flatnonzero(self.modes[before] != self.modes[after])))

    def _wheels_of(self, bearings: np.ndarray) -> np.ndarray:
        """(k,) the wheels of bearings (k,)."""
        axles = self.wheels if TORQUE in self.holds.names else 0
        of_a_wheel = 1 if self.holds.spins is None else self.plain.rollers_per_wheel
        return np.where(bearings < axles, bearings, (bearings - axles) // of_a_wheel)

    def _none(self, row: int, reason: str, wheels: np.ndarray) -> NoDerivativeError:
        return no_derivative(self.motion.trajectory.t[row], reason, wheels)

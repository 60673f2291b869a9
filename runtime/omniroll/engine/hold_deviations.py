"""How deviations pass where bearings come to rest, stick and break away.

What sticks takes G nu away: the motions beside a run reach G nu = 0 a little earlier or later, and by forces that are
combinations of the rows of G alone. So behind such an instant, whatever the order in which several bearings have come
to rest, with the mass matrix M* and the directions A that are left,

    d+ = A (A^T M* A)^-1 A^T M* (d - q) + q,   G q = -dG nu:

the projection in the kinetic metric, of nu's deviation. The free rollers' axial speeds do not jump. Where a bearing
passes zero and goes on turning, or where one breaks away, rates jump at a time that deviates, d+ = d- + (f- - f+) dt,
with dt from the function whose zero that is: a rate, or the facet of what can be held (complementarity.py). Where
sliding and break-away torques are the same, rates do not jump at a break-away, and neither does the derivative.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from omniroll.effects.complementarity import Facets
from omniroll.engine.motion import Columns, Motion
from omniroll.errors import NoDerivativeError
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent

FIELDS = {"bearing_torque": "wheel", "contact_bearing": "roller"}  # how the effect's numbers begin
JUMPS = 1e-9  # of a rate: it does not jump by less
TOGETHER = 1e-9  # of the larger one: times that differ by less are the same
REACHED = 1e-6  # of what a facet takes: it has been reached
GRAZES = 1e-9  # of the rate that it could have: what passes zero more slowly grazes it


class HoldDeviations:
    """The deviations of one run in P columns, where its bearings come to rest and break away."""

    def __init__(self, motion: Motion, columns: Columns):
        self.motion, self.columns, self.holds = motion, columns, motion.holds
        self.trajectory, self.plain = motion.trajectory, motion.plain
        self.wheels = motion.plain.wheels

    # What numbers do to the rows G, to the directions A, and to the torques

    def _rows(self, kernel: TangentKernel, chi: np.ndarray) -> np.ndarray:
        """(..., B, 3) the rates for each of nu at chi (..., N), which carry tangents."""
        found = []
        for unit in np.eye(3):
            given = {
                "bearing_torque": lambda unit=unit: kernel.call("wheel_speeds", unit),
                "contact_bearing": lambda unit=unit: kernel.call("wheel_rates", unit, chi)[1],
            }
            parts = [given[name]() for name in self.holds.names]
            lead = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
            found.append(np.concatenate([np.broadcast_to(p, (*lead, p.shape[-1])) for p in parts], axis=-1))
        return np.stack(found, axis=-1)

    @cached_property
    def turning_rows(self) -> np.ndarray:
        """(P, B, 3) dG, where chi is 0."""
        return tangent_of(self._rows(self.columns.kernel, np.zeros(self.wheels)))

    @cached_property
    def turning(self) -> np.ndarray:
        """(H, P, 3, 3) dA. Raises NoDerivativeError for a number by which what sticks would leave less to nu."""
        holds = self.holds
        found = np.zeros((len(holds.sets), len(self.columns), 3, 3))
        lengths = np.linalg.norm(holds.rows, axis=1, keepdims=True)
        for k, sticking in enumerate(holds.sets):
            rows, turning = (holds.rows / lengths)[sticking], (self.turning_rows / lengths)[:, sticking]
            if not turning.any():
                continue
            asked = turning @ holds.allowed[k]
            found[k] = -np.linalg.pinv(rows) @ asked
            left = np.abs(rows @ found[k] + asked).max(axis=(1, 2)) > TOGETHER * np.abs(asked).max(axis=(1, 2))
            if left.any():
                row = int(np.flatnonzero(holds.which == k)[0])
                names = ", ".join(np.array(self.columns.names)[left])
                raise self._none(row, f"what sticks together would leave other directions; by {names}", sticking)
        return found

    def held(self, rows: np.ndarray) -> tuple[Mapping, Mapping]:
        """What generated functions take of the sets in rows (k,), by name; and the same with the tangents of the Q
        numbers that these functions know, (Q, k, ...)."""
        found = self.holds.at(rows)
        turning = self.turning[self.holds.which[rows]][:, self.columns.numbered]
        turned = with_tangent(found["directions"], np.moveaxis(turning.reshape(*turning.shape[:2], 9), 1, 0))
        return found, found | {"directions": turned}

    @cached_property
    def tables(self) -> np.ndarray:
        """(H, 12 + 9 Q) for C: directions and absent of each set, and the slopes of the directions by the numbers."""
        holds, turning = self.holds, self.turning[:, self.columns.numbered]
        parts = (holds.allowed.reshape(-1, 9), holds.absent, turning.reshape(len(turning), -1))
        return np.concatenate(parts, axis=1)

    @cached_property
    def torques(self) -> tuple[np.ndarray, np.ndarray]:
        """(P, B) deviations of the torques of bearings that turn, and of the largest at rest."""
        own = self.columns.signals
        sliding, holding = [], []
        for name in self.holds.names:
            zero = np.zeros((len(self.columns), self.wheels))
            coulomb, most = (
                own.get((self.holds.place, f"{FIELDS[name]}_{what}"), zero) for what in ("coulomb", "break_away")
            )
            given = getattr(self.columns.effects[self.holds.place], f"{FIELDS[name]}_break_away") is not None
            sliding.append(coulomb)
            holding.append(most if given else coulomb)
        return np.concatenate(sliding, axis=1), np.concatenate(holding, axis=1)

    def given(self, rows: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Deviations of value and slope (S, P, N) of the bearings' torques in the steps from rows (S,), by the input's
        name."""
        moved = -self.holds.modes[rows][:, None] * self.torques[0]
        parts = np.split(moved, len(self.holds.names), axis=2)
        return {name: (part, np.zeros_like(part)) for name, part in zip(self.holds.names, parts, strict=True)}

    # Transitions

    @cached_property
    def enters(self) -> np.ndarray:
        """(T,) bool: whether bearings stick in the step from a row, in which the step before has not held the same."""
        holds, starts = self.holds, self.motion.starts_step
        same = np.append(False, starts[:-1] & (holds.which[:-1] == holds.which[1:]))
        return starts & holds.sets.any(axis=1)[holds.which] & ~same

    def projected(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which what sticks in a row leaves those before it."""
        holds, motion = self.holds, self.motion
        k, nu = holds.which[row], motion.y[row, :3]
        mass = self.plain.mass_matrix(motion.vector.view(motion.y[row], "chi"))
        A = holds.allowed[k]
        beside = (self.turning[k] @ (A.T @ nu)).T
        found = np.array(moved)
        found[:3] = beside + A @ np.linalg.solve(
            A.T @ mass @ A + np.diag(holds.absent[k]), A.T @ mass @ (moved[:3] - beside)
        )
        if "spins" in motion.deviations.rates:
            chi, still = motion.vector.view(motion.y[row], "chi"), np.zeros(motion.vector.shapes["spins"])
            jump = self.plain.spins_from_axial((found - moved)[:3].T, chi, still)
            found[motion.deviations.places["spins"].ravel()] += jump.reshape(len(self.columns), -1).T
        return found

    @cached_property
    def changes(self) -> np.ndarray:
        """(T - 1,) bool: whether bearings stop or break away between a row and the next, where no time passes."""
        return (self.holds.modes[:-1] != self.holds.modes[1:]).any(axis=1) & ~self.motion.starts_step[:-1]

    def passed(self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after bearings have changed their modes between a row and the next.

        knot    (P,) by how much the time deviates at which a drive jumps there; None where none does
        inputs  (U, 1 + P) how fast the phase's inputs change, and their deviations
        """
        before, after = self.holds.modes[row : row + 2]
        changed = before != after
        if not (changed & ((before == 0) | (after != 0))).any() and knot is None:
            return self.projected(row + 1, moved)
        rates = self.motion.rates[row : row + 2]
        jump = rates[0] - rates[1]
        if np.abs(jump[:3]).max() <= JUMPS * np.abs(rates[:, :3]).max():
            return moved
        stopped = changed & (before != 0)
        if stopped.any():
            times = self._times_of_stops(row, moved, np.flatnonzero(stopped))
        elif self._inputs_jump(row):
            times = np.zeros((1, len(self.columns))) if knot is None else knot[None]
        else:
            times = self._times_of_release(row, moved, inputs)
        if stopped.any() and knot is not None:
            times = np.concatenate([times, knot[None]])
        apart = np.ptp(times, axis=0) > TOGETHER * np.abs(times).max(axis=0)
        if apart.any():
            names = ", ".join(np.array(self.columns.names)[apart])
            reason = f"several bearings stop or break away together, and apart where a number changes; by {names}"
            raise self._none(row, reason, changed)
        return moved + jump[:, None] * times[0]

    def _inputs_jump(self, row: int) -> bool:
        """Whether drives jump between a row and the next."""
        names = self.trajectory.effects.drives()
        own = [k for k, name in enumerate(names) if name not in self.holds.names]
        return not np.array_equal(*self.trajectory.drive[row : row + 2, own])

    def _times_of_stops(self, row: int, moved: np.ndarray, which: np.ndarray) -> np.ndarray:
        """(k, P) by how much the times deviate at which the rates of turning bearings come to zero."""
        rows, nu, rates = self.holds.rows[which], self.motion.y[row, :3], self.motion.rates[row, :3]
        slopes = rows @ rates
        slow = np.abs(slopes) <= GRAZES * np.linalg.norm(rows, axis=1) * np.linalg.norm(rates)
        if slow.any():
            raise self._none(row, "a bearing comes to rest and turns on without any acceleration", which[slow])
        return -(rows @ moved[:3] + (self.turning_rows[:, which] @ nu).T) / slopes[:, None]

    def _times_of_release(self, row: int, moved: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """(k, P) the same of the facets that are reached: of the power that they lack, excess = n . h - sum S |G n|."""
        motion, holds = self.motion, self.holds
        sticking = holds.modes[row] == 0
        columns = Columns(self.trajectory, self.columns.names, others=1)  # the first is that of the time
        kernel = columns.kernel
        force, rows = self._held(row, kernel, np.concatenate([motion.rates[row][:, None], moved], axis=1), inputs)
        rows, turning = rows.real[0][sticking], tangent_of(rows)[:, sticking]
        bounds = holds.holding[sticking]
        facets = Facets.of(rows, bounds)
        excess, slopes = facets.excess(force.real[0]), []
        holding = np.concatenate([np.zeros((1, len(holds.sliding))), self.torques[1]])[:, sticking]
        reached = np.flatnonzero(excess >= -REACHED * facets.reach)
        for n, rates in zip(facets.normals[reached], facets.moved[reached], strict=True):
            rests = rates == 0
            turn = -np.einsum("ij,pj->pi", np.linalg.pinv(rows[rests]), turning[:, rests] @ n)
            faster = np.sign(rates) * (turning @ n + turn @ rows.T)
            slopes.append(tangent_of(force) @ n + turn @ force.real[0] - holding @ np.abs(rates) - faster @ bounds)
        found = np.array(slopes)
        if not len(found) or not (found[:, 0] > 0).all():
            raise self._none(row, "what holds a bearing only just comes to its bound", sticking)
        return -found[:, 1:] / found[:, :1]

    def _held(
        self, row: int, kernel: TangentKernel, moved: np.ndarray, inputs: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(1 + P, 3) the force that holds what sticks, and (1 + P, B, 3) the rows, carrying tangents."""
        motion, deviations = self.motion, self.motion.deviations
        y = with_tangent(motion.y[row], motion.whole(moved.T))
        given = with_tangent(motion.inputs[row], inputs.T)
        for name, modes in zip(self.holds.names, np.split(self.holds.modes[row], len(self.holds.names)), strict=True):
            given[:, deviations.views(np.arange(given.shape[1]))[name][modes == 0]] = 0.0
        turned = np.concatenate([np.zeros((1, 3, 3)), self.turning[self.holds.which[row]]])
        held = self.holds.at(np.array(row))
        known: Mapping = {
            "directions": with_tangent(held["directions"], turned.reshape(-1, 9)), "absent": held["absent"]
        }  # fmt: skip
        found = deviations.known_of(kernel, y, given, known)
        return found["held_force"], self._rows(kernel, found["chi"])

    def _none(self, row: int, reason: str, bearings: np.ndarray) -> NoDerivativeError:
        places = np.flatnonzero(bearings) if bearings.dtype == bool else bearings
        wheels = tuple(sorted({int(place) % self.wheels for place in places}))
        return NoDerivativeError(reason, t=float(self.trajectory.t[row]), wheels=wheels)

"""How deviations pass where bearings come to rest, stick and break away.

What sticks takes G nu away: the motions beside a run reach G nu = 0 a little earlier or later, and by forces that are
combinations of the rows of G alone. So behind such an instant, whatever the order in which several bearings have come
to rest, with the mass matrix M* and the directions A that are left,

    d+ = A (A^T M* A)^-1 A^T M* (d - q) + q,   G q = -dG nu:

the projection in the kinetic metric, of nu's deviation. The free rollers' axial speeds do not jump, but for those of
rollers that stick: each is one more row G, its spin, and its inertia and its momentum go to nu (`stuck_momenta`, from
maxima/effects/roller_sticking.mac). Where a bearing passes zero and goes on turning, or where one breaks away, rates
jump at a time that deviates, d+ = d- + (f- - f+) dt, with dt from the function whose zero that is: a rate, the facet
of what can be held (complementarity.py), or what holds a free roller. Where sliding and break-away torques are the
same, rates do not jump at a break-away, and neither does the derivative.

Where a rate comes to zero without any acceleration, or what holds comes to its bound and goes back, the motions on one
side of the run stick, or break away, and those on the other side do not: there is no derivative.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from omniroll.engine.events_beside import GRAZES, JUMPS, REACHED, TOGETHER, apart, no_derivative
from omniroll.engine.facets import Facets
from omniroll.engine.holds import tables_of
from omniroll.engine.motion import Columns, Motion, first_with_modes
from omniroll.errors import NoDerivativeError
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent

AXLES = "bearing_torque"
FIELDS = {AXLES: "wheel", "contact_bearing": "roller"}  # how the effect's numbers begin

Inputs = Callable[[], np.ndarray]


class HoldDeviations:
    """The deviations of one run in P columns, where its bearings come to rest and break away.

    in_c  what the run's library computes for it; the caller gives it
    """

    def __init__(self, motion: Motion, columns: Columns):
        self.motion, self.columns, self.holds = motion, columns, motion.holds
        self.trajectory, self.plain = motion.trajectory, motion.plain
        self.wheels = motion.plain.wheels
        self.in_c: InC

    # What numbers do to the rows G, to the directions A, and to the torques

    def _rows(self, kernel: TangentKernel, chi: np.ndarray) -> np.ndarray:
        """(..., B, 3) the rates for each of nu at chi (..., N), which carry tangents."""
        found = []
        for unit in np.eye(3):
            given = {
                AXLES: lambda unit=unit: kernel.call("wheel_speeds", unit),
                "contact_bearing": lambda unit=unit: kernel.call("wheel_rates", unit, chi)[1],
            }
            parts = [given[name]() for name in self.holds.names]
            lead = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
            found.append(np.concatenate([np.broadcast_to(p, (*lead, p.shape[-1])) for p in parts], axis=-1))
        return np.stack(found, axis=-1)

    @cached_property
    def turning_rows(self) -> np.ndarray:
        """(P, B, 3) dG, where chi is 0."""
        if self.holds.names != (AXLES,):
            return tangent_of(self._rows(self.columns.kernel, np.zeros(self.wheels)))
        found = np.zeros((len(self.columns), self.wheels, 3))
        found[self.columns.numbered] = self.in_c.turning_rows()
        return found

    @cached_property
    def _lengths(self) -> np.ndarray:
        """(B,) of the rows G."""
        return np.linalg.norm(self.holds.rows, axis=1)

    @cached_property
    def turning(self) -> np.ndarray:
        """(H, P, 3, 3) dA. Raises NoDerivativeError for a number by which what sticks would leave less to nu."""
        holds = self.holds
        lengths, sticking = self._lengths[:, None], holds.sets[:, :, None]
        rows = np.where(sticking, holds.rows / lengths, 0.0)[:, None]  # (H, 1, B, 3), 0 of those that turn
        turning = np.where(sticking[:, None], self.turning_rows / lengths, 0.0)
        asked = turning @ holds.allowed[:, None]
        found = -np.linalg.pinv(rows) @ asked
        sizes = np.abs(turning).max(axis=(2, 3))
        left = np.abs(rows @ found + asked).max(axis=(2, 3)) > TOGETHER * sizes
        for k in np.flatnonzero(left.any(axis=1)):
            row = int(np.flatnonzero(holds.which == k)[0])
            names = ", ".join(np.array(self.columns.names)[left[k]])
            raise self._none(row, f"what sticks together would leave other directions; by {names}", holds.sets[k])
        return found

    @cached_property
    def tables(self) -> np.ndarray:
        """(H, 12 + 9 Q) what C takes of the sets."""
        return tables_of(self.holds.allowed, self.holds.absent, self.turning[:, self.columns.numbered])

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

    @cached_property
    def torques_of_spins(self) -> tuple[np.ndarray, np.ndarray]:
        """(P, F) the same as `torques`, of the free rollers' bearings, which are those of rollers in contact."""
        wheels = slice(len(self.holds.sliding) - self.wheels, None)
        sliding, holding = (own[:, wheels] for own in self.torques)
        slots = self.plain.rollers_per_wheel - 1
        return np.repeat(sliding, slots, axis=1), np.repeat(holding, slots, axis=1)

    def given_to_spins(self, rows: np.ndarray) -> np.ndarray:
        """(S, P, F) deviations of the torques of the free rollers' bearings in the steps from rows (S,)."""
        return -self.holds.spins.modes[rows].reshape(len(rows), 1, -1) * self.torques_of_spins[0]

    # Transitions

    @cached_property
    def modes(self) -> np.ndarray:
        """(T, B + F) of all bearings in each row: those of free rollers are the last."""
        holds = self.holds
        if holds.spins is None:
            return holds.modes
        return np.concatenate([holds.modes, holds.spins.modes.reshape(len(holds.modes), -1)], axis=1)

    @cached_property
    def enters(self) -> np.ndarray:
        """(T,) bool: whether bearings stick in the step from a row, in which the step before has not held the same."""
        starts, sticks = self.motion.starts_step, self.modes == 0
        same = np.append(False, starts[:-1] & (sticks[:-1] == sticks[1:]).all(axis=1))
        return starts & sticks.any(axis=1) & ~same

    @cached_property
    def left_to_do(self) -> np.ndarray:
        """(T,) int32, not 0 in the rows in which something happens as a step begins: 1 where nothing but free rollers
        changes, which a library may look at. Who has done it makes 0 of it."""
        alone = np.full(len(self.modes), self.holds.spins is not None)
        alone[1:] &= ~self.motion.starts_step[:-1] | (self.holds.modes[1:] == self.holds.modes[:-1]).all(axis=1)
        return np.where(self.enters | self.turns_alone, np.where(alone, 1, -1), 0).astype(np.int32)

    @cached_property
    def meets(self) -> np.ndarray:
        """(k,) the rows in which deviations may meet bearings that have begun to stick, or that stick no more."""
        return np.flatnonzero(self.enters | self.turns_alone | np.append(False, self.changes))

    @cached_property
    def rates(self) -> np.ndarray:
        """(T, m) the rates of what deviates, in those rows and in the ones before them."""
        rows = np.unique(np.concatenate([self.meets, self.meets - 1]).clip(min=0))
        found = np.zeros((len(self.trajectory), len(self.motion.deviations.state)))
        found[rows] = self.in_c.rates(rows)
        return found

    @cached_property
    def _met(self) -> tuple[np.ndarray, np.ndarray]:
        """(k, 3, 3) the mass matrices in the rows `meets`, and what they let forces do."""
        mass = self.plain.mass_matrix(self.motion.vector.view(self.motion.y[self.meets], "chi"))
        return mass, self._yields(self.meets, mass)

    def _yields(self, rows: np.ndarray, mass: np.ndarray) -> np.ndarray:
        """(k, 3, 3) A (A^T M* A)^-1 A^T, where what sticks is as in rows (k,): what forces do to nu."""
        sets = self.holds.which[rows]
        A = self.holds.allowed[sets]
        back = A.swapaxes(1, 2)
        return A @ np.linalg.solve(back @ mass @ A + self.holds.absent[sets][:, :, None] * np.eye(3), back)

    def projected(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which what sticks in a row leaves those before it."""
        holds, motion = self.holds, self.motion
        k, nu, chi = holds.which[row], motion.y[row, :3], motion.vector.view(motion.y[row], "chi")
        if holds.spins is None:
            mass, yields = (own[np.searchsorted(self.meets, row)] for own in self._met)
            pull = mass @ moved[:3]
        else:
            stuck = (holds.spins.modes[row] == 0).ravel()
            mass, pull = self._with_stuck_spins(chi, moved, stuck)
            (yields,) = self._yields(np.array([row]), mass[None])
        beside = (self.turning[k] @ (holds.allowed[k].T @ nu)).T
        found = np.array(moved)
        found[:3] = beside + yields @ (pull - mass @ beside)
        if "spins" in motion.deviations.rates:
            still = np.zeros(motion.vector.shapes["spins"])
            jump = self.plain.spins_from_axial((found - moved)[:3].T, chi, still)
            found[self._places_of_spins()] += jump.reshape(len(self.columns), -1).T
        if holds.spins is not None:
            found[self._places_of_spins()[stuck]] = 0.0
        return found

    def _places_of_spins(self) -> np.ndarray:
        return self.motion.deviations.places["spins"].ravel()

    def _with_stuck_spins(self, chi: np.ndarray, moved: np.ndarray, stuck: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(3, 3) the mass matrix with the free rollers that stick, stuck (F,); (3, P) the momenta of the deviations."""
        spins = moved[self._places_of_spins()].T.reshape(len(self.columns), *self.motion.vector.shapes["spins"])
        mass, own = self.plain.call("stuck_momenta", chi, spins, stuck.reshape(spins.shape[1:]).astype(float))
        pull = mass[0] @ moved[:3]
        pull[2] += own
        return mass[0], pull

    def entered(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(m, P) the same where the step from this row begins."""
        if self._follows_a_step(row):
            stopped = np.flatnonzero((self.modes[row - 1] != 0) & (self.modes[row] == 0))
            if len(stopped):
                self._refuse_grazing(self._event_alone(row), stopped)
        return self.projected(row, moved)

    def _follows_a_step(self, row: int) -> bool:
        """Whether a step ends in the row in which another one starts."""
        return row > 0 and bool(self.motion.starts_step[row - 1])

    @cached_property
    def changes(self) -> np.ndarray:
        """(T - 1,) bool: whether bearings stop or break away between a row and the next, where no time passes."""
        return (self.modes[:-1] != self.modes[1:]).any(axis=1) & ~self.motion.starts_step[:-1]

    @cached_property
    def turns_alone(self) -> np.ndarray:
        """(T,) bool: whether free rollers turn back or break away in a row that ends one step and starts the next."""
        if self.holds.spins is None:
            return np.zeros(len(self.modes), bool)
        goes_on = (self.modes[1:] != self.modes[:-1]) & (self.modes[1:] != 0)
        return self.holds.spins.alone & np.append(False, goes_on.any(axis=1))

    def turned(self, row: int, moved: np.ndarray, inputs: Inputs) -> np.ndarray:
        """(m, P) the deviations after free rollers have turned back or broken away in a row."""
        return self._after(self._event_alone(row), moved, None, inputs)

    def _event_alone(self, row: int) -> "Event":
        """The event in a row in which a step ends and the next one starts."""
        motion = self.motion
        given = np.array(motion.inputs[row])
        if self.holds.spins is not None:
            motion.deviations.views(given)["free_bearing"][...] = self.holds.spins.torques[row - 1]
        before = motion.rates_in(motion.y[row], given, np.array(row - 1))
        return Event(row, row - 1, row, np.stack([before, self.rates[row]]), given)

    def passed(self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: Inputs) -> np.ndarray:
        """(m, P) the deviations after bearings have changed their modes between a row and the next.

        knot    (P,) by how much the time deviates at which a drive jumps there; None where none does
        inputs  gives (U, 1 + P) how fast the phase's inputs change, and their deviations
        """
        before, after = self.modes[row : row + 2]
        changed = before != after
        event = Event(row, row, row + 1, self.rates[row : row + 2], self.motion.inputs[row])
        if not (changed & ((before == 0) | (after != 0))).any() and knot is None:
            if not self._inputs_jump(row):
                self._refuse_grazing(event, np.flatnonzero(changed))
            self.left_to_do[row + 1] = 0  # the same is done where the step begins
            return self.projected(row + 1, moved)
        return self._after(event, moved, knot, inputs)

    def _after(self, event: "Event", moved: np.ndarray, knot: np.ndarray | None, inputs: Inputs) -> np.ndarray:
        """(m, P) the deviations after an event at which rates jump."""
        if not self._jumps(event.rates):
            return moved
        row, before, after = event.row, self.modes[event.before], self.modes[event.after]
        changed = before != after
        stopped = changed & (before != 0)
        if stopped.any():
            times = self._times_of_stops(event, moved, np.flatnonzero(stopped))
        elif self._inputs_jump(row):
            times = np.zeros((1, len(self.columns))) if knot is None else knot[None]
        else:
            times = self._times_of_release(event, moved, inputs())
        if stopped.any() and knot is not None:
            times = np.concatenate([times, knot[None]])
        names = apart(self.columns.names, times)
        if names:
            reason = f"several bearings stop or break away together, and apart where a number changes; by {names}"
            raise self._none(row, reason, changed)
        return moved + (event.rates[0] - event.rates[1])[:, None] * times[0]

    def _jumps(self, rates: np.ndarray) -> bool:
        """Whether rates (2, m) jump: those of nu, or of free rollers."""
        parts = [rates[:, :3]] + ([rates[:, self._places_of_spins()]] if self.holds.spins is not None else [])
        return any(np.abs(part[0] - part[1]).max() > JUMPS * np.abs(part).max() for part in parts)

    def _inputs_jump(self, row: int) -> bool:
        """Whether drives jump between a row and the next."""
        return not self.motion.starts_step[row] and self.motion.drives_jump(row, self.holds.names)

    def _times_of_stops(self, event: "Event", moved: np.ndarray, which: np.ndarray) -> np.ndarray:
        """(k, P) by how much the times deviate at which the rates of turning bearings come to zero."""
        slopes, nu = self._refuse_grazing(event, which), self.motion.y[event.row, :3]
        rests = self.holds.rows @ moved[:3] + (self.turning_rows @ nu).T
        if self.holds.spins is not None:
            rests = np.concatenate([rests, moved[self._places_of_spins()]])
        return -rests[which] / slopes[:, None]

    def _refuse_grazing(self, event: "Event", which: np.ndarray) -> np.ndarray:
        """(k,) the accelerations with which some bearings (k,) come to zero; raises NoDerivativeError for none."""
        rows, rates = self.holds.rows, event.rates[0]
        slopes, fastest = rows @ rates[:3], self._lengths * np.linalg.norm(rates[:3])
        if self.holds.spins is not None:
            spins = rates[self._places_of_spins()]
            slopes = np.append(slopes, spins)
            fastest = np.append(fastest, np.full(len(spins), np.abs(spins).max()))
        slow = which[np.abs(slopes[which]) <= GRAZES * fastest[which]]
        if len(slow):
            reason = "a bearing only just comes to rest, so that a change however small lets it turn on"
            raise self._none(event.row, reason, slow)
        return slopes[which]

    def _times_of_release(self, event: "Event", moved: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """(k, P) the same of what is reached: facets, and the torques of free rollers."""
        columns = self._behind_time
        rates = np.concatenate([event.rates[0][:, None], moved], axis=1)
        found = self._held(event, columns.kernel, rates, inputs)
        parts = [self._slopes_of_facets(event, columns.kernel, found)]
        if self.holds.spins is not None:
            parts.append(self._slopes_of_spins(event, found["free_holding"]))
        slopes, bounds = (np.concatenate(own) for own in zip(*parts, strict=True))
        if not len(slopes) or not (slopes[:, 0] * self._time_of_hold(event) > GRAZES * bounds).all():
            raise self._none(event.row, self._why_unknown(event), self.modes[event.before] == 0)
        return -slopes[:, 1:] / slopes[:, :1]

    @cached_property
    def _behind_time(self) -> Columns:
        """The columns behind that of the time."""
        return self.columns.behind_another(self.trajectory)

    def _time_of_hold(self, event: "Event") -> float:
        """For how long the bearings have had the modes before an event."""
        return self._time_in_modes(event.row, event.before)

    def _time_in_modes(self, row: int, before: int) -> float:
        elapsed = self.trajectory.elapsed
        return float(elapsed[row] - elapsed[first_with_modes(self.modes, before)])

    @cached_property
    def held_for(self) -> np.ndarray:
        """(T,) the same in rows in which a step ends and free rollers turn on in the next one; else 0."""
        found = np.zeros(len(self.modes))
        for row in np.flatnonzero(self.turns_alone):
            found[row] = self._time_in_modes(row, row - 1)
        return found

    def _why_unknown(self, event: "Event") -> str:
        """Why what holds bearings rises too little before an event: what is known of it begins with the piece."""
        reason = "what holds a bearing only just comes to its bound, so that a change however small lets it stick on"
        if first_with_modes(self.modes, event.before) == 0:
            reason += (
                f"; or too little of its rise is seen, since the run, or this step of a session, began only "
                f"{self._time_of_hold(event):.2g} s before: let it begin earlier, or behind the break-away"
            )
        return reason

    def _slopes_of_facets(
        self, event: "Event", kernel: TangentKernel, found: Mapping[str, np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """(k, 1 + P) of the power that facets lack, excess = n . h - sum S |G n|, of those that are reached; and (k,)
        what these take."""
        sticking = self.holds.modes[event.before] == 0
        if not sticking.any():
            return np.zeros((0, 1 + len(self.columns))), np.zeros(0)
        force, rows = found["held_force"], self._rows(kernel, found["chi"])
        rows, turning = rows.real[0][sticking], tangent_of(rows)[:, sticking]
        bounds = self.holds.holding[sticking]
        facets = Facets.of(rows, bounds)
        excess, slopes = facets.excess(force.real[0]), []
        holding = np.concatenate([np.zeros((1, len(self.holds.sliding))), self.torques[1]])[:, sticking]
        reached = np.flatnonzero(excess >= -REACHED * facets.reach)
        for n, rates in zip(facets.normals[reached], facets.moved[reached], strict=True):
            rests = rates == 0
            turn = -np.einsum("ij,pj->pi", np.linalg.pinv(rows[rests]), turning[:, rests] @ n)
            faster = np.sign(rates) * (turning @ n + turn @ rows.T)
            slopes.append(tangent_of(force) @ n + turn @ force.real[0] - holding @ np.abs(rates) - faster @ bounds)
        return np.array(slopes).reshape(-1, 1 + len(self.columns)), facets.reach[reached]

    def _slopes_of_spins(self, event: "Event", torques: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(k, 1 + P) of |torque| - S of the free rollers that stick, of those that are reached; and (k,) S."""
        spins = self.holds.spins
        torques, bounds = torques.reshape(len(torques), -1), spins.holding.ravel()
        own = np.abs(torques[0].real)
        reached = (spins.modes[event.before] == 0).ravel() & (own >= (1 - REACHED) * bounds)
        holding = np.concatenate([np.zeros((1, len(bounds))), self.torques_of_spins[1]])
        return (np.sign(torques[0].real) * tangent_of(torques) - holding)[:, reached].T, bounds[reached]

    def _held(
        self, event: "Event", kernel: TangentKernel, moved: np.ndarray, inputs: np.ndarray
    ) -> dict[str, np.ndarray]:
        """What generated functions give of the state at the event, carrying tangents, with what sticks before it."""
        motion, deviations, before = self.motion, self.motion.deviations, np.array(event.before)
        y = with_tangent(motion.y[event.row], motion.whole(moved.T))
        given = with_tangent(event.inputs, inputs.T)
        modes = self.holds.modes[event.before]
        for name, own in zip(self.holds.names, np.split(modes, len(self.holds.names)), strict=True):
            given[:, deviations.views(np.arange(given.shape[1]))[name][own == 0]] = 0.0
        turned = np.concatenate([np.zeros((1, 3, 3)), self.turning[self.holds.which[event.before]]])
        held = self.holds.at(before)
        known = held | {"directions": with_tangent(held["directions"], turned.reshape(-1, 9))}
        return deviations.known_of(kernel, y, given, known)

    def _none(self, row: int, reason: str, bearings: np.ndarray) -> NoDerivativeError:
        places = np.flatnonzero(bearings) if bearings.dtype == bool else bearings
        plane, slots = len(self.holds.sliding), self.plain.rollers_per_wheel - 1
        wheels = {int(place) % self.wheels if place < plane else int(place - plane) // slots for place in places}
        return no_derivative(self.trajectory.t[row], reason, wheels)


@dataclass(frozen=True)
class InC:
    """What a library computes for holds.

    turning_rows  gives (Q, N, 3) how the wheels' rates for each of nu move with the numbers
    rates         of rows (k,) gives (k, m) the rates of what deviates
    """

    turning_rows: Callable[[], np.ndarray]
    rates: Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Event:
    """An instant at which bearings change their modes.

    row            of its state
    before, after  rows that have the modes before and after it
    rates          (2, m) of what deviates, before and after it
    inputs         (U,) what the phase before it was given
    """

    row: int
    before: int
    after: int
    rates: np.ndarray
    inputs: np.ndarray

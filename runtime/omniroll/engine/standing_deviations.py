"""How deviations pass where contacts and bearings stick side by side, under Coulomb's friction on the ground.

What holds for contacts (contact_deviations.py) holds for axles and rollers beside them, with torques in the place of
forces: what comes to rest does so by its own force or torque alone, so that

    d* = d- - R W^-1 ds                              (ds: of the slips, rates and spins that have come to rest)

whatever their order. A wheel stands along its rolling direction where its contact and its axle stick, and along its
axle where its contact and its roller do; it takes that direction from nu. Where several wheels stand W may have no
inverse, but what is left of d does not depend on the choice among the forces that take ds away. Where other modes
change as well, d+ = d* + (f* - f+) dt, with the rates f* of what has come to rest and sticks.

What lets go does so at

    d+ = d- + (f- - f+) dt,   dt = -d excess / excess'.

The forces on wheels that stand follow from what holds nu, as far as they are determined. What comes to its bound where
such a wheel lets go is the least use of the contacts and bearings that hold them all (least_use_slopes.py). Loads that
follow the motion are solved for with the accelerations, and are numbers of that problem.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from omniroll.engine.bearing_deviations import BearingDeviations
from omniroll.engine.contact_deviations import ContactDeviations
from omniroll.engine.events_beside import GRAZES, JUMPS, REACHED
from omniroll.engine.holds import tables_of
from omniroll.engine.least_use_slopes import slopes_of_use
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.standing import SAME, Standing, leaving, rows_of_standing, stands_of, turned
from omniroll.errors import NoDerivativeError
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent


class BearingsBesideContacts(BearingDeviations):
    """The bearings of one run; what happens to them is told with the contacts."""

    def __init__(self, motion: Motion, columns: Columns):
        super().__init__(motion, columns, motion.axles, motion.rollers or motion.strips)
        self.standing: Standing = motion.standing
        self.changes = np.zeros(len(self.modes) - 1, bool)
        self.turns_alone = np.zeros(len(self.modes), bool)

    def held(self, rows: np.ndarray) -> tuple[Mapping, Mapping]:
        """The same with the directions that standing wheels leave, and how the numbers turn these, (Q, k, 9)."""
        return self.at(rows) | self.standing.at(rows), self.carried(rows, self.columns.numbered)

    def began(self, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which a run starts, as they are."""
        return moved

    def stilled(self, row: int, moved: np.ndarray, stops: np.ndarray) -> np.ndarray:
        """(m, P) without what rounding has left of the rates of some bearings."""
        found = np.array(moved)
        found[self.speeds[stops]] -= self.turning(row, moved)[:, stops].T
        return found

    @cached_property
    def turning_rows(self) -> np.ndarray:
        """(P, N, 2, 3) how the numbers turn the directions in which wheels may stand."""
        return tangent_of(rows_of_standing(self.columns.kernel))

    @cached_property
    def turning_directions(self) -> np.ndarray:
        """(H, P, 3, 3) how the numbers turn what each set of standing wheels leaves to nu."""

        def refused(row: int, numbers: np.ndarray) -> NoDerivativeError:
            names = ", ".join(np.array(self.columns.names)[numbers])
            stuck = self.modes[row] == 0
            return self.none(row, f"what sticks together would leave other directions; by {names}", stuck)

        return self.standing.turning(self.turning_rows, refused)

    @cached_property
    def tables(self) -> np.ndarray:
        """(H, 12 + 9 Q) what C takes of the sets that stand."""
        allowed, turning = self.standing.allowed, self.turning_directions[:, self.columns.numbered]
        return tables_of(allowed, leaving(allowed)["absent"], turning)

    @cached_property
    def numbers(self) -> tuple[np.ndarray, np.ndarray]:
        """(2 + 6 N,) what C takes of the wheels that may stand: radius; distance from the axes of rollers to the ground
        in their middles, if these stick; rows. And (P, 2 + 6 N) how these move."""
        kernel = self.columns.kernel
        carried = [np.ravel(kernel.constant("wheel_radius"))] * 2
        if self.rollers is not None:
            carried[1] = kernel.call("contact_reaches", np.zeros(self.wheels))[..., 0]
        given = [own[0].real for own in carried]
        moved = [tangent_of(own)[:, None] for own in carried] + [self.turning_rows.reshape(len(self.columns), -1)]
        return np.concatenate([given, self.standing.rows.ravel()]), np.concatenate(moved, axis=1)

    def carried(self, rows: np.ndarray, columns: np.ndarray | slice = slice(None)) -> dict[str, np.ndarray]:
        found = self.at(rows) | self.standing.at(rows)
        turning = np.moveaxis(self.turning_directions[self.standing.which[rows]][..., columns, :, :], -3, 0)
        return found | {"directions": with_tangent(found["directions"], turning.reshape(*turning.shape[:-2], 9))}


@dataclass(frozen=True)
class Modes:
    """Contacts (N,) bool that stick, and the modes (B,) of bearings."""

    sticks: np.ndarray
    bearings: np.ndarray

    @property
    def stuck(self) -> np.ndarray:
        return self.bearings == 0


@dataclass(frozen=True)
class Bounds:
    """What may end a phase (E,): by how much it is beyond its bound, as a part of that, its slopes (c, E), and which
    contacts, bearings and loads have a part in it, (E, N + B + N) bool."""

    beyond: np.ndarray
    slopes: np.ndarray
    parts: np.ndarray


class StandingDeviations(ContactDeviations):
    """The deviations of one run in P columns, where its contacts and bearings come to rest and give way."""

    bearings: BearingsBesideContacts

    def __init__(self, motion: Motion, columns: Columns):
        super().__init__(motion, columns)
        self.bearings = self._bearings()

    def _bearings(self) -> BearingsBesideContacts:
        return BearingsBesideContacts(self.motion, self.columns)

    @cached_property
    def changes(self) -> np.ndarray:
        modes = self.bearings.modes
        found = (modes[:-1] != modes[1:]).any(axis=1) & ~self.motion.starts_step[:-1]
        found[self.motion.switched - 1] = False
        return super().changes | found

    @cached_property
    def turns_alone(self) -> np.ndarray:
        rollers = self.motion.rollers
        return super().turns_alone if rollers is None else rollers.alone

    def _modes(self, row: int) -> Modes:
        return Modes(self.contacts.sticks[row], self.bearings.modes[row])

    # What happens

    def began(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which a run starts in a row: what sticks takes its slip and its rate."""
        contacts, modes = self.contacts, self._modes(row)
        still = self._still(row) & (contacts.sticks | contacts.slides)[row]
        loose = np.flatnonzero(still & contacts.slides[row])
        if loose.size and not self._begins_rolling() and self._slips(row, moved)[:, loose, self.own].any():
            raise self._none(row, "a contact begins to slip from rest, and has a slip beside the run", loose)
        moves = self.bearings.moves(row, moved)
        self.bearings.refuse_loose(row, moves)
        self._refuse_edges(row, modes)
        if not moves[modes.stuck].any() and self._begins_rolling():
            return moved
        return self._at_rest_from_start(row, moved, still, modes)

    def _at_rest_from_start(self, row: int, moved: np.ndarray, still: np.ndarray, modes: Modes) -> np.ndarray:
        """The same where contacts, of which `still` (N,) bool have no slip, and bearings that stick have speeds beside
        the run."""
        rests, stops = np.flatnonzero(still & modes.sticks), np.flatnonzero(modes.stuck)
        before = Modes(modes.sticks & ~still, np.where(modes.stuck, 1, modes.bearings))
        return self._rested(row, moved, (rests, stops), before)

    def passed(self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after contacts and bearings have changed their modes between a row and the next."""
        return self._after(row, row + 1, self._modes(row), moved, knot, inputs)

    def turned(self, row: int, moved: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the same after rollers have in a row that ends one step and starts the next."""
        before = Modes(self.contacts.sticks[row], self.bearings.modes_of_step(row))
        return self._after(row, row, before, moved, None, inputs)

    def _after(
        self, row: int, following: int, before: Modes, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray
    ) -> np.ndarray:
        """(m, P) the deviations in the row `following`, where modes are those of that row."""
        after, f = self._modes(following), self.motion.rates[following]
        jumps = following > row and self._inputs_jump(row)
        rests = np.flatnonzero(self.contacts.slides[row] & self._has_come(row)) if following > row else np.zeros(0, int)
        stops = self._stops(row, before, after, rests)
        self._refuse_edges(following, after, self._settle(row, before, after, stops))
        if not (rests.size or stops.size):
            if jumps:
                return moved if knot is None else moved + (self.motion.rates[row] - f)[:, None] * knot
            return self._let_go(row, following, before, moved, inputs)
        times = self._times_of_all(row, before, moved, rests, stops)
        resting = Modes(before.sticks.copy(), before.bearings.copy())
        resting.sticks[rests], resting.bearings[stops] = True, 0
        if self._answers_bend(row, before, rests):
            found = self._rested_at(row, moved, times, (rests, stops), (before, resting))
        else:
            found = self._rested(row, moved, (rests, stops), before)
        same = np.array_equal(resting.sticks, after.sticks) and np.array_equal(resting.bearings, after.bearings)
        if same and not jumps:
            return found
        if jumps:
            times = np.concatenate([times, np.zeros((1, len(self.columns))) if knot is None else knot[None]])
        rates = self._rates_where(row, resting)
        if self._is_jump(rates, f):
            self._refuse_apart(row, times, np.union1d(rests, self.bearings.wheel_of[stops]))
        return found + (rates - f)[:, None] * times[0]

    def _stops(self, row: int, before: Modes, after: Modes, rests: np.ndarray) -> np.ndarray:
        """The bearings whose rates have come to rest, beside the slips of contacts `rests`."""
        return np.flatnonzero((before.bearings != 0) & (before.bearings != after.bearings))

    def _answers_bend(self, row: int, before: Modes, rests: np.ndarray) -> bool:
        """Whether rates are no linear function of the forces and torques of what comes to rest, contacts `rests` among
        that."""
        return False

    def _settle(self, row: int, before: Modes, after: Modes, stops: np.ndarray) -> np.ndarray:
        """(B,) bool: bearings that begin to stick at their bound, which they leave."""
        return np.zeros(len(after.bearings), bool)

    def _is_jump(self, before: np.ndarray, after: np.ndarray) -> bool:
        """Whether rates (m,) are others afterwards: those of what is solved for."""
        core = self.deviations.core
        size = np.maximum(np.abs(before), np.abs(after))[core].max()
        return bool(np.abs(before - after)[core].max() > JUMPS * size)

    # In a row, where contacts and bearings have modes

    def _given(self, row: int, modes: Modes) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """The inputs (U,) in a row in these modes, and what functions take of them."""
        slides, bearings = self.contacts.slides[row] & ~modes.sticks, self.bearings
        given = np.array(self.motion.inputs_in(row))
        self.deviations.views(given)["sticks"][...] = modes.sticks
        given[bearings.places] = np.where(modes.stuck, 0.0, -modes.bearings * bearings.sliding)
        held = self.contacts.where(slides) | bearings.where(modes.stuck)
        return given, held | bearings.standing.where(self._stands(modes))

    def _stands(self, modes: Modes) -> np.ndarray:
        """(N, 2) bool, along the axle and along the rolling direction."""
        bearings = self.bearings
        of_axles, of_rollers = bearings.split(modes.stuck)
        axles = None if bearings.axles is None else of_axles
        return stands_of(modes.sticks, axles, None if bearings.rollers is None else of_rollers[:, 0])

    def _rates_where(self, row: int, modes: Modes) -> np.ndarray:
        return self.deviations.rates_of(self.motion.plain, self.motion.y[row], *self._given(row, modes))

    def _in_run(self, row: int, modes: Modes) -> dict[str, np.ndarray]:
        """What functions take and give in a row."""
        return self.deviations.known_of(self.motion.plain, self.motion.y[row], *self._given(row, modes))

    def _known(self, row: int, sticks: np.ndarray, bearings: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """The same as for contacts alone, with B units more: of the torques of bearings."""
        modes = Modes(sticks, self.bearings.modes[row] if bearings is None else bearings)
        (inputs, held), count, own = self._given(row, modes), self.wheels, self.bearings.places
        held["load"] = self.contacts.at(np.array(row))["load"]
        width = 3 * count + len(own)
        units = np.eye(width, 2 * count).reshape(-1, count, 2)
        held["pushed"] = with_tangent(np.zeros(units.shape), units)
        turning = np.zeros((width, len(inputs)))
        headings = self.deviations.views(np.arange(len(inputs)))["slip_heading"]
        turning[2 * count + np.arange(width - 2 * count), np.concatenate([headings, own])] = 1.0
        return self.deviations.known_of(self.carrying, self.motion.y[row], with_tangent(inputs, turning), held)

    # What comes to rest

    def _rested(self, row: int, moved: np.ndarray, rests: tuple[np.ndarray, np.ndarray], before: Modes) -> np.ndarray:
        """(m, P) d*: what is left where the slips of contacts and the rates of bearings `rests` are taken away, while
        those stick that do `before`. A slip that its own force does not move is no speed of its own: that along the
        axle of a massless roller that turns, or where other wheels hold nu."""
        contacts, stops = rests
        left = np.concatenate(
            [self._slips(row, moved)[:, contacts, self.own].reshape(len(self.columns), -1),
             self.bearings.turning(row, moved)[:, stops]], axis=1
        )  # fmt: skip
        if not left.any():
            return moved
        known = self._known(row, before.sticks, before.bearings)
        rates, slip = tangent_of(self.deviations.rates_among(known)), tangent_of(known["slip_dot"])
        components = np.arange(2)[self.own]
        units = np.concatenate([(2 * contacts[:, None] + components).ravel(), 3 * self.wheels + stops])
        of_slips = slip[units][:, contacts, self.own].reshape(len(units), -1)
        matrix = np.concatenate([of_slips, tangent_of(self.bearings.dots(known))[units][:, stops]], axis=1)
        masses = np.full(contacts.size * components.size, self.motion.plain.vehicle.mass)
        moves = np.abs(np.diag(matrix)) * np.append(masses, self.bearings.inertias[stops]) > SAME
        matrix, left, units = matrix[moves][:, moves], left[:, moves], units[moves]
        scale = 1 / np.sqrt(np.abs(np.diag(matrix)))
        inverse = np.linalg.pinv(scale[:, None] * matrix.T * scale, rcond=SAME)
        found = moved - ((scale[:, None] * (inverse @ (scale[:, None] * left.T))).T @ rates[units]).T
        resting = Modes(before.sticks.copy(), before.bearings.copy())
        resting.sticks[contacts], resting.bearings[stops] = True, 0
        return self._stilled(row, found, stops, resting)

    def _rested_at(
        self, row: int, moved: np.ndarray, times: np.ndarray, rests: tuple[np.ndarray, np.ndarray],
        modes: tuple[Modes, Modes],
    ) -> np.ndarray:  # fmt: skip
        """(m, P) the same where rates are no linear function of these forces and torques: d- + (f- - f*) dt, where all
        come to rest at one time, times (k, P). modes: before, and while these stick."""
        contacts, stops = rests
        self._refuse_apart(row, times, np.union1d(contacts, self.bearings.wheel_of[stops]))
        jump = self._rates_where(row, modes[0]) - self._rates_where(row, modes[1])
        return self._stilled(row, moved + jump[:, None] * times[0], stops, modes[1])

    def _stilled(self, row: int, moved: np.ndarray, stops: np.ndarray, resting: Modes) -> np.ndarray:
        """(m, P) without what rounding has left of rates of bearings, and of nu where the vehicle stands."""
        found = np.array(moved)
        if not self.bearings.standing.where(self._stands(resting))["directions"].any():  # the vehicle stands
            found[:3] = 0.0
        return self.bearings.stilled(row, found, stops)

    def _times_of_all(
        self, row: int, before: Modes, moved: np.ndarray, rests: np.ndarray, stops: np.ndarray
    ) -> np.ndarray:
        """(k, P) by how much the times deviate at which slips and rates come to zero."""
        parts = []
        if rests.size:
            parts.append(self._times_of_rests(row, moved, rests)[1])
        if stops.size:
            parts.append(self._times_of_stops(row, before, moved, stops))
        return np.concatenate(parts)

    def _times_of_stops(self, row: int, before: Modes, moved: np.ndarray, stops: np.ndarray) -> np.ndarray:
        """(k, P) the same of some bearings."""
        bearings, known = self.bearings, self._in_run(row, before)
        dots, asked = bearings.dots(known), np.abs(bearings.asked(known))
        possible = np.abs(dots) + (asked + bearings.holding) / bearings.inertias
        slow = stops[np.abs(dots[stops]) <= GRAZES * possible[stops]]
        if slow.size:
            reason = "a bearing only just comes to rest, so that a change however small lets it turn on"
            raise bearings.none(row, reason, slow)
        return -bearings.turning(row, moved)[:, stops].T / dots[stops, None]

    # What lets go

    def _let_go(self, row: int, following: int, before: Modes, moved: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after contacts or bearings have given way, or loads have vanished or come back."""
        f, later = self._rates_where(row, before), self.motion.rates[following]
        if not self._is_jump(f, later):
            return moved
        columns = self.columns.behind_another(self.motion.trajectory)  # the first is that of the time
        along = np.concatenate([f[:, None], moved], axis=1).T
        bounds = self._bounds_beside(row, before, columns, along, inputs.T)
        changed = self._changed(row, following, before)
        reached = np.flatnonzero((bounds.beyond >= -REACHED) & (bounds.parts & changed).any(axis=1))
        wheels = self._wheels_of(bounds.parts[reached].any(axis=0) if reached.size else changed)
        time = self._time_in(row, before)
        if not reached.size or not (bounds.slopes[0, reached] * time > GRAZES).all():
            raise self._just_at_bound(row, following, wheels)
        times = -bounds.slopes[1:, reached].T / bounds.slopes[0, reached, None]
        self._refuse_apart(row, times, wheels)
        return moved + (f - later)[:, None] * times[0]

    def _just_at_bound(self, row: int, following: int, wheels: np.ndarray) -> NoDerivativeError:
        """The error of rates that jump behind a row while nothing comes to its bound with a rate, at these wheels."""
        reason = "what sticks only just comes to its bound, so that a change however small lets it stay"
        return self._none(row, reason, wheels)

    def _changed(self, row: int, following: int, before: Modes) -> np.ndarray:
        """(N + B + N,) bool: contacts and bearings that have let go, and loads that vanish or come back."""
        after, carries = self._modes(following), self.contacts.carries
        of_contacts, of_bearings = before.sticks & ~after.sticks, before.stuck & ~after.stuck
        return np.concatenate([of_contacts, of_bearings, carries[row] != carries[following]])

    def _wheels_of(self, parts: np.ndarray) -> np.ndarray:
        """The wheels of some contacts, bearings and loads, (N + B + N,) bool."""
        wheels = np.arange(self.wheels)
        return np.unique(np.concatenate([wheels, self.bearings.wheel_of, wheels])[parts])

    def _time_in(self, row: int, before: Modes) -> float:
        """For how long modes have been those with which contacts and bearings come to a row."""
        own, elapsed = self.contacts, self.motion.trajectory.elapsed
        modes = np.concatenate([own.sticks, own.carries, self.bearings.modes], axis=1)
        last = row if np.array_equal(self.bearings.modes[row], before.bearings) else row - 1
        return self.motion.time_in_modes(modes, last) + float(elapsed[row] - elapsed[last])

    def _bounds_beside(self, row: int, modes: Modes, columns: Columns, along: np.ndarray, given: np.ndarray) -> Bounds:
        """The bounds in a row, along deviations (c, m) and (c, U) in which the numbers of the columns (c,) deviate."""
        bearings, y = self.bearings, with_tangent(self.motion.y[row], self.motion.whole(along))
        inputs, held = self._given(row, modes)
        inputs = with_tangent(inputs, given)
        held = self.contacts.moved(held, columns.constants, 0)
        if self.contacts.turns:
            self._turn(row, y, inputs, columns.kernel)
        stands, turning = self._stands(modes), tangent_of(rows_of_standing(columns.kernel))
        allowed = held["directions"].reshape(3, 3)
        own, _ = turned(bearings.standing.rows[stands], turning[:, stands], allowed)
        held["directions"] = with_tangent(allowed.ravel(), own.reshape(len(own), 9))
        known = self.deviations.known_of(columns.kernel, y, inputs, held)
        most = np.concatenate([np.zeros((1, len(bearings.holding))), bearings.torques[1]])
        return self._bounds(row, modes, columns.kernel, known, with_tangent(bearings.holding, most), columns.constants)

    def _bounds(
        self,
        row: int,
        modes: Modes,
        kernel: Kernel,
        known: Mapping[str, np.ndarray],
        torques: np.ndarray,
        constants: Mapping[str, np.ndarray],
    ) -> Bounds:
        """The same of what functions give, (c, ...); `torques` (c, B) are the largest of bearings at rest."""
        contacts, bearings, count = self.contacts, self.bearings, len(torques)
        stands, asked = self._stands(modes), np.array(bearings.asked(known), complex)
        loads = known["loads"] if contacts.loaded else with_tangent(
            contacts.grip.loads, constants.get("contact_load", np.zeros((count, self.wheels)))
        )  # fmt: skip
        held = np.isin(np.arange(len(bearings.holding)), bearings.of_standing(stands))
        alone = np.concatenate([modes.sticks & ~stands.any(axis=1), modes.stuck & ~held])
        beyond = np.full((count, len(alone) + self.wheels), -1.0 + 0j)
        of_contacts = self._taken(known["ground_force"], loads, constants)
        with np.errstate(divide="ignore", invalid="ignore"):
            of_bearings = asked * np.sign(asked.real) / torques - 1
        beyond[:, : len(alone)] = np.where(alone, np.concatenate([of_contacts, of_bearings], axis=-1), -1.0)
        if contacts.loaded:
            weight = contacts.grip.loads.sum()
            beyond[:, len(alone) :] = np.where(contacts.carries[row], -1, 1) * known["compression"] / weight
        found = Bounds(beyond[0].real, tangent_of(beyond), np.eye(beyond.shape[1], dtype=bool))
        if not stands.any():
            return found
        return _joined(found, self._use_of_standing(stands, kernel, known, loads, torques, constants))

    def _use_of_standing(
        self,
        stands: np.ndarray,
        kernel: Kernel,
        known: Mapping[str, np.ndarray],
        loads: np.ndarray,
        torques: np.ndarray,
        constants: Mapping[str, np.ndarray],
    ) -> Bounds:
        """Those of the least use of what holds wheels that stand (N, 2) bool (ground_with_bearings.py, rule 2). Forces
        are counted by what they do along the rows of nu."""
        (wheels, ways), bearings, grip, count = np.nonzero(stands), self.bearings, self.contacts.grip, len(torques)
        contacts, own = np.flatnonzero(stands.any(axis=1)), bearings.of_standing(stands)
        first, size = len(contacts), len(contacts) + len(wheels)
        static = with_tangent(grip.static, constants.get("ground_static_friction", np.zeros(grip.static.shape)))
        static, largest = np.broadcast_to(static, (count, self.wheels, 2)), grip.loads.max()
        measure = np.broadcast_to(largest, loads.shape) if self.contacts.loaded else loads
        reach = measure[..., None] * static
        per_row, arms = (_arms(kernel, chi, wheels, ways) for chi in (np.zeros(self.wheels), known["chi"]))
        per_force, given = np.zeros((count, size, 2, len(wheels)), complex), np.zeros((count, size, 2), complex)
        places = np.arange(len(wheels))
        per_force[:, np.searchsorted(contacts, wheels), ways, places] = 1 / (per_row * reach[:, wheels, ways])
        per_force[:, first + places, 0, places] = arms / (per_row * torques[:, own])
        with np.errstate(divide="ignore", invalid="ignore"):
            used = np.where(stands[contacts], 0.0, (known["ground_force"] / reach)[:, contacts])
        given[:, :first, self.own] = used[..., self.own]
        given[:, first:, 0] = bearings.asked(known)[:, own] / torques[:, own]
        lacking = np.zeros((count, size), complex)
        if self.contacts.loaded:
            lacking[:, :first] = 1 - loads[:, contacts] / largest
        rows = np.broadcast_to(rows_of_standing(kernel), (count, self.wheels, 2, 3))[:, stands]
        use, slopes, sets = slopes_of_use(rows, np.asarray(known["held_force"], complex), per_force, given, lacking)
        parts = np.zeros((len(use), 2 * self.wheels + len(bearings.holding)), bool)
        parts[:, contacts], parts[:, self.wheels + own] = sets[:, :first], sets[:, first:]
        return Bounds(use - 1, slopes, parts)

    def _refuse_edges(self, row: int, modes: Modes, but: np.ndarray | None = None) -> None:
        """Raises NoDerivativeError where a contact or a bearing sticks from a row on that holds all that it can; some
        bearings may, (B,) bool."""
        if not (modes.sticks.any() or modes.stuck.any()):
            return
        known = {name: np.asarray(value)[None] for name, value in self._in_run(row, modes).items()}
        bounds = self._bounds(row, modes, self.motion.plain, known, self.bearings.holding[None], {})
        parts = np.array(bounds.parts[:, : -self.wheels])
        if but is not None:
            parts[:, self.wheels :] &= ~but
        own = parts.any(axis=1)
        edge = own & (bounds.beyond >= -REACHED)
        if edge.any():
            reason = "a contact or a bearing sticks by all its friction, so that a change however small lets it go"
            raise self._none(row, reason, self._wheels_of(bounds.parts[edge].any(axis=0)))


def _arms(kernel: Kernel, chi: np.ndarray, wheels: np.ndarray, ways: np.ndarray) -> np.ndarray:
    """(..., m) in m, with which forces of the ground on wheels (m,) at chi (..., N) act on the bearings that hold them,
    in ways (m,), along the axle (0) or the rolling direction (1)."""
    rolling = np.repeat(-np.reshape(kernel.constant("wheel_radius"), (-1, 1)), len(ways), axis=1)
    if ways.all():
        return rolling
    return np.where(ways == 0, kernel.call("contact_reaches", chi)[..., wheels], rolling)


def _joined(one: Bounds, other: Bounds) -> Bounds:
    return Bounds(
        np.concatenate([one.beyond, other.beyond]),
        np.concatenate([one.slopes, other.slopes], axis=1),
        np.concatenate([one.parts, other.parts]),
    )

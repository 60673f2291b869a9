"""How deviations pass where contacts come to rest on the ground, stick and give way under Coulomb's friction.

A slip that comes to rest does so a little earlier or later in the motions beside the run, by more or less of the force
of its own contact. So with the rates f and what forces on contacts do to them, R = df/dF, to the slips W = d s'/dF,

    d* = d- - R W^-1 ds                              (ds: of the slips that have come to rest)

whatever the way to rest was: the projection in the kinetic metric on motions whose slip is zero. Where other modes
change as well, or where a slip of one component turns back at once, rates jump at a time that deviates,

    d+ = d* + (f* - f+) dt,

with the rates f* of contacts that stick once they rest. dt is where the slip along its direction comes to zero. In the
row of the rest what was left of it across has been taken away, by forces that turn, F' = dF/dheading. On the way there
they turn without end, so that nodes and roundings would decide what they leave: the row is put right,

    d- := d- - R F' l,   0 = the slips of the new d- across their directions.

Contacts that give way do so at

    d+ = d- + (f- - f+) dt,   dt = -d excess / excess',

where the force that holds comes to its bound. With equal static and sliding friction rates do not jump there, and
neither do deviations.

There is no derivative where a slip only just comes to rest, where a force only just comes to its bound or is at it in
what begins, and where events coincide that do not in the motions beside the run.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from omniroll.engine.axle_modes import TORQUE
from omniroll.engine.contact_modes import MODES, slips
from omniroll.engine.events_beside import GRAZES, JUMPS, REACHED, apart, no_derivative
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.roller_modes import KEPT
from omniroll.errors import NoDerivativeError
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent


class ContactDeviations:
    """The deviations of one run in P columns, where its contacts come to rest and give way."""

    def __init__(self, motion: Motion, columns: Columns):
        self.motion, self.columns, self.contacts = motion, columns, motion.contacts
        self.deviations, self.wheels = motion.deviations, motion.plain.wheels
        self.own = slice(self.contacts.first, 2)  # components of slips

    @cached_property
    def carrying(self) -> TangentKernel:
        """The functions of a motion, on numbers that carry tangents; no number of the vehicle deviates."""
        return TangentKernel(self.motion.plain)

    def held(self, rows: np.ndarray) -> tuple[Mapping, Mapping]:
        """What generated functions take of the contacts in rows (k,), by name; and the same with the tangents of the Q
        numbers that these functions know, (Q, k, ...)."""
        found = self.contacts.at(rows)
        tangents = {name: own[self.columns.numbered] for name, own in self.columns.constants.items()}
        return found, self.contacts.moved(found, tangents, 1)

    @cached_property
    def changes(self) -> np.ndarray:
        """(T - 1,) bool: whether contacts change their modes, or the way that they slip, between a row and the next,
        where no time passes and no wheel switches."""
        contacts, motion = self.contacts, self.motion
        found = (contacts.sticks[:-1] != contacts.sticks[1:]).any(axis=1)
        found |= (contacts.carries[:-1] != contacts.carries[1:]).any(axis=1)
        one_way = contacts.slides & ~contacts.turning
        found |= (one_way[:-1] & (np.diff(contacts.headings, axis=0) != 0)).any(axis=1)
        found &= ~motion.starts_step[:-1]
        found[motion.switched - 1] = False
        return found

    @cached_property
    def turns_alone(self) -> np.ndarray:
        """(T,) bool: whether modes change in a row that ends one step and starts the next."""
        return np.zeros(len(self.motion.y), bool)

    @property
    def rests_at_switches(self) -> np.ndarray:
        """Rows behind which a contact comes to rest just as a wheel switches."""
        before = self.motion.switched - 1
        return before[(self.contacts.slides[before] & self.contacts.sticks[before + 1]).any(axis=1)]

    def refuse_rests(self, row: int) -> None:
        """Raises NoDerivativeError where a contact comes to rest just as a wheel switches, behind a row."""
        rests = np.flatnonzero(self.contacts.slides[row] & self.contacts.sticks[row + 1])
        if rests.size:
            raise self._none(row, "a contact comes to rest just as a wheel switches", rests)

    def refuse_orders(self, row: int, wheels: np.ndarray) -> None:
        """Raises NoDerivativeError where wheels that switch together behind a row, and apart beside the run, change the
        modes of contacts."""
        changed = (own[row] != own[row + 1] for own in (self.contacts.sticks, self.contacts.carries))
        if any(own.any() for own in changed):
            reason = "wheels switch together, and contacts decide with them in more than one order"
            raise self._none(row, reason, wheels)

    def began(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which a run starts in a row: where a contact sticks, it takes its slip."""
        if not self.contacts.grips or self._begins_rolling():
            return moved
        still = np.flatnonzero(self._still(row) & (self.contacts.sticks | self.contacts.slides)[row])
        if not still.size or not self._slips(row, moved)[:, still, self.own].any():
            return moved
        loose = still[self.contacts.slides[row, still]]
        if loose.size and self._slips(row, moved)[:, loose, self.own].any():
            raise self._none(row, "a contact begins to slip from rest, and has a slip beside the run", loose)
        sticks = self.contacts.sticks[row].copy()
        sticks[still] = False
        return self._at_rest(row, moved, still, sticks)

    def _begins_rolling(self) -> bool:
        """Whether all wheels roll at the start, whose speeds the run is not given: they do beside it, too."""
        speeds = ("wheel_rates", "contact_spins")
        return all(getattr(effect, name, None) is None for effect in self.columns.effects for name in speeds)

    def come_to_rest(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations in a row, put right where slips come to rest: these are along their directions."""
        rests = np.flatnonzero(self.contacts.turning[row] & self._has_come(row))
        if not rests.size:
            return moved
        rates, slip_dot = self._responses(row, self.contacts.sticks[row])
        _, across = self._directions(row, rests)
        own = 2 * self.wheels + rests
        matrix = np.einsum("jkc,kc->jk", slip_dot[own][:, rests], across)
        left = np.einsum("pkc,kc->kp", self._slips(row, moved)[:, rests], across)
        return moved - rates[own].T @ self._turned_away(matrix.T, left)

    def _turned_away(self, matrix: np.ndarray, left: np.ndarray) -> np.ndarray:
        """(k, P) the turns that make slips (k, P) across their directions; what they do to these is (k, k)."""
        return np.linalg.solve(matrix, left)

    def passed(self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after contacts have changed their modes between a row and the next.

        moved   (m, P) those in the row, as come_to_rest() gives them
        knot    (P,) by how much the time deviates at which a drive jumps there; None where none does
        inputs  (U, 1 + P) how fast the phase's inputs change, and their deviations
        """
        contacts, motion = self.contacts, self.motion
        slides, f, inputs_jump = contacts.slides[row], motion.rates, self._inputs_jump(row)
        self._refuse_edges(row + 1)
        rests = np.flatnonzero(slides & self._has_come(row))
        if not rests.size:
            if inputs_jump:
                return moved if knot is None else moved + (f[row] - f[row + 1])[:, None] * knot
            return self._let_go(row, moved, inputs)
        after = slides.copy()
        after[rests] = False
        speeds, times = self._times_of_rests(row, moved, rests)
        found = self._at_rest(row, moved, rests, contacts.sticks[row])
        if np.array_equal(after, contacts.slides[row + 1]) and not inputs_jump:
            return found
        if inputs_jump:
            times = np.concatenate([times, np.zeros((1, len(self.columns))) if knot is None else knot[None]])
        self._refuse_apart(row, times, rests)
        given = np.array(motion.inputs_in(row))
        self.deviations.views(given)["sticks"][rests] = 1.0
        rates = self.deviations.rates_of(motion.plain, motion.y[row], given, contacts.where(after))
        return found + (rates - f[row + 1])[:, None] * times[0]

    # Slips and forces in a row

    def _known(self, row: int, sticks: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take and give in a row, where the contacts `sticks` (N,) stick, carrying tangents of
        3 N units: of the forces on contacts, and of the headings."""
        held = self.contacts.at(np.array(row))
        y, inputs, count = self.motion.y[row], np.array(self.motion.inputs_in(row)), self.wheels
        self.deviations.views(inputs)["sticks"][...] = sticks
        units = np.eye(3 * count, 2 * count).reshape(-1, count, 2)
        held["pushed"] = with_tangent(np.zeros(units.shape), units)
        turned = with_tangent(inputs, np.zeros((3 * count, len(inputs))))
        heading = self.deviations.views(np.arange(len(inputs)))["slip_heading"]
        turned[2 * count + np.arange(count), heading] = with_tangent(inputs[heading], np.ones(count))
        return self.deviations.known_of(self.carrying, y, turned, held)

    def _responses(self, row: int, sticks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(3 N, m) and (3 N, N, 2) what forces on contacts, and turns of directions, do to rates and to slip_dot, where
        the contacts `sticks` (N,) stick."""
        known = self._known(row, sticks)
        return tangent_of(self.deviations.rates_among(known)), tangent_of(known["slip_dot"])

    def _slips(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(P, N, 2) deviations of the slips where the state has these (m, P)."""
        y = with_tangent(self.motion.y[row], self.motion.whole(moved.T))
        return tangent_of(slips(self.columns.kernel, self.deviations.known_in(y, self.motion.inputs_in(row))))

    def _still(self, row: int) -> np.ndarray:
        """(N,) bool: contacts whose slip is rounding."""
        y = self.motion.y[row]
        slip = slips(self.motion.plain, self.deviations.known_in(y, self.motion.inputs_in(row)))
        return np.linalg.norm(slip, axis=-1) <= self.contacts.roundings(y)

    def _has_come(self, row: int) -> np.ndarray:
        """(N,) bool: contacts that stick behind a row, or of slips of one component that turn back."""
        contacts = self.contacts
        turns_back = np.sin(contacts.headings[row]) * np.sin(contacts.headings[row + 1]) < 0
        one_way = contacts.slides[row + 1] & ~contacts.turning[row : row + 2].any(axis=0)
        return contacts.sticks[row + 1] | (turns_back & one_way)

    def _inputs_jump(self, row: int) -> bool:
        """Whether drives jump between a row and the next: those that are not modes, nor what bearings that may stick
        take."""
        own = () if self.motion.axles is None else (TORQUE,)
        rollers = () if self.motion.rollers is None and self.motion.massless is None else KEPT
        return self.motion.drives_jump(row, (*MODES, *own, *rollers))

    def _directions(self, row: int, contacts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(k, 2) and (k, 2): the directions in which some contacts slip in a row, and those across."""
        heading = self.deviations.views(self.motion.inputs_in(row))["slip_heading"][contacts]
        across = np.where(self.contacts.turning[row, contacts], np.cos(heading), 0.0)
        along = np.stack([across, np.sin(heading)], axis=-1)
        return along, np.stack([-along[:, 1], along[:, 0]], axis=-1)

    # What happens

    def _at_rest(self, row: int, moved: np.ndarray, rests: np.ndarray, sticks: np.ndarray) -> np.ndarray:
        """(m, P) d*: what is left where the slips of some contacts (k,) are taken away, while `sticks` (N,) stick."""
        rates, slip = self._responses(row, sticks)
        places = (2 * rests[:, None] + np.arange(2)[self.own]).ravel()
        matrix = slip[places][:, rests, self.own].reshape(len(places), -1)
        own = self._slips(row, moved)[:, rests, self.own].reshape(len(self.columns), -1)
        return moved - (np.linalg.solve(matrix.T, own.T).T @ rates[places]).T

    def _times_of_rests(self, row: int, moved: np.ndarray, rests: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(k,) how fast the slips of some contacts come to rest, and (k, P) by how much the times deviate.

        Raises NoDerivativeError where one only just does.
        """
        along, _ = self._directions(row, rests)
        known = self._known(row, self.contacts.sticks[row])
        accelerations = known["slip_dot"][0].real[rests]
        speeds = np.einsum("kc,kc->k", along, accelerations)
        slow = rests[-speeds <= GRAZES * self.contacts.friction_rate()]
        if slow.size:
            raise self._none(row, "a slip only just comes to rest, so that a change however small lets it go on", slow)
        return speeds, -np.einsum("pkc,kc->kp", self._slips(row, moved)[:, rests], along) / speeds[:, None]

    def _let_go(self, row: int, moved: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after contacts have given way, or loads have vanished or come back."""
        contacts, f = self.contacts, self.motion.rates
        core = self.deviations.core
        if np.abs(f[row] - f[row + 1])[core].max() <= JUMPS * np.abs(f[row : row + 2, core]).max():
            return moved
        beyond, rises = self._beyond(row, self.carrying, {}, f[row][None], inputs[:, :1].T)
        _, slopes = self._beyond(row, self.columns.kernel, self.columns.constants, moved.T, inputs[:, 1:].T)
        changed = np.concatenate(
            [contacts.sticks[row] & ~contacts.sticks[row + 1], contacts.carries[row] != contacts.carries[row + 1]]
        )
        reached, rises = np.flatnonzero(changed & (beyond >= -REACHED)), rises[0]
        wheels = np.unique((reached if reached.size else np.flatnonzero(changed)) % self.wheels)
        if not reached.size or not (rises[reached] * self._time_of_modes(row) > GRAZES).all():
            reason = "what a contact holds only just comes to its bound, so that a change however small lets it stay"
            raise self._none(row, reason, wheels)
        times = -slopes[:, reached].T / rises[reached, None]
        self._refuse_apart(row, times, wheels)
        return moved + (f[row] - f[row + 1])[:, None] * times[0]

    def _beyond(
        self, row: int, kernel: TangentKernel, constants: Mapping[str, np.ndarray], moved: np.ndarray, given: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(2 N,) how much of its static friction the force on a contact takes, squared, less 1, then by what part of
        the weight loads are below zero, or springs of contacts that are off above it; and slopes of these (k, 2 N).

        kernel, constants  whose numbers deviate
        moved, given       (k, m) and (k, U) deviations of the state and of the inputs
        """
        contacts, count = self.contacts, len(moved)
        y = with_tangent(self.motion.y[row], self.motion.whole(moved))
        inputs = with_tangent(self.motion.inputs_in(row), given)
        held = contacts.moved(self.motion.held_at(np.array(row)), constants, 0)
        if contacts.turns:
            self._turn(row, y, inputs, kernel)
        known = self.deviations.known_of(kernel, y, inputs, held)
        found = np.full((count, 2 * self.wheels), -1.0 + 0j)
        loads = with_tangent(contacts.grip.loads, constants.get("contact_load", np.zeros((count, self.wheels))))
        if contacts.loaded:
            carried = self.deviations.loads_among(kernel, known)
            loads, weight = carried["loads"], contacts.grip.loads.sum()
            found[:, self.wheels :] = np.where(contacts.carries[row], -1, 1) * carried["compression"] / weight
        if contacts.grips:
            found[:, : self.wheels] = self._taken(known["ground_force"], loads, constants)
        return found[0].real, tangent_of(found)

    def _taken(self, force: np.ndarray, loads: np.ndarray, constants: Mapping[str, np.ndarray]) -> np.ndarray:
        """(..., N) how much of its static friction a force (..., N, 2) takes, squared, less 1, under loads (..., N)."""
        static = self.contacts.grip.static
        static = with_tangent(static, constants.get("ground_static_friction", np.zeros(static.shape)))
        with np.errstate(divide="ignore", invalid="ignore"):
            taken = ((force / (loads[..., None] * static))[..., self.own] ** 2).sum(axis=-1)
        return np.where(loads.real > 0, taken, 0.0) - 1

    def _turn(self, row: int, y: np.ndarray, inputs: np.ndarray, kernel: TangentKernel) -> None:
        """Give the headings in inputs (k, U) their deviations, those of the slips in states y."""
        slip = slips(kernel, self.deviations.known_in(y, inputs))
        slides = self.contacts.turning[row] & ~self._still(row)
        with np.errstate(divide="ignore", invalid="ignore"):
            size = (slip.real**2).sum(axis=-1)
            turn = (slip.real[..., 0] * tangent_of(slip)[..., 1] - slip.real[..., 1] * tangent_of(slip)[..., 0]) / size
        headings = self.deviations.views(np.arange(inputs.shape[1]))["slip_heading"]
        inputs[:, headings] = with_tangent(inputs[:, headings].real, np.where(slides, turn, 0.0))

    def _time_of_modes(self, row: int) -> float:
        """For how long the contacts have had the modes of a row."""
        return self.motion.time_in_modes(np.concatenate([self.contacts.sticks, self.contacts.carries], axis=1), row)

    # What has no derivative

    def _refuse_edges(self, row: int) -> None:
        """Raises NoDerivativeError where a contact sticks from a row on whose force is at its bound."""
        contacts = self.contacts
        if not contacts.sticks[row].any():
            return
        known = self._known(row, contacts.sticks[row])
        loads = known["loads"][0] if contacts.loaded else contacts.grip.loads
        taken = self._taken(known["ground_force"][0], loads, {}).real
        edge = np.flatnonzero(contacts.sticks[row] & (np.abs(taken) <= REACHED))
        if edge.size:
            reason = "a contact sticks by all its friction, so that a change however small lets it go"
            raise self._none(row, reason, edge)

    def _refuse_apart(self, row: int, times: np.ndarray, wheels: np.ndarray) -> None:
        names = apart(self.columns.names, times)
        if names:
            reason = f"several contacts change their modes together, and apart where a number changes; by {names}"
            raise self._none(row, reason, wheels)

    def _none(self, row: int, reason: str, wheels: np.ndarray) -> NoDerivativeError:
        return no_derivative(self.motion.trajectory.t[row], reason, wheels)

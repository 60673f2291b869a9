"""How deviations pass where contacts and axles stick side by side, under Coulomb's friction on the ground.

What holds for contacts (contact_deviations.py) holds for axles beside them, with torques in the place of forces: what
comes to rest does so by its own force or torque alone, so that

    d* = d- - R W^-1 ds                              (ds: of the slips and rates that have come to rest)

whatever their order. A wheel whose contact and axle stick stands and takes a direction from nu (ground_with_axles.py).
The force F on it along its rolling direction follows from what holds nu, as far as the rolling directions of all
standing wheels are independent: it lets go by its contact or by its axle, whichever comes to its bound,

    d+ = d- + (f- - f+) dt,   dt = -d excess / excess'.

Where these directions are not independent their forces are not determined, and neither is what lets go.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from omniroll.engine.axle_deviations import AxleDeviations
from omniroll.engine.contact_deviations import ContactDeviations
from omniroll.engine.events_beside import GRAZES, JUMPS, REACHED
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.standing_axles import StandingAxles
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent

SAME = 1e-9  # relative: directions that are nearer to each other are the same


def rolling_rows(kernel: Kernel) -> np.ndarray:
    """(..., N, 3) the rates of rolling wheels for each of nu."""
    return np.stack([kernel.call("wheel_speeds", unit) for unit in np.eye(3)], axis=-1)


class AxlesBesideContacts(AxleDeviations):
    """The axles of one run; what happens to them is told with the contacts."""

    axles: StandingAxles

    @cached_property
    def changes(self) -> np.ndarray:
        return np.zeros(len(self.axles.modes) - 1, bool)

    def held(self, rows: np.ndarray) -> tuple[Mapping, Mapping]:
        return self.axles.at(rows), self.carried(rows, self.columns.numbered)

    def began(self, moved: np.ndarray) -> np.ndarray:
        return moved

    @cached_property
    def turning(self) -> np.ndarray:
        """(H, P, 3, 3) how the numbers turn the directions that standing wheels leave to nu."""
        axles, turning = self.axles, tangent_of(rolling_rows(self.columns.kernel))
        found = np.zeros((len(axles.sets), len(self.columns), 3, 3))
        for k, stands in enumerate(axles.sets):
            if stands.any():
                found[k] = -np.linalg.pinv(axles.rows[stands]) @ turning[:, stands] @ axles.allowed[k]
        return found

    def carried(self, rows: np.ndarray, columns: np.ndarray | slice = slice(None)) -> dict[str, np.ndarray]:
        """What generated functions take of the axles in rows (...), carrying the tangents of some columns."""
        found = self.axles.at(rows)
        turning = np.moveaxis(self.turning[self.axles.which[rows]][..., columns, :, :], -3, 0)
        return found | {"directions": with_tangent(found["directions"], turning.reshape(*turning.shape[:-2], 9))}


class StandingDeviations(ContactDeviations):
    """The deviations of one run in P columns, where its contacts and axles come to rest and give way."""

    def __init__(self, motion: Motion, columns: Columns):
        super().__init__(motion, columns)
        self.axles: StandingAxles = motion.axles
        self.of_axles = AxlesBesideContacts(motion, columns)
        self.rates = self.deviations.places["rates"]

    @cached_property
    def changes(self) -> np.ndarray:
        modes = self.axles.modes
        found = (modes[:-1] != modes[1:]).any(axis=1) & ~self.motion.starts_step[:-1]
        found[self.motion.switched - 1] = False
        return super().changes | found

    def began(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which a run starts in a row: what sticks takes its slip and its rate."""
        contacts, stuck = self.contacts, self.axles.modes[row] == 0
        still = self._still(row) & (contacts.sticks | contacts.slides)[row]
        loose = np.flatnonzero(still & contacts.slides[row])
        if loose.size and self._slips(row, moved)[:, loose, self.own].any():
            raise self._none(row, "a contact begins to slip from rest, and has a slip beside the run", loose)
        self._refuse_edges(row)
        rests, axles = np.flatnonzero(still & contacts.sticks[row]), np.flatnonzero(stuck)
        return self._rested(row, moved, (rests, axles), (contacts.sticks[row] & ~still, stuck & False))

    def passed(self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after contacts and axles have changed their modes between a row and the next."""
        contacts, motion, (before, following) = self.contacts, self.motion, self.axles.modes[row : row + 2]
        f, inputs_jump = motion.rates, self._inputs_jump(row)
        rests = np.flatnonzero(contacts.slides[row] & self._has_come(row))
        axles = np.flatnonzero((before != 0) & (before != following))
        if not (rests.size or axles.size):
            self._refuse_edges(row + 1)
            if inputs_jump:
                return moved if knot is None else moved + (f[row] - f[row + 1])[:, None] * knot
            return self._let_go(row, moved, inputs)
        times = self._times_of_all(row, moved, rests, axles)
        self._refuse_edges(row + 1)
        sticks, stuck = contacts.sticks[row].copy(), before == 0
        found = self._rested(row, moved, (rests, axles), (sticks.copy(), stuck.copy()))
        sticks[rests], stuck[axles] = True, True
        same = np.array_equal(sticks, contacts.sticks[row + 1]) and np.array_equal(stuck, following == 0)
        if same and not inputs_jump:
            return found
        if inputs_jump:
            times = np.concatenate([times, np.zeros((1, len(self.columns))) if knot is None else knot[None]])
        self._refuse_apart(row, times, np.union1d(rests, axles))
        rates = self._rates_where(row, sticks, stuck)
        return found + (rates - f[row + 1])[:, None] * times[0]

    # In a row, where some contacts and axles stick

    def _given(self, row: int, sticks: np.ndarray, stuck: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """The inputs (U,) in a row where contacts and axles (N,) bool stick, and what functions take of their modes."""
        slides = self.contacts.slides[row] & ~sticks
        given = np.array(self.motion.inputs[row])
        views = self.deviations.views(given)
        views["sticks"][...] = sticks
        views["bearing_torque"][stuck] = 0.0
        return given, self.contacts.where(slides) | self.axles.where(sticks, stuck)

    def _rates_where(self, row: int, sticks: np.ndarray, stuck: np.ndarray) -> np.ndarray:
        return self.deviations.rates_of(self.motion.plain, self.motion.y[row], *self._given(row, sticks, stuck))

    def _known(self, row: int, sticks: np.ndarray, stuck: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """The same as for contacts alone, with N units more: of the torques of axles."""
        stuck = self.axles.modes[row] == 0 if stuck is None else stuck
        (inputs, held), count = self._given(row, sticks, stuck), self.wheels
        held["load"] = self.contacts.at(np.array(row))["load"]
        units = np.eye(4 * count, 2 * count).reshape(-1, count, 2)
        held["pushed"] = with_tangent(np.zeros(units.shape), units)
        turned = with_tangent(inputs, np.zeros((4 * count, len(inputs))))
        places = self.deviations.views(np.arange(len(inputs)))
        for k, name in enumerate(("slip_heading", "bearing_torque"), start=2):
            own = places[name]
            turned[k * count + np.arange(count), own] = with_tangent(inputs[own], np.ones(count))
        return self.deviations.known_of(self.carrying, self.motion.y[row], turned, held)

    def _rested(
        self,
        row: int,
        moved: np.ndarray,
        rests: tuple[np.ndarray, np.ndarray],
        before: tuple[np.ndarray, np.ndarray],
    ) -> np.ndarray:
        """(m, P) d*: what is left where the slips of contacts and the rates of axles `rests` are taken away, while
        those stick that do `before`."""
        contacts, axles = rests
        if not contacts.size + axles.size:
            return moved
        known = self._known(row, *before)
        rates, slip = tangent_of(self.deviations.rates_among(known)), tangent_of(known["slip_dot"])
        components = np.arange(2)[self.own]
        units = np.concatenate([(2 * contacts[:, None] + components).ravel(), 3 * self.wheels + axles])
        wide = len(contacts) * len(components)
        taken = [slip[units][:, contacts, self.own].reshape(len(units), wide), rates[units][:, self.rates[axles]]]
        slips = self._slips(row, moved)[:, contacts, self.own]
        own = [slips.reshape(len(self.columns), wide)]
        own.append(moved[self.rates[axles]].T)
        matrix, left = np.concatenate(taken, axis=1), np.concatenate(own, axis=1)
        if not left.any():
            return moved
        scale = 1 / np.sqrt(np.abs(np.diag(matrix)))
        inverse = np.linalg.pinv(scale[:, None] * matrix.T * scale, rcond=SAME)
        found = moved - ((scale[:, None] * (inverse @ (scale[:, None] * left.T))).T @ rates[units]).T
        found[self.rates[axles]] = 0.0
        places = np.arange(self.wheels)
        stands = (before[0] | np.isin(places, contacts)) & (before[1] | np.isin(places, axles))
        if not self.axles.where(stands, stands)["directions"].any():  # the vehicle stands
            found[:3] = 0.0
        return found

    def _times_of_all(self, row: int, moved: np.ndarray, rests: np.ndarray, axles: np.ndarray) -> np.ndarray:
        """(k, P) by how much the times deviate at which slips and rates come to zero."""
        parts = []
        if rests.size:
            parts.append(self._times_of_rests(row, moved, rests)[1])
        if axles.size:
            parts.append(self.of_axles.times_of_stops(row, moved, axles))
        return np.concatenate(parts)

    # What is held

    def _taken_by_all(
        self, row: int, kernel: Kernel, known: Mapping[str, np.ndarray], torques: np.ndarray, constants: Mapping
    ) -> np.ndarray:
        """(..., 2 N) by how much more than they hold contacts that stick are asked for, squared, less 1, and axles that
        stick, less 1; -1 of others. `torques` (..., N) are the largest of axles at rest."""
        sticks, stuck = self.contacts.sticks[row], self.axles.modes[row] == 0
        stands = np.flatnonzero(sticks & stuck)
        force, asked = (np.array(known[name], complex) for name in ("ground_force", "axle_holding"))
        radius = self._radius(constants)
        if stands.size:
            rows = rolling_rows(kernel)[..., stands, :]
            if np.linalg.matrix_rank(self.axles.rows[stands], SAME) < len(stands):
                raise self._none(row, "the forces on the wheels that stand are not determined", stands)
            held = -np.asarray(known["held_force"]) / radius[..., None]
            square = rows @ rows.swapaxes(-1, -2)
            along = np.linalg.solve(square, rows @ held[..., None])[..., 0]
            force[..., stands, 1] += along
            asked[..., stands] -= radius[..., None] * along
        loads = with_tangent(
            self.contacts.grip.loads, constants.get("contact_load", np.zeros((len(radius), self.wheels)))
        )
        contacts = np.where(sticks, self._taken(force, loads, constants), -1.0)
        return np.concatenate([contacts, np.where(stuck, asked * np.sign(asked.real) / torques - 1, -1.0)], axis=-1)

    def _radius(self, constants: Mapping[str, np.ndarray]) -> np.ndarray:
        """(k,) the radius of the wheels, carrying tangents."""
        moved = constants.get("wheel_radius", np.zeros(1))
        return with_tangent(np.full(moved.shape, self.motion.plain.vehicle.wheel_radius), moved)

    def _let_go(self, row: int, moved: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after contacts or axles have given way."""
        contacts, f, modes = self.contacts, self.motion.rates, self.axles.modes
        core = self.deviations.core
        if np.abs(f[row] - f[row + 1])[core].max() <= JUMPS * np.abs(f[row : row + 2, core]).max():
            return moved
        columns = self.columns.behind_another(self.motion.trajectory)  # the first is that of the time
        along = np.concatenate([f[row][:, None], moved], axis=1).T
        beyond, slopes = self._slopes_of_bounds(row, columns, along, inputs.T)
        of_axles = (modes[row] == 0) & (modes[row + 1] != 0)
        changed = np.concatenate([contacts.sticks[row] & ~contacts.sticks[row + 1], of_axles])
        reached = np.flatnonzero(changed & (beyond >= -REACHED))
        wheels = np.unique((reached if reached.size else np.flatnonzero(changed)) % self.wheels)
        if not reached.size or not (slopes[0, reached] * self._time_of_modes(row) > GRAZES).all():
            reason = "what sticks only just comes to its bound, so that a change however small lets it stay"
            raise self._none(row, reason, wheels)
        times = -slopes[1:, reached].T / slopes[0, reached, None]
        self._refuse_apart(row, times, wheels)
        return moved + (f[row] - f[row + 1])[:, None] * times[0]

    def _slopes_of_bounds(
        self, row: int, columns: Columns, along: np.ndarray, given: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(2 N,) what _taken_by_all gives in a row, and (1 + P, 2 N) its slopes along deviations."""
        y = with_tangent(self.motion.y[row], self.motion.whole(along))
        inputs = with_tangent(self.motion.inputs[row], given)
        held = self.contacts.moved(self.contacts.at(np.array(row)), columns.constants, 0)
        if self.contacts.turns:
            self._turn(row, y, inputs, columns.kernel)
        beside = AxlesBesideContacts(self.motion, columns).carried(np.array(row))
        known = self.deviations.known_of(columns.kernel, y, inputs, held | beside)
        most = np.concatenate([np.zeros((1, self.wheels)), self.of_axles.torques[1]])
        torques = with_tangent(np.broadcast_to(self.axles.holding, most.shape), most)
        found = self._taken_by_all(row, columns.kernel, known, torques, columns.constants)
        return found[0].real, tangent_of(found)

    def _time_of_modes(self, row: int) -> float:
        modes = np.concatenate([self.contacts.sticks, self.contacts.carries, self.axles.modes], axis=1)
        return self.motion.time_in_modes(modes, row)

    def _refuse_edges(self, row: int) -> None:
        """Raises NoDerivativeError where a contact or an axle sticks from a row on that holds all that it can."""
        sticks, stuck = self.contacts.sticks[row], self.axles.modes[row] == 0
        stands = sticks & stuck
        if not (sticks | stuck).any() or np.linalg.matrix_rank(self.axles.rows[stands], SAME) < stands.sum():
            return
        motion = self.motion
        known = self.deviations.known_of(motion.plain, motion.y[row], motion.inputs[row], motion.held_at(np.array(row)))
        known = {name: np.asarray(value)[None] for name, value in known.items()}
        beyond = self._taken_by_all(row, motion.plain, known, self.axles.holding, {})
        edge = np.flatnonzero(beyond[0].real >= -REACHED) % self.wheels
        if edge.size:
            reason = "a contact or an axle sticks by all its friction, so that a change however small lets it go"
            raise self._none(row, reason, np.unique(edge))

"""Contacts, axles and rollers that may stick in a run whose wheels may slip: what C takes of them to follow deviations.

How deviations pass what happens to them is computed in C alone (csrc/deviations). Here are their numbers with what the
columns' numbers do to these, what deviates at a start at which something sticks, and what has no derivative.

What sticks at the start of a run has no slip and no rate in the motions beside it either. The deviations d of a start
that would give it some, ds, lose that by impulses of what sticks alone,

    d* = d - R W^+ ds,

with what forces and torques do to the rates, R, and to the slips and rates of what sticks, W.
"""

from functools import cached_property

import numpy as np

from omniroll.engine.axle_modes import TORQUE
from omniroll.engine.contact_modes import slips
from omniroll.engine.events_beside import REACHED, no_derivative
from omniroll.engine.holds import tables_of
from omniroll.engine.massless_modes import StripModes
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.roller_modes import FREE, IN_CONTACT, spins
from omniroll.engine.standing import SAME, leaving, rows_of_standing
from omniroll.errors import NoDerivativeError
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent

ROUNDED = 1e-13  # of what they are differences of: deviations of slips and rates are rounding


class Sticking:
    """The contacts (N,) of one run and its bearings (B,), those of axles (N,), if these may stick, then those of the
    rollers (N n,) by place, if these may; of massless ones (N,) those in contact alone.

    axles, rollers, contacts  the modes of each; None where they may not stick
    """

    def __init__(self, motion: Motion, columns: Columns):
        self.motion, self.columns, self.deviations = motion, columns, motion.deviations
        self.contacts, self.axles, self.standing = motion.contacts, motion.axles, motion.standing
        self.massless = motion.massless is not None
        self.rollers = StripModes(motion.massless) if self.massless else motion.rollers
        self.wheels = motion.plain.wheels
        self.of_axles = 0 if self.axles is None else self.wheels
        self.shape = (self.wheels, 0) if self.rollers is None else self.rollers.sliding.shape
        numbers = np.arange(self.wheels)
        self.wheel_of = self._all(numbers, np.broadcast_to(numbers[:, None], self.shape))

    @classmethod
    def of(cls, motion: Motion, columns: Columns) -> "Sticking | None":
        """None where nothing sticks that may slip."""
        found = (motion.contacts, motion.axles, motion.rollers, motion.massless)
        return cls(motion, columns) if any(own is not None for own in found) else None

    # Numbers and modes of the bearings

    @property
    def has_bearings(self) -> bool:
        return self.axles is not None or self.rollers is not None

    def _all(self, of_axles: np.ndarray | None, of_rollers: np.ndarray | None) -> np.ndarray:
        """(..., B) of values of axles (..., N) and of rollers (..., N, n)."""
        if self.rollers is None:
            return np.zeros((0,), int) if of_axles is None else of_axles
        of_rollers = of_rollers.reshape(*of_rollers.shape[:-2], -1)
        return of_rollers if self.axles is None else np.concatenate([of_axles, of_rollers], axis=-1)

    def _split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The inverse of _all; of axles that may not stick (..., 0), of rollers that may not (..., N, 0)."""
        of_rollers = values[..., self.of_axles :]
        return values[..., : self.of_axles], of_rollers.reshape(*of_rollers.shape[:-1], *self.shape)

    def _of_modes(self, name: str) -> np.ndarray:
        """(..., B) what the modes of axles and of rollers call so."""
        return self._all(*(None if own is None else getattr(own, name) for own in (self.axles, self.rollers)))

    @cached_property
    def modes(self) -> np.ndarray:
        """(T, B) in each row 0 where one sticks, else the sign of its rate."""
        if not self.has_bearings:
            return np.zeros((len(self.motion.y), 0), int)
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
        """(B,) in kg m^2; of massless rollers beside contacts that stick what the vehicle's mass is to a torque that
        holds it by the ground."""
        plain = self.motion.plain
        own = np.full(self.shape, plain.vehicle.roller_inertia)
        if self.massless and self.contacts is not None:
            reach = plain.call("contact_reaches", np.zeros(self.wheels))
            own = np.broadcast_to(plain.vehicle.mass * reach[:, None] ** 2, self.shape)
        return self._all(np.full(self.wheels, plain.vehicle.wheel_inertia), own)

    @cached_property
    def torques(self) -> tuple[np.ndarray, np.ndarray]:
        """(P, B) deviations of the torques of bearings that turn, and of the largest at rest."""
        of_wheels = (("wheel", self.axles), ("roller", self.rollers))
        moved = [None if own is None else torques_of(self.columns, body, own.place) for body, own in of_wheels]
        axles, rollers = ((None, None) if own is None else own for own in moved)
        if self.rollers is not None:
            rollers = tuple(np.repeat(own[..., None], self.shape[1], axis=-1) for own in rollers)
        sliding, most = (self._all(*own) for own in zip(axles, rollers, strict=True))
        return sliding, most

    @property
    def most_moved(self) -> np.ndarray:
        """(P, B) deviations of the largest torques at rest."""
        return self.torques[1]

    def _by_input(self, values: np.ndarray) -> dict[str, np.ndarray]:
        """Values (..., B) by the inputs of generated functions that are torques of these bearings."""
        of_axles, of_rollers = self._split(values)
        found = {} if self.rollers is None else self.rollers.given(of_rollers)
        return found if self.axles is None else found | {TORQUE: of_axles}

    def given(self, rows: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Deviations of value and slope (S, P, ...) of the bearings' torques in the steps from rows (S,), by the
        input's name."""
        if not self.has_bearings:
            return {}
        moved = self._by_input(-self.modes[rows][:, None] * self.torques[0])
        return {name: (part, np.zeros_like(part)) for name, part in moved.items()}

    def _where(self, stuck: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take where bearings (..., B) bool stick, by name."""
        of_axles, of_rollers = self._split(stuck)
        found = {} if self.axles is None else {"axle_sticks": of_axles.astype(float)}
        return found if self.rollers is None else found | self.rollers.where(of_rollers)

    # Wheels that stand

    @cached_property
    def turning_rows(self) -> np.ndarray:
        """(P, N, 2, 3) how the numbers turn the directions in which wheels may stand."""
        return tangent_of(rows_of_standing(self.columns.kernel))

    @cached_property
    def turning_directions(self) -> np.ndarray:
        """(H, P, 3, 3) how the numbers turn what each set of standing wheels leaves to nu."""

        def refused(row: int, numbers: np.ndarray) -> NoDerivativeError:
            names = ", ".join(np.array(self.columns.names)[numbers])
            return self._none(row, f"what sticks together would leave other directions; by {names}", np.arange(0))

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

    def carried(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take in rows (...), by name, carrying the tangents of all columns."""
        found = self._where(self.modes[rows] == 0) if self.has_bearings else {}
        if self.contacts is not None:
            found |= self.contacts.moved(self.contacts.at(rows), self.columns.constants, 1)
        if self.standing is None:
            return found
        found |= self.standing.at(rows)
        turning = np.moveaxis(self.turning_directions[self.standing.which[rows]], -3, 0)
        return found | {"directions": with_tangent(found["directions"], turning.reshape(*turning.shape[:-2], 9))}

    # The start

    @cached_property
    def _first(self) -> np.ndarray:
        """(U,) what the first phase is given."""
        return self.motion.given_in(np.zeros(1, int))[0]

    def began(self, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which a run starts, of those of its state, if nothing stuck."""
        stuck = np.flatnonzero(self.modes[0] == 0)
        if self.massless:
            stuck = stuck[stuck < self.of_axles]
        held = np.zeros(0, int) if self.contacts is None else np.flatnonzero(self.contacts.sticks[0])
        self._refuse_at_bounds()
        of_contacts, of_bearings = self._slips(moved), self._rates(moved)
        self._refuse_loose(moved, of_contacts, of_bearings)
        left = np.concatenate([of_contacts[:, held].reshape(len(of_contacts), -1), of_bearings[:, stuck]], axis=1)
        if not self._is_seen(left, moved).any():
            return moved
        known = self._unit_responses(held, stuck)
        rates, matrix = tangent_of(self.deviations.rates_among(known)), tangent_of(self._dots(known))[:, stuck]
        if held.size:
            slips = tangent_of(known["slip_dot"])[:, held][..., self._own]
            matrix = np.concatenate([slips.reshape(len(rates), -1), matrix], axis=1)
        own = np.abs(np.diag(matrix))
        moves = own > SAME * own.max()
        scale = 1 / np.sqrt(own[moves])
        inverse = np.linalg.pinv(scale[:, None] * matrix[moves][:, moves].T * scale, rcond=SAME)
        impulses = scale[:, None] * (inverse @ (scale[:, None] * left[:, moves].T))
        return self._stilled(moved - rates[moves].T @ impulses, stuck)

    def _stilled(self, moved: np.ndarray, stuck: np.ndarray) -> np.ndarray:
        """(m, P) without what rounding has left of rates of bearings, and of nu where the vehicle stands."""
        found = np.array(moved)
        if self.standing is not None and not self.standing.allowed[self.standing.which[0]].any():
            found[:3] = 0.0
        places = self.deviations.places
        speeds = places["rates"]
        if not self.massless and self.rollers is not None:
            of_rollers = np.concatenate([places["contact_omega"][:, None], places["axial"]], axis=1)
            speeds = self._all(speeds, of_rollers)
        if stuck.size:
            found[speeds[stuck]] -= self._rates(found)[:, stuck].T
        return found

    @staticmethod
    def _is_seen(left: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """(P, k) bool: deviations of slips or rates (P, k) that are more than rounding of those of a state (m, P)."""
        return np.abs(left) > ROUNDED * np.abs(moved).max(axis=0)[:, None]

    def _refuse_loose(self, moved: np.ndarray, of_contacts: np.ndarray, of_bearings: np.ndarray) -> None:
        """Raises NoDerivativeError where something begins to slip or turn from rest, and moves beside the run."""
        if self.contacts is not None:
            known = self.deviations.known_in(self.motion.y[0], self._first)
            size = np.linalg.norm(slips(self.motion.plain, known), axis=-1)
            still = (size <= self.contacts.roundings(self.motion.y[0])) & self.contacts.slides[0]
            slips_beside = self._is_seen(of_contacts.reshape(len(of_contacts), -1), moved)
            loose = np.flatnonzero(still & slips_beside.reshape(of_contacts.shape).any(axis=(0, 2)))
            if loose.size:
                raise self._none(0, "a contact begins to slip from rest, and has a slip beside the run", loose)
        if self.motion.rollers is not None:
            still = self._all(np.zeros(self.wheels, bool), np.abs(self.rollers.spins[0]) <= self.rollers.rest)
            loose = np.flatnonzero((self.modes[0] != 0) & still & self._is_seen(of_bearings, moved).any(axis=0))
            if loose.size:
                reason = "a roller begins to turn from rest, and turns beside the run"
                raise self._none(0, reason, self.wheel_of[loose])

    def _refuse_at_bounds(self) -> None:
        """Raises NoDerivativeError where something sticks at the start by all that it can hold."""
        trajectory = self.motion.trajectory
        reason = "sticks by all its friction, so that a change however small lets it go"
        if self.contacts is not None:
            taken = (trajectory.ground_force[0] ** 2 * self.contacts.per_reach()).sum(axis=-1)
            edge = np.flatnonzero(self.contacts.sticks[0] & (np.abs(taken - 1) <= REACHED))
            if edge.size:
                raise self._none(0, f"a contact {reason}", edge)
        if self.has_bearings:
            asked, holding = np.abs(self._asked()), self.holding
            edge = np.flatnonzero((self.modes[0] == 0) & (asked >= (1 - REACHED) * holding))
            if edge.size:
                kind = "an axle" if edge[0] < self.of_axles else "a roller"
                raise self._none(0, f"{kind} {reason}", self.wheel_of[edge])

    def _asked(self) -> np.ndarray:
        """(B,) in N m, what holds bearings that stick at the start."""
        trajectory, names, motion = self.motion.trajectory, self.motion.trajectory.effects.drives(), self.motion
        rows = {name: trajectory.drive[0, names.index(name)] for name in (TORQUE, IN_CONTACT) if name in names}
        if self.rollers is None:
            return rows[TORQUE]
        own = rows[IN_CONTACT][:, None]
        if not self.massless:
            held = motion.held_at(np.array(0))
            known = self.deviations.known_of(motion.plain, motion.y[0], self._first, held)
            own = np.concatenate([own, known["free_holding"]], axis=1)
        return self._all(rows.get(TORQUE), own)

    @property
    def _own(self) -> slice:
        """Components of slips that contacts have."""
        return slice(0 if self.contacts is not None and self.contacts.turns else 1, 2)

    def _slips(self, moved: np.ndarray) -> np.ndarray:
        """(P, N, 1 or 2) deviations of the slips at the start where the state has these (m, P)."""
        if self.contacts is None:
            return np.zeros((moved.shape[1], self.wheels, 0))
        y = with_tangent(self.motion.y[0], self.motion.whole(moved.T))
        known = self.deviations.known_in(y, self._first)
        return tangent_of(slips(self.columns.kernel, known))[..., self._own]

    def _rates(self, moved: np.ndarray) -> np.ndarray:
        """(P, B) deviations of the rates of wheels and of the spins; of massless rollers none."""
        views = self.motion.vector.views(with_tangent(self.motion.y[0], self.motion.whole(moved.T)))
        if not self.has_bearings:
            return np.zeros((moved.shape[1], 0))
        own = None
        if self.rollers is not None:
            none = np.zeros((moved.shape[1], *self.shape))
            own = none if self.massless else tangent_of(spins(self.columns.kernel, views))
        return self._all(tangent_of(views["rates"]), own)

    def _dots(self, known: dict[str, np.ndarray]) -> np.ndarray:
        """(..., B) in rad/s^2, accelerations of the wheels and of the rollers' spins."""
        if not self.has_bearings:
            return np.zeros((*known["rates_dot"].shape[:-1], 0), complex)
        if self.rollers is None:
            return known["rates_dot"]
        if self.massless:
            return self._all(known["rates_dot"], np.zeros((*known["rates_dot"].shape[:-1], *self.shape), complex))
        of_rollers = np.concatenate([known["contact_spin_dot"][..., None], known["spins_dot"]], axis=-1)
        return self._all(known["rates_dot"], of_rollers)

    def _unit_responses(self, held: np.ndarray, stuck: np.ndarray) -> dict[str, np.ndarray]:
        """What functions give at the start, carrying tangents of units: of the forces on contacts `held`, by
        component, and of the torques of bearings `stuck`; none of these sticks."""
        inputs = np.array(self._first)
        places = self.deviations.views(np.arange(self.deviations.input_size))
        components = np.arange(2)[self._own]
        count = len(held) * len(components)
        given = np.zeros((count + len(stuck), len(inputs)))
        known = dict(self.motion.held_at(np.array(0)))
        if self.contacts is not None:
            inputs[places["sticks"][held]] = 0.0
            units = np.zeros((len(given), self.wheels, 2))
            units[np.arange(count), np.repeat(held, len(components)), np.tile(components, len(held))] = 1.0
            known["pushed"] = with_tangent(np.zeros(units.shape), units)
        if self.has_bearings:
            modes = self.modes[0] == 0
            modes[stuck] = False
            known |= self._where(modes)
            own = self._all(places.get(TORQUE), self._places_of_rollers(places))[stuck]
            given[count + np.arange(len(stuck)), own] = 1.0
        if self.standing is not None:
            known |= self.standing.where(np.zeros((self.wheels, 2), bool))
        y = np.broadcast_to(self.motion.y[0], (len(given), self.motion.vector.size))
        return self.deviations.known_of(TangentKernel(self.motion.plain), y, with_tangent(inputs, given), known)

    def _places_of_rollers(self, places: dict[str, np.ndarray]) -> np.ndarray | None:
        if self.rollers is None:
            return None
        own = places[IN_CONTACT][:, None]
        return own if self.massless else np.concatenate([own, places[FREE]], axis=1)

    # What happens

    @property
    def alone(self) -> np.ndarray:
        """(T,) bool: rows in which a step ends and the next one starts, with other modes of rollers."""
        rollers = self.motion.rollers
        return np.zeros(len(self.modes), bool) if rollers is None else rollers.alone

    @property
    def rests_at_switches(self) -> np.ndarray:
        """Rows behind which a contact comes to rest just as a wheel switches."""
        before = self.motion.switched - 1
        if self.contacts is None:
            return before[:0]
        return before[(self.contacts.slides[before] & self.contacts.sticks[before + 1]).any(axis=1)]

    # What has no derivative

    def refuse(self, row: int, reason: str) -> None:
        """Raises NoDerivativeError: something changes its mode in a row, which C does not pass for this reason."""
        raise self._none(row, reason, np.flatnonzero(self._changed(row, min(row + 1, len(self.modes) - 1))))

    def _changed(self, row: int, after: int) -> np.ndarray:
        """(N,) bool: wheels with what changes its mode between two rows."""
        found = np.zeros(self.wheels, bool)
        found[self.wheel_of[np.flatnonzero(self.modes[row] != self.modes[after])]] = True
        return found if self.contacts is None else found | (self.contacts.sticks[row] != self.contacts.sticks[after])

    def refuse_rests(self, row: int) -> None:
        """Raises NoDerivativeError where something comes to rest just as a wheel switches, behind a row."""
        before, after = self._at_switch(row)
        rests = (before != 0) & (before != after)
        if self.massless:  # another roller has come into contact, which stands on its disk
            rests[self.of_axles :] &= self.motion.directions[row + 1] == 0
        found = np.zeros(self.wheels, bool)
        found[self.wheel_of[rests]] = True
        if self.contacts is not None:
            found |= self.contacts.slides[row] & self.contacts.sticks[row + 1]
        if found.any():
            reason = "a contact or a bearing comes to rest just as a wheel switches"
            raise self._none(row, reason, np.flatnonzero(found))

    def refuse_orders(self, row: int, wheels: np.ndarray) -> None:
        """Raises NoDerivativeError where wheels that switch together behind a row, and apart beside the run, change
        modes."""
        before, after = self._at_switch(row)
        changed = (before != after).any()
        if self.contacts is not None:
            changed |= (self.contacts.sticks[row] != self.contacts.sticks[row + 1]).any()
        if changed:
            reason = "wheels switch together, and contacts or bearings decide with them in more than one order"
            raise self._none(row, reason, wheels)

    def _at_switch(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """(B,) modes before and after wheels switch behind a row, each roller at its place before."""
        if not self.has_bearings:
            return self.modes[row], self.modes[row + 1]
        of_axles = None if self.axles is None else self.axles.modes[row + 1]
        of_rollers = None if self.rollers is None else self.rollers.by_roller_of(row + 1, row, self.rollers.modes)
        return self.modes[row], self._all(of_axles, of_rollers)

    def _none(self, row: int, reason: str, wheels: np.ndarray) -> NoDerivativeError:
        return no_derivative(self.motion.trajectory.t[row], reason, wheels)


def torques_of(columns: Columns, body: str, place: int) -> tuple[np.ndarray, np.ndarray]:
    """(P, N) deviations of the torques of the bearings of each wheel, or of its rollers, where they turn, and of the
    largest at rest: of the effect at this place."""
    own, zero = columns.signals, np.zeros((len(columns), columns.plain.wheels))
    sliding, most = (own.get((place, f"{body}_{what}"), zero) for what in ("coulomb", "break_away"))
    given = getattr(columns.effects[place], f"{body}_break_away") is not None
    return sliding, most if given else sliding

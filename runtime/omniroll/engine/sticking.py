"""Contacts, axles and rollers that may stick in a run: what C takes of them to follow deviations.

How deviations pass what happens to them is computed in C alone (csrc/deviations). Here are their numbers with what the
columns' numbers do to these, what deviates at a start at which something sticks, and what has no derivative.

What sticks at the start of a run in which wheels may slip has no slip and no rate in the motions beside it either. The
deviations d of a start that would give it some, ds, lose that by impulses of what sticks alone,

    d* = d - R W^+ ds,

with what forces and torques do to the rates, R, and to the slips and rates of what sticks, W.
"""

from functools import cached_property

import numpy as np

from omniroll.engine.bearing_modes import FREE, IN_CONTACT, TORQUE
from omniroll.engine.contact_modes import slips
from omniroll.engine.directions import SAME, directions_left, leaving, rows_of_standing
from omniroll.engine.events_beside import LETS_GO_ONLY_JUST, REACHED, no_derivative
from omniroll.engine.motion import Columns, Motion
from omniroll.errors import NoDerivativeError
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent

ROUNDED = 1e-13  # of what they are differences of: deviations of slips and rates are rounding
AT_REST = 1e-12  # of the fastest spin of a run: spins of what rests are rounding
MISSED = 1e-3  # of the accuracy: so much of the fastest they may be, too


class Sticking:
    """The contacts (N,) of one run and its bearings (B,) that may stick.

    contacts, bearings  the modes of each; None where they may not stick
    held                what they leave to nu; None where they leave all
    """

    def __init__(self, motion: Motion, columns: Columns):
        self.motion, self.columns, self.deviations = motion, columns, motion.deviations
        self.contacts, self.bearings, self.held = motion.contacts, motion.bearings, motion.held
        self.plain, self.wheels = motion.plain, motion.plain.wheels
        self.massless = self.plain.slips and not self.plain.has_spins and self._has("roller")
        numbers = np.arange(self.wheels)
        self.wheel_of = numbers[:0]
        if self.bearings is not None:
            self.wheel_of = self.bearings.of_wheels({"axle": numbers, "roller": numbers})

    @classmethod
    def of(cls, motion: Motion, columns: Columns) -> "Sticking | None":
        """None where nothing may stick."""
        return cls(motion, columns) if motion.contacts is not None or motion.bearings is not None else None

    # Numbers of the bearings

    def _has(self, body: str) -> bool:
        """Whether bearings of this kind, "axle" or "roller", may stick."""
        return self.bearings is not None and body in self.bearings.places

    @cached_property
    def modes(self) -> np.ndarray:
        """(T, B) as the bearings have them; of none (T, 0)."""
        return np.zeros((len(self.motion.y), 0), int) if self.bearings is None else self.bearings.modes

    @cached_property
    def inertias(self) -> np.ndarray:
        """(B,) in kg m^2, which a torque moves: a wheel or a roller; the vehicle's mass by the ground where rates
        follow from nu, and of massless rollers beside contacts that stick."""
        plain, vehicle, ones = self.plain, self.plain.vehicle, np.ones(self.wheels)
        of_rollers = np.full(self.bearings.shape, vehicle.roller_inertia)
        if not plain.slips:
            by_ground = vehicle.mass * vehicle.wheel_radius**2
            of_rollers[:, :1] = by_ground
            return self.bearings.joined(by_ground * ones, of_rollers)
        if self.massless and self.contacts is not None:
            of_rollers = vehicle.mass * plain.call("contact_reaches", 0 * ones)[:, None] ** 2
        return self.bearings.joined(vehicle.wheel_inertia * ones, of_rollers)

    @cached_property
    def torques(self) -> tuple[np.ndarray, np.ndarray]:
        """(P, B) deviations of the torques of bearings that turn, and of the largest at rest."""
        numbers = {"axle": "wheel", "roller": "roller"}  # how the effects' numbers begin
        moved = {name: _torques_of(self.columns, numbers[name], place) for name, place in self.bearings.places.items()}
        sliding, most = (self.bearings.of_wheels({name: own[k] for name, own in moved.items()}) for k in (0, 1))
        return sliding, most

    def given(self, rows: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Deviations of value and slope (S, P, ...) of the bearings' torques in the steps from rows (S,), by the
        input's name."""
        if self.bearings is None:
            return {}
        moved = self.bearings.given(-self.modes[rows][:, None] * self.torques[0])
        return {name: (part, np.zeros_like(part)) for name, part in moved.items()}

    # What is held

    @cached_property
    def turning_rows(self) -> np.ndarray:
        """(P, R, 3) how the numbers turn the rates that are held, for each of nu."""
        turning = tangent_of(rows_of_standing(self.columns.kernel))
        if self.motion.stands:
            return turning.reshape(len(self.columns), -1, 3)
        parts = [k for k, body in ((1, "axle"), (0, "roller")) if self._has(body)]
        return np.concatenate([turning[:, :, k] for k in parts], axis=1)

    @cached_property
    def turning_directions(self) -> np.ndarray:
        """(H, P, 3, 3) how the numbers turn what is left to nu. Raises NoDerivativeError for a number by which that
        would be less."""

        def refused(row: int, held: np.ndarray, numbers: np.ndarray) -> NoDerivativeError:
            names = ", ".join(np.array(self.columns.names)[numbers])
            places = np.flatnonzero(held)
            wheels = places // 2 if self.motion.stands else places % self.wheels
            return self._none(row, f"what sticks together would leave other directions; by {names}", wheels)

        return self.held.turning(self.turning_rows, refused)

    @cached_property
    def numbers(self) -> tuple[np.ndarray, np.ndarray]:
        """(2,) what C takes of the wheels that may stand: radius; distance from the axes of rollers to the ground in
        their middles, if these stick. And (P,) how the radius moves."""
        radius = reach = np.ravel(self.columns.kernel.constant("wheel_radius"))
        if self._has("roller"):
            reach = self.columns.kernel.call("contact_reaches", np.zeros(self.wheels))[..., 0]
        return np.array([radius[0].real, reach[0].real]), tangent_of(radius)

    def carried(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take in rows (...), by name, carrying the tangents of all columns."""
        found = {} if self.bearings is None else self.bearings.at(rows)
        if self.contacts is not None:
            found |= self.contacts.moved(self.contacts.at(rows), self.columns.constants)
        if self.held is None:
            return found
        found |= self.held.at(rows)
        turning = np.moveaxis(self.turning_directions[self.held.which[rows]], -3, 0)
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
            stuck = stuck[stuck < self.bearings.axles]
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
        if self.held is not None and not self.held.allowed[self.held.which[0]].any():
            found[:3] = 0.0
        places = self.deviations.places
        speeds = places["rates"]
        if self._has("roller") and not self.massless:
            of_rollers = np.concatenate([places["contact_omega"][:, None], places["axial"]], axis=1)
            speeds = self.bearings.joined(speeds, of_rollers)
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
            self._refuse_at_start("a contact begins to slip from rest, and has a slip beside the run", loose)
        if self._has("roller") and not self.massless:
            still = self.bearings.joined(np.zeros(self.wheels, bool), self._spins_at_rest())
            loose = np.flatnonzero((self.modes[0] != 0) & still & self._is_seen(of_bearings, moved).any(axis=0))
            self._refuse_at_start("a roller begins to turn from rest, and turns beside the run", self.wheel_of[loose])

    def _spins_at_rest(self) -> np.ndarray:
        """(N, n) bool: rollers whose spins are rounding at the start."""
        trajectory, vehicle = self.motion.trajectory, self.plain.vehicle
        spins = np.abs(np.concatenate([trajectory.contact_spin[..., None], trajectory.spins], axis=-1))
        fastest = spins.max() + np.linalg.norm(trajectory.nu, axis=1).max() / vehicle.yaw_scale
        by_torque = self.bearings.split(self.bearings.holding)[1] / vehicle.roller_inertia * trajectory.elapsed[-1]
        return spins[0] <= max(AT_REST, MISSED * trajectory.accuracy) * (fastest + by_torque)

    def _refuse_at_bounds(self) -> None:
        """Raises NoDerivativeError where something sticks at the start by all that it can hold."""
        trajectory = self.motion.trajectory
        reason = "sticks by all its friction, so that a change however small lets it go"
        if self.contacts is not None:
            taken = (trajectory.ground_force[0] ** 2 * self.contacts.per_reach()).sum(axis=-1)
            edge = np.flatnonzero(self.contacts.sticks[0] & (np.abs(taken - 1) <= REACHED))
            self._refuse_at_start(f"a contact {reason}", edge)
        if self.bearings is not None:
            asked, holding = np.abs(self._asked()), self.bearings.holding
            edge = np.flatnonzero((self.modes[0] == 0) & (asked >= (1 - REACHED) * holding))
            kind = "an axle" if (edge[:1] < self.bearings.axles).any() else "a roller"
            self._refuse_at_start(f"{kind} {reason}", self.wheel_of[edge])

    def _refuse_at_start(self, reason: str, wheels: np.ndarray) -> None:
        """Raises NoDerivativeError where there are such wheels."""
        if wheels.size:
            raise self._none(0, reason, wheels)

    def _asked(self) -> np.ndarray:
        """(B,) in N m, what holds bearings that stick at the start."""
        trajectory, names, motion = self.motion.trajectory, self.motion.trajectory.effects.drives(), self.motion
        rows = {name: trajectory.drive[0, names.index(name)] for name in (TORQUE, IN_CONTACT) if name in names}
        if not self._has("roller"):
            return rows[TORQUE]
        own = rows[IN_CONTACT][:, None]
        if not self.massless:
            held = motion.held_at(np.array(0))
            known = self.deviations.known_of(motion.plain, motion.y[0], self._first, held)
            own = np.concatenate([own, known["free_holding"]], axis=1)
        return self.bearings.joined(rows.get(TORQUE), own)

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
        if self.bearings is None:
            return np.zeros((moved.shape[1], 0))
        views = self.motion.vector.views(with_tangent(self.motion.y[0], self.motion.whole(moved.T)))
        of_rollers = np.zeros((moved.shape[1], *self.bearings.shape))
        if self._has("roller") and not self.massless:
            kernel, nu, chi = self.columns.kernel, views["nu"], views["chi"]
            in_contact = kernel.call("slip_spins", nu, chi, views["contact_omega"])[..., None]
            free = kernel.spins_from_axial(nu, chi, views["axial"])
            of_rollers = tangent_of(np.concatenate([in_contact, free], axis=-1))
        return self.bearings.joined(tangent_of(views["rates"]), of_rollers)

    def _dots(self, known: dict[str, np.ndarray]) -> np.ndarray:
        """(..., B) in rad/s^2, accelerations of the wheels and of the rollers' spins; of massless rollers 0."""
        of_axles = known["rates_dot"]
        if self.bearings is None:
            return of_axles[..., :0]
        of_rollers = np.zeros((*of_axles.shape[:-1], *self.bearings.shape), complex)
        if self._has("roller") and not self.massless:
            of_rollers = np.concatenate([known["contact_spin_dot"][..., None], known["spins_dot"]], axis=-1)
        return self.bearings.joined(of_axles, of_rollers)

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
        if self.bearings is not None:
            modes = self.modes[0] == 0
            modes[stuck] = False
            known |= self.bearings.where(modes)
            of_rollers = None
            if self._has("roller"):
                kinds = [places[IN_CONTACT][:, None]] + ([] if self.massless else [places[FREE]])
                of_rollers = np.concatenate(kinds, axis=1)
            own = self.bearings.joined(places.get(TORQUE), of_rollers)[stuck]
            given[count + np.arange(len(stuck)), own] = 1.0
        if self.held is not None:
            known |= leaving(directions_left(self.held.rows[:0]))
        y = np.broadcast_to(self.motion.y[0], (len(given), self.motion.vector.size))
        return self.deviations.known_of(TangentKernel(self.motion.plain), y, with_tangent(inputs, given), known)

    # What happens

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
        alone = self.bearings is not None and self.bearings.alone[row]
        before, after = (row - 1, row) if alone else (row, min(row + 1, len(self.modes) - 1))
        if reason == LETS_GO_ONLY_JUST and not self.plain.slips and (self.modes[:before] == self.modes[before]).all():
            elapsed = self.motion.trajectory.elapsed
            reason += (
                f"; or too little of its rise is seen, since the run, or this step of a session, began only "
                f"{elapsed[row] - elapsed[0]:.2g} s before: let it begin earlier, or behind the break-away"
            )
        raise self._none(row, reason, np.flatnonzero(self._changed(before, after)))

    def _changed(self, row: int, after: int) -> np.ndarray:
        """(N,) bool: wheels with what changes its mode between two rows."""
        found = np.zeros(self.wheels, bool)
        found[self.wheel_of[np.flatnonzero(self.modes[row] != self.modes[after])]] = True
        return found if self.contacts is None else found | (self.contacts.sticks[row] != self.contacts.sticks[after])

    def refuse_rests(self, row: int) -> None:
        """Raises NoDerivativeError where something comes to rest just as a wheel switches, behind a row. Where wheels
        roll that leaves deviations as they are."""
        if not self.plain.slips:
            return
        before, after = self._at_switch(row)
        rests = (before != 0) & (before != after)
        if self.massless:  # another roller has come into contact, which stands on its disk
            rests[self.bearings.axles :] &= self.motion.directions[row + 1] == 0
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
        if not self.plain.slips:
            return
        before, after = self._at_switch(row)
        changed = (before != after).any()
        if self.contacts is not None:
            changed |= (self.contacts.sticks[row] != self.contacts.sticks[row + 1]).any()
        if changed:
            reason = "wheels switch together, and contacts or bearings decide with them in more than one order"
            raise self._none(row, reason, wheels)

    def _at_switch(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """(B,) modes before and after wheels switch behind a row, each roller at its place before."""
        after = self.modes[row + 1] if self.bearings is None else self.bearings.before_switch(row)
        return self.modes[row], after

    def _none(self, row: int, reason: str, wheels: np.ndarray) -> NoDerivativeError:
        return no_derivative(self.motion.trajectory.t[row], reason, wheels)


def _torques_of(columns: Columns, body: str, place: int) -> tuple[np.ndarray, np.ndarray]:
    """(P, N) deviations of the torques of the bearings of each wheel, or of its rollers, where they turn, and of the
    largest at rest: of the effect at this place."""
    own, zero = columns.signals, np.zeros((len(columns), columns.plain.wheels))
    sliding, most = (own.get((place, f"{body}_{what}"), zero) for what in ("coulomb", "break_away"))
    given = getattr(columns.effects[place], f"{body}_break_away") is not None
    return sliding, most if given else sliding

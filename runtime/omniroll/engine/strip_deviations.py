"""How deviations pass where massless rollers stick on their disks beside contacts that stick on the ground, and axles.

Bearing and ground are in series along the axle (effects/ground_with_massless_rollers.py): a contact has one force and
one speed there, that of its wheel, of which a roller that turns has no number of its own in the state. What holds for
contacts and bearings (standing_deviations.py) holds with that speed in the place of the spin:

1. A contact whose roller sticks slips as a rigid wheel does, and comes to rest with both components of its slip. One
   whose roller turns does so along the rolling direction alone. There the roller's spin is the speed along the axle,
   which comes to rest by the torque of its bearing.
2. Where both move, the bearing and the ellipse say the forces, whatever the speeds are. A roller that stops on its disk
   there stops where the ground asks for its sliding torque just as before: no speed comes to rest, and no rate jumps.
   It sticks at its bound and leaves it, since what is asked of it falls as its spin did.
3. A roller that comes into contact stands on its disk. That is part of the switch.
4. Where the bearing has viscous friction, too, the contact of a roller that turns slips along its axle alone while that
   would take more than the ground gives. Its slip along the rolling direction passes zero then, and is no rest.

There is no derivative, beside the cases of standing_deviations.py, where such a spin only just comes to zero and the
bearing holds more than it takes while the roller turns: the motions beside the run turn on. Nor is there one where a
roller stops in a fold of friction and loads (csrc/ground/strips_under_loads.c): rates go with the root of the time that
is left until then, and have no slope.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from omniroll.engine.contact_modes import slips
from omniroll.engine.events_beside import GRAZES, JUMPS
from omniroll.engine.roller_modes import IN_CONTACT
from omniroll.engine.standing import SAME
from omniroll.engine.standing_deviations import BearingsBesideContacts, Modes, StandingDeviations
from omniroll.errors import NoDerivativeError
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent
from omniroll.results.accelerations import call_named


class BearingsInSeries(BearingsBesideContacts):
    """The bearings (B,) of one run: of axles (N,), if these may stick, then of the massless rollers in contact (N,)."""

    @property
    def of_rollers(self) -> slice:
        """Their places."""
        return slice(self.of_axles, None)

    @cached_property
    def places(self) -> np.ndarray:
        places = self.deviations.views(np.arange(self.deviations.input_size))
        return self._all(places.get("bearing_torque"), places[IN_CONTACT][:, None])

    @cached_property
    def inertias(self) -> np.ndarray:
        """(B,) in kg m^2; of rollers what the vehicle's mass is to a torque that holds it by the ground."""
        plain = self.motion.plain
        reach = plain.call("contact_reaches", np.zeros(self.wheels))
        own = plain.vehicle.mass * reach[:, None] ** 2
        return self._all(np.full(self.wheels, plain.vehicle.wheel_inertia), np.broadcast_to(own, self.shape))

    def dots(self, known: Mapping[str, np.ndarray]) -> np.ndarray:
        """(..., B) in rad/s^2, accelerations of the wheels, and of the speeds along the axles over rho."""
        reach = self.motion.plain.call("contact_reaches", np.asarray(known["chi"]).real)
        return self._all(known["rates_dot"], (known["slip_dot"][..., 0] / reach)[..., None])

    def asked(self, known: Mapping[str, np.ndarray]) -> np.ndarray:
        return self._all(known.get("axle_holding"), np.asarray(known["contact_holding"])[..., None])

    def rates_in(self, views: Mapping[str, np.ndarray]) -> np.ndarray:
        """(..., B) the rates of wheels, and the speeds along the axles over rho, which may carry tangents."""
        reach = self.motion.plain.call("contact_reaches", views["chi"].real)
        along = slips(self.columns.kernel, views)[..., 0] / reach
        return self._all(views["rates"], along[..., None])

    def stilled(self, row: int, moved: np.ndarray, stops: np.ndarray) -> np.ndarray:
        axles = stops[stops < self.of_axles]
        found = np.array(moved)
        found[self.deviations.places["rates"][axles]] -= self.turning(row, moved)[:, axles].T
        return found

    def _sizes(self, row: int, moved: np.ndarray) -> np.ndarray:
        along = np.abs(self.standing.rows[:, 0]).max(axis=0)  # of a roller that rolls, for each of nu
        return super()._sizes(row, moved) + along @ np.abs(moved[:3])

    def refuse_loose(self, row: int, moves: np.ndarray) -> None:
        views = self.motion.vector.views(self.motion.y[row])
        speeds = np.abs(slips(self.motion.plain, views)[:, 0])
        still = (speeds <= self.contacts.roundings(self.motion.y[row])) & self.contacts.sticks[row]
        loose = (self.modes[row] != 0) & self._all(np.zeros(self.wheels, bool), still[:, None]) & moves
        if loose.any():
            raise self.none(row, "a roller begins to turn from rest, and turns beside the run", loose)

    def refuse_rests(self, row: int) -> None:
        """Raises NoDerivativeError where a bearing comes to rest just as a wheel switches, behind a row, but for the
        roller that comes into contact."""
        before, after = self._at_switch(row)
        came = self.motion.directions[row + 1] != 0
        rests = (before != 0) & (before != after) & ~self._all(np.zeros(self.wheels, bool), came[:, None])
        if rests.any():
            raise self.none(row, "a bearing comes to rest just as a wheel switches", rests)


class StripDeviations(StandingDeviations):
    """The deviations of one run in P columns, where its contacts, axles and massless rollers stick and give way."""

    bearings: BearingsInSeries

    def _bearings(self) -> BearingsInSeries:
        return BearingsInSeries(self.motion, self.columns)

    def _turns(self, modes: Modes) -> np.ndarray:
        """(N,) bool: rollers that turn."""
        return modes.bearings[self.bearings.of_rollers] != 0

    def _still(self, row: int) -> np.ndarray:
        """(N,) bool: contacts whose slip is rounding; where rollers turn that along the rolling direction."""
        y = self.motion.y[row]
        slip = slips(self.motion.plain, self.deviations.known_in(y, self.motion.inputs_in(row)))
        size = np.where(self._turns(self._modes(row)), np.abs(slip[:, 1]), np.linalg.norm(slip, axis=1))
        return (size <= self.contacts.roundings(y)) & ~self._slips_alone(row)

    def _slips_alone(self, row: int) -> np.ndarray:
        """(N,) bool: contacts that slip along their axles whatever they do along the rolling direction (rule 4)."""
        if not self.contacts.damped:
            return np.zeros(self.wheels, bool)
        modes = self._modes(row)
        known = self.deviations.known_in(self.motion.y[row], self.motion.inputs_in(row))
        known |= {"load": np.where(self.contacts.slides[row], self.contacts.given_loads, 1.0)}
        known |= {"friction": self.contacts.grip.sliding, "slip_direction": np.tile([0.0, 1.0], (self.wheels, 1))}
        *_, taken = call_named(self.motion.plain, "damped_ways", known)  # of the ground's friction
        return self.contacts.slides[row] & self._turns(modes) & (np.abs(taken) > 1)

    def _has_come(self, row: int) -> np.ndarray:
        """The same; what passes zero beside a slip along the axle alone has not."""
        return super()._has_come(row) & (self.contacts.sticks[row + 1] | ~self._slips_alone(row))

    def _begins_rolling(self) -> bool:
        """Whether no contact has a slip beside the run at its start: one whose roller sticks does where it rolls."""
        return False

    def _turned_away(self, matrix: np.ndarray, left: np.ndarray) -> np.ndarray:
        """The same; where other wheels hold the vehicle along an axle no slip there turns."""
        first, sizes, second = np.linalg.svd(matrix)
        moves = sizes > SAME * self.contacts.friction_rate()
        return second[moves].T @ ((first[:, moves].T @ left) / sizes[moves, None])

    def _answers_bend(self, row: int, before: Modes, rests: np.ndarray) -> bool:
        """Whether a roller turns on a contact that slips on: where loads follow the motion, its bearing leaves of the
        friction what goes with the load in no proportion."""
        corners = self.contacts.slides[row] & self._turns(before)
        corners[rests] = False
        return self.deviations.corners and bool(corners.any())

    def _at_rest_from_start(self, row: int, moved: np.ndarray, still: np.ndarray, modes: Modes) -> np.ndarray:
        rests = np.flatnonzero(still & modes.sticks)
        if self._answers_bend(row, modes, rests) and self._slips(row, moved)[:, rests].any():
            reason = "a contact slips beside the run that sticks, while a roller turns on another one that slips"
            raise self._none(row, reason, rests)
        stops = np.flatnonzero(modes.stuck[: self.bearings.of_axles])
        bearings = np.array(modes.bearings)
        bearings[stops] = 1
        return self._rested(row, moved, (rests, stops), Modes(modes.sticks & ~still, bearings))

    def _slips_along(self, row: int, before: Modes, after: Modes) -> np.ndarray:
        """(N,) bool: contacts that let go whose wheels move along their axles: with rollers that stick then, contacts
        slip as fast as these have turned."""
        y = self.motion.y[row]
        speeds = np.abs(slips(self.motion.plain, self.deviations.known_in(y, self.motion.inputs[row]))[:, 0])
        moves = speeds > np.maximum(self.contacts.roundings(y), SAME * speeds.max())
        return before.sticks & ~after.sticks & moves

    def _stops(self, row: int, before: Modes, after: Modes, rests: np.ndarray) -> np.ndarray:
        """The same, but for rollers on contacts that slip, or do from now on."""
        stops = super()._stops(row, before, after, rests)
        holds = before.sticks | np.isin(np.arange(self.wheels), rests)
        holds &= ~self._slips_along(row, before, after)
        return stops[(stops < self.bearings.of_axles) | holds[self.bearings.wheel_of[stops]]]

    def _settle(self, row: int, before: Modes, after: Modes, stops: np.ndarray) -> np.ndarray:
        """Rollers that stop on their disks while their contacts slip. Raises NoDerivativeError where a spin only just
        comes to zero."""
        found = (before.bearings != 0) & (after.bearings == 0)
        found[stops], found[: self.bearings.of_axles] = False, False
        slow = found & (self.bearings.holding > (1 + JUMPS) * self.bearings.sliding)
        self._refuse_grazing(row, before, slow & ~before.sticks[self.bearings.wheel_of])
        return found

    def _just_at_bound(self, row: int, following: int, wheels: np.ndarray) -> NoDerivativeError:
        folds = np.flatnonzero(self._stops_turning(row, following))
        if not folds.size:
            return super()._just_at_bound(row, following, wheels)
        reason = (
            "a roller stops in a fold, where friction and loads have no solution any more in which it turns, so that "
            "rates up to it have no slope"
        )
        return self._none(row, reason, folds)

    def _stops_turning(self, row: int, following: int) -> np.ndarray:
        """(N,) bool: rollers that stop behind a row, where they have a spin, while their contacts slip."""
        modes, reach = self._modes(row), self.motion.plain.call("contact_reaches", self.motion.trajectory.chi[row])
        stops = self._turns(modes) & ~self._turns(self._modes(following)) & self.contacts.slides[row]
        speeds = np.abs(self.motion.trajectory.contact_spin[row]) * reach
        return stops & (speeds > self.contacts.roundings(self.motion.y[row]))

    def _refuse_grazing(self, row: int, before: Modes, bearings: np.ndarray) -> None:
        """Raises NoDerivativeError where spins of some bearings (B,) bool, which fall to zero, hardly change."""
        if not bearings.any():
            return
        (given, held), known = self._given(row, before), self._in_run(row, before)
        y = with_tangent(self.motion.y[row], self.motion.whole(self.deviations.rates_among(known)))[None]
        ahead = self.deviations.known_of(self.carrying, y, given, held)
        spins = tangent_of(call_named(self.carrying, "slip_spins", ahead)[0])[0]
        own = self.bearings.of_rollers
        possible = np.abs(self.bearings.dots(known)) + self.bearings.holding / self.bearings.inertias
        slow = np.zeros(len(bearings), bool)
        slow[own] = -before.bearings[own] * spins <= GRAZES * possible[own]
        if (slow & bearings).any():
            reason = "a roller only just stops on its disk, so that a change however small lets it turn on"
            raise self.bearings.none(row, reason, slow & bearings)

"""Contacts, axles and rollers that may all stick: Coulomb's friction as the set-valued law on the ground and in all
bearings.

The rules of ground_with_axles.py hold, and for rollers those of slipping_rollers.py. Beside them:

1. A wheel stands along its axle where its contact and its roller in contact stick, as it stands along its rolling
   direction where its contact and its axle do: nu loses that direction. The ground's force on it there, F_a, and the
   roller's bearing hold each other: the bearing takes q + rho F_a, with q what takes the roller along with its disk.
2. Of the forces along the directions in which wheels stand only what they do to nu together is determined. The vehicle
   is held where some of them do that and leave no contact and no bearing more to take than it can. What they can do is
   no zonotope where a wheel stands both ways, as an ellipse is round. So one number is looked at, the least use
   (least_use.py): the part of what it can take that the most used contact or bearing has to take at least. A phase ends
   where that is 1, and there those are let go which have to take all that they can.
3. At an instant contacts, axles and rollers are one convex problem, in which rollers that do not touch the ground have
   a part through the yaw acceleration.
4. The forces of least norm among those that are possible are reported, and the torques beside them.
5. A contact that gives way at its bound, without a jump, holds instead where its slip would come to rest at once: the
   function that would end it decides, since it knows the rates themselves.
"""

from dataclasses import dataclass, replace

import numpy as np

from omniroll.effects import cones
from omniroll.effects.complementarity import allowed_by
from omniroll.effects.ground import AT_REST as CONTACT_AT_REST
from omniroll.effects.ground import HELD_ROUNDINGS, Ground
from omniroll.effects.ground_with_axles import LEAST_REACH, GroundWithAxles, directions_of_nu
from omniroll.effects.guards import EPS, PASSED, Guard
from omniroll.effects.least_use import Uses, least_norm, least_use
from omniroll.effects.massless_rollers import rows_along_axles
from omniroll.effects.slipping_bearings import SlippingBearings
from omniroll.vehicles.state import State

AMPLE = 8.0  # times what bearings may be asked for
TINY = 1e-300  # where no bearing takes anything
USED = 1e-6  # below the least use: what is used so much has come to its bound


@dataclass(frozen=True)
class Parts:
    """What has a part in holding wheels that stand in m directions.

    contacts  (S,) the wheels
    bearings  (m,) in the list of all, one for each direction
    arms      (m,) in m, what it takes of a unit force there
    uses      of the contacts (S,), then of the bearings (m,)
    """

    contacts: np.ndarray
    bearings: np.ndarray
    arms: np.ndarray
    uses: Uses


class GroundWithBearings(GroundWithAxles):
    """Contacts, axles and rollers in one run.

    axles   all bearings (B,), with their modes
    held    what the rates that were computed last say, by name
    stands  (N, 2) bool: wheels that stand in the present phase, along the axle and along the rolling direction
    """

    axles: SlippingBearings
    at_edge = USED
    from_inside = False  # whether forces at an instant are sought from inside what can be taken

    def _put_axles(self, axles: SlippingBearings, held: dict[str, np.ndarray]) -> None:
        super()._put_axles(axles, held)
        self.rows_along = rows_along_axles(self.kernel)
        self.stands = np.zeros((self.kernel.wheels, 2), bool)

    # What the state says

    def at_rest(self, state: State) -> State:
        """The state with what rests at zero. What is zero within rounding rests, too."""
        vehicle, bearings = self.kernel.vehicle, self.axles
        rounding = Ground.roundings(self, state.nu, state.rates, state.contact_axial())
        self.largest = max(self.largest, float(rounding.max()))
        speed = self.largest / (CONTACT_AT_REST * EPS)
        bearings.least = bearings.by_kind(speed / vehicle.wheel_radius, speed / self._reach(state.chi).min())
        for _ in range(2):  # the vehicle may rest altogether where some wheels do
            state = bearings.at_rest(Ground.at_rest(self, bearings.at_rest(state)))
            stands = self._standing(self.resting, bearings.resting)
            if stands.any():
                state = replace(state, nu=allowed_by(self._rows(stands)) @ state.nu)
                state = bearings.at_rest(self._rolling(state))
        if not (state.nu.any() or state.rates.any() or bearings.modes[bearings.may_stick].any()):
            self.largest = self.least
        return state

    def _rolling(self, state: State) -> State:
        """The state with the speeds of rolling where contacts rest."""
        rolling, _ = self.kernel.wheel_rates(state.nu, state.chi)
        turning = self.kernel.contact_axial(state.nu, state.chi)
        state = replace(state, rates=np.where(self.resting, rolling, state.rates))
        return state.with_contact_axial(np.where(self.resting, turning, state.contact_axial()))

    def _standing(self, contacts: np.ndarray, bearings: np.ndarray) -> np.ndarray:
        """(N, 2) bool, along the axle and along the rolling direction, where contacts (N,) and bearings (B,) stick."""
        of_axles, rollers = self.axles.split(bearings)
        return contacts[:, None] & np.stack([rollers[:, 0], of_axles], axis=1)

    def _rows(self, stands: np.ndarray) -> np.ndarray:
        """(m, 3) what a unit force along each direction (N, 2) bool in which wheels stand does to nu."""
        both = np.stack([self.rows_along, -self.radius * self.rows], axis=1)
        return both[stands]

    def _reach(self, chi: np.ndarray) -> np.ndarray:
        """(N,) in m, from the axes of the rollers in contact to the ground."""
        return self.kernel.call("contact_reaches", chi)

    # What has happened

    def switched(self, directions: np.ndarray) -> None:
        """Wheels have passed to their next rollers, directions (N,). One that rests on its disk as the last one did is
        at rest on the ground as it was."""
        before = self.axles.resting[self.axles.contact].copy()
        self.axles.switched(directions)
        still = before & self.axles.resting[self.axles.contact]
        resting = self.resting & still
        Ground.switched(self, directions)
        self.resting |= resting

    def pass_guards(self, passed: np.ndarray) -> None:
        """Guards that have ended the phase: of contacts and loads, of bearings, and the least use."""
        ends = np.cumsum([self.guards_of_contacts, len(self.axles.modes)])
        of_contacts, of_bearings, of_use = np.split(passed, ends)
        super(GroundWithAxles, self).pass_guards(of_contacts)
        self.axles.pass_guards(of_bearings, self._asked())
        if of_use.any():
            self._release_used()

    def _asked(self) -> np.ndarray:
        """(B,) what holds the bearings that stick, without the forces along directions in which wheels stand."""
        return self.axles.asked_in(self.held)

    # What wheels that stand can take

    def _parts(self) -> Parts:
        """What has a part in holding the wheels that stand."""
        wheels, ways = np.nonzero(self.stands)
        contacts, count = np.flatnonzero(self.stands.any(axis=1)), len(wheels)
        (reach, lacking), first = self._of_ground(), len(contacts)
        bearings = np.where(ways == 0, self.axles.contact[wheels], wheels)
        arms = np.where(ways == 0, self._reach(self.held["chi"])[wheels], -self.radius)
        holding = np.maximum(self.axles.holding[bearings], LEAST_REACH * self.axles.holding.max() + TINY)
        per_force, given = np.zeros((first + count, 2, count)), np.zeros((first + count, 2))
        per_force[np.searchsorted(contacts, wheels), ways, np.arange(count)] = 1 / reach[wheels, ways]
        per_force[first + np.arange(count), 0, np.arange(count)] = arms / holding
        given[:first] = np.where(self.stands[contacts], 0.0, self.held["ground_force"][contacts] / reach[contacts])
        given[first:, 0] = self._asked()[bearings] / holding
        return Parts(contacts, bearings, arms, Uses(per_force, given, np.append(lacking[contacts], np.zeros(count))))

    def _of_ground(self) -> tuple[np.ndarray, np.ndarray]:
        """(N, 2) in N, by what forces of the ground are measured, and (N,) what contacts can take less than that, as a
        part of it."""
        return self.load[:, None] * self.grip.static, np.zeros(len(self.load))

    def _least_use(self, parts: Parts) -> tuple[float, np.ndarray]:
        """The least use, and forces (m,) that make it; the rates have been computed."""
        return least_use(self._rows(self.stands).T, self.held["held_force"], parts.uses)

    def _release_used(self) -> None:
        """What has to take all that it can is let go."""
        parts = self._parts()
        use, forces = self._least_use(parts)
        used, first = parts.uses.of(forces) >= use * (1 - USED), len(parts.contacts)
        self.released[parts.contacts[used[:first]]] = True
        takes = (parts.uses.per_force @ forces + parts.uses.given)[first:, 0]
        self.axles.released[parts.bearings[used[first:]]] = -np.sign(takes[used[first:]]).astype(int)

    def excess(self) -> tuple[np.ndarray, np.ndarray]:
        """(B + 1,) how far each bearing is beyond the end of its mode, where no wheel stands by it, and how far the
        least use is beyond 1; and the rounding of that. The rates have been computed."""
        values, rounded = self.axles.excess(self._asked(), self.held)
        use = 0.0
        if self.stands.any():
            parts = self._parts()
            values[parts.bearings] = -1.0
            use, _ = self._least_use(parts)
        return np.append(values, use - 1), np.append(rounded, HELD_ROUNDINGS * EPS * (1 + use))

    # What follows

    def bearing_torques(self) -> np.ndarray:
        """(B,) in N m, what all bearings take where the rates have been computed; of standing wheels beside the forces
        of least norm (rule 4)."""
        torques = self.axles.torques() + self._asked()
        if self.stands.any():
            parts = self._parts()
            forces = least_norm(self._rows(self.stands).T, self.held["held_force"], parts.uses)
            torques[parts.bearings] += parts.arms * forces
        return torques

    def inputs(self, sticks: np.ndarray, stuck: np.ndarray, torques: np.ndarray) -> dict[str, np.ndarray]:
        """What the rates take, by name, where contacts (N,) and bearings (B,) stick and others have torques (B,)."""
        directions = directions_of_nu(self._rows(self._standing(sticks, stuck)))
        return {"sticks": sticks} | directions | self.axles.inputs(stuck, torques)

    def turning_guards(self, nu: np.ndarray, rates: np.ndarray) -> list[Guard]:
        """None: what turns is among excess()."""
        return []

    def _stand(self) -> None:
        self.stands = self._standing(self.sticks, (self.axles.modes == 0) & self.axles.may_stick)

    def _least(self, matrix: np.ndarray, without: np.ndarray, reach: np.ndarray) -> cones.Decided:
        """As it is for axles; bearings that can take far more than they may be asked for are measured by that."""
        contacts = slice(0, int(self.resting.sum()))
        by_ground = np.einsum("kjc,jc->k", np.abs(matrix[:, 0, contacts]), reach[contacts])
        asked = (np.abs(without[:, 0]) + by_ground) / np.einsum("kckc->kc", matrix)[:, 0]
        less = np.minimum(reach, AMPLE * asked[:, None])
        less[contacts] = reach[contacts]
        less = np.maximum(less, LEAST_REACH * less.max())
        found = cones.decide_semidefinite(matrix, without, less, from_inside=self.from_inside)
        at_bound = np.abs(found.force[:, 0]) >= less[:, 0] * (1 - USED)
        too_little = at_bound & (less[:, 0] < reach[:, 0])
        if not too_little.any():
            return found
        return cones.decide_semidefinite(matrix, without, reach, from_inside=self.from_inside)

    def _overdone(self) -> bool:
        """Whether something that sticks is asked for more than it takes. It is let go."""
        beyond, rounding = self.used_up(self.held["ground_force"])
        contacts = self.sticks & (beyond > PASSED * rounding)
        values, rounded = self.excess()
        passed = values > PASSED * rounded
        bearings = passed[:-1] & (self.axles.modes == 0)
        self.released |= contacts
        self.axles.let_go(bearings, self._asked())
        if passed[-1]:
            self._release_used()
        return bool(contacts.any() or bearings.any() or passed[-1]) or self._hold_what_falls_back()

    def _hold_what_falls_back(self) -> bool:
        """Whether a contact that has been let go would come to rest at once. It holds (rule 5)."""
        contacts = self.released & self.resting & ~self.sticks & (self._falling() > self.settles)
        self.released[contacts] = False
        return bool(contacts.any())

    def _falling(self) -> np.ndarray:
        """(N,) in m/s^2, how slips fall along the ways that contacts go."""
        return -(self.towards * self.held["slip_dot"]).sum(axis=1)

    def torques_in_rows(self) -> dict[str, np.ndarray]:
        """What rows keep of the bearings (N,), by name."""
        return self.axles.in_rows(self.bearing_torques())

    def accelerations(self) -> np.ndarray:
        """(B,) of the bearings' rates, as the rates that were computed last say."""
        return self.axles.accelerations_in(self.held)

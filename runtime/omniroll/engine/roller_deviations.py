"""How deviations pass where rollers come to rest on their disks, stick and break away where wheels may slip.

Under a smooth law of the ground the state goes on through all of that, and rates jump at times that deviate. What comes
to rest does so by its own bearing alone. So with what the torques of bearings do to the rates, R, and to the spins, W,

    d* = d- - R W^-1 ds                              (ds: of the spins that have come to rest)

whatever their order was. Where one turns back at once, or where others change their modes with it, that happens at a
time that deviates, dt = -ds/s', and with the rates f* of rollers that stick d+ = d* + (f* - f+) dt. One breaks away
where what holds it comes to its bound,

    d+ = d- + (f- - f+) dt,   dt = -d excess / excess',

and where sliding and break-away torques are the same rates do not jump there, and neither do deviations. Rollers feel
each other: those that change their modes together, but to stick, must do so beside the run, too.

Axles that stick are bearings like these. They are told here where they change their modes together with rollers, and in
axle_deviations.py where they do alone.

There is no derivative where a spin only just comes to zero, and where what is asked of a bearing only just comes to its
bound, or is at it in what begins.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from omniroll.engine.axle_deviations import GRAZES, JUMPS, REACHED, TOGETHER, AxleDeviations
from omniroll.engine.axle_modes import TORQUE
from omniroll.engine.contact_modes import ContactModes
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.roller_modes import FREE, IN_CONTACT, KEPT, RollerModes, spins
from omniroll.errors import NoDerivativeError
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent

AT_REST = 1e-13  # of what they are differences of: deviations of spins are rounding


class RollerDeviations:
    """The deviations of one run in P columns, where its rollers come to rest on their disks and break away.

    Bearings (B,) are those of axles (N,), if these may stick, then those of the rollers (N n,) by place.
    """

    def __init__(self, motion: Motion, columns: Columns):
        self.motion, self.columns, self.deviations = motion, columns, motion.deviations
        self.rollers: RollerModes = motion.rollers
        self.contacts: ContactModes | None = motion.contacts
        self.axles = None if motion.axles is None else AxleDeviations(motion, columns)
        self.of_axles = 0 if self.axles is None else motion.plain.wheels
        self.shape = self.rollers.sliding.shape

    # Numbers and modes of all bearings

    def _all(self, of_axles: np.ndarray, of_rollers: np.ndarray) -> np.ndarray:
        """(..., B) of values of axles (..., N) and of rollers (..., N, n)."""
        of_rollers = of_rollers.reshape(*of_rollers.shape[:-2], -1)
        return of_rollers if self.axles is None else np.concatenate([of_axles, of_rollers], axis=-1)

    def _split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The inverse of _all; of axles that may not stick (..., 0)."""
        of_rollers = values[..., self.of_axles :]
        return values[..., : self.of_axles], of_rollers.reshape(*of_rollers.shape[:-1], *self.shape)

    @cached_property
    def modes(self) -> np.ndarray:
        """(T, B) as those of the rollers are."""
        return self._all(None if self.axles is None else self.motion.axles.modes, self.rollers.modes)

    @cached_property
    def sliding(self) -> np.ndarray:
        return self._all(None if self.axles is None else self.motion.axles.sliding, self.rollers.sliding)

    @cached_property
    def holding(self) -> np.ndarray:
        return self._all(None if self.axles is None else self.motion.axles.holding, self.rollers.holding)

    @cached_property
    def inertias(self) -> np.ndarray:
        """(B,) in kg m^2."""
        vehicle = self.motion.plain.vehicle
        wheels = np.full(self.shape[0], vehicle.wheel_inertia)
        return self._all(wheels, np.full(self.shape, vehicle.roller_inertia))

    @cached_property
    def torques(self) -> tuple[np.ndarray, np.ndarray]:
        """(P, N, n) deviations of the torques of rollers that turn, and of the largest at rest."""
        own, place = self.columns.signals, self.rollers.place
        zero = np.zeros((len(self.columns), self.shape[0]))
        sliding, most = (own.get((place, f"roller_{what}"), zero) for what in ("coulomb", "break_away"))
        given = self.columns.effects[place].roller_break_away is not None
        found = (np.repeat(moved[..., None], self.shape[1], axis=-1) for moved in (sliding, most if given else sliding))
        return tuple(found)

    def given(self, rows: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Deviations of value and slope (S, P, ...) of the rollers' torques in the steps from rows (S,), by the input's
        name."""
        moved = self.rollers.given(-self.rollers.modes[rows][:, None] * self.torques[0])
        return {name: (part, np.zeros_like(part)) for name, part in moved.items()}

    def held(self, rows: np.ndarray) -> tuple[Mapping, Mapping]:
        """What generated functions take of the rollers in rows (k,), by name; no number moves it."""
        return self.rollers.at(rows), self.rollers.at(rows)

    # When something happens

    @cached_property
    def changes(self) -> np.ndarray:
        """(T - 1,) bool: whether rollers change their modes between a row and the next, where no time passes and no
        wheel switches."""
        modes = self.rollers.modes
        found = (modes[:-1] != modes[1:]).any(axis=(1, 2)) & ~self.motion.starts_step[:-1]
        found[self.motion.switched - 1] = False
        return found

    @cached_property
    def turns_alone(self) -> np.ndarray:
        """(T,) bool: whether rollers change their modes in a row that ends one step and starts the next."""
        return self.rollers.alone

    def _at_switch(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """(N, n) modes by place before and after wheels switch behind a row, each roller at its place before."""
        return self.rollers.modes[row], self.rollers.by_roller_of(row + 1, row, self.rollers.modes)

    def refuse_rests(self, row: int) -> None:
        """Raises NoDerivativeError where a roller comes to rest just as a wheel switches, behind a row."""
        before, after = self._at_switch(row)
        rests = (before != 0) & (before != after)
        if rests.any():
            reason = "a roller comes to rest on its disk just as a wheel switches"
            raise self._none(row, reason, self._of_rollers(rests))

    def refuse_orders(self, row: int, wheels: np.ndarray) -> None:
        """Raises NoDerivativeError where wheels that switch together behind a row, and apart beside the run, change the
        modes of rollers."""
        before, after = self._at_switch(row)
        if (before != after).any():
            changed = self._of_rollers(before != after)
            raise self._none(
                row, "wheels switch together, and rollers decide with them in more than one order", changed
            )

    def _of_rollers(self, chosen: np.ndarray) -> np.ndarray:
        """(B,) bool, of rollers (N, n)."""
        return self._all(np.zeros(self.shape[0], bool), chosen)

    # What happens

    def began(self, moved: np.ndarray) -> np.ndarray:
        """(m, P) the deviations with which a run starts: what sticks has no spin beside it either."""
        modes = self.modes[0]
        moves = (np.abs(self._turning(0, moved)) > AT_REST * self._sizes(0, moved)[:, None]).any(axis=0)
        self._refuse_edges(0, modes)
        still = self._of_rollers(np.abs(self.rollers.spins[0]) <= self.rollers.rest)
        loose = (modes != 0) & still & moves
        if loose.any():
            raise self._none(0, "a roller begins to turn from rest, and turns beside the run", loose)
        rests = (modes == 0) & moves
        return self._rested(0, np.where(rests, 1, modes), moved, rests)

    def _sizes(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(P,) what deviations of spins are differences of."""
        places, scale = self.deviations.places, self.motion.plain.vehicle.yaw_scale
        speeds = np.concatenate([places[name].ravel() for name in ("rates", "contact_omega", "axial")])
        by_disks = np.abs(moved[2]) + np.abs(self.motion.y[row, 2]) * np.abs(moved[places["chi"]]).max(axis=0)
        return np.abs(moved[speeds]).max(axis=0) + by_disks / scale

    def passed(self, row: int, moved: np.ndarray, knot: np.ndarray | None, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the deviations after rollers, or rollers and axles, have changed their modes between a row and the
        next.

        knot    (P,) by how much the time deviates at which a drive jumps there; None where none does
        inputs  (U, 1 + P) how fast the phase's inputs change, and their deviations
        """
        before, after = self.modes[row : row + 2]
        if self.contacts is not None and (self.contacts.carries[row] != self.contacts.carries[row + 1]).any():
            reason = "a roller changes its mode just as a load vanishes or comes back"
            raise self._none(row, reason, before != after)
        if not self.motion.drives_jump(row, (TORQUE, *KEPT, "carries")):
            return self._after(row, before, after, moved, inputs)
        stops = (before != 0) & (before != after)
        times = np.zeros((1, len(self.columns))) if knot is None else knot[None]
        if stops.any():
            times = np.concatenate([times, self._times_of_stops(row, before, after, moved, stops)])
        self._refuse_edges(row + 1, after)
        self._refuse_apart(row, times, before != after)
        rates = self.motion.rates
        return moved + (rates[row] - rates[row + 1])[:, None] * times[0]

    def turned(self, row: int, moved: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """(m, P) the same after they have in a row that ends one step and starts the next."""
        return self._after(row, self.modes_of_step(row), self.modes[row], moved, inputs)

    def modes_of_step(self, row: int) -> np.ndarray:
        """(B,) those of the step that ends in a row."""
        step = int(np.searchsorted(self.motion.trajectory.step_rows, row)) - 1
        of_axles = None if self.axles is None else self.motion.axles.of_steps[step]
        return self._all(of_axles, self.rollers.of_steps[step])

    def _after(
        self, row: int, before: np.ndarray, after: np.ndarray, moved: np.ndarray, inputs: np.ndarray
    ) -> np.ndarray:
        """(m, P) the deviations after the modes (B,) have changed where no drive jumps."""
        stops = (before != 0) & (before != after)
        resting = np.where(stops, 0, before)
        others, times = resting != after, []
        if stops.any():
            times.append(self._times_of_stops(row, before, after, moved, stops))
        self._refuse_edges(row, after)
        found = self._rested(row, before, moved, stops)
        if not others.any():
            return found
        (f, dots), (later, dots_later) = self._rates(row, resting), self._rates(row, after)
        if not (np.abs(dots - dots_later) > JUMPS * self._possible(row, before, after))[others].any():
            return found
        gone = others & ~stops
        if gone.any():
            times += self._times_of_release(row, before, moved, gone, inputs, must=not stops.any())
        times = np.concatenate(times)
        self._refuse_apart(row, times, others)
        return found + (f - later)[:, None] * times[0]

    # In a row, where bearings have modes (B,)

    def _known(
        self, row: int, modes: np.ndarray, kernel: TangentKernel, y: np.ndarray, inputs: np.ndarray
    ) -> dict[str, np.ndarray]:
        """What generated functions take and give in states y (..., size) with inputs (..., U) that carry tangents."""
        given, places = np.array(inputs), self.deviations.views(np.arange(inputs.shape[-1]))
        stuck, torques = self._by_input(modes == 0), self._by_input(-modes * self.sliding)
        for name, own in stuck.items():
            moves = given[..., places[name]]
            given[..., places[name]] = np.where(own, 0.0, moves - moves.real + torques[name])
        held = self.motion.held_at(np.array(row))
        if self.contacts is not None and kernel is self.columns.kernel:
            held = self.contacts.moved(held, self.columns.constants, 0)
        of_axles, of_rollers = self._split(modes)
        held |= self.rollers.where(of_rollers == 0)
        held |= {} if self.axles is None else {"axle_sticks": (of_axles == 0).astype(float)}
        return self.deviations.known_of(kernel, y, given, held)

    def _by_input(self, values: np.ndarray) -> dict[str, np.ndarray]:
        """Values (B,) by the inputs of generated functions that are torques of these bearings."""
        of_axles, of_rollers = self._split(values)
        return self.rollers.given(of_rollers) | ({} if self.axles is None else {TORQUE: of_axles})

    def _dots(self, known: Mapping[str, np.ndarray]) -> np.ndarray:
        """(..., B) in rad/s^2, accelerations of the wheels and of the rollers' spins."""
        of_rollers = np.concatenate([known["contact_spin_dot"][..., None], known["spins_dot"]], axis=-1)
        return self._all(known["rates_dot"], of_rollers)

    def _asked(self, known: Mapping[str, np.ndarray]) -> np.ndarray:
        """(..., B) in N m, what holds bearings that stick; 0 of others."""
        of_rollers = np.concatenate([known["contact_holding"][..., None], known["free_holding"]], axis=-1)
        return self._all(known.get("axle_holding"), of_rollers)

    def _in_run(self, row: int, modes: np.ndarray) -> dict[str, np.ndarray]:
        motion = self.motion
        return self._known(row, modes, motion.plain, motion.y[row], motion.inputs[row])

    def _rates(self, row: int, modes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(m,) the rates, and (B,) what _dots gives."""
        known = self._in_run(row, modes)
        return self.deviations.rates_among(known), self._dots(known)

    def _turning(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(P, B) deviations of the rates of wheels and of the spins, where the state has these (m, P)."""
        views = self.motion.vector.views(with_tangent(self.motion.y[row], self.motion.whole(moved.T)))
        return tangent_of(self._all(views["rates"], spins(self.columns.kernel, views)))

    def _rested(self, row: int, before: np.ndarray, moved: np.ndarray, rests: np.ndarray) -> np.ndarray:
        """(m, P) d*: what is left where the speeds of some bearings (B,) bool, which turn before, are taken away."""
        left = self._turning(row, moved)[:, rests]
        if not left.any():
            return moved
        places = self.deviations.views(np.arange(self.deviations.input_size))
        of_rollers = np.concatenate([places[IN_CONTACT][:, None], places[FREE]], axis=1)
        own = self._all(places.get(TORQUE), of_rollers)[rests]
        inputs = self.motion.inputs[row]
        pushed = np.zeros((len(own), len(inputs)))
        pushed[np.arange(len(own)), own] = 1.0
        y = np.broadcast_to(self.motion.y[row], (len(own), self.motion.vector.size))
        known = self._known(row, before, self._carrying, y, with_tangent(inputs, pushed))
        rates, dots = tangent_of(self.deviations.rates_among(known)), tangent_of(self._dots(known))[:, rests]
        return moved - (np.linalg.solve(dots.T, left.T).T @ rates).T

    @cached_property
    def _carrying(self) -> TangentKernel:
        """The functions of a motion, on numbers that carry tangents; no number of the vehicle deviates."""
        return TangentKernel(self.motion.plain)

    # When it happens beside the run

    def _possible(self, row: int, *modes: np.ndarray) -> np.ndarray:
        """(B,) in rad/s^2, accelerations that bearings could have: by what acts on them in some modes, and by what they
        take."""
        known = [self._in_run(row, own) for own in modes]
        acting = [np.abs(self._dots(own)) + np.abs(self._asked(own)) / self.inertias for own in known]
        return np.max(acting, axis=0) + self.holding / self.inertias

    def _times_of_stops(
        self, row: int, before: np.ndarray, after: np.ndarray, moved: np.ndarray, stops: np.ndarray
    ) -> np.ndarray:
        """(k, P) by how much the times deviate at which the speeds of some bearings (B,) bool come to zero."""
        _, dots = self._rates(row, before)
        slow = stops & (np.abs(dots) <= GRAZES * self._possible(row, before, after))
        if slow.any():
            reason = "a bearing only just comes to rest, so that a change however small lets it turn on"
            raise self._none(row, reason, slow)
        return -self._turning(row, moved)[:, stops].T / dots[stops, None]

    def _times_of_release(
        self, row: int, before: np.ndarray, moved: np.ndarray, released: np.ndarray, inputs: np.ndarray, must: bool
    ) -> list[np.ndarray]:
        """[(k, P)] the same where what bearings are asked for comes to its bound, of those where it has.

        must  whether it has to: nothing else lets them go
        """
        motion, columns = self.motion, self.columns.behind_another(self.motion.trajectory)
        along = np.concatenate([self._rates(row, before)[0][:, None], moved], axis=1)  # the first is that of the time
        y, ahead = with_tangent(motion.y[row], motion.whole(along.T)), RollerDeviations(motion, columns)
        asked = self._asked(ahead._known(row, before, columns.kernel, y, with_tangent(motion.inputs[row], inputs.T)))
        of_axles = None if ahead.axles is None else ahead.axles.torques[1]
        most = self._all(of_axles, ahead.torques[1])
        slopes = (np.sign(asked[0].real) * tangent_of(asked) - most).T
        rises = slopes[:, 0] * self._time_in(before, row) > GRAZES * self.holding
        reached = released & (np.abs(asked[0].real) >= (1 - REACHED) * self.holding)
        slow = (reached & ~rises) | (released & ~reached & must)
        if slow.any():
            reason = "what a bearing holds only just comes to its bound, so that a change however small lets it stay"
            raise self._none(row, reason, slow)
        return [-slopes[reached, 1:] / slopes[reached, :1]] if reached.any() else []

    def _time_in(self, before: np.ndarray, row: int) -> float:
        """For how long the bearings have had the modes with which they come to a row."""
        last = row if (self.modes[row] == before).all() else row - 1
        elapsed = self.motion.trajectory.elapsed
        return self.motion.time_in_modes(self.modes, last) + float(elapsed[row] - elapsed[last])

    # What has no derivative

    def _refuse_edges(self, row: int, modes: np.ndarray) -> None:
        """Raises NoDerivativeError where a bearing sticks in these modes that is asked for all that it takes."""
        asked = np.abs(self._asked(self._in_run(row, modes)))
        edge = (modes == 0) & (asked >= (1 - REACHED) * self.holding)
        if edge.any():
            reason = "a bearing sticks by all its friction, so that a change however small lets it go"
            raise self._none(row, reason, edge)

    def _refuse_apart(self, row: int, times: np.ndarray, bearings: np.ndarray) -> None:
        apart = np.ptp(times, axis=0) > TOGETHER * np.abs(times).max(axis=0)
        if apart.any():
            names = ", ".join(np.array(self.columns.names)[apart])
            reason = f"several bearings stop or break away together, and apart where a number changes; by {names}"
            raise self._none(row, reason, bearings)

    def _none(self, row: int, reason: str, bearings: np.ndarray) -> NoDerivativeError:
        of_axles, of_rollers = self._split(bearings)
        wheels = {*np.flatnonzero(of_axles).tolist(), *np.flatnonzero(of_rollers.any(axis=1)).tolist()}
        return NoDerivativeError(reason, t=float(self.motion.trajectory.t[row]), wheels=tuple(sorted(wheels)))

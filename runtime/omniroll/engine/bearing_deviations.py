"""The bearings of a run that may stick beside wheels that may slip, and what deviates of them.

They are one list (B,): those of axles (N,), if these may stick, then those of the rollers (N n,) by place, if these
may. How deviations pass what happens to them is told in axle_deviations.py where axles alone have a part in it, in
roller_deviations.py where rollers do, and in standing_deviations.py where contacts stick, too.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from omniroll.engine.axle_modes import TORQUE, AxleModes
from omniroll.engine.contact_modes import ContactModes
from omniroll.engine.events_beside import REACHED, apart, no_derivative
from omniroll.engine.massless_modes import StripModes
from omniroll.engine.motion import Columns, Motion
from omniroll.engine.roller_modes import FREE, IN_CONTACT, RollerModes, spins
from omniroll.errors import NoDerivativeError
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent

AT_REST = 1e-13  # of what they are differences of: deviations of rates are rounding
KINDS = {"axle": "an axle comes to rest", "roller": "a roller comes to rest on its disk"}


class BearingDeviations:
    """The bearings (B,) of one run, and their deviations in P columns.

    axles, rollers  the modes of each; None where they may not stick
    wheel_of        (B,) the wheels of the bearings
    """

    name = "bearing"  # what errors call one

    def __init__(
        self,
        motion: Motion,
        columns: Columns,
        axles: AxleModes | None,
        rollers: RollerModes | StripModes | None,
    ):
        self.motion, self.columns, self.deviations = motion, columns, motion.deviations
        self.contacts: ContactModes | None = motion.contacts
        self.axles, self.rollers, self.wheels = axles, rollers, motion.plain.wheels
        self.of_axles = 0 if axles is None else self.wheels
        self.shape = (self.wheels, 0) if rollers is None else rollers.sliding.shape
        numbers = np.arange(self.wheels)
        self.wheel_of = self._all(numbers, np.broadcast_to(numbers[:, None], self.shape))

    # Numbers and modes of all bearings

    def _all(self, of_axles: np.ndarray, of_rollers: np.ndarray) -> np.ndarray:
        """(..., B) of values of axles (..., N) and of rollers (..., N, n)."""
        if self.rollers is None:
            return of_axles
        of_rollers = of_rollers.reshape(*of_rollers.shape[:-2], -1)
        return of_rollers if self.axles is None else np.concatenate([of_axles, of_rollers], axis=-1)

    def split(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The inverse of _all; of axles that may not stick (..., 0), of rollers that may not (..., N, 0)."""
        of_rollers = values[..., self.of_axles :]
        return values[..., : self.of_axles], of_rollers.reshape(*of_rollers.shape[:-1], *self.shape)

    def _of_modes(self, name: str) -> np.ndarray:
        """(..., B) what the modes of axles and of rollers call so."""
        own = (None if modes is None else getattr(modes, name) for modes in (self.axles, self.rollers))
        return self._all(*own)

    @cached_property
    def modes(self) -> np.ndarray:
        """(T, B) as those of axles and rollers are."""
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
        """(B,) in kg m^2."""
        vehicle = self.motion.plain.vehicle
        wheels = np.full(self.wheels, vehicle.wheel_inertia)
        return self._all(wheels, np.full(self.shape, vehicle.roller_inertia))

    @cached_property
    def torques(self) -> tuple[np.ndarray, np.ndarray]:
        """(P, B) deviations of the torques of bearings that turn, and of the largest at rest."""
        of_wheels = (("wheel", self.axles), ("roller", self.rollers))
        moved = [None if modes is None else torques_of(self.columns, body, modes.place) for body, modes in of_wheels]
        axles, rollers = ((None, None) if own is None else own for own in moved)
        if self.rollers is not None:
            rollers = tuple(np.repeat(own[..., None], self.shape[1], axis=-1) for own in rollers)
        sliding, most = (self._all(*own) for own in zip(axles, rollers, strict=True))
        return sliding, most

    def by_input(self, values: np.ndarray) -> dict[str, np.ndarray]:
        """Values (..., B) by the inputs of generated functions that are torques of these bearings."""
        of_axles, of_rollers = self.split(values)
        found = {} if self.rollers is None else self.rollers.given(of_rollers)
        return found if self.axles is None else found | {TORQUE: of_axles}

    def given(self, rows: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Deviations of value and slope (S, P, ...) of the bearings' torques in the steps from rows (S,), by the
        input's name."""
        moved = self.by_input(-self.modes[rows][:, None] * self.torques[0])
        return {name: (part, np.zeros_like(part)) for name, part in moved.items()}

    def held(self, rows: np.ndarray) -> tuple[Mapping, Mapping]:
        """What generated functions take of the bearings in rows (k,), by name; no number moves it."""
        return self.at(rows), self.at(rows)

    def at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """The same in rows (...)."""
        return self.where(self.modes[rows] == 0)

    def carried(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """The same, carrying the tangents of all columns."""
        return self.at(rows)

    def where(self, stuck: np.ndarray) -> dict[str, np.ndarray]:
        """The same where bearings (..., B) bool stick."""
        of_axles, of_rollers = self.split(stuck)
        found = {} if self.axles is None else {"axle_sticks": of_axles.astype(float)}
        return found if self.rollers is None else found | self.rollers.where(of_rollers)

    # What generated functions give of them

    @cached_property
    def places(self) -> np.ndarray:
        """(B,) the places of their torques among the inputs."""
        places = self.deviations.views(np.arange(self.deviations.input_size))
        if self.rollers is None:
            return places[TORQUE]
        of_rollers = np.concatenate([places[IN_CONTACT][:, None], places[FREE]], axis=1)
        return self._all(places.get(TORQUE), of_rollers)

    @cached_property
    def speeds(self) -> np.ndarray:
        """(B,) the places of their speeds in what deviates: of the wheels' rates, and of the rollers' axial speeds."""
        places = self.deviations.places
        if self.rollers is None:
            return places["rates"]
        of_rollers = np.concatenate([places["contact_omega"][:, None], places["axial"]], axis=1)
        return self._all(places["rates"], of_rollers)

    def dots(self, known: Mapping[str, np.ndarray]) -> np.ndarray:
        """(..., B) in rad/s^2, accelerations of the wheels and of the rollers' spins."""
        if self.rollers is None:
            return known["rates_dot"]
        of_rollers = np.concatenate([known["contact_spin_dot"][..., None], known["spins_dot"]], axis=-1)
        return self._all(known["rates_dot"], of_rollers)

    def asked(self, known: Mapping[str, np.ndarray]) -> np.ndarray:
        """(..., B) in N m, what holds bearings that stick; 0 of rollers that turn."""
        if self.rollers is None:
            return known["axle_holding"]
        of_rollers = np.concatenate([known["contact_holding"][..., None], known["free_holding"]], axis=-1)
        return self._all(known.get("axle_holding"), of_rollers)

    def turning(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(P, B) deviations of the rates of wheels and of the spins, where the state has these (m, P)."""
        views = self.motion.vector.views(with_tangent(self.motion.y[row], self.motion.whole(moved.T)))
        return tangent_of(self.rates_in(views))

    def rates_in(self, views: Mapping[str, np.ndarray]) -> np.ndarray:
        """(..., B) the rates of wheels and the spins, which may carry tangents."""
        of_rollers = None if self.rollers is None else spins(self.columns.kernel, views)
        return self._all(views.get("rates"), of_rollers)

    def of_standing(self, stands: np.ndarray) -> np.ndarray:
        """(m,) the places of those that hold wheels which stand along the axle and along the rolling direction,
        (N, 2) bool: of each wheel in this order."""
        first = self.of_axles + self.shape[1] * np.arange(self.wheels)
        return np.stack([first, np.arange(self.wheels)], axis=1)[stands]

    # In a row, where bearings have modes (B,)

    def known(
        self, row: int, modes: np.ndarray, kernel: TangentKernel, y: np.ndarray, inputs: np.ndarray
    ) -> dict[str, np.ndarray]:
        """What generated functions take and give in states y (..., size) with inputs (..., U) that carry tangents."""
        given, places = np.array(inputs), self.deviations.views(np.arange(inputs.shape[-1]))
        stuck, torques = self.by_input(modes == 0), self.by_input(-modes * self.sliding)
        for name, own in stuck.items():
            moves = given[..., places[name]]
            given[..., places[name]] = np.where(own, 0.0, moves - moves.real + torques[name])
        held = self.motion.held_at(np.array(row))
        if self.contacts is not None and kernel is self.columns.kernel:
            held = self.contacts.moved(held, self.columns.constants, 0)
        held |= self.where(modes == 0)
        return self.deviations.known_of(kernel, y, given, held)

    def rested(self, row: int, before: np.ndarray, moved: np.ndarray, rests: np.ndarray) -> np.ndarray:
        """(m, P) d*: what is left where the speeds of some bearings (B,) bool, which turn before, are taken away."""
        left = self.turning(row, moved)[:, rests]
        if not left.any():
            return moved
        own = self.places[rests]
        inputs = self.motion.inputs_in(row)
        pushed = np.zeros((len(own), len(inputs)))
        pushed[np.arange(len(own)), own] = 1.0
        y = np.broadcast_to(self.motion.y[row], (len(own), self.motion.vector.size))
        known = self.known(row, before, self._carrying, y, with_tangent(inputs, pushed))
        rates, dots = tangent_of(self.deviations.rates_among(known)), tangent_of(self.dots(known))[:, rests]
        return moved - (np.linalg.solve(dots.T, left.T).T @ rates).T

    @cached_property
    def _carrying(self) -> TangentKernel:
        """The functions of a motion, on numbers that carry tangents; no number of the vehicle deviates."""
        return TangentKernel(self.motion.plain)

    # What moves at the start

    def moves(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(B,) bool: bearings whose rates deviate by more than rounding, where the state does by (m, P)."""
        return (np.abs(self.turning(row, moved)) > AT_REST * self._sizes(row, moved)[:, None]).any(axis=0)

    def _sizes(self, row: int, moved: np.ndarray) -> np.ndarray:
        """(P,) what deviations of rates and spins are differences of."""
        places, scale = self.deviations.places, self.motion.plain.vehicle.yaw_scale
        names = (name for name in ("rates", "contact_omega", "axial") if name in places)
        speeds = np.concatenate([places[name].ravel() for name in names])
        by_disks = np.abs(moved[2]) + np.abs(self.motion.y[row, 2]) * np.abs(moved[places["chi"]]).max(axis=0)
        return np.abs(moved[speeds]).max(axis=0) + by_disks / scale

    def refuse_loose(self, row: int, moves: np.ndarray) -> None:
        """Raises NoDerivativeError where a roller begins to turn from rest in a row, of bearings (B,) bool that have
        a rate beside the run."""
        if self.rollers is None:
            return
        still = self._all(np.zeros(self.wheels, bool), np.abs(self.rollers.spins[row]) <= self.rollers.rest)
        loose = (self.modes[row] != 0) & still & moves
        if loose.any():
            raise self.none(row, "a roller begins to turn from rest, and turns beside the run", loose)

    # When something happens

    @cached_property
    def changes(self) -> np.ndarray:
        """(T - 1,) bool: whether bearings change their modes between a row and the next, where no time passes and no
        wheel switches."""
        found = (self.modes[:-1] != self.modes[1:]).any(axis=1) & ~self.motion.starts_step[:-1]
        found[self.motion.switched - 1] = False
        return found

    @cached_property
    def turns_alone(self) -> np.ndarray:
        """(T,) bool: whether rollers change their modes in a row that ends one step and starts the next."""
        return np.zeros(len(self.modes), bool) if self.rollers is None else self.rollers.alone

    def modes_of_step(self, row: int) -> np.ndarray:
        """(B,) those of the step that ends in a row."""
        return self._of_modes("of_steps")[int(np.searchsorted(self.motion.trajectory.step_rows, row)) - 1]

    # What has no derivative

    def _at_switch(self, row: int) -> tuple[np.ndarray, np.ndarray]:
        """(B,) modes before and after wheels switch behind a row, each roller at its place before."""
        of_axles = None if self.axles is None else self.axles.modes[row + 1]
        of_rollers = None if self.rollers is None else self.rollers.by_roller_of(row + 1, row, self.rollers.modes)
        return self.modes[row], self._all(of_axles, of_rollers)

    def refuse_rests(self, row: int) -> None:
        """Raises NoDerivativeError where a bearing comes to rest just as a wheel switches, behind a row."""
        before, after = self._at_switch(row)
        rests = (before != 0) & (before != after)
        if rests.any():
            kind = "axle" if rests[: self.of_axles].any() else "roller"
            raise self.none(row, f"{KINDS[kind]} just as a wheel switches", rests)

    def refuse_orders(self, row: int, wheels: np.ndarray) -> None:
        """Raises NoDerivativeError where wheels that switch together behind a row, and apart beside the run, change the
        modes of bearings."""
        before, after = self._at_switch(row)
        if (before != after).any():
            reason = f"wheels switch together, and {self.name}s decide with them in more than one order"
            raise self.none(row, reason, before != after)

    def refuse_lifts(self, row: int, bearings: np.ndarray) -> None:
        """Raises NoDerivativeError where bearings (B,) bool change their modes just as a load does."""
        carries = None if self.contacts is None else self.contacts.carries[row : row + 2]
        if carries is not None and (carries[0] != carries[1]).any():
            reason = f"{article(self.name)} changes its mode just as a load vanishes or comes back"
            raise self.none(row, reason, bearings)

    def refuse_at_bound(self, row: int, stuck: np.ndarray, asked: np.ndarray) -> None:
        """Raises NoDerivativeError where one of those that stick (B,) bool is asked (B,) for all that it takes."""
        edge = stuck & (np.abs(asked) >= (1 - REACHED) * self.holding)
        if edge.any():
            reason = f"{article(self.name)} sticks by all its friction, so that a change however small lets it go"
            raise self.none(row, reason, edge)

    def refuse_apart(self, row: int, times: np.ndarray, bearings: np.ndarray) -> None:
        """Raises NoDerivativeError where instants of bearings, with deviations (k, P), part beside the run."""
        names = apart(self.columns.names, times)
        if names:
            reason = f"several {self.name}s stop or break away together, and apart where a number changes; by {names}"
            raise self.none(row, reason, bearings)

    def none(self, row: int, reason: str, bearings: np.ndarray) -> NoDerivativeError:
        """The error, where this happens to some bearings: (B,) bool, or their places."""
        return no_derivative(self.motion.trajectory.t[row], reason, self.wheel_of[bearings])


def torques_of(columns: Columns, body: str, place: int) -> tuple[np.ndarray, np.ndarray]:
    """(P, N) deviations of the torques of the bearings of each wheel, or of its rollers, where they turn, and of the
    largest at rest: of the effect at this place."""
    own, zero = columns.signals, np.zeros((len(columns), columns.plain.wheels))
    sliding, most = (own.get((place, f"{body}_{what}"), zero) for what in ("coulomb", "break_away"))
    given = getattr(columns.effects[place], f"{body}_break_away") is not None
    return sliding, most if given else sliding


def article(name: str) -> str:
    """The word with its article."""
    return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"

"""Contacts, axles and massless rollers that may all stick, where the rollers' bearings have viscous friction, too.

The rules of ground_with_massless_rollers.py hold but for contacts whose rollers turn: there the bearing's force goes
with the spin, T + c phi', and the spin is what the slip leaves of the speed along the axle. Both follow from the state
(maxima/effects/contact_damped_strip.mac).

1. Such a contact slips in the direction of its true slip, and comes to rest where that vanishes. Passing zero along
   the rolling direction alone is no rest where the bearing would take more than the ground gives.
2. Where it sticks, it gives way as the ellipse says of a force whose part along the axle moves with the state. Rest
   both ways is decided at no spin, where viscous friction has no part.
3. Where it gives way while its bearing takes more than the sliding friction along the axle, it slips along the axle at
   once and its roller goes on turning, slower; it stops only where the Coulomb part alone takes as much (rule 4 there).
"""

import numpy as np

from omniroll.effects.bound_rates import BoundRates
from omniroll.effects.ground import EPS, HELD_ROUNDINGS, Grip, Ground
from omniroll.effects.ground_flow import GroundFlow
from omniroll.effects.ground_with_axles import Evaluate
from omniroll.effects.ground_with_massless_rollers import GroundWithMasslessRollers, StripFlow
from omniroll.effects.guards import PASSED
from omniroll.effects.slipping_bearings import SlippingBearings
from omniroll.kernels.kernel import Flow, Kernel
from omniroll.vehicles.state import State

ALONG_THE_AXLE = 1e-6  # a way with less of the rolling direction is that of the axle
LEFT_AT_REST = 4.0  # roundings: of what is left of a slip at its rest the bearing may take so much more


class GroundWithDampedRollers(GroundWithMasslessRollers):
    """Contacts, axles and massless rollers in one run.

    yields  (N,) in m/(s N), slip along the axle per force of contacts that slip and whose rollers turn, at an instant
    """

    def __init__(self, kernel: Kernel, grip: Grip, bearings: SlippingBearings, held: dict[str, np.ndarray]):
        super().__init__(kernel, grip, bearings, held)
        self.damping = np.asarray(kernel.constant("roller_damping"), float)
        self.yields = np.zeros(kernel.wheels)

    # What the state says

    def _find_resting(self, state: State) -> None:
        """The same; a contact whose roller turns rests where its true slip does."""
        bearings, places = self.axles, self.axles.contact
        resting = self.resting.copy()
        super()._find_resting(state)
        rounding = self.roundings(state.nu, state.rates, None)
        slip = self._true_slips(state.nu, state.chi, state.rates, ~bearings.resting[places])
        rests = resting | self.still | (np.linalg.norm(slip, axis=1) <= rounding)
        self.resting &= bearings.resting[places] | rests

    def _true_slips(self, nu: np.ndarray, chi: np.ndarray, rates: np.ndarray, turns: np.ndarray) -> np.ndarray:
        """(N, 2) in m/s: of contacts that slip whose rollers turn, (N,) bool, the slip, of others that of rigid wheels;
        and puts their yields."""
        given = {"nu": nu, "chi": chi, "rates": rates, "load": np.where(self.off, 1.0, self.load)}
        given |= {"friction": self.grip.sliding, "slip_direction": np.tile([0.0, 1.0], (len(turns), 1))}
        taken = -self.turning * self.axles.sliding[self.axles.contact]
        given |= {"contact_sticks": (~turns).astype(float), "contact_bearing": np.where(turns, taken, 0.0)}
        given |= {"ground_push": np.zeros((len(turns), 2)), "ground_yield": np.zeros(len(turns))}
        _, yields, _ = self._called("damped_corners", given)
        self.yields = np.where(turns & ~self.off, yields, 0.0)
        return self._called("slip_forces", given | {"damped_yield": self.yields})[0]

    def _called(self, name: str, given: dict[str, np.ndarray]) -> tuple[np.ndarray, ...]:
        return self.kernel.call(name, *(given[argument.name] for argument in self.kernel.signatures[name].inputs))

    def used_up(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same; of a slip that comes to rest rounding is left, and the bearing feels it."""
        values, rounded = super().used_up(force)
        speeds = self.roundings(self.held["nu"], self.held["rates"], None)
        reach = np.where(self.off, 1.0, self.load * self.grip.static[:, 0])
        of_slip = np.abs(force[:, 0]) * self._dampers() * speeds / reach**2
        return values, rounded + np.where(self.turning != 0, LEFT_AT_REST * of_slip / PASSED, 0.0)

    def _dampers(self) -> np.ndarray:
        """(N,) in N s/m, of the bearings along the axles."""
        return self.damping / self._reach(self.held["chi"]) ** 2

    # What follows

    def inputs(self, sticks: np.ndarray, stuck: np.ndarray, torques: np.ndarray) -> dict[str, np.ndarray]:
        """What the rates take, by name, where contacts (N,) and bearings (B,) stick and others have torques (B,)."""
        return super().inputs(sticks, stuck, torques) | {"damped_yield": self.yields}

    def direction(self, slip: np.ndarray, rounding: np.ndarray) -> np.ndarray:
        """(N, 2) along the slip (N, 2), or where that is rounding, where the contact went last."""
        return Ground.direction(self, slip, rounding)

    def aim(self, slip: np.ndarray, slides: np.ndarray) -> None:
        """Where the contacts `slides` (N,) bool go, which slip with (N, 2) in m/s."""
        Ground.aim(self, slip, slides)

    def sliding_forces(self, loads: np.ndarray) -> np.ndarray:
        """(N, 2) in N, the forces on contacts that slip, or begin to."""
        return Ground.sliding_forces(self, loads)

    def begin(self, slip: np.ndarray, evaluate: Evaluate) -> None:
        """Modes in the phase that begins now; `slip` is that in the modes before, and not asked."""
        super().begin(self._slips_now(), evaluate)

    def _slips_now(self) -> np.ndarray:
        """(N, 2) in m/s, and puts the yields."""
        held, slides = self.held, ~self.resting & (self.turning != 0)
        return self._true_slips(held["nu"], held["chi"], held["rates"], slides)

    def _taken_along(self) -> np.ndarray:
        """(N,) in N, what the bearings take along the axles of wheels that roll there, or whose rollers stand."""
        rolls = self._dampers() * np.abs(self.rows_along @ self.held["nu"])
        return super()._taken_along() + np.where(self._turned(), rolls, 0.0)

    def _stop_rollers(self, slid: np.ndarray) -> bool:
        """Whether contacts of `slid` (N,) bool, whose rollers turn, give way along their axles (rule 3)."""
        stopped = super()._stop_rollers(slid)
        most = self.load * self.grip.sliding[:, 0]
        most[self.released] *= 1 - PASSED * HELD_ROUNDINGS * EPS  # these have just come to that
        goes = self.resting & self._turned() & slid & (self._taken_along() >= most)
        self.towards[goes] = np.stack([self.turning[goes], 0.0 * self.turning[goes]], axis=1)
        self.resting &= ~goes
        self.sticks &= ~goes
        if goes.any():
            self._slips_now()
        return stopped or bool(goes.any())

    def _take_contacts(self, contacts: np.ndarray, slips: np.ndarray, begun: np.ndarray, turns: np.ndarray) -> None:
        """The same; where a roller turns, the contact begins along the ellipse's normal."""
        super()._take_contacts(contacts, slips, begun, turns)
        own = contacts[slips & turns]
        mu = self.grip.sliding[own]
        part = np.minimum(self._taken_along()[own] / (self.load[own] * mu[:, 0]), 1.0)
        across = np.copysign(np.sqrt((1 - part) * (1 + part)), self.towards[own, 1])
        normal = np.stack([self.turning[own] * part, across], axis=1) / mu
        self.towards[own] = normal / np.linalg.norm(normal, axis=1, keepdims=True)

    def _falling(self) -> np.ndarray:
        """(N,) in m/s^2, how slips that begin fall; of contacts whose rollers turn along the rolling direction."""
        across = -np.sign(self.towards[:, 1]) * self.held["slip_dot"][:, 1]
        return np.where(self.turning != 0, across, super()._falling())


class DampedStripFlow(StripFlow):
    """The rates of a phase, of which `slip` are slips, of wheels whose rollers stick as of rigid ones."""

    ground: GroundWithDampedRollers

    def __init__(self, ground: GroundWithDampedRollers, rates: BoundRates, plain: Flow):
        super().__init__(ground, rates, plain)
        kernel, buffers = ground.kernel, self.buffers
        for name in ("damped_corners", "damped_ways"):
            signature = kernel.signatures[name]
            for argument in (*signature.inputs, *signature.outputs):
                buffers.setdefault(argument.name, np.zeros(argument.shape))
        buffers["slip_direction"][:] = [0.0, 1.0]  # until there are directions: slips do not depend on these
        self.both = self.slides & self.turns
        self.turning = np.flatnonzero(self.slides)
        aside = {"ground_force": np.zeros_like(buffers["ground_force"]), "contact_sticks": (~self.both).astype(float)}
        aside |= {"contact_bearing": np.where(self.both, ground.axles.torques()[ground.axles.contact], 0.0)}
        self._slip = kernel.bind("slip_forces", buffers | aside)
        self._root, self._way = kernel.bind("damped_corners", buffers), kernel.bind("damped_ways", buffers)
        self._slide = self._ellipse

    def slip(self, y: np.ndarray) -> np.ndarray:
        """(N, 2) in m/s, in the state y; and puts what follows from the state where rollers turn."""
        self.y[:] = y
        self._root()
        self.buffers["damped_yield"][:] = np.where(self.both, self.buffers["root_yield"], 0.0)
        self._slip()
        slip = self.buffers["slip"].copy()
        rolls = self.turns & ~self.slides
        slip[rolls, 0] = 0.0
        return slip

    def __call__(self, time: float, y: np.ndarray) -> np.ndarray:
        rates = super().__call__(time, y)
        buffers = self.buffers
        changes = np.column_stack([buffers["slip_dot"], buffers["chi_dot"]])
        along = (buffers["slip_slopes"] * changes).sum(axis=1)
        rests, way = self._at_rest(), self._going()
        turns = rests & (np.abs(way[:, 1]) > ALONG_THE_AXLE)
        along[rests] = changes[rests, 0]
        along[turns] = 0.0  # it goes with the rate across, whose rounding it would enlarge
        buffers["slip_dot"][:, 0] = np.where(self.both, along, changes[:, 0])
        return rates

    def _take_state(self, y: np.ndarray) -> None:
        """What is asked next is asked in the state y."""
        self.y[:] = y

    def _going(self) -> np.ndarray:
        """(N, 2) where contacts go, in the rates that were computed last."""
        return self.buffers["slip_direction"]

    def _at_rest(self) -> np.ndarray:
        """(N,) bool: contacts that slip on rollers that turn, whose slip in the last state is rounding."""
        return self.both & (np.linalg.norm(self.buffers["slip"], axis=1) <= self.rounding())

    def _push_along(self, directions: np.ndarray) -> None:
        """The forces of slips along directions (N, 2); where rollers turn, of the state, with that sign along the
        rolling direction. Where such a slip is rounding, that of the rolling direction would turn it anyhow."""
        buffers, rests = self.buffers, self._at_rest()
        across = np.stack([0 * directions[:, 1], np.copysign(1.0, directions[:, 1])], axis=1)
        moves = self.both & ~rests
        buffers["slip_direction"][:] = np.where(moves[:, None], across, directions / _lengths(directions))
        self._ellipse()
        self._root()
        self._way()
        buffers["damped_yield"][:] = np.where(moves, buffers["root_yield"], np.where(rests, buffers["way_yield"], 0.0))
        buffers["ground_push"][:] = np.where(self.slides[:, None], buffers["sliding_force"], 0.0)
        buffers["ground_push"][moves, 1] = buffers["damped_force"][moves]

    def headings(self, y: np.ndarray) -> np.ndarray:
        """(N,) in rad, where contacts go, as a row keeps it; where rollers turn along the rolling direction."""
        own = GroundFlow.headings(self, y)
        return np.where(self.turns, np.copysign(np.pi / 2, np.sin(own)), own)

    # The polar form

    def _aim(self, angles: np.ndarray) -> None:
        buffers = self.buffers
        buffers["slip_direction"][self.turning] = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self._ellipse()
        self._way()
        buffers["damped_yield"][:] = np.where(self.both, buffers["way_yield"], 0.0)
        buffers["ground_push"][:] = np.where(self.slides[:, None], buffers["sliding_force"], 0.0)

    def along_and_across(self, y: np.ndarray, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(m,) the parts of the slips along these directions, and across them, in m/s; where rollers turn how the
        latter falls as the direction turns, and that, over one speed."""
        along, across = super().along_and_across(y, angles)
        own = self.both[self.turning]
        if not own.any():
            return along, across
        self._aim(angles)
        of_way, across_way = (self.buffers[name][self.turning] for name in ("way_along", "way_across"))
        return np.where(own, of_way, along), np.where(own, across_way, across)

    def are_ahead(self, places: np.ndarray, angles: np.ndarray, along: np.ndarray) -> bool:
        """The same; where rollers turn, of slips themselves."""
        if not super().are_ahead(places, angles, along):
            return False
        for y, own in zip(places, angles, strict=True):
            self._take_state(y)
            self._aim(own)
            if (self.buffers["way_size"] < -self.rounding())[self.both].any():
                return False
        return True

    def _by_angles(self, time: float, y: np.ndarray, angles: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """As for bearings without viscous friction; by differences, since slips turn with the directions."""
        return self._by_turned_angles(time, y, angles, rates)


def _lengths(vectors: np.ndarray) -> np.ndarray:
    """(N, 1) of vectors (N, 2), 1 of those that are zero."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(lengths > 0, lengths, 1.0)

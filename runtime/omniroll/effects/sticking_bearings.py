"""Bearings of rollers, and of axles beside them, that stick: the set-valued law of Coulomb's friction in a run.

The rules are those of sticking.py, for more bearings: the axles where they may stick, the rollers in contact, and each
free roller. A mode each.

1. The rates of axles and of rollers in contact depend on nu alone, in directions that never change: a roller in
   contact turns as its wheel's centre moves along its axle, over rho. What holds them is a force on nu, with facets.
2. A free roller turns relative to its disk at a rate that is a state of its own. What holds it takes it along with its
   disk; it breaks away alone, where that needs more than its break-away torque.
3. All bearings at rest are decided together. The accelerations of all rates are linear in the torques, a = K u + c,
   with Delassus' matrix K = G M^-1 G^T: the torques within their bounds make u^T K u/2 + c^T u least.
4. An impact changes the rates, and the bearings have no part in it. What rests afterwards is seen from the rates.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from omniroll.effects.complementarity import Facets, allowed_by, bounded_fit, least_torques, span
from omniroll.effects.guards import EPS, PASSED, Guard
from omniroll.effects.state_vector import StateVector
from omniroll.effects.sticking import AT_REST, HELD_ROUNDINGS, in_rounds
from omniroll.kernels.kernel import Flow, Kernel
from omniroll.vehicles.state import State

Torques = tuple[np.ndarray, np.ndarray]  # (N,) of bearings that turn, and the largest at rest


def independent(rows: np.ndarray) -> list[int]:
    """Places of rows that span what all of them span."""
    chosen: list[int] = []
    for k in range(len(rows)):
        if len(span(rows[[*chosen, k]])) > len(chosen):
            chosen.append(k)
    return chosen


class StickingBearings:
    """The bearings in one run: of N axles or none, of N rollers in contact, of N (n-1) free rollers or none.

    sliding   (m,) torques in N m where they turn
    holding   (m,) the largest torques in N m at rest
    resting   (m,) bool: those whose rate is zero
    modes     (m,) int: 0 sticks, +-1 is the sign of the rate
    """

    def __init__(self, kernel: Kernel, axles: Torques | None, rollers: Torques):
        self.kernel, wheels = kernel, kernel.wheels
        self.free_shape = (wheels, kernel.rollers_per_wheel - 1 if kernel.has_spins else 0)
        self.axle_count = 0 if axles is None else wheels
        self.plane = self.axle_count + wheels  # of those that depend on nu alone
        of_free = [np.repeat(torques, self.free_shape[1]) for torques in rollers]
        of_axles = (np.zeros(0), np.zeros(0)) if axles is None else axles
        self.sliding, self.holding = (np.concatenate(parts) for parts in zip(of_axles, rollers, of_free, strict=True))
        count = len(self.sliding)
        self.resting, self.modes = np.zeros(count, bool), np.zeros(count, int)
        self.released = np.zeros(count, int)  # signs of those that have been let go at this instant
        self.rows = self.rows_at(np.zeros(wheels))[: self.plane]
        self.force_size, self.speed = np.zeros(3), 0.0

    def rows_at(self, chi: np.ndarray) -> np.ndarray:
        """(m, 3) the rates for each of nu where the free rollers' axial speeds are zero: G."""
        along = np.eye(3)
        axles = self.kernel.wheel_rows[: self.axle_count]
        contacts = self.kernel.wheel_rates(along, chi)[1].T
        if not self.free_shape[1]:
            return np.concatenate([axles, contacts])
        free = self.kernel.spins_from_axial(along, chi, np.zeros(self.free_shape))
        return np.concatenate([axles, contacts, free.reshape(3, -1).T])

    # What the state says

    def _rates(self, nu: np.ndarray, spins: np.ndarray) -> np.ndarray:
        return np.concatenate([self.rows @ nu, spins.ravel()])

    def _sizes(self, nu: np.ndarray, spins: np.ndarray) -> np.ndarray:
        """(m,) what the rates are rounded against: nu is what is left of larger numbers, each of about its length."""
        speed = max(float(np.linalg.norm(nu)), self.speed)
        yaw = speed / self.kernel.vehicle.yaw_scale
        return np.concatenate([np.linalg.norm(self.rows, axis=1) * speed, np.abs(spins).ravel() + yaw])

    def _find_resting(self, nu: np.ndarray, spins: np.ndarray) -> None:
        self.resting |= np.abs(self._rates(nu, spins)) <= AT_REST * EPS * self._sizes(nu, spins)

    def _spins(self, state: State) -> np.ndarray:
        if not self.free_shape[1]:
            return np.zeros(self.free_shape)
        return self.kernel.spins_from_axial(state.nu, state.chi, state.free_axial())

    def at_rest(self, state: State) -> State:
        """The state with the rates of resting bearings at zero. Those rest, too, whose rates are rounding."""
        self._find_resting(state.nu, self._spins(state))
        nu = allowed_by(self.rows[self.resting[: self.plane]]) @ state.nu
        found = replace(state, nu=nu)
        spins = self._spins(found)
        self._find_resting(nu, spins)
        spins[self.resting[self.plane :].reshape(self.free_shape)] = 0.0
        if not nu.any():
            self.speed = 0.0
        turning = ~self.resting
        self.modes[turning] = np.sign(self._rates(nu, spins)[turning])
        if self.free_shape[1]:
            moved = spins != self._spins(found)
            axial = np.where(moved, self.kernel.axial_speeds(nu, state.chi, spins), found.free_axial())
            found = found.with_free_axial(axial)
        return found

    def of_wheels(self, rates: np.ndarray, still: np.ndarray) -> np.ndarray:
        """Rates or accelerations (N,) of the wheels, exactly zero where bearings `still` (m,) are the axles' own."""
        if not self.axle_count:
            return rates
        return np.where(still[: self.axle_count], 0.0, rates)

    # What has happened

    def moved(self) -> None:
        """Some time has passed."""
        self.resting = self.modes == 0
        self.released[:] = 0

    def jumped(self) -> None:
        """An impact has changed the rates, and has numbered the rollers anew."""
        self.resting[:] = False
        self.released[:] = 0

    def pass_guards(self, passed: np.ndarray) -> None:
        """Guards of the phase, (k,) bool, have ended it: of bearings that turn, then of those that stick."""
        turning = np.flatnonzero(self.modes)
        self.resting[turning[passed[: len(turning)]]] = True
        self._release(passed[len(turning) :])

    def _release(self, passed: np.ndarray) -> None:
        of_facets, of_free = passed[: len(self.facets.reach)], passed[len(self.facets.reach) :]
        if of_facets.any():
            signs = self.facets.directions(of_facets)
            self.released[self.stuck_plane[signs != 0]] = signs[signs != 0]
        own = self.stuck_free[of_free]
        self.released[own] = -np.sign(self.torques[own])

    # What follows

    def begin(self) -> None:
        """A phase begins with the present modes."""
        stuck = np.flatnonzero(self.modes == 0)
        self.stuck_plane, self.stuck_free = stuck[stuck < self.plane], stuck[stuck >= self.plane]
        rows = self.rows[self.stuck_plane]
        self.facets = Facets.of(rows, self.holding[self.stuck_plane])
        self.held = np.concatenate([self.stuck_plane[independent(rows)], self.stuck_free]).astype(int)
        self.torques = -self.modes * self.sliding

    def turning_guards(self, layout: StateVector, nu: np.ndarray, spins: np.ndarray) -> list[Guard]:
        """Where the rate of a bearing that turns passes zero."""
        sizes, guards = self._sizes(nu, spins), []
        self.speed = max(self.speed, float(np.linalg.norm(nu)))
        for k in np.flatnonzero(self.modes):
            weights = np.zeros(layout.size)
            if k < self.plane:
                weights[:3] = -self.modes[k] * self.rows[k]
            else:
                weights[layout.slices["spins"].start + k - self.plane] = -self.modes[k]
            guards.append(Guard(0.0, 0.0, weights, sizes[k]))
        return guards

    def excess(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(k,) how much more power or torque than they can take the bearings that stick are asked for; rounding.

        rows  (m, 3) of the present chi
        """
        plane = self.stuck_plane
        force = self._force(rows)
        nearer = np.linalg.norm(rows[plane], axis=1) / np.linalg.norm(self.rows[plane], axis=1)  # rho at 0 over rho
        reach = np.abs(self.facets.moved) @ (self.holding[plane] * nearer)
        rounding = EPS * (np.abs(self.facets.normals) @ (np.abs(force) + self.force_size) + reach)
        own, most = np.abs(self.torques[self.stuck_free]), self.holding[self.stuck_free]
        of_free = HELD_ROUNDINGS * EPS * (own + most)
        return np.concatenate([self.facets.normals @ force - reach, own - most]), np.concatenate([rounding, of_free])

    def reported(self, rows: np.ndarray) -> np.ndarray:
        """(A + N,) torques of axles and of rollers in contact; of least norm within the bounds where they hold."""
        torques, plane = self.torques[: self.plane].copy(), self.stuck_plane
        if len(plane):
            torques[plane] = least_torques(self._force(rows), rows[plane], self.holding[plane])
        return torques

    def _force(self, rows: np.ndarray) -> np.ndarray:
        """(3,) the generalised force that holds axles and rollers in contact."""
        own = self.held[self.held < self.plane]
        return rows[own].T @ self.torques[own]

    def sizes_of_torques(self) -> np.ndarray:
        """(A + N,) what torques that hold are rounded against."""
        return HELD_ROUNDINGS * np.linalg.norm(self.force_size) / np.linalg.norm(self.rows, axis=1)

    def decide(self, flow: "BearingFlow", y: np.ndarray, drives: np.ndarray) -> None:
        """Modes of the bearings at rest, and the phase that begins with them.

        flow    of this phase
        y       its first state
        drives  (N,) sizes of the drives' torques
        """
        at_rest = np.flatnonzero(self.resting)
        self.modes[at_rest] = 0
        self.begin()
        self.force_size = flow.force_size(y, drives)
        if not self.released.any() and not self._overdone(flow, y).any():
            return
        for _ in range(len(at_rest) + 1):
            self._rounds(at_rest, flow, y)
            self.begin()
            passed = self._overdone(flow, y)
            if not passed.any():
                return
            self._release(passed)

    def _overdone(self, flow: "BearingFlow", y: np.ndarray) -> np.ndarray:
        """(k,) bool: what the bearings that stick cannot take."""
        flow(0.0, y)
        values, rounding = self.excess(flow.rows)
        return values > PASSED * rounding

    def _rounds(self, at_rest: np.ndarray, flow: "BearingFlow", y: np.ndarray) -> None:
        reach, given = flow.responses(y, at_rest), flow.unheld(y, np.where(self.resting, 0, self.modes))[at_rest]
        target = np.linalg.lstsq(reach.T, given, rcond=None)[0]
        matrix = reach.T @ reach

        def nearest(bounds: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            torques = bounded_fit(reach, -target, bounds)
            return matrix @ torques + given, np.abs(given) + np.abs(matrix) @ bounds, torques

        sliding, holding = self.sliding[at_rest], self.holding[at_rest]
        self.modes[at_rest] = in_rounds(self.released[at_rest], sliding, holding, nearest)


class BearingFlow:
    """The rates f(time, y) -> y' of a phase in the modes of its bearings.

    After a call `rows` (m, 3) are those of the state, and the bearings' `torques` hold what sticks.

    buffers  arrays by name, from which `plain` takes the torques
    plain    the rates with these torques
    layout   of y
    """

    def __init__(self, bearings: StickingBearings, buffers: Mapping[str, np.ndarray], plain: Flow, layout: StateVector):
        self.bearings, self.plain, self.layout = bearings, plain, layout
        self.buffers, self.kernel = buffers, bearings.kernel
        inertia = self.kernel.vehicle.roller_inertia
        self.own = np.concatenate([np.zeros(bearings.plane), np.full(bearings.free_shape, inertia).ravel()])
        self.rows = bearings.rows

    def __call__(self, time: float, y: np.ndarray) -> np.ndarray:
        bearings = self.bearings
        bearings.torques = -bearings.modes * bearings.sliding
        found = self._with(time, y, bearings.torques)
        self.rows = bearings.rows_at(self.layout.view(y, "chi"))
        held = bearings.held
        if not len(held):
            return found
        reach = self.responses(y, held)
        scale = np.linalg.norm(reach, axis=0)
        reach = reach / scale
        for _ in range(2):  # the second time takes off what rounding has left
            asked = self.accelerations(y, found)[held] / scale
            bearings.torques[held] -= np.linalg.solve(reach.T @ reach, asked) / scale
            found = self._with(time, y, bearings.torques)
        still = bearings.modes == 0
        chi = self.layout.slices["chi"]
        found[chi] = bearings.of_wheels(found[chi], still)
        if len(bearings.stuck_free):
            found[self.layout.slices["spins"].start + bearings.stuck_free - bearings.plane] = 0.0
        return found

    def _with(self, time: float, y: np.ndarray, torques: np.ndarray) -> np.ndarray:
        """The rates with these torques (m,)."""
        bearings, buffers = self.bearings, self.buffers
        if bearings.axle_count:
            buffers["bearing_torque"][:] = torques[: bearings.axle_count]
        buffers["contact_bearing"][:] = torques[bearings.axle_count : bearings.plane]
        if bearings.free_shape[1]:
            buffers["free_bearing"][:] = torques[bearings.plane :].reshape(bearings.free_shape)
        return self.plain(time, y)

    def accelerations(self, y: np.ndarray, found: np.ndarray) -> np.ndarray:
        """(m,) of the bearings, from the rates y'."""
        layout, nu_dot = self.layout, found[:3]
        axles = self.kernel.wheel_rows[: self.bearings.axle_count] @ nu_dot
        contacts = self.kernel.call("contact_spin_rates", layout.view(y, "nu"), layout.view(y, "chi"), nu_dot)
        free = found[layout.slices["spins"]] if self.bearings.free_shape[1] else np.zeros(0)
        return np.concatenate([axles, contacts, free])

    def unheld(self, y: np.ndarray, modes: np.ndarray) -> np.ndarray:
        """(m,) the accelerations at the start with the torques of these modes (m,), 0 where nothing is taken."""
        return self.accelerations(y, self._with(0.0, y, -modes * self.bearings.sliding))

    def responses(self, y: np.ndarray, which: np.ndarray) -> np.ndarray:
        """(3 + m, len(which)) a root of Delassus' matrix of these bearings: it is the product of this with itself."""
        chi = self.layout.view(y, "chi")
        root = np.linalg.cholesky(self.kernel.mass_matrix(chi))
        of_nu = np.linalg.solve(root, self.bearings.rows_at(chi)[which].T)
        own = np.zeros((len(self.own), len(which)))
        has_own = self.own[which] > 0
        own[which[has_own], np.flatnonzero(has_own)] = 1 / np.sqrt(self.own[which[has_own]])
        return np.concatenate([of_nu, own])

    def force_size(self, y: np.ndarray, drives: np.ndarray) -> np.ndarray:
        """(3,) sums of the sizes of the terms of the generalised force without the bearings."""
        found = self._with(0.0, y, np.zeros(len(self.own)))
        force = self.kernel.mass_matrix(self.layout.view(y, "chi")) @ found[:3]
        return np.abs(force) + np.abs(self.kernel.wheel_rows.T) @ drives

"""A run as its sensitivities see it: its rows and rates, and the numbers beside which it is looked at."""

from functools import cached_property

import numpy as np

from omniroll.effects.effect_set import EffectSet
from omniroll.engine.bearing_modes import BearingModes
from omniroll.engine.columns import Column, columns_of, stacked, start_shapes, values_of
from omniroll.engine.contact_modes import MODES, ContactModes
from omniroll.engine.deviations import Deviations
from omniroll.engine.directions import Directions, rows_of_standing
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, with_tangent
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles.state import by_place, by_roller


class Motion:
    """The rows of a run, with what its phases were given and its rates there."""

    def __init__(self, trajectory: Trajectory):
        self.trajectory = trajectory
        self.plain = trajectory.effects.kernel(trajectory.vehicle, trajectory.roller_model, "python")
        self.deviations = trajectory.effects.made(Deviations, self.plain)
        self.vector = self.deviations.vector
        self.starts_step = np.zeros(len(trajectory), bool)
        self.starts_step[trajectory.step_rows] = True
        self.y = trajectory.state_rows()

    @cached_property
    def axial(self) -> np.ndarray | None:
        """(T, N, n) axial speeds of the rollers by physical number; 0 for those in contact where they roll."""
        if not self.plain.has_spins:
            return None
        found = self.trajectory
        free = self.plain.axial_speeds(found.nu, found.chi, found.spins)
        own = self.vector.view(self.y, "contact_omega") if self.plain.slips else np.zeros_like(free[..., 0])
        return by_roller(np.concatenate([own[..., None], free], axis=-1), found.contact)

    @cached_property
    def bearings(self) -> BearingModes | None:
        """Which bearings stick; None where none may."""
        return BearingModes(self.trajectory, self.plain) if self.trajectory.effects.bearings(self.plain) else None

    @cached_property
    def contacts(self) -> ContactModes | None:
        """Which contacts stick on the ground, and which carry; None where none has such a mode."""
        if self.deviations.inputs.keys().isdisjoint(MODES):
            return None
        strips = "corner_forces" in self.plain.signatures
        rigid = self.bearings.split(self.bearings.modes)[1][..., 0] == 0 if strips else None
        return ContactModes(self.trajectory, self.plain, self.deviations, rigid)

    @cached_property
    def held(self) -> Directions | None:
        """What bearings that stick of wheels that roll, or wheels that stand, leave to nu; None where none may."""
        if self.bearings is None or (self.plain.slips and not self.stands):
            return None
        of_axles, of_rollers = self.bearings.split(self.bearings.modes == 0)
        of_rollers = of_rollers[..., :1].reshape(len(of_axles), -1)
        rows = rows_of_standing(self.plain)
        if not self.stands:
            parts = [k for k, own in enumerate((of_rollers, of_axles)) if own.size]
            own = np.concatenate([rows[:, k] for k in reversed(parts)])
            return Directions(own, np.concatenate([of_axles, of_rollers], axis=1))
        never = np.zeros(self.contacts.sticks.shape, bool)
        both = [own if own.size else never for own in (of_rollers, of_axles)]
        held = self.contacts.sticks[..., None] & np.stack(both, axis=-1)
        return Directions(rows.reshape(-1, 3), held.reshape(len(held), -1))

    @property
    def stands(self) -> bool:
        """Whether contacts and bearings of a wheel may stick together."""
        return not {"standing_dynamics", "bearing_dynamics"}.isdisjoint(self.plain.signatures)

    def held_at(self, rows: np.ndarray) -> dict[str, np.ndarray]:
        """What generated functions take of all that sticks in rows (...), by name."""
        found: dict[str, np.ndarray] = {}
        for own in (self.contacts, self.bearings, self.held):
            found |= {} if own is None else own.at(rows)
        return found

    @cached_property
    def inputs(self) -> np.ndarray:
        """(T, U) what the rows' phases were given."""
        return self.given_in(np.arange(len(self.trajectory)))

    def given_in(self, rows: np.ndarray) -> np.ndarray:
        """(k, U) what the phases of rows (k,) were given."""
        trajectory, shapes = self.trajectory, self.deviations.inputs
        given = {name: trajectory.drive[rows, k] for k, name in enumerate(trajectory.effects.drives())}
        if "momenta" in shapes:
            start = (own[rows] for own in (trajectory.nu, trajectory.chi, trajectory.spins))
            given["momenta"] = self.plain.momenta(self.plain.axial_speeds(*start))
        if self.bearings is not None:
            given |= self.bearings.given(self.bearings.torques[rows])
        found = self.deviations.joined(given) if shapes else np.zeros((len(rows), 0))
        return found if self.contacts is None else self.contacts.headed(self.y[rows], found, rows)

    @cached_property
    def directions(self) -> np.ndarray:
        """(T, N) +1 or -1 where a wheel has switched before the row, else 0."""
        passed = np.diff(self.trajectory.contact, axis=0, prepend=self.trajectory.contact[:1])
        rollers = self.plain.rollers_per_wheel
        return np.where(passed % rollers == 1, -1, np.where(passed % rollers == rollers - 1, 1, 0))

    @cached_property
    def switched(self) -> np.ndarray:
        """(K,) the rows after a switch."""
        return np.flatnonzero(self.directions.any(axis=1))

    @cached_property
    def phases(self) -> np.ndarray:
        """(K + 1,) the rows at which the phases between switches start."""
        return np.append(0, self.switched)

    def phase_of(self, row: np.ndarray | int) -> np.ndarray:
        """The phases between two switches to which rows belong."""
        return np.searchsorted(self.phases, row, side="right") - 1

    def whole(self, moved: np.ndarray) -> np.ndarray:
        """(..., size) deviations (..., m) at their places in y."""
        whole = np.zeros((*moved.shape[:-1], self.vector.size))
        whole[..., self.deviations.state] = moved
        return whole

    def later_spins(
        self,
        bound: TangentKernel,
        y: np.ndarray,
        row: np.ndarray,
        times: np.ndarray,
        start: np.ndarray,
        axial: np.ndarray,
        time: float | np.ndarray = 0.0,
    ) -> np.ndarray:
        """(..., N, n-1) the free rollers' spins in later states y (..., size) of phases, carrying tangents as y does.

        row, times  (...) the row at or before each state, and its time
        start       (..., m) tangents where the phase of each state starts
        axial       (..., N, n) those of the axial speeds there, by physical roller
        time        (...) those of the times
        """
        trajectory = self.trajectory
        first = self.phases[self.phase_of(row)]
        speeds = with_tangent(self.axial[first], axial)
        contact = np.broadcast_to(trajectory.contact[first], speeds.shape[:-1])
        speeds = by_place(speeds, contact)[..., 1:]
        before = self.vector.views(with_tangent(self.y[first], self.whole(start)))
        elapsed = np.where(trajectory.t[row] < times, times - trajectory.start_time, trajectory.elapsed[row])
        since = with_tangent(elapsed - trajectory.elapsed[first], time)
        later = trajectory.effects.axial_later(bound, speeds, before, self.vector.views(y), since)
        return bound.spins_from_axial(self.vector.view(y, "nu"), self.vector.view(y, "chi"), later)

    def rates_in(self, y: np.ndarray, inputs: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """(..., m) the rates of what deviates in states (..., size), where what sticks is as in rows (...)."""
        return self.deviations.rates_of(self.plain, y, inputs, self.held_at(rows))

    @cached_property
    def rates(self) -> np.ndarray:
        """(T, m) the same in the rows."""
        return self.rates_in(self.y, self.inputs, np.arange(len(self.y)))


class Columns:
    """The columns of a run: what each of its numbers moves; before them `others`, in which no number deviates.

    They depend on effects, kernel and names alone: all runs that have these share them (columns_beside).

    plain  Kernel of the run, with Python's functions
    """

    def __init__(self, effects: EffectSet, plain: Kernel, names: tuple[str, ...], others: int = 0):
        self.effects, self.plain = effects.effects, plain
        self.columns: tuple[Column, ...] = (Column(""),) * others + columns_of(names, self.plain, self.effects)
        shapes = {name: value.shape for name, value in values_of(self.plain, self.effects).items()}
        self.constants = stacked(self.columns, lambda column: column.constants, shapes)
        self.start = stacked(self.columns, lambda column: column.start, start_shapes(self.plain))
        wheels = self.plain.wheels
        self.signals = stacked(
            self.columns,
            lambda column: column.signals,
            {key: self.effects[key[0]].shape_of(key[1], wheels) for c in self.columns for key in c.signals},
        )

    def __len__(self) -> int:
        return len(self.columns)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(column.name for column in self.columns)

    @cached_property
    def sizes(self) -> np.ndarray:
        """(P,) the sizes of the numbers."""
        return np.array([column.size for column in self.columns])

    @cached_property
    def numbered(self) -> np.ndarray:
        """(Q,) the columns whose numbers the generated functions know."""
        moves = np.zeros(len(self), bool)
        for tangent in self.constants.values():
            moves |= tangent.reshape(len(self), -1).any(axis=1)
        return np.flatnonzero(moves)

    @cached_property
    def kernel(self) -> TangentKernel:
        """The functions on (P,) states, each with the deviation of its own number."""
        return TangentKernel(self.plain, self.constants, (len(self),))

    def single(self, column: int) -> TangentKernel:
        """The functions with the deviation of one number, for states of any leading axes."""
        return TangentKernel(self.plain, {name: tangents[column] for name, tangents in self.constants.items()})


def columns_beside(trajectory: Trajectory, names: tuple[str, ...], others: int = 0) -> Columns:
    """The columns of a run by the numbers of these names."""
    effects = trajectory.effects
    plain = effects.kernel(trajectory.vehicle, trajectory.roller_model, "python")
    return effects.made(Columns, plain, names, others)

"""How deviations pass a switch: the rule of the switch as it stands, on numbers that carry tangents.

With the map g of the switch and the rates f before and after it,

    d+ = g' (d- + f- dt) - f+ dt,   dt = -dchi_i / chi_i'

(the saltation matrix). Arrays have the deviations' axis W before their own axes, and may have further leading axes.
"""

from dataclasses import dataclass, replace

import numpy as np

from omniroll.engine.motion import Columns, Motion
from omniroll.engine.switching import SwitchingModel
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent
from omniroll.vehicles.state import State, by_place, by_roller

NUMBERS_AT_ONCE = 2**15  # of one array, where several switches are computed together
GRAZING = 1e-6  # of the fastest wheel's speed: a wheel that passes its joint more slowly grazes it


def grazing(speeds: np.ndarray) -> np.ndarray:
    """(..., N) whether wheels of these speeds (..., N) would graze their joints."""
    return np.abs(speeds) <= GRAZING * np.abs(speeds).max(axis=-1, keepdims=True)


@dataclass(frozen=True)
class Phase:
    """What a phase between two switches starts with, on numbers that carry W deviations.

    elapsed  (..., 1) in s
    contact  (..., 1, N) the rollers in contact
    y        (..., W, size)
    axial    (..., W, N, n) axial speeds by physical roller; None but for free rollers
    """

    elapsed: np.ndarray
    contact: np.ndarray
    y: np.ndarray
    axial: np.ndarray | None

    def free(self) -> np.ndarray:
        """(..., W, N, n-1) of the rollers that are free."""
        return by_place(self.axial, self.contact)[..., 1:]


@dataclass(frozen=True)
class Instant:
    """A state of the run at a switch: y (..., 1, size) and the rates (..., 1, m) of what deviates."""

    elapsed: np.ndarray
    y: np.ndarray
    rates: np.ndarray


class Passage:
    """The passing of switches, for W deviations with which the constants of `kernel` go."""

    def __init__(self, motion: Motion, kernel: TangentKernel):
        self.kernel, self.motion, self.deviations, self.vector = kernel, motion, motion.deviations, motion.vector
        self.effects = motion.trajectory.effects
        self.model = SwitchingModel(kernel, motion.trajectory.switching)

    def passed(
        self,
        phase: Phase,
        before: Instant,
        after: Instant,
        moved: np.ndarray,
        directions: np.ndarray,
        times: np.ndarray,
    ) -> Phase:
        """The phase after wheels have switched as one.

        moved       (W, m) deviations before
        directions  (..., 1, N) of the wheels that switch, else 0
        times       (W,) by how much the time of the switch deviates
        """
        reached = self.carrying(before.y, moved + before.rates * times[:, None])
        axial = self.later(phase, reached, with_tangent(before.elapsed - phase.elapsed, times))
        state = self.model.apply(self.state(reached, phase.contact, axial), directions)
        switched = self.whole(after.y, state, self.kernel)
        left = Phase(after.elapsed, state.contact, switched, state.axial)
        y = self.carrying(after.y, self.deviation(switched) - after.rates * times[:, None])
        return replace(left, y=y, axial=self.later(left, y, with_tangent(np.zeros_like(after.elapsed), -times)))

    def carrying(self, y: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """(..., W, size) y (..., 1, size) with deviations (..., W, m)."""
        return with_tangent(y, self.motion.whole(moved))

    def deviation(self, y: np.ndarray) -> np.ndarray:
        """The inverse of `carrying`."""
        return tangent_of(y)[..., self.deviations.state]

    def state(self, y: np.ndarray, contact: np.ndarray, axial: np.ndarray | None) -> State:
        state = State(*(self.vector.view(y, name) for name in ("nu", "chi", "pose")), contact, axial)
        return self.effects.state_at(self.vector, y, state)

    def whole(self, y: np.ndarray, state: State, bound: Kernel) -> np.ndarray:
        """y (..., size) of a state in which what the effects integrate begins anew; what they have done stays."""
        lead = state.nu.shape[:-1]
        whole = np.array(np.broadcast_to(y, (*lead, self.vector.size)), state.nu.dtype)
        parts = {"nu": state.nu, "chi": state.chi, "pose": state.pose} | self.effects.initial(bound, state)
        for name, value in parts.items():
            whole[..., self.vector.slices[name]] = value.reshape(*value.shape[: len(lead)], -1)
        return whole

    def later(self, phase: Phase, y: np.ndarray, elapsed: np.ndarray) -> np.ndarray | None:
        """(..., W, N, n) axial speeds by physical roller in a later state y (..., W, size) of a phase."""
        if phase.axial is None:
            return None
        before, after = self.vector.views(phase.y), self.vector.views(y)
        free = self.effects.axial_later(self.kernel, phase.free(), before, after, elapsed)
        return by_roller(np.concatenate([np.zeros_like(free[..., :1]), free], axis=-1), phase.contact)


class SwitchMaps:
    """All switches of a run as linear maps, computed at once where the wheels of each switch as one.

    What comes in is one row of numbers: the deviations (m,) before the switch, the axial speeds' (A = N n) at the
    phase's start and, where these change in a phase, the deviations (m,) there. What goes out is the deviations (m,)
    and the axial speeds' (A,) after the switch.

    together  (K,) bool: more wheels than one switch
    grazed    (K,) bool: one of them grazes its joint, and the map means nothing
    """

    def __init__(self, motion: Motion, columns: Columns):
        self.motion, self.columns = motion, columns
        plain, deviations = motion.plain, motion.deviations
        self.size = len(deviations.state)
        self.axial = plain.wheels * plain.rollers_per_wheel if plain.has_spins else 0
        self.fades = bool(self.axial) and not set(deviations.rates).isdisjoint({"momenta", "axial", "spins"})
        self.incoming = self.size + 1 + self.axial + self.size * self.fades
        # The pose goes on as it is, and a switch does not feel it.
        self.units = np.setdiff1d(np.arange(self.incoming), deviations.places["pose"])
        self.passage = Passage(motion, columns.behind(len(self.units)))
        self.maps = np.zeros((len(motion.switched), self.size + self.axial, self.incoming))
        self.by_numbers = np.zeros((len(motion.switched), self.size + self.axial, len(columns)))
        pose = deviations.places["pose"]
        self.maps[:, pose, pose] = 1.0
        width = self.incoming + len(columns.numbered)
        at_once = max(1, NUMBERS_AT_ONCE // (width * (self.size + self.axial)))
        for first in range(0, len(self.maps), at_once):
            self._compute(np.arange(first, min(first + at_once, len(self.maps))))
        self._with_times()

    def _with_times(self) -> None:
        """Put what the time's deviation does, in the place behind the first m, into the columns of the wheels."""
        motion, chi = self.motion, self.motion.deviations.places["chi"]
        switching = motion.directions[motion.switched] != 0
        speeds = motion.rates[motion.switched - 1][:, chi]
        self.together = switching.sum(axis=1) > 1
        self.grazed = (grazing(speeds) & switching).any(axis=1)
        wheel, switch = switching.argmax(axis=1), np.arange(len(switching))
        with np.errstate(divide="ignore", invalid="ignore"):
            by_time = self.maps[:, :, self.size] / speeds[switch, wheel][:, None]
        self.maps[switch, :, chi[wheel]] -= by_time
        self.maps = np.delete(self.maps, self.size, axis=2)

    def _compute(self, some: np.ndarray) -> None:
        motion, count = self.motion, len(self.units)
        width = count + len(self.columns.numbered)
        unit = np.zeros((width, self.incoming))
        unit[np.arange(count), self.units] = 1.0
        moved, times, axial, start = np.split(unit, [self.size, self.size + 1, self.size + 1 + self.axial], axis=1)
        after, first = motion.switched[some], motion.phases[some]
        contact, elapsed = motion.trajectory.contact, motion.trajectory.elapsed
        shape = (width, motion.plain.wheels, motion.plain.rollers_per_wheel)
        phase = Phase(
            elapsed[first, None], contact[first, None],
            self.passage.carrying(motion.y[first, None], start if self.fades else np.zeros_like(moved)),
            with_tangent(motion.axial[first, None], axial.reshape(shape)) if self.axial else None,
        )  # fmt: skip
        left = self.passage.passed(
            phase, self._instants(after - 1), self._instants(after), moved, motion.directions[after, None], times[:, 0]
        )
        found = self.passage.deviation(left.y)
        if self.axial:
            found = np.concatenate([found, tangent_of(left.axial).reshape(len(some), width, -1)], axis=-1)
        found = found.swapaxes(1, 2)
        self.maps[some[:, None], :, self.units] = found[..., :count].transpose(0, 2, 1)
        self.by_numbers[some[:, None], :, self.columns.numbered] = found[..., count:].transpose(0, 2, 1)

    def _instants(self, rows: np.ndarray) -> Instant:
        motion = self.motion
        return Instant(motion.trajectory.elapsed[rows, None], motion.y[rows, None], motion.rates[rows, None])

    def through(
        self, switch: int, moved: np.ndarray, axial: np.ndarray | None, start: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Deviations (m, P) and the axial speeds' (A, P) after a switch, from those that come in."""
        if axial is not None:
            moved = np.concatenate([moved, axial, start] if self.fades else [moved, axial])
        left = self.maps[switch] @ moved + self.by_numbers[switch]
        return left[: self.size], None if axial is None else left[self.size :]


def momenta_maps(motion: Motion, columns: Columns) -> tuple[np.ndarray, np.ndarray]:
    """(K, 2 N, A) and (K, 2 N, P) the deviations of the constant momenta of each phase, by those of the axial speeds by
    physical roller at its start, and by the numbers."""
    axial = motion.axial[motion.phases]
    count, numbered = axial[0].size, columns.numbered
    unit = np.eye(count + len(numbered), count).reshape(-1, *axial.shape[1:])
    contact = motion.trajectory.contact[motion.phases][:, None]
    free = by_place(with_tangent(axial[:, None], unit), contact)[..., 1:]
    found = tangent_of(columns.behind(count).momenta(free)).reshape(len(axial), len(unit), -1)
    by_numbers = np.zeros((len(axial), found.shape[-1], len(columns)))
    by_numbers[:, :, numbered] = found[:, count:].swapaxes(1, 2)
    return found[:, :count].swapaxes(1, 2), by_numbers

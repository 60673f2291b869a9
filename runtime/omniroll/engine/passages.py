"""How deviations pass a switch: the rule of the switch as it stands, on numbers that carry tangents.

With the map g of the switch and the rates f before and after it,

    d+ = g' (d- + f- dt) - f+ dt,   dt = -dchi_i / chi_i'

(the saltation matrix). Arrays have the deviations' axis W before their own axes, and may have further leading axes.
"""

from dataclasses import dataclass, replace

import numpy as np

from omniroll.engine.motion import Motion
from omniroll.engine.switching import SwitchingModel
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent
from omniroll.vehicles.state import State, by_place, by_roller

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
        """With the wheels' rates and the axial speeds of the rollers in contact, where wheels may slip."""
        views = self.vector.views(y)
        rates = views["rates"].copy() if "rates" in views else None
        state = State(views["nu"], views["chi"], views["pose"], contact, axial, rates)
        return state.with_contact_axial(views["contact_omega"]) if "contact_omega" in views else state

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
        free = by_place(phase.axial, phase.contact)[..., 1:]
        free = self.effects.axial_later(self.kernel, free, before, after, elapsed)
        return by_roller(np.concatenate([np.zeros_like(free[..., :1]), free], axis=-1), phase.contact)

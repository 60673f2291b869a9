"""What ends a phase of contacts that stick and slip: friction that is used up, and slips that come to rest."""

import numpy as np

from omniroll.effects.ground import PART_OF_WAY
from omniroll.effects.ground_flow import GroundFlow
from omniroll.effects.ground_with_axles import GroundWithAxles
from omniroll.effects.ground_with_bearings import GroundWithBearings
from omniroll.effects.ground_with_massless_rollers import StripFlow
from omniroll.effects.guards import PASSED, Guards
from omniroll.effects.loaded_axles import GroundBesideAxles
from omniroll.effects.loaded_bearings import GroundBesideBearings
from omniroll.effects.loaded_ground import LoadedFlow
from omniroll.effects.loaded_massless_rollers import GroundBesideMasslessRollers
from omniroll.effects.smooth_ground import SmoothFlow
from omniroll.engine.holding import START, MotionGuards


class GroundGuards(MotionGuards):
    """The guards of a phase, then one of each contact (N,): how far its mode is from its end.

    Of a contact that sticks it is what it takes of its static friction, less all of it. Of one that slips, the slip
    against the way that it goes, so that it rises to zero as the slip comes to rest.
    """

    def __init__(self, guards: Guards, flow: GroundFlow, further: int = 0):
        super().__init__(guards, len(flow.ground.sticks) + further)
        self.flow, self.ground = flow, flow.ground
        self.has_direction = flow.ground.directions.start == 0

    def _approach(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(N,) the slips along the way that they go, the rates at which these fall, and the slips' rounding."""
        self.flow(time, y)
        slip, rounding = self.flow.slip(y), self.flow.rounding()
        towards = self.ground.direction(slip, rounding)
        towards = towards / np.linalg.norm(towards, axis=1, keepdims=True)
        return (towards * slip).sum(axis=1), -(towards * self.flow.slip_dot).sum(axis=1), rounding

    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        left, falls, rounding = self._approach(time, y)
        excess, of_excess = self.ground.used_up(self.flow.force)
        if self.has_direction:  # a slip never comes to zero itself, but to its rounding
            left = left - np.where(falls > self.ground.settles, 2 * rounding, 0.0)
        values = np.where(self.ground.sticks, excess, -left)
        return np.where(self.ground.off, -1.0, values), np.where(self.ground.sticks, of_excess, rounding / PASSED)

    def _rising(self, time: float, y: np.ndarray, rates: np.ndarray, values: np.ndarray) -> np.ndarray:
        """The rates of what is no slip are probed."""
        count = len(self.ground.sticks)
        needed = self.ground.sticks.any() or len(values) > count
        probed = super()._rising(time, y, rates, values) if needed else values
        ends = np.where(self.ground.sticks, probed[:count], self._approach(time, y)[1])
        return np.append(ends, probed[count:])

    def longest_step(self, time: float, y: np.ndarray, rates: np.ndarray) -> float:
        """A slip with a direction may not come to rest within a step: there the direction turns without end."""
        if not self.has_direction:
            return np.inf
        self.ground.follow(self.flow.slip(y), self.flow.rounding())
        left, falls, _ = self._approach(time, y)
        ends = self.flow.slides & (falls > self.ground.settles) & (left > 0)
        return float((PART_OF_WAY * left[ends] / falls[ends]).min(initial=np.inf))


class LoadedGuards(GroundGuards):
    """The same, then one of each load (N,), which vanishes or comes back, and one of the coupled matrix."""

    def __init__(self, guards: Guards, flow: LoadedFlow, further: int = 0):
        super().__init__(guards, flow, len(flow.ground.sticks) + 1 + further)
        self.flow: LoadedFlow = flow

    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, rounding = super()._own(time, y)
        beyond, of_loads = self.ground.loads.beyond(self.flow.carried)
        return np.append(values, beyond), np.append(rounding, of_loads)


class AxleGuards(GroundGuards):
    """The same as GroundGuards, then those of axles that stick: of dragged wheels, of standing ones, and the facets of
    what these can take together."""

    def __init__(self, guards: Guards, flow: GroundFlow, further: int = 0):
        super().__init__(guards, flow, len(flow.ground.excess()[0]) + further)

    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, rounding = super()._own(time, y)
        beyond, of_axles = self.ground.excess()
        return np.append(values, beyond), np.append(rounding, of_axles)


class LoadsAndAxlesGuards(AxleGuards, LoadedGuards):
    """Those of LoadedGuards, then those of axles that stick."""


class AllBearingGuards(AxleGuards):
    """The same as GroundGuards, then of each bearing (B,) how far it is beyond the end of its mode, and of what holds
    wheels that stand the least use."""

    def _missed(self, values: np.ndarray) -> np.ndarray:
        contacts, bearings = len(self.ground.sticks), len(self.ground.axles.modes)
        slides = ~self.ground.sticks & ~self.ground.off
        own = np.append(np.arange(contacts), values.shape[1] - 1 - bearings + np.arange(bearings))
        return missed_of_turning(values, own, np.append(slides, self._modes()))

    def _modes(self) -> np.ndarray:
        """(B,) of the bearings, 0 of those that have not just begun to move."""
        return self.ground.axles.modes


class StripGuards(AllBearingGuards):
    """The same of massless rollers, whose contacts slip in a direction where these stick."""

    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A roller that is let go turns from here on: the spin that it begins with is the rounding of larger speeds."""
        values, rounding = super()._own(time, y)
        if time <= 0:
            begins = (self.ground.axles.released != 0) & (self.ground.axles.modes != 0)
            own = slice(len(values) - 1 - len(begins), len(values) - 1)
            values[own] = np.where(begins, np.minimum(values[own], 0.0), values[own])
        return values, rounding

    def longest_step(self, time: float, y: np.ndarray, rates: np.ndarray) -> float:
        return super().longest_step(time, y, rates) if len(self.flow.turning) else np.inf

    def _modes(self) -> np.ndarray:
        """A roller that has just begun to stick is as near to its bound at first as the polynomial is wrong."""
        axles, _ = np.split(self.ground.axles.modes, 2)
        return np.append(axles, np.ones_like(axles))


class LoadsAndBearingsGuards(AllBearingGuards, LoadedGuards):
    """Those of LoadedGuards, then those of bearings and the least use."""


class LoadsAndStripGuards(StripGuards, LoadedGuards):
    """The same of massless rollers."""


class LoadGuards(MotionGuards):
    """The guards of a phase under a smooth law, then one of each load (N,) and one of the coupled matrix."""

    def __init__(self, guards: Guards, flow: SmoothFlow, further: int = 0):
        super().__init__(guards, len(flow.ground.off) + 1 + further)
        self.flow = flow

    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        self.flow(time, y)
        return self.flow.ground.loads.beyond(self.flow.carried)


class LoadedAxleGuards(LoadGuards):
    """The same, then what the axles (S,) that stick are asked for beyond what they take."""

    def __init__(self, guards: Guards, flow: SmoothFlow):
        super().__init__(guards, flow, int((flow.ground.axles.modes == 0).sum()))

    def _own(self, time: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, rounding = super()._own(time, y)
        beyond, of_axles = self.flow.ground.excess()
        return np.append(values, beyond), np.append(rounding, of_axles)


class LoadedBearingGuards(LoadedAxleGuards):
    """The same as LoadGuards, then of each bearing (B,) how far it is beyond the end of its mode."""

    def __init__(self, guards: Guards, flow: SmoothFlow):
        LoadGuards.__init__(self, guards, flow, len(flow.ground.axles.modes))

    def _missed(self, values: np.ndarray) -> np.ndarray:
        return missed_of_turning(values, slice(len(self.flow.ground.off) + 1, None), self.flow.ground.axles.modes)


class LoadedMasslessGuards(LoadedBearingGuards):
    """The same of massless rollers, whose modes have ends that follow from the state and the loads."""

    def _missed(self, values: np.ndarray) -> np.ndarray:
        """A roller whose mode has just begun is as near to its end at first as the polynomial is wrong."""
        axles, rollers = np.split(self.flow.ground.axles.modes, 2)
        own = slice(len(self.flow.ground.off) + 1, None)
        return missed_of_turning(values, own, np.append(axles, np.ones_like(rollers)))


def ground_guards(guards: Guards, flow: GroundFlow | SmoothFlow) -> MotionGuards:
    """The guards of a phase, and those of its contacts."""
    if isinstance(flow, SmoothFlow):
        if isinstance(flow.ground, GroundBesideMasslessRollers):
            return LoadedMasslessGuards(guards, flow)
        if isinstance(flow.ground, GroundBesideBearings):
            return LoadedBearingGuards(guards, flow)
        beside = isinstance(flow.ground, GroundBesideAxles)
        return LoadedAxleGuards(guards, flow) if beside else LoadGuards(guards, flow)
    if isinstance(flow, StripFlow):
        return (LoadsAndStripGuards if isinstance(flow, LoadedFlow) else StripGuards)(guards, flow)
    if isinstance(flow.ground, GroundWithBearings):
        return (LoadsAndBearingsGuards if isinstance(flow, LoadedFlow) else AllBearingGuards)(guards, flow)
    if isinstance(flow.ground, GroundWithAxles):
        return (LoadsAndAxlesGuards if isinstance(flow, LoadedFlow) else AxleGuards)(guards, flow)
    return LoadedGuards(guards, flow) if isinstance(flow, LoadedFlow) else GroundGuards(guards, flow)


def missed_of_turning(values: np.ndarray, own: slice | np.ndarray, modes: np.ndarray) -> np.ndarray:
    """(K,) what polynomials through values (P, K) may miss, of which `own` are contacts or bearings with modes (B,), 0
    of those that stick: one that has just begun to move is as slow at first as its rate's polynomial is wrong."""
    missed, largest = np.zeros(values.shape[1]), np.abs(values[:, own]).max(axis=0)
    starts = (modes != 0) & (np.abs(values[0, own]) <= START * largest)
    missed[own] = np.where(starts, START * largest, 0.0)
    return missed

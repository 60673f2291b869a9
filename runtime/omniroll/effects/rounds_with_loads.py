"""Modes and loads that do not find each other in turn, where contacts let go under loads that follow the motion.

1. For loads there are modes, and for modes loads. Taken in turn they need not come to an end though there is one
   motion: loads may feel more of a mode, or of the direction of a slip, than it has changed; and where static friction
   is above the sliding one, a contact that gives way may get loads under which it would not have.
2. Loads are two moments. Under loads with given moments what rests is decided, and the motion asks for two moments
   again. Where everything has one friction this is a map of the plane which is continuous, since the accelerations of a
   convex problem are. Where it leads to itself modes and loads belong together. That is sought by Newton's rule.
3. Static friction above the sliding one goes in rounds, as in rule 3 of ground.py, but with the loads of each round:
   what has broken away has its sliding friction, whether it moves or not, and all else its static one. What moves in
   the modes and loads of a round has broken away in the next one, and does not stick by static friction again at that
   instant. The last round is the one in which nothing further breaks away.
4. Massless rollers take part that have stuck so far, also those of contacts that slip: one that would be let go takes
   what it has held at most, and its sliding torque in the next round. Else the map would jump where it is let go.
5. Where Newton's rule does not come to an end it begins elsewhere. Massless rollers go with the contacts that carry
   there, by the moments. Where no start leads to loads the whole polygon is looked through (where_it_stands.py).
6. All this comes after turns, which most instants need few of; and where the loads of some modes are not found, since
   rollers that would turn under the last loads have none in which they do, or since no contacts may carry in modes of
   such rollers that other loads would change.
7. With the friction of a round the vehicle stands or it tips (tipping.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from omniroll.effects.ground import Dynamics
from omniroll.effects.ground_loads import Carried, GroundFailsError
from omniroll.effects.tipping import where_it_tips
from omniroll.effects.where_it_stands import where_it_may_stand

STARTS = 2  # on the way from the middle to each contact, where loads are looked for elsewhere
MOMENT_ROUNDS = 40
MOVED_MOMENT = 1e-7  # of the weight times the vehicle's size: by which slopes are found
LEAST_PART = 1e-3  # of a step
BETTER = 0.25  # of what a step promises it must keep
SETTLED = 1e-14  # of the weight times the vehicle's size
# Of the weight, and of it times the vehicle's size: loads that modes have, and for which they were found, are the same.
SAME_LOADS = 1e-11
FLAT = 1e-12  # of its terms: a determinant that is no more is rounding

# Finds modes under the loads of the ground, of contacts (N,) bool whose slip is zero; returns these under the loads.
FindModes = Callable[[np.ndarray], np.ndarray]
OffBy = Callable[[np.ndarray], np.ndarray]  # from moments (2,) to what those that are asked for are more (2,)


class FollowedLoads(Protocol):
    """What a search needs of a ground whose loads follow the motion (loaded_ground.py)."""

    loads: Any
    bearings: Any  # those that may stick beside the contacts, or None
    grip: Any
    load: np.ndarray  # (N,) in N
    off: np.ndarray  # (N,) bool
    released: np.ndarray  # (N,) bool
    sticks: np.ndarray  # (N,) bool
    turns: int
    seeks_everywhere: bool  # whether loads are looked for in all of the polygon, where a few starts lead to none

    def bearings_in_rounds(self) -> np.ndarray: ...
    def contacts_in_rounds(self, rests: np.ndarray) -> np.ndarray: ...
    def carry_by_moments(self, sums: np.ndarray) -> None: ...
    def press(self, found: Carried) -> None: ...
    def trying(self, carries: np.ndarray) -> None: ...
    def sums_in_modes(self, dynamics: Dynamics) -> np.ndarray: ...
    def carry_in_modes(self, rests: np.ndarray, dynamics: Dynamics) -> Carried: ...
    def turns_to_steady(self, rests: np.ndarray, dynamics: Dynamics) -> bool: ...


def root(off_by: OffBy, moments: np.ndarray, size: float) -> np.ndarray | None:
    """(2,) where `off_by` vanishes, from `moments` (2,) on, by Newton's rule; None where it does not lead there.

    size  in N m: moments are the same that differ by SAME_LOADS of it
    """
    off = off_by(moments)
    for _ in range(MOMENT_ROUNDS):
        if np.linalg.norm(off) <= SETTLED * size:
            break
        moved = MOVED_MOMENT * size
        slope = np.stack([(off_by(moments + moved * way) - off) / moved for way in np.eye(2)], axis=1)
        terms = slope[0, 0] * slope[1, 1], slope[0, 1] * slope[1, 0]
        if not abs(terms[0] - terms[1]) > FLAT * (abs(terms[0]) + abs(terms[1])):
            break
        step, part = -np.linalg.solve(slope, off), 2.0
        while part > LEAST_PART:
            part /= 2
            off_there = off_by(moments + part * step)
            if np.linalg.norm(off_there) < (1 - BETTER * part) * np.linalg.norm(off):
                break
        if not np.linalg.norm(off_there) < np.linalg.norm(off):
            break
        moments, off = moments + part * step, off_there
    return moments if np.linalg.norm(off) <= SAME_LOADS * size else None


@dataclass(frozen=True)
class Kept:
    """What a ground and its bearings had as a search began: values by the objects and their names."""

    values: list[tuple[Any, str, Any]]

    @classmethod
    def of(cls, ground: FollowedLoads) -> Kept:
        names = ("load", "pressing", "off", "resting", "sticks", "released", "towards", "grip")
        own = [(ground, name) for name in names]
        own += [(ground.loads, name) for name in ("carries", "start")]
        if (bearings := ground.bearings) is not None:
            own += [(bearings, name) for name in ("modes", "resting", "released", "sliding", "holding")]
        return cls([(owner, name, copy(getattr(owner, name))) for owner, name in own])

    def put_back(self) -> None:
        for owner, name, value in self.values:
            setattr(owner, name, copy(value))

    def put_back_friction(self) -> None:
        for owner, name, value in self.values:
            if name in ("grip", "sliding", "holding"):
                setattr(owner, name, copy(value))


def take_rounds(
    ground: FollowedLoads,
    kept: Kept,
    rests: np.ndarray,
    find_modes: FindModes,
    dynamics: Dynamics,
    stands_or_tips: bool,
) -> bool:
    """Whether modes and loads are found by rounds (rule 3) that begin where `kept` does.

    rests           (N,) bool: contacts whose slip is zero
    stands_or_tips  whether it is told where the vehicle tips in a round for which none are found (rule 7)

    Raises GroundFailsError there, and where there are no loads in the modes.
    """
    kept.put_back()
    bearings = ground.bearings
    broken, in_rounds = ground.released.copy(), ground.contacts_in_rounds(rests)
    if bearings is not None:
        turned, at_rest = bearings.released != 0, ground.bearings_in_rounds()

    def begin_again() -> None:
        kept.put_back()
        ground.grip = _one_friction(ground.grip, broken, in_rounds)
        if bearings is not None:
            bearings.sliding = np.where(at_rest & ~turned, bearings.holding, bearings.sliding)
            bearings.holding = np.where(at_rest & turned, bearings.sliding, bearings.holding)

    try:
        while True:
            found, tips = False, None
            for start in _starts(ground, rests, find_modes, dynamics):
                begin_again()
                if found := _take_moments(ground, rests, find_modes, dynamics, start):
                    break
            if not found and stands_or_tips:
                begin_again()
                tips = _where_it_tips(ground, rests, find_modes, dynamics)
            if not found and tips is None:
                return False
            slips = in_rounds & ~ground.sticks & ~ground.off & ~broken
            further = bool(slips.any())
            if bearings is not None:
                moves = at_rest & ground.bearings_in_rounds() & (bearings.modes != 0) & ~turned
                turned, further = turned | moves, further or bool(moves.any())
            if not further:
                if tips is not None:
                    ground.loads.refuse_beyond_the_edge(tips)
                return True
            broken = broken | slips
    finally:
        kept.put_back_friction()


def _starts(
    ground: FollowedLoads, rests: np.ndarray, find_modes: FindModes, dynamics: Dynamics
) -> Iterator[np.ndarray | None]:
    """Where a search in a round begins, as _take_moments() has it."""
    places, weight = ground.loads.springs.places, ground.loads.weight
    yield None
    yield from points_elsewhere(places)
    if ground.seeks_everywhere:
        asked = _Asked(ground, rests, find_modes, dynamics, seeks_sets=True)
        yield from where_it_may_stand(places, lambda point: asked(weight * point) / weight)


def points_elsewhere(places: np.ndarray) -> Iterator[np.ndarray]:
    """Points (2,) on the lines from the middle of the contacts (N, 2) to each."""
    middle = places.mean(axis=0)
    for k in range(STARTS):
        part = (k + 1) / (STARTS + 1)
        yield from (1 - part) * middle + part * places


def _one_friction(grip: Any, broken: np.ndarray, rests: np.ndarray) -> Any:
    """The friction of a round."""
    keeps, slides = (rests & ~broken)[:, None], (rests & broken)[:, None]
    sliding = np.where(keeps, grip.static, grip.sliding)
    return replace(grip, sliding=sliding, static=np.where(slides, grip.sliding, grip.static))


class _Asked:
    """By how much more than moments (2,) those are that the motion asks for, under loads of these with the modes found
    for them (rule 2).

    seeks_sets  whether moments say which contacts carry
    still       (N,) bool: contacts whose slip is zero, under the last loads
    """

    def __init__(
        self, ground: FollowedLoads, rests: np.ndarray, find_modes: FindModes, dynamics: Dynamics, seeks_sets: bool
    ):
        self.ground, self.rests, self.find_modes, self.dynamics = ground, rests, find_modes, dynamics
        self.seeks_sets, self.still = seeks_sets, rests

    def __call__(self, moments: np.ndarray) -> np.ndarray:
        ground, loads = self.ground, self.ground.loads
        sums = np.append(loads.start[0], moments)
        if self.seeks_sets:
            ground.carry_by_moments(sums)
        compression = loads.springs.shares(loads.carries) @ sums
        ground.press(Carried(np.where(loads.carries, compression, 0.0), sums, compression, np.array(1.0)))
        ground.turns = 0  # a map knows nothing of the modes of before
        self.still = self.find_modes(self.rests)
        return (ground.sums_in_modes(self.dynamics) - sums)[1:]


def _take_moments(
    ground: FollowedLoads,
    rests: np.ndarray,
    find_modes: FindModes,
    dynamics: Dynamics,
    start: np.ndarray | None,
) -> bool:
    """Whether modes and loads are found (rule 2).

    start  (2,) in m, where loads act that it begins with; None: where the present ones do, and these contacts carry
    """
    loads = ground.loads
    asked = _Asked(ground, rests, find_modes, dynamics, start is not None)
    first = loads.springs.rows[:, 1:].T @ ground.load if start is None else loads.start[0] * start
    found = root(asked, first, loads.weight * loads.arm)
    if found is None:
        return False
    asked(found)
    before = ground.load
    try:
        ground.carry_in_modes(asked.still, dynamics)
    except GroundFailsError:
        return False
    return not (
        np.abs(ground.load - before).max() > SAME_LOADS * loads.weight or ground.turns_to_steady(asked.still, dynamics)
    )


def _where_it_tips(
    ground: FollowedLoads, rests: np.ndarray, find_modes: FindModes, dynamics: Dynamics
) -> np.ndarray | None:
    """(3,) sums of the loads that the motion asks for beyond an edge, with the friction of a round (rule 7); the modes
    are those that it has there. None where it does not tip."""
    loads = ground.loads
    asked = _Asked(ground, rests, find_modes, dynamics, seeks_sets=False)

    def moved_by(point: np.ndarray, carries: np.ndarray) -> np.ndarray:
        loads.carries, ground.off = carries, ~carries
        ground.trying(carries)
        return asked(loads.weight * point) / loads.weight

    point = where_it_tips(loads.springs.places, moved_by)
    return None if point is None else loads.weight * np.append(1.0, point)

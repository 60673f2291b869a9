"""Loads that follow the motion: solved together with the accelerations, with a mode for each contact, carries or off.

1. The sums of the loads' balance, sum N_i (1, xi_i, eta_i), are linear in the accelerations (maxima, contact_loads),
   the accelerations in the forces of the ground, and in the modes of a phase these are linear in the loads. What loads
   do to the sums comes back to the loads: a linear system of two unknown moments. Its matrix is the coupled matrix,
   which without friction is 1.
2. Three wheels determine the loads. Of more, the platform is rigid and stands on equal springs: of all loads with these
   sums that pull on no contact they are those of least norm.
3. A load that vanishes is an event: the contact is off. It carries again where the plane's compression at its place
   turns positive. Where the contacts that are left lie on one line, the vehicle tips.
4. Where something has jumped, all sets of contacts that may carry are tried, up to MOST wheels; of more, those that
   lead on from the present one. Exactly one set must fit, with a coupled matrix of positive determinant. None: the
   vehicle tips, or loads and friction have no solution. Several, or a determinant that is not positive: what they
   would do is not determined (Painleve).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import NoReturn

import numpy as np

from omniroll.vehicles.loads import Springs, SupportPolygon

MOST = 7  # wheels of which all sets are tried
FITS = 1e-11  # of the weight: a load, or a spring that pulls, is zero within this
AT_EVENT = 1e-6  # of the weight: the same of one that comes back at this instant
SAME = 1e-9  # of the weight: solutions that differ by less are one
AT_EDGE = 1e-9  # of the vehicle's size: the load acts on the edge within this
DETERMINED = 1e-6  # least determinant of the coupled matrix
ROUNDINGS = 256  # of the weight, in a load

# What loads and friction do that do not go on together; where there is no solution the vehicle may tip.
NONE, SEVERAL, UNDETERMINED, UNSETTLED, UNSETTLED_BEARINGS, BEHIND_FOLD = (
    "have no solution",
    "have several solutions",
    "do not determine each other",
    "do not find each other where contacts hold or let go",
    "do not find each other where bearings hold or let go",
    "do not find each other behind a fold, in which a roller has stopped",
)

# In the order of engine_calls.h.
FAILURES = (NONE, SEVERAL, UNDETERMINED, UNSETTLED, UNSETTLED_BEARINGS, BEHIND_FOLD)

SumsOf = Callable[[np.ndarray], np.ndarray]  # from loads (..., N) that friction feels to the sums (..., 3)


class GroundFailsError(ArithmeticError):
    """The ground and the vehicle do not go on together; `wheel` is the number of one that has to do with it, and
    `failure` one of FAILURES; `tips`, whether that is since the vehicle tips; `ends`, whether loads have been found, be
    they such that no wheel has them: Newton's rule has come to an end."""

    def __init__(self, reason: str, wheel: int, failure: str, tips: bool = False, ends: bool = True):
        super().__init__(reason)
        self.wheel, self.failure, self.tips, self.ends = wheel, failure, tips, ends


@dataclass(frozen=True)
class Carried:
    """Loads (..., N) in N and their sums (..., 3); compression (..., N) in N, the loads or what springs would pull.

    determinant (...) of the coupled matrix
    """

    loads: np.ndarray
    sums: np.ndarray
    compression: np.ndarray
    determinant: np.ndarray


def carried(shares: np.ndarray, carries: np.ndarray, sums_of: SumsOf, start: np.ndarray, arm: float) -> Carried:
    """The loads whose sums are those that they cause.

    shares   (..., N, 3) of Springs, where `carries` (..., N) bool
    sums_of  linear, the sums under the friction of loads
    start    (..., 3) sums from which the solution is sought; the first is the weight
    arm      in m, a length of the vehicle
    """

    def off_by(sums: np.ndarray) -> np.ndarray:
        loads = np.where(carries, (shares @ sums[..., None])[..., 0], 0.0)
        return (sums_of(loads) - sums)[..., 1:]

    missing, step = off_by(start), start[..., :1] * arm
    columns = []
    for k in (1, 2):
        moved = start.copy()
        moved[..., k] += step[..., 0]
        columns.append((missing - off_by(moved)) / step)
    matrix = np.stack(columns, axis=-1)
    sums = start.copy()
    determinant = np.linalg.det(matrix)
    solvable = np.where((np.abs(determinant) > 0)[..., None, None], matrix, np.eye(2))
    sums[..., 1:] += np.linalg.solve(solvable, missing[..., None])[..., 0]
    compression = (shares @ sums[..., None])[..., 0]
    return Carried(np.where(carries, compression, 0.0), sums, compression, determinant)


class Loads:
    """The loads in one run.

    carries         (N,) bool, of the present phase
    dropped, taken  (N,) bool: contacts that have gone off at this instant, and those that carry again
    """

    def __init__(self, places: np.ndarray, at_rest: np.ndarray):
        self.springs, self.polygon = Springs(places), SupportPolygon.of(places)
        self.arm = float(np.abs(places).max())
        self.weight = float(at_rest.sum())
        self.start = self.springs.rows.T @ at_rest
        self.carries = np.ones(len(places), bool)
        self.dropped, self.taken = (np.zeros(len(places), bool) for _ in range(2))

    def moved(self) -> None:
        """Some time has passed."""
        self.dropped[:] = self.taken[:] = False

    def pass_guards(self, passed: np.ndarray) -> None:
        """Loads, (N,) bool, that have vanished, or springs of contacts that are off that begin to be compressed."""
        self.dropped |= passed & self.carries
        self.taken |= passed & ~self.carries

    def solve(self, sums_of: SumsOf) -> Carried:
        """The loads in the present set."""
        found = carried(self.springs.shares(self.carries), self.carries, sums_of, self.start, self.arm)
        if np.isfinite(found.sums).all():
            self.start = found.sums
        return found

    def in_set(self, shares: np.ndarray, carries: np.ndarray, sums_of: SumsOf) -> Carried:
        """The loads at an instant of a set (N,) that may carry."""
        return carried(shares, carries, sums_of, self.start, self.arm)

    def beyond(self, found: Carried) -> tuple[np.ndarray, np.ndarray]:
        """(N + 1,) what ends the phase where it is positive, and its rounding: loads below zero, springs of contacts
        that are off above it, and the coupled matrix, whose determinant may not come to zero."""
        values = np.where(self.carries, -found.compression, found.compression) / self.weight
        rounding = np.full(len(values) + 1, ROUNDINGS * np.finfo(float).eps)
        return np.append(values, DETERMINED - found.determinant), rounding

    def decide(self, sums_for: Callable[[np.ndarray], SumsOf], friction: bool) -> Carried:
        """The set that carries from now on.

        sums_for  makes the function of `carried` for a set (N,) bool
        friction  whether the forces of the ground depend on the loads

        Raises GroundFailsError where the vehicle tips, and where there is no such set, or several.
        """
        fits: list[tuple[np.ndarray, Carried]] = []
        tried: list[tuple[np.ndarray, Carried]] = []
        candidates = self._all_sets() if len(self.carries) <= MOST else self._leading_on(tried)
        for carries in candidates:
            shares = self.springs.shares(carries)
            if shares is None:
                continue
            tried.append((carries, self.in_set(shares, carries, sums_for(carries))))
            if not self._wrong(*tried[-1]).any():
                fits.append(tried[-1])
        self._refuse(tried, fits, friction)
        near = min(fits, key=lambda entry: int((entry[0] != self.carries).sum()))
        self.carries, self.start = near[0].copy(), near[1].sums
        return near[1]

    def _all_sets(self) -> Iterator[np.ndarray]:
        for choice in product((True, False), repeat=len(self.carries)):
            carries = np.array(choice)
            if not (carries & self.dropped).any() and not (~carries & self.taken).any():
                yield carries

    def _leading_on(self, tried: list[tuple[np.ndarray, Carried]]) -> Iterator[np.ndarray]:
        """From the present set, whoever is wrong changes."""
        carries = (self.carries | self.taken) & ~self.dropped
        for _ in range(4 * len(carries)):
            count = len(tried)
            yield carries
            wrong = self._wrong(*tried[-1]) if len(tried) > count else np.zeros(len(carries), bool)
            if not wrong.any():
                return
            carries = carries ^ wrong

    def _wrong(self, carries: np.ndarray, found: Carried) -> np.ndarray:
        """(N,) contacts whose mode is not theirs. What comes back begins with no load: if its friction takes the load
        away again, neither mode is its own. Where the others' loads act on a line a contact that is off has none either
        way, and stays off."""
        pulls = np.where(carries, -found.compression, found.compression)
        within = np.where(self.taken, AT_EVENT, np.where(carries & ~self.carries, -FITS, FITS))
        return ~(pulls <= within * self.weight) & ~self.dropped

    def _refuse(
        self, tried: list[tuple[np.ndarray, Carried]], fits: list[tuple[np.ndarray, Carried]], friction: bool
    ) -> None:
        """Raises GroundFailsError unless there is one solution, and it is determined."""
        different = [fit for fit in fits if np.abs(fit[1].loads - fits[0][1].loads).max() > SAME * self.weight]
        if not fits:
            self._refuse_none(tried)
        if different:
            self.refuse(SEVERAL, different[0][1])
        if friction and not min(float(fit[1].determinant) for fit in fits) > DETERMINED:
            self.refuse(UNDETERMINED, fits[0][1])

    def _refuse_none(self, tried: list[tuple[np.ndarray, Carried]]) -> None:
        determined = all(found.determinant > DETERMINED for _, found in tried)
        found = tried[0][1] if tried else Carried(np.zeros(len(self.carries)), self.start, self.start, np.nan)
        self.refuse_as(NONE, found, determined)

    def refuse_as(self, failure: str, found: Carried, is_regular: bool) -> NoReturn:
        """Raises GroundFailsError for one of FAILURES.

        is_regular  whether the coupled matrix is as it must be, whichever contacts carry
        """
        if failure == NONE and is_regular:
            self.refuse_beyond_the_edge(found.sums)
        self.refuse(failure, found)

    def refuse_beyond_the_edge(self, sums: np.ndarray) -> None:
        """Raises GroundFailsError where the vehicle tips: where loads with the sums (3,) act at its edge, or beyond."""
        point = sums[1:] / self.weight
        if self.polygon.margin(point) > AT_EDGE * self.arm:
            return
        edge = [int(np.argmin(np.hypot(*(self.springs.places - end).T))) for end in self.polygon.nearest_edge(point)]
        beside = -float(self.polygon.margin(point))
        over = f", {1000 * beside:.3g} mm beyond it" if beside > AT_EDGE * self.arm else ""
        reason = (
            f"the vehicle tips over the edge of its wheels {min(edge)} and {max(edge)}: the loads act there{over}, and "
            "no wheel holds beyond"
        )
        raise GroundFailsError(reason, min(edge), NONE, tips=True)

    def refuse(self, what: str, found: Carried) -> NoReturn:
        """Raises GroundFailsError: loads and friction `what`."""
        wheel = int(np.argmax(np.abs(found.compression)))
        load = f"wheel {wheel + 1} would carry {found.compression[wheel]:.6g} N"
        if not np.isfinite(found.compression).all():
            load = f"no load of wheel {wheel + 1} is found"
        determinant = f"the determinant of the coupled matrix is {float(found.determinant):.3g}"
        in_one = "in one of them " if what == SEVERAL else ""
        asked = " (it must stay positive)" if found.determinant <= 0 else ""
        reason = (
            f"loads and friction {what}: {in_one}{load}, the vehicle weighs {self.weight:.6g} N, and {determinant}"
            f"{asked}; a lower centre of mass or less friction gives one solution"
        )
        raise GroundFailsError(reason, wheel, what, ends=bool(np.isfinite(found.compression).all()))

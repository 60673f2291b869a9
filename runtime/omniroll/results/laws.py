"""The energy of every run with friction that may stick, asked of some of its instants: a run without it is no result.

At the beginning of a phase, where the modes have just been decided, the energy that the vehicle has gained is what the
effects have done, and so it is over the whole run. Else it is a fault of this program, or numbers beyond those that a
double can hold apart; either way nothing of the motion from there on may be used. What sticks and takes more than it
can ends a run in the engine (runtime/csrc/run/laws.c).
"""

from typing import NamedTuple

import numpy as np

from omniroll.results.trajectory import Trajectory

STICKING = {"contact_coulomb", "axle_sticking", "roller_sticking"}  # effects whose friction is a set-valued law
MOST_ROWS = 10_000  # of a run whose account is made as a whole
MOST_PHASES = 8  # that are asked, spread over the run; the first one among them
SHORT = 1e-9  # of the run: in shorter steps what the last sweep has left of slips turns their directions
INSIDE = (0.25, 0.75)  # parts of a phase's first step at which it is asked
LEDGER = 1e-3  # of the energy that may be unexplained: far more than errors of runs, and far less than wrong modes
REST = 1e-9  # 1/s: a vehicle whose |nu| stays below this rests, but for roundings of its forces
TOLERANCES = 1e3  # times the tolerance, where that is more


class Broken(NamedTuple):
    """What is broken, in words; and when, in s."""

    what: str
    t: float


def broken(run: Trajectory) -> Broken | None:
    """The first law that a run breaks at the instants that are asked, or None."""
    if run.engine == "python" or not STICKING.intersection(run.effects.names()):  # that steps in time, without phases
        return None
    times = _instants(run)
    if not len(times):
        return None
    bound = LEDGER + TOLERANCES * run.stats["tolerance"]
    return _of_energy(run, times, bound) or _of_ledger(run, bound)


def _instants(run: Trajectory) -> np.ndarray:
    """Times (K, 2) inside the first steps of some phases."""
    rows = run.step_rows
    if not len(rows) or not run.is_dense:
        return np.zeros((0, 2))
    start, end = run.t[rows], run.t[np.minimum(rows + 1, len(run) - 1)]
    begins = (rows == 0) | (start == run.t[np.maximum(rows - 1, 0)])
    times = start[:, None] + (end - start)[:, None] * np.array(INSIDE)
    lasts = end - start > SHORT * (run.t[-1] - run.t[0])
    asked = np.flatnonzero(begins & lasts & (start < times[:, 0]) & (times[:, 0] < times[:, 1]) & (times[:, 1] < end))
    asked = asked[np.unique(np.linspace(0, len(asked) - 1, min(MOST_PHASES, len(asked))).astype(int))]
    return times[asked]


def _of_energy(run: Trajectory, times: np.ndarray, bound: float) -> Broken | None:
    energy, done = (values.reshape(times.shape) for values in run.account_at(times.ravel()))
    left = np.abs(np.diff(energy - done, axis=1)[:, 0])
    scale = max(energy.max(), _at_end(run), np.abs(done).max(), _at_rest(run))
    if not left.max() <= bound * scale:
        k = int(np.argmax(left))
        what = f"{left[k]:.3g} J of {scale:.3g} J come from nowhere or go there within {np.ptp(times[k]):.3g} s"
        return Broken(what, float(times[k, 1]))
    return None


def _at_end(run: Trajectory) -> float:
    """The energy of the last row, in J; of a short run from the array that its account reads anyway."""
    return float(run.energy[-1] if len(run) <= MOST_ROWS else run.account_at(run.t[-1:])[0][0])


def _at_rest(run: Trajectory) -> float:
    """The energy, in J, of a vehicle that rests."""
    return run.vehicle.mass * (run.vehicle.platform_radius * REST) ** 2


def _of_ledger(run: Trajectory, bound: float) -> Broken | None:
    """The account of the whole run: an event may lose what phases keep."""
    if len(run) > MOST_ROWS:
        return None
    account = run.ledger
    scale = max(account.scale, _at_rest(run))
    if abs(account.residual) <= bound * scale:
        return None
    what = f"{account.residual:.3g} J of {scale:.3g} J of the whole run come from nowhere"
    return Broken(what, float(run.t[-1]))

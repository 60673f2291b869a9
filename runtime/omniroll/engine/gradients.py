"""The derivative of one number, a loss, by many numbers of a run, backwards through it.

A run is a chain of phases between two switches. What a phase hands on to the next is a row of numbers: the deviations
of its state, of the rollers' axial speeds and of what the controllers remember. Each phase is a linear map of that
row, made by the same walk as the sensitivities', from unit deviations at the phase's start. A loss then goes through
the transposed maps from the last phase to the first, and meets each number where it acts. The work hardly grows with
the numbers of the start and of tables, however many there are.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.engine.drive_deviations import refuse_what_is_not_followed
from omniroll.engine.motion import Motion, columns_beside
from omniroll.engine.sensitivities import Sweep
from omniroll.errors import InvalidValueError
from omniroll.kernels.tangent_kernel import tangent_of, with_tangent
from omniroll.results.trajectory import Trajectory


def gradient(
    run: Trajectory,
    names: Sequence[str],
    t: ArrayLike,
    *,
    nu: ArrayLike | None = None,
    chi: ArrayLike | None = None,
    pose: ArrayLike | None = None,
) -> dict[str, float]:
    """The derivatives of a loss by numbers of a run, by name, where the loss depends on the motion at some times.

    run    Trajectory, with its polynomials
    names  of the numbers, as for `sensitivities` of simulate
    t      (K,) times within the run, in s
    nu     (K, 3) derivatives of the loss by nu at these times; None: it does not depend on nu
    chi    (K, N) the same by the wheels' angles
    pose   (K, 3) the same by the pose

    The same as the sums of these over the sensitivities, for a price that hardly depends on how many numbers of the
    start there are. Raises InvalidValueError for values that do not fit, and for names and effects without
    sensitivities; NoDerivativeError as simulate does, and where wheels switch together and the order matters.
    """
    if not isinstance(run, Trajectory):
        raise InvalidValueError("run", run, "must be a Trajectory")
    names = [validation.text("names", name) for name in validation.sequence("names", names, "must be names of numbers")]
    motion = Motion(run)
    refuse_what_is_not_followed(run.effects.effects, motion.plain)
    times = validation.real_array("t", t)
    if times.ndim != 1:
        raise InvalidValueError("t", t, "must be a row of times")
    weights = np.zeros((len(times), motion.vector.size))
    for name, given in {"nu": nu, "chi": chi, "pose": pose}.items():
        if given is not None:
            shape = (len(times), *motion.vector.shapes[name])
            motion.vector.view(weights, name)[...] = validation.real_array(name, given, shape)
    chain = Chain(motion, tuple(names))
    chain.run()
    found = chain.pulled_back(times, weights[:, motion.deviations.state])
    return dict(zip(names, found.tolist(), strict=True))


class Chain(Sweep):
    """The phases of a run as linear maps. Columns are the unit deviations at a phase's start, then the numbers."""

    def __init__(self, motion: Motion, names: tuple[str, ...]):
        plain = motion.plain
        self.sizes = {"state": len(motion.deviations.state)}
        if plain.has_spins:
            self.sizes["axial"] = plain.wheels * plain.rollers_per_wheel
        samplers = sum(hasattr(effect, "proportional") for effect in motion.trajectory.effects.effects)
        self.sizes["controllers"] = 2 * plain.wheels * samplers
        self.handed_on = sum(self.sizes.values())
        super().__init__(motion, columns_beside(motion.trajectory, names, self.handed_on))
        self.maps: list[np.ndarray] = []  # (W, W + P) of each phase's start, by the start of that before it

    def _put_start(self) -> None:
        super()._put_start()
        self._phase_begun(0)

    def _samples(self) -> np.ndarray:
        """Also the phases' starts: what controllers remember deviates anew there."""
        found = super()._samples()
        found[self.motion.phases] = True
        return found

    def _phase_begun(self, row: int) -> None:
        """Where a phase begins: what it is handed is kept, and it begins with the unit deviations (m, W + P)."""
        phase, samplers = int(np.searchsorted(self.motion.phases, row)), self.drives.samplers
        if phase == len(self.motion.phases) or self.motion.phases[phase] != row:
            return
        handed = [self.rows[row]] + ([] if self.axial is None else [self.axial[phase]])
        handed += [tangent_of(part).T for sampler in samplers for part in (sampler.sum, sampler.output)]
        self.maps.append(np.concatenate(handed))
        unit, ends = np.eye(self.handed_on, len(self.columns)), np.cumsum(list(self.sizes.values()))
        rest = np.split(unit[ends[-2] :], 2 * len(samplers)) if samplers else []
        for sampler, own_sum, own_output in zip(samplers, rest[::2], rest[1::2], strict=True):
            sampler.sum = with_tangent(sampler.sum.real, own_sum.T)
            sampler.output = with_tangent(sampler.output.real, own_output.T)
        if self.axial is not None:
            self.axial[phase] = unit[ends[0] : ends[1]]
        self.rows[row] = unit[: ends[0]]

    def _one_after_the_other(
        self, row: int, moved: np.ndarray, times: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray | None]:
        if self.motion.plain.roller_model == "massless" or self.motion.plain.slips:
            return super()._one_after_the_other(row, moved, times)
        wheels = np.flatnonzero(self.motion.directions[row + 1])
        reason = "they switch together, and backwards the order of the switches is not known"
        raise self._no_derivative(self._instant(row), reason, wheels)

    def pulled_back(self, times: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """(P,) the derivatives of a loss by the numbers; `weights` (K, m) are those by the deviations at the times."""
        _, row = self.trajectory.state_and_row(times)
        seen = np.einsum("km,kmc->kc", weights, self.followed().moved_at(self.motion, self.columns, row, times))
        phase = self.motion.phase_of(row)
        by_numbers, later = np.zeros(len(self.columns) - self.handed_on), np.zeros(self.handed_on)
        for k in reversed(range(len(self.maps))):
            own = seen[phase == k].sum(axis=0)
            passed = (later + own[: self.handed_on]) @ self.maps[k]
            by_numbers += own[self.handed_on :] + passed[self.handed_on :]
            later = passed[: self.handed_on]
        return by_numbers

"""How what instruments read depends on the numbers of a run, and on the time at which they read.

The motion and what its drives give carry the deviations that the run's sensitivities found; the generated functions
from which readings are made carry them on, with those of the numbers that they know themselves. Nothing is differenced.
"""

from collections.abc import Sequence

import numpy as np

from omniroll.engine.contact_modes import MODES, slips
from omniroll.engine.motion import columns_beside
from omniroll.engine.sensitivities import Followed
from omniroll.engine.sticking import Sticking
from omniroll.identification.way_slopes import way_slopes
from omniroll.kernels.tangent_kernel import TangentKernel, tangent_of, with_tangent
from omniroll.results.measurements import (
    ANGLE_OF,
    Instruments,
    Moments,
    counts_per_rad,
    measuring_kernel,
    true_values,
)
from omniroll.results.tracking import ways_at
from omniroll.results.trajectory import Trajectory


def reading_slopes(
    run: Trajectory, times: np.ndarray, instruments: Instruments, names: Sequence[str]
) -> dict[str, np.ndarray]:
    """(1 + P, T, ...) derivatives of what ideal instruments read at times (T,), by name: by the time itself, then by
    each of the P numbers of which the run has sensitivities.

    names  of readings, and "pose"; the counts of encoders are taken before they are made whole
    """
    return _Slopes(run, times, instruments).of(tuple(names))


class _Slopes:
    def __init__(self, run: Trajectory, times: np.ndarray, instruments: Instruments):
        self.run, self.times, self.instruments = run, times, instruments
        self.followed: Followed = run.followed
        look = self.followed.look_at(run, times)
        self.motion, self.y, self.row = look.motion, look.y, look.row
        self.columns = columns_beside(run, self.followed.names, others=1)  # the first is that of the time
        self.drives = {name: value for name, value in run.drives_at(times).items() if name not in MODES}
        self.drive_slopes = self._drive_slopes()
        self.inputs = self._inputs()
        rates = self.motion.rates_in(self.y, self.inputs, self.row)
        self.carrying = with_tangent(
            self.y, self.motion.whole(np.concatenate([rates[None], np.moveaxis(look.moved, -1, 0)]))
        )

    def of(self, names: tuple[str, ...]) -> dict[str, np.ndarray]:
        run, view = self.run, self.motion.vector.view
        nu, chi, pose = (view(self.carrying, name) for name in ("nu", "chi", "pose"))
        passes = np.zeros(chi.shape[1:], int)  # a whole number of rollers, which does not deviate
        spins = self._spins() if "accelerometer" in names and self.motion.plain.has_spins else None
        drives = {
            name: with_tangent(value, self._moved(k, name)) for k, (name, value) in enumerate(self.drives.items())
        }
        slipping = (view(self.carrying, "rates"), lambda: self._accelerations(spins)) if self.motion.plain.slips else ()
        moments = Moments(nu, chi, pose, passes, spins, drives, passes, *slipping, ways=self._ways)
        asked = {ANGLE_OF.get(name, name) for name in names} - {"pose"}
        plain = measuring_kernel(run.vehicle, run.roller_model, run.effects, tuple(asked))
        found = true_values(
            run.vehicle, run.roller_model, run.effects, moments, self.instruments, tuple(asked), self._bound(plain)
        )
        for name in ANGLE_OF.keys() & set(names):
            found[name] = found[ANGLE_OF[name]] * counts_per_rad(self.instruments, name)
        return {name: tangent_of(found[name] if name in found else pose) for name in names}

    def _ways(self) -> np.ndarray:
        """(1 + P, T, 3) nu integrated since the start."""
        by_time = self.motion.vector.view(self.y, "nu")[None]
        slopes = np.concatenate([by_time, way_slopes(self.run, self.followed, self.times)])
        run = self.run
        return with_tangent(ways_at(run.elapsed, run.step_rows, run.dense, self.times - run.start_time), slopes)

    def _bound(self, plain) -> TangentKernel:
        """The functions of a kernel for states (1 + P, T)."""
        tangents = {name: own[:, None] for name, own in self.columns.constants.items()}
        return TangentKernel(plain, tangents, (len(self.columns), 1))

    def _inputs(self) -> np.ndarray:
        """(T, U) what the phases are given at the times."""
        deviations, contacts = self.motion.deviations, self.motion.contacts
        if not deviations.inputs:
            return np.zeros((len(self.times), 0))
        bearings = self.motion.bearings
        turning = {} if bearings is None else bearings.given(bearings.torques[self.row])
        found = deviations.joined(deviations.views(self.motion.inputs[self.row]) | self.drives | turning)
        return found if contacts is None else contacts.headed(self.y, found, self.row)

    def _accelerations(self, spins: np.ndarray | None) -> dict[str, np.ndarray]:
        """nu_dot (1 + P, T, 3) of wheels that may slip, by name; it carries deviations as the rollers' spins do."""
        motion, bound = self.motion, self._bound(self.motion.plain)
        deviations, contacts = motion.deviations, motion.contacts
        given, nu, chi = deviations.views(self.inputs), *(motion.vector.view(self.carrying, n) for n in ("nu", "chi"))
        for k, name in enumerate(self.drives):
            if name in given:
                given[name] = with_tangent(given[name], self._moved(k, name))
        if "momenta" in given:
            given["momenta"] = bound.momenta(bound.axial_speeds(nu, chi, spins))
        sticking = Sticking.of(motion, self.columns)
        held = {} if sticking is None else sticking.carried(self.row)
        if contacts is not None and contacts.turns:
            given["slip_heading"] = self._headings(bound, given["slip_heading"])
        inputs = deviations.joined(given) if given else self.inputs
        return {"nu_dot": deviations.rates_of(bound, self.carrying, inputs, held)[..., deviations.places["nu"]]}

    def _headings(self, bound: TangentKernel, headings: np.ndarray) -> np.ndarray:
        """(1 + P, T, N) the directions of slips (T, N), carrying how the slips turn them."""
        known = self.motion.deviations.known_in(self.carrying, self.inputs)
        slip, cos, sin = slips(bound, known), np.cos(headings), np.sin(headings)
        along, across = slip[..., 0] * cos + slip[..., 1] * sin, slip[..., 1] * cos - slip[..., 0] * sin
        slides = self.motion.contacts.turning[self.row]
        return with_tangent(headings, np.where(slides, tangent_of(across) / np.where(slides, along.real, 1.0), 0.0))

    def _drive_slopes(self) -> dict[str, np.ndarray]:
        """(T, N) how fast the inputs of the drives change, by name."""
        run, after, place = self.run, np.minimum(self.row + 1, len(self.run) - 1), self.run.effects.drives().index
        length = (run.elapsed[after] - run.elapsed[self.row])[:, None]
        steps = {name: run.drive[after, place(name)] - run.drive[self.row, place(name)] for name in self.drives}
        return {name: np.divide(s, length, out=np.zeros_like(s), where=length > 0) for name, s in steps.items()}

    def _moved(self, drive: int, name: str) -> np.ndarray:
        """(1 + P, T, N) deviations of one of the drives' inputs."""
        run, deviations, wheels = self.run, self.motion.deviations, self.motion.plain.wheels
        step = np.searchsorted(run.step_rows, self.row, side="right") - 1
        since = (self.times - run.start_time - run.elapsed[run.step_rows[step]])[:, None, None]
        value, slope = (
            self.followed.inputs[step, first + drive * wheels : first + (drive + 1) * wheels]
            for first in (0, deviations.input_size)
        )
        by_numbers = np.moveaxis(value + since * slope, -1, 0)
        return np.concatenate([self.drive_slopes[name][None], by_numbers])

    def _spins(self) -> np.ndarray:
        """(1 + P, T, N, n-1) of the free rollers, carrying their deviations."""
        phase = self.motion.phase_of(self.row)
        start = np.moveaxis(self.followed.rows[self.followed.phases[phase]], -1, 0)
        axial = np.moveaxis(self.followed.axial[phase], -1, 0)
        axial = axial.reshape(*axial.shape[:2], self.motion.plain.wheels, self.motion.plain.rollers_per_wheel)
        start, axial = (np.concatenate([np.zeros_like(part[:1]), part]) for part in (start, axial))
        time = np.zeros((len(self.columns), 1))
        time[0] = 1.0
        return self.motion.later_spins(
            self._bound(self.motion.plain), self.carrying, self.row, self.times, start, axial, time
        )

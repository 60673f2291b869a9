"""A run's result: rows at the steps' ends, two at every switch, and polynomials in between."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from omniroll import extras, validation, vocabulary
from omniroll.effects.effect_set import EffectSet
from omniroll.effects.named import kind_of
from omniroll.effects.state_vector import StateVector
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.neutral_kernel import best_backend, kernel_by
from omniroll.kernels.phases import Carry, call_in_phases, in_phases
from omniroll.results import on_springs, tables, trajectory_files
from omniroll.results.dense import places_in_steps, steps_of, values_at
from omniroll.results.ledger import Ledger
from omniroll.results.measurements import (
    Instruments,
    Moments,
    checked_instruments,
    readings_of,
    reckoned,
    reckoned_by_tracking,
    tracking_of,
    true_values,
)
from omniroll.results.on_demand import MadeOnDemand, Maker, OnDemand, Stats
from omniroll.results.slipping import Contacts, given_in_rows, rollers_hold
from omniroll.results.tracking import ways_at
from omniroll.results.trajectory_content import ARRAYS, Stored
from omniroll.vehicles.checks import joint_angles
from omniroll.vehicles.state import by_roller, physical_roller, place_of_roller
from omniroll.vehicles.vehicle import Vehicle

if TYPE_CHECKING:  # only an extra brings them
    import pandas
    import xarray
    from matplotlib.figure import Figure

MOST_TIMES = 10**7  # of a sample, whose motion takes some GB then
FEW = 3  # an array that has less than so many times the rows that are wanted is computed as a whole
ON_GROUND = ("slip", "ground_force", "ground_load")
SHOWN = ("nu", "chi", "contact", "contact_spin", "spins", "energy", *ON_GROUND)  # in tables
DESCRIPTION = ("roller_model", "switching", "accuracy", "engine", "start_time", "stats")  # fields that JSON can hold


@dataclass(frozen=True, eq=False)
class Samples(MadeOnDemand):
    """A motion at given times, which may have any shape (...).

    t             (...) in s
    nu            (..., 3) in 1/s
    chi           (..., N) in rad, |chi| <= pi/n
    contact       (..., N) int, the physical roller in contact
    contact_spin  (..., N) in rad/s, the spin of the roller in contact, (2.1)
    spins         (..., N, n-1) in rad/s, of the free rollers j = 2..n relative to their disks; None but for the roller
                  model "free"
    pose          (..., 3) x, y in m, theta in rad
    energy        (...) in J, (3.2)
    slip          (..., N, 2) in m/s, velocities of the contacts on the ground, along the axle n and along the rolling
                  direction e_z x n; None where wheels cannot slip
    ground_force  (..., N, 2) in N, forces of the ground on the wheels, along the same; None where wheels cannot slip
    ground_load   (..., N) in N, loads of the contacts; None where wheels cannot slip, and under a law that knows none
    made          how contact_spin, spins, energy, and what contacts do that may slip are computed when first read
    """

    t: np.ndarray
    nu: np.ndarray
    chi: np.ndarray
    contact: np.ndarray
    pose: np.ndarray
    made: Mapping[str, Maker]

    contact_spin = OnDemand()
    spins = OnDemand()
    energy = OnDemand()
    slip = OnDemand()
    ground_force = OnDemand()
    ground_load = OnDemand()


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """The derivative of a motion by a number, in the number's unit, at times of any shape (...) that stay fixed.

    name   of the number
    t      (...) in s
    nu     (..., 3)
    chi    (..., N)
    pose   (..., 3)
    spins  (..., N, n-1) of the free rollers j = 2..n; None but for the roller model "free"

    At a switch the motion jumps, and so does its derivative.
    """

    name: str
    t: np.ndarray
    nu: np.ndarray
    chi: np.ndarray
    pose: np.ndarray
    spins: np.ndarray | None


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(MadeOnDemand):
    """A motion of a vehicle with N wheels of n rollers; T rows.

    t             (T,) time; never decreasing. A switch has two rows of one time, before and after
    nu            (T, 3) in 1/s
    chi           (T, N) in rad, |chi| <= pi/n
    contact       (T, N) int, the physical roller in contact, 0..n-1
    pivots        (T, N) int, 1 for a mecanum wheel or one with two rows that stands on its joint; None of others
    modes         (T, B) int of bearings that may stick, 0 where one does, else the sign of its rate: of axles (N,), if
                  these may, then of rollers (N, n), if these may, by place (without spins (N,), of those in contact). A
                  row in which a step starts has those of the step, others those with which a phase ends. None where
                  none may, and from the Python engine
    contact_spin  (T, N) in rad/s, the spin of the roller in contact, (2.1)
    spins         (T, N, n-1) in rad/s, spins of the free rollers j = 2..n relative to their disks; None but
                  for the roller model "free"
    pose          (T, 3) x, y in m, theta in rad
    energy        (T,) in J, (3.2)
    switches      records (t, wheel, direction, energy_jump), one for each wheel that switched, also as
                  switches.t, ...; the jump of a joint switch is shared equally among its wheels. Direction 0: the wheel
                  stops at its joint, or goes on from there to the side from which it came
    stats         dict: steps, evaluations, switches, phases, error_estimate, ...
    elapsed       (T,) time since start_time, not rounded to the clock
    dense         (S, d + 1, 6 + N + E) Bernstein coefficients of (nu, chi, pose, added) on each of the S steps, or None
    step_rows     (S,) the row at which each step starts
    added         (T, E) what the effects integrate, see `quantity`; None without effects
    drive         (T, D, N) what the drives give: torque in N m at the axles, and with motors damping in N m s, which
                  takes damping * chi' from it; then, where axles may stick, the torque in N m of their bearings; last,
                  where contacts may stick, whether each does (1) or slips (0), and the angle in rad from its axle in
                  which its slip began; and where loads follow the motion, whether each carries (1) or is off (0).
                  effects.drives() names them; None where there are none. A row that ends a phase has the values of
                  that phase, not of the next one
    vehicle, roller_model, switching, accuracy, engine, start_time, effects    what was asked for
    made          how the arrays are computed when they are first read
    in_part       how some rows (or of `dense` steps) of such an array are computed where few are wanted; where wheels
                  may slip also of `axial`, the free rollers' axial speeds (..., N, n-1)
    followed      the derivatives that were asked for, see `sensitivity`; None where none were
    is_read       whether `load` has read it: files do not keep derivatives
    """

    vehicle: Vehicle
    roller_model: str
    switching: str
    accuracy: float
    engine: str
    start_time: float
    made: Mapping[str, Maker]
    stats: Stats = field(default_factory=lambda: Stats({}))
    effects: EffectSet = EffectSet()
    in_part: Mapping[str, Callable[[np.ndarray], np.ndarray]] = field(default_factory=dict)
    followed: Any = None
    is_read: bool = False

    t = OnDemand()
    elapsed = OnDemand()
    nu = OnDemand()
    chi = OnDemand()
    contact = OnDemand()
    pivots = OnDemand()
    modes = OnDemand()
    contact_spin = OnDemand()
    spins = OnDemand()
    pose = OnDemand()
    energy = OnDemand()
    switches = OnDemand()
    dense = OnDemand()
    step_rows = OnDemand()
    added = OnDemand()
    drive = OnDemand()

    def __len__(self) -> int:
        return len(self.t)

    def __getstate__(self) -> dict:
        return super().__getstate__() | {"in_part": {}}

    def __repr__(self) -> str:
        return (
            f"<Trajectory: {self.roller_model}, {self.switching}, N={self.vehicle.wheels}, "
            f"n={self.vehicle.rollers_per_wheel}, t = {self.t[0]:g} ... {self.t[-1]:g}, {len(self)} rows, "
            f"{len(self.switches)} switches>"
        )

    # Rollers by place and by number

    def physical_roller(self, j: ArrayLike) -> np.ndarray:
        """(T, N) the physical number 0..n-1 of roller j = 1..n (1 is in contact) in every row; j - 1 where a wheel has
        fewer rollers than j."""
        j = self._whole("j", j, 1, self.vehicle.rollers_per_wheel)
        return physical_roller(self.contact, j, np.array(self.vehicle.rollers))

    def place_of_roller(self, roller: ArrayLike) -> np.ndarray:
        """(T, N) the place j = 1..n of a physical roller 0..n-1 in every row; its number + 1 where a wheel has none."""
        roller = self._whole("roller", roller, 0, self.vehicle.rollers_per_wheel - 1)
        return place_of_roller(self.contact, roller, np.array(self.vehicle.rollers))

    def spins_by_roller(self) -> np.ndarray:
        """(T, N, n) spins of all rollers relative to their disks, by physical number; 0 for locked ones."""
        shape = self.chi.shape + (self.vehicle.rollers_per_wheel - 1,)
        spins = np.zeros(shape) if self.spins is None else self.spins
        whole = np.concatenate([self.contact_spin[..., None], spins], axis=-1)
        return by_roller(whole, self.contact, np.array(self.vehicle.rollers))

    def _whole(self, name: str, value: ArrayLike, least: int, most: int) -> np.ndarray:
        array = validation.real_array(name, value)
        if array.dtype.kind not in "iu" and (array % 1).any() or ((array < least) | (array > most)).any():
            raise InvalidValueError(name, value, f"must be a whole number from {least} to {most}")
        try:
            return np.broadcast_to(array, self.contact.shape).astype(int)
        except ValueError:
            bound = f"must be one number, or go with the shape {self.contact.shape}"
            raise InvalidValueError(name, value, bound) from None

    # Sampling

    def sample(self, t: ArrayLike) -> Samples:
        """The motion at any times within the run; at a switch that after it (right-continuous).

        t may be a number or an array (...,); the fields have its shape in front. At a row's time they are
        that row. Raises InvalidValueError for times outside the run, or where the dense output was not saved.
        """
        times = validation.real_array("t", t)
        self._check_times(times)
        y, row = self.state_and_row(times)
        return self._complete(times, y, row)

    def sensitivity(self, name: str, t: ArrayLike | None = None) -> Sensitivity:
        """The derivative of the motion by a number that `sensitivities` of simulate named.

        name  as it was named
        t     times of any shape within the run, at a switch that after it; None: the rows

        Raises InvalidValueError for another name, for times outside the run, and for a trajectory that `load` has read:
        files do not keep derivatives.
        """
        if self.followed is None and self.is_read:
            bound = "files do not keep derivatives; name it in sensitivities=(...) of simulate, and ask that trajectory"
            raise InvalidValueError("name", name, bound)
        if self.followed is None:
            raise InvalidValueError("name", name, "simulate was not asked for it; name it in sensitivities=(...)")
        if t is not None:
            self._check_times(validation.real_array("t", t))
        return self.followed.at(self, name, t)

    def state_rows(self) -> np.ndarray:
        """(T, 6 + N + E) nu, chi, pose and what the effects integrate, row by row."""
        return self._rows(np.arange(len(self)))

    def _check_times(self, times: np.ndarray) -> None:
        if times.size > MOST_TIMES:
            raise InvalidValueError("t", f"{times.size} times", f"must be at most {MOST_TIMES} at once: go in parts")
        if times.size and (times.min() < self.t[0] or times.max() > self.t[-1]):
            bound = f"must lie within the run, {float(self.t[0])!r} to {float(self.t[-1])!r}"
            raise InvalidValueError("t", times.tolist(), bound)

    def measure(
        self, t: ArrayLike, instruments: Instruments | None = None, names: Sequence[str] | None = None
    ) -> dict[str, np.ndarray]:
        """What instruments on the robot read, by the names of omniroll.vocabulary.MEASUREMENTS.

        t            (T,) increasing times within the run, in s; at each of them odometry goes on
        instruments  Instruments; None: without errors
        names        of the readings that are wanted; the others are not computed. None: all that there are. Mecanum
                     wheels and two rows have an accelerometer where they may slip

        Arrays (T, N), (T, W) of W tracking wheels, (T, 2), (T, 3) or (T,). Raises InvalidValueError as `sample` does.
        """
        instruments = checked_instruments(instruments)
        names = readings_of(self.vehicle, self.effects, names)
        times = np.array(vocabulary.TIMES.checked("t", t))
        samples = self.sample(times)
        moments = Moments(
            samples.nu, samples.chi, samples.pose, samples.contact,
            samples.spins if "accelerometer" in names else None, self.drives_at(times), self._passes(times),
            *self._rates_at(times), ways=partial(self._ways, times),
        )  # fmt: skip
        by_tracking = "tracking_odometry" in names and tracking_of(instruments) is not None
        needed = (*names, *("encoder_count",) * ("odometry" in names), *("tracking_count", "gyro") * by_tracking)
        true = true_values(self.vehicle, self.roller_model, self.effects, moments, instruments, needed)
        if "odometry" in names:
            odometry = reckoned(self.vehicle, samples.pose[0], true["encoder_count"], instruments)
            true |= {} if odometry is None else {"odometry": odometry}
        read = instruments.read(true, np.random.default_rng(instruments.seed))
        if by_tracking:
            odometry = reckoned_by_tracking(self.vehicle, samples.pose[0], times, read, instruments)
            read |= {} if odometry is None else {"tracking_odometry": odometry}
        return {name: value for name, value in read.items() if name in names}

    def _rates_at(self, times: np.ndarray) -> tuple:
        """The rates (T, N) of wheels that may slip, and what makes the motion's accelerations by name; of wheels that
        may stand on their joint their rates; nothing elsewhere."""
        y, row = self.state_and_row(times)
        if self.pivots is not None and not self.effects.slips:
            angles = self.kernel.angles_or_nothing(y[:, 3 : 3 + self.vehicle.wheels])
            carry = Carry(self.contact, self.pivots).at(row)
            return (call_in_phases(self.kernel, "wheel_speeds", y[:, :3], *angles, carry=carry),)
        if not self.effects.slips:
            return ()
        contacts, end = self._contacts_in(y, row, partial(self._beside, times, y, row)), 3 + self.vehicle.wheels
        return contacts.rates, lambda: contacts.accelerations(y[:, :3], y[:, 3:end])

    def _ways(self, times: np.ndarray) -> np.ndarray:
        return ways_at(self.elapsed, self.step_rows, self.dense, times - self.start_time)

    def drives_at(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """(..., N) the inputs of the drives at times (...), which are linear between rows, by name."""
        if self.drive is None:
            return {}
        row = np.searchsorted(self.t, times, side="right") - 1
        after = np.minimum(row + 1, len(self.t) - 1)
        length = self.t[after] - self.t[row]
        part = np.divide(times - self.t[row], length, out=np.zeros_like(length), where=length > 0)
        drive = self.drive[row] + part[..., None, None] * (self.drive[after] - self.drive[row])
        return {name: drive[..., k, :] for k, name in enumerate(self.effects.drives())}

    def _passes(self, times: np.ndarray) -> np.ndarray:
        """(T, N) joints that each wheel has passed forwards, less those backwards, up to the times."""
        passed = np.zeros((len(times), self.vehicle.wheels), int)
        before = np.searchsorted(self.switches["t"], times, side="right")
        for wheel in range(self.vehicle.wheels):
            own = np.where(self.switches["wheel"] == wheel, self.switches["direction"], 0)
            passed[:, wheel] = np.concatenate([[0], np.cumsum(own)])[before]
        return passed

    def state_at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """y = (nu, chi, pose), (T, 6 + N), and contact (T, N) at times (T,) within the run, and no more."""
        y, row = self.state_and_row(times)
        return y[..., : 6 + self.vehicle.wheels], self.contact[row]

    def state_and_row(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """y (..., 6 + N + E) at times within the run, and the last row at or before each."""
        # Where t is large, several elapsed times round to one t. A time that equals a row's t is taken as that row.
        row = np.searchsorted(self.t, times, side="right") - 1
        on_row = self.t[row] == times
        y = self._rows(row)
        between = ~on_row
        if between.any():
            y[between] = self._polynomials((times - self.start_time)[between])
        return y, row

    def _rows(self, row: np.ndarray) -> np.ndarray:
        """y (..., 6 + N + E) of some rows."""
        added = () if self.added is None else (self.added[row],)
        return np.concatenate([self.nu[row], self.chi[row], self.pose[row], *added], axis=-1)

    def _polynomials(self, elapsed: np.ndarray) -> np.ndarray:
        """y (..., 6 + N + E) from the steps' polynomials, at times since the start."""
        if not self.is_dense:
            raise InvalidValueError("t", None, "lies between rows, and the dense output was not saved")
        step, x = places_in_steps(*self._steps, elapsed)
        return values_at(self._some("dense", step, len(self._steps[0])), x)

    @property
    def is_dense(self) -> bool:
        """Whether the steps' polynomials are there, or can be made."""
        return "dense" in self.in_part or self.dense is not None

    def _some(self, name: str, places: np.ndarray, count: int) -> np.ndarray:
        """Some of the `count` rows of an array, which are computed alone where they are few."""
        wanted, back = np.unique(places, return_inverse=True)
        if name in vars(self) or name not in self.in_part or FEW * len(wanted) > count:
            return getattr(self, name)[places]
        return self.in_part[name](wanted)[back.reshape(places.shape)]

    @cached_property
    def _steps(self) -> tuple[np.ndarray, np.ndarray]:
        """Starts and lengths (S,) of the steps."""
        return steps_of(self.elapsed, self.step_rows)

    def _complete(self, times: np.ndarray, y: np.ndarray, row: np.ndarray) -> Samples:
        """Samples from y = (nu, chi, pose), where `row` is the last row at or before each time."""
        end = 3 + self.vehicle.wheels
        joint = joint_angles(self.vehicle)
        nu, chi, pose = y[..., :3], np.clip(y[..., 3:end], -joint, joint), y[..., end : end + 3]
        on_row = times == self.t[row]
        slipping = self._contacts_in(y, row, partial(self._beside, times, y, row))

        def with_rows(name: str, values: np.ndarray) -> np.ndarray:
            if on_row.any():
                values[on_row] = self._some(name, row[on_row], len(self))
            return values

        @cache
        def axial() -> np.ndarray | None:
            return self._axial(times, y, row) if self.roller_model == "free" else None

        def spins() -> np.ndarray | None:
            if self.roller_model != "free":
                return None
            carry = Carry(self.contact, self.pivots).at(row)
            found = call_in_phases(self.kernel, "spins_from_axial", nu, chi, axial(), carry=carry)
            return with_rows("spins", found if slipping is None else found - slipping.carried(nu, chi))

        def energy() -> np.ndarray:
            if slipping is not None:
                return with_rows("energy", slipping.energy_by_axial(nu, chi, axial()))
            bound, carry = self.kernel, Carry(self.contact, self.pivots).at(row)
            own = bound.spins_or_nothing(samples.spins)
            return with_rows("energy", call_in_phases(bound, "energy", nu, chi, *own, carry=carry))

        def contact_spin() -> np.ndarray:
            inside = np.concatenate([nu, chi, y[..., end:]], axis=-1)
            return with_rows("contact_spin", self.contact_spins_in(inside, times, row))

        made = {"contact_spin": contact_spin, "spins": spins, "energy": energy}
        on_ground = cache(lambda: (None, None, None) if slipping is None else slipping.forces(nu, chi))
        made |= {name: partial(lambda k: on_ground()[k], k) for k, name in enumerate(ON_GROUND)}
        samples = Samples(times, nu, chi, self.contact[row], pose, made)
        return samples

    def _axial(self, times: np.ndarray, y: np.ndarray, row: np.ndarray) -> np.ndarray:
        """The free rollers' axial speeds (..., N, n-1), from the last row at or before each time."""
        axial = self.in_part["axial"](row) if "axial" in self.in_part else self._axial_of_rows(row)
        if not self.effects:
            return axial
        before, after = self._state_vector.views(self._rows(row)), self._state_vector.views(y)
        elapsed = (times - self.start_time) - self.elapsed[row]
        return self.effects.axial_later(self._effect_kernel, axial, before, after, elapsed)

    def _axial_of_rows(self, row: np.ndarray) -> np.ndarray:
        """The same in some rows, from the spins there."""
        spins = self._some("spins", row, len(self))
        carry = Carry(self.contact, self.pivots).at(row)
        axial = call_in_phases(self.kernel, "axial_speeds", self.nu[row], self.chi[row], spins, carry=carry)
        if self.effects.slips and any(self.vehicle.roller_angle):
            axial = axial + self._contacts_in(self._rows(row), row).carried(self.nu[row], self.chi[row])
        return axial

    def times_on_joints(self) -> np.ndarray | None:
        """(N,) in s, for how long each mecanum wheel or wheel with two rows has stood on its joint; None of others.

        Both its rollers push it back there: on the ground both its rollers slide, which pure rolling leaves out.
        """
        return None if self.pivots is None else np.diff(self.elapsed) @ self.pivots[:-1]

    @property
    def kernel(self) -> Kernel:
        """The kernel of this vehicle and roller model without effects, compiled where that is there."""
        return kernel_by(self._backend, self.effects.equipped(self.vehicle), self.roller_model)

    @property
    def _backend(self) -> str:
        return "python" if self.engine == "python" else best_backend(self.roller_model)

    @property
    def _effect_kernel(self) -> Kernel:
        return self.effects.kernel(self.vehicle, self.roller_model, self._backend)

    @cached_property
    def _state_vector(self) -> StateVector:
        return self.effects.state_vector(self._effect_kernel)

    def contact_spins_in(self, y: np.ndarray, times: np.ndarray, row: np.ndarray) -> np.ndarray:
        """(..., N) in rad/s, of the rollers in contact relative to their disks.

        y      (..., 6 + N + E) states of the run: nu, chi, pose, and what the effects integrate
        times  (...) in s, when it is in them
        row    (...) the last row at or before each time
        """
        nu, chi = y[..., :3], y[..., 3 : 3 + self.vehicle.wheels]
        contacts = self._contacts_in(y, row, partial(self._beside, times, y, row))
        return self.kernel.wheel_rates(nu, chi)[1] if contacts is None else contacts.spins(nu, chi)

    # Contacts that slip

    def _contacts_in(
        self, y: np.ndarray, row: np.ndarray, beside: Callable[[], Mapping[str, np.ndarray]] = dict
    ) -> "Contacts | None":
        """Those in states y (..., 6 + N + E), where wheels may slip, with the last row at or before each; beside: see
        omniroll.results.slipping."""
        if not self.effects.slips:
            return None
        carry = Carry(self.contact, self.pivots).at(row)
        kernel = in_phases(self._effect_kernel, carry)
        return Contacts(kernel, self._state_vector.views(y), self.effects.grip(kernel.vehicle), beside, carry.pivots)

    @cached_property
    def contacts(self) -> "Contacts | None":
        """What the contacts do in the T rows, where wheels may slip: see omniroll.results.slipping. None elsewhere."""
        rows = np.arange(len(self))
        return self._contacts_in(self._rows(rows), rows, partial(self._beside, None, self._rows(rows), rows))

    def _beside(self, times: np.ndarray | None, y: np.ndarray, row: np.ndarray) -> dict[str, np.ndarray]:
        """What the forces of contacts that stick ask for beside the state, at times (...), or in the rows (None)."""
        place, in_rows = 3 + self.vehicle.wheels, times is None
        found = {"heading": y[..., place + 2]}
        if times is None:
            found |= {name: self.drive[:, k] for k, name in enumerate(self.effects.drives())}
            times = self.t
        else:
            found |= self.drives_at(times)
            if "axle_sticking" in self.effects.names() and "sticks" not in found:  # what holds is not linear in time
                rests = self.quantity("rates") == 0
                found["axle_sticks"] = rests[row] & rests[np.minimum(row + 1, len(rests) - 1)]
        if self.roller_model == "free":
            found["axial"] = self._axial(times, y, row)
        return found | self._massless_rollers(found.get("contact_bearing"), found.get("slip_heading"), row, in_rows)

    def _massless_rollers(
        self, taken: np.ndarray | None, heading: np.ndarray | None, row: np.ndarray, in_rows: bool
    ) -> dict[str, np.ndarray]:
        """Which massless rollers stick where wheels may slip, the torques (..., N) that the others have, and what all
        take."""
        sliding = self.effects.sliding_of_massless_rollers(self._effect_kernel)
        if sliding is None or taken is None:
            return {}
        names = self.effects.drives()
        if in_rows:
            return {"contact_taken": taken} | given_in_rows(taken, rollers_hold(taken, sliding, heading))
        headings = None if heading is None else self.drive[:, names.index("slip_heading")]
        of_rows = rollers_hold(self.drive[:, names.index("contact_bearing")], sliding, headings)
        sticks = of_rows[row] | of_rows[np.minimum(row + 1, len(of_rows) - 1)]
        return {"contact_taken": taken} | given_in_rows(taken, sticks)

    @property
    def sticks(self) -> np.ndarray | None:
        """(T, N) bool: contacts that stick on the ground, under the law coulomb; None under others. A row that ends a
        phase has the modes of that phase."""
        names = self.effects.drives()
        return self.drive[:, names.index("sticks")] > 0.5 if "sticks" in names else None

    @property
    def presses(self) -> np.ndarray | None:
        """(T, N) bool: contacts that press on the ground, on springs; None elsewhere. A row that ends a phase has the
        modes of that phase."""
        names = self.effects.drives()
        return self.drive[:, names.index("presses")] > 0.5 if "presses" in names else None

    @cached_property
    def _on_ground(self) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        return self.contacts.forces(self.nu, self.chi)

    @property
    def slip(self) -> np.ndarray | None:
        """(T, N, 2) in m/s, velocities of the contacts on the ground, along the axle n and along the rolling direction
        e_z x n; None where wheels cannot slip."""
        return None if self.contacts is None else self._on_ground[0]

    @property
    def ground_force(self) -> np.ndarray | None:
        """(T, N, 2) in N, forces of the ground on the wheels, along the same; None where wheels cannot slip."""
        return None if self.contacts is None else self._on_ground[1]

    @property
    def ground_load(self) -> np.ndarray | None:
        """(T, N) in N, loads of the contacts where wheels may slip; None elsewhere, and under a law that knows none."""
        return None if self.contacts is None else self._on_ground[2]

    # Energy

    def quantity(self, name: str) -> np.ndarray:
        """(T, ...) what an effect has integrated, by name: drive_work, axle_loss, roller_loss in J, ..."""
        names = [quantity.name for quantity in self.effects.quantities(self._effect_kernel)]
        validation.choice("name", name, names)
        return self._state_vector.view(self._rows(np.arange(len(self))), name)

    def contributions(self) -> dict[str, np.ndarray]:
        """(T,) the energy that the vehicle has gained from each effect since the start, in J; losses are negative."""
        return self._contributions_of(self._rows(np.arange(len(self))))

    def account_at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The energy and the sum of the contributions, (K,) each in J, at times (K,) within the run."""
        y, row = self.state_and_row(times)
        done = sum(self._contributions_of(y).values(), np.zeros(len(times)))
        return self._complete(times, y, row).energy, done

    def _contributions_of(self, y: np.ndarray) -> dict[str, np.ndarray]:
        """The same in states (K, 6 + N + E)."""
        accounts = {
            quantity.name: quantity.account * self._state_vector.view(y, quantity.name).reshape(len(y), -1).sum(axis=1)
            for quantity in self.effects.quantities(self._effect_kernel)
            if quantity.account
        }
        for entry, name in self.effects.potentials().items():
            of = self._effect_kernel.signatures[name].inputs[0].name  # the pose, or the wheels' angles
            start = self._rows(np.zeros(1, int))
            at_start, potential = (
                self._effect_kernel.call(name, self._state_vector.view(rows, of)) for rows in (start, y)
            )
            accounts[entry] = at_start[0] - potential
        if on_springs.WORK in accounts:
            start, work = self._rows(np.zeros(1, int))[0], accounts.pop(on_springs.WORK)
            accounts |= on_springs.in_two(self._effect_kernel, self._state_vector, work, start, y)
        return accounts

    def gained(self) -> np.ndarray:
        """(T,) their sum."""
        return sum(self.contributions().values(), np.zeros(len(self)))

    @property
    def ledger(self) -> Ledger:
        """The account of the energy of the whole run."""
        sums = {name: float(values[-1]) for name, values in self.contributions().items()}
        sums["switches"] = float(self.switches["energy_jump"].sum())
        return Ledger(float(self.energy[0]), float(self.energy[-1]), sums, float(self.energy.max()))

    # Pictures

    def plot(self, what: str = "motion", *, title: str = "") -> "Figure":
        """A picture of the run, a Figure of matplotlib; a notebook shows it, figure.savefig writes it.

        what   "motion": path, heading, energy and nu; "forces": torques, currents, voltages, slip, loads and the error
               along a path, as far as the run has them
        title  of the picture; "": the roller model and the time

        Raises MissingPackageError without the extra `plots`, InvalidValueError for forces of a run that has none.
        """
        validation.choice("what", what, ("motion", "forces"))
        validation.text("title", title)
        matplotlib = extras.needed("matplotlib", "plots", "plot")
        from omniroll.results import force_pictures, pictures

        title = title or f"{self.roller_model} rollers, {self.t[0]:g} to {self.t[-1]:g} s"
        with matplotlib.rc_context(pictures.STYLE):
            if what == "motion":
                return pictures.sheet({f"{self.roller_model}, {self.switching}": self}, self.t[-1], title)
            figure = force_pictures.sheet(self, title)
        if figure is None:
            raise InvalidValueError("what", what, "needs a drive or wheels that may slip: this run has neither")
        return figure

    # Tables

    def arrays(self, t: ArrayLike | None = None, instruments: Instruments | None = None) -> dict[str, np.ndarray]:
        """The motion as arrays by name, whose first axis is time: what the tables below hold.

        t            (T,) increasing times within the run, in s; None: the run's own rows, two at a switch
        instruments  Instruments, whose readings are added; they need times. None: no readings

        t, x, y, theta, nu, chi, contact, contact_spin, spins of free rollers, energy, of wheels that may slip slip,
        ground_force and ground_load, what the drives give, and the energy that each effect has brought since the start.

        Raises InvalidValueError as `sample` and `measure` do, and for instruments without times.
        """
        if t is None and instruments is not None:
            raise InvalidValueError("t", t, "must be increasing times where instruments are read")
        times = self.t if t is None else np.array(vocabulary.TIMES.checked("t", t))
        moments = self if t is None else self.sample(times)
        found = {"t": times} | dict(zip(tables.POSE, moments.pose.T, strict=True))
        found |= {name: getattr(moments, name) for name in SHOWN if getattr(moments, name) is not None}
        if t is None:
            y = self._rows(np.arange(len(self)))
            found |= {name: self.drive[:, k] for k, name in enumerate(self.effects.drives())}
        else:
            y, _ = self.state_and_row(times)
            found |= self.drives_at(times)
        found |= self._contributions_of(y)
        return found if instruments is None else found | self.measure(times, instruments)

    def to_pandas(self, t: ArrayLike | None = None, instruments: Instruments | None = None) -> "pandas.DataFrame":
        """The motion as a table of pandas over t, with a column for each number: x, nu_1, chi_3, spins_1_2, ...

        t, instruments  as in `arrays`

        frame.attrs["units"] has the columns' units. Raises MissingPackageError without the extra `tables`,
        InvalidValueError as `arrays` does.
        """
        return tables.to_pandas(self.arrays(t, instruments))

    def to_xarray(self, t: ArrayLike | None = None, instruments: Instruments | None = None) -> "xarray.Dataset":
        """The motion as a Dataset of xarray over t.

        t, instruments  as in `arrays`

        The other dimensions are component (of nu, from 1), wheel (from 1), place (j = 2..n of the free rollers),
        direction (along_axle, along_rolling), and of readings axis and coordinate. Each variable has its unit in
        attrs["units"], the whole what was asked for. Raises as `to_pandas` does.
        """
        described = {name: getattr(self, name) for name in DESCRIPTION if name != "stats"}
        return tables.to_xarray(self.arrays(t, instruments), described | {"vehicle": repr(self.vehicle)})

    def to_parquet(
        self, path: str | PathLike, t: ArrayLike | None = None, instruments: Instruments | None = None
    ) -> None:
        """Write the table of `to_pandas` to a Parquet file, with the units.

        path            str or path
        t, instruments  as in `arrays`

        Raises as `to_pandas` does, and OSError where the file cannot be written: the file before is left then.
        """
        tables.to_parquet(self.arrays(t, instruments), validation.file_path("path", path))

    # Files

    def save(self, path: str | PathLike, *, dense: bool = True, measured: bool = True) -> None:
        """Write to a .npz or .csv file, by the name's ending; `load` gives the same trajectory, bit by bit.

        path      str or path
        dense     False leaves the polynomials out: a smaller file, a table to look at; the trajectory that `load` makes
                  of it can then be sampled at its rows only
        measured  False makes no further runs: the figures of `stats` that need them and that nobody has read are None

        Raises InvalidValueError for another ending, and for an effect that has no registered name
        (omniroll.register_effect); OSError where the file cannot be written: the file before is left then.
        """
        dense, measured = validation.truth("dense", dense), validation.truth("measured", measured)
        description = {name: getattr(self, name) for name in DESCRIPTION} | {
            "stats": self.stats.complete() if measured else self.stats.known(),
            "vehicle": self.vehicle.as_dict(),
            "effects": [effect.as_dict() for effect in self.effects.effects],
            "drive_names": list(self.effects.drives()),
        }
        arrays = {name: getattr(self, name) for name in ARRAYS} | ({} if dense else {"dense": None})
        trajectory_files.write(Stored(description, arrays, self.switches), validation.file_path("path", path))

    @classmethod
    def joined(cls, parts: "Sequence[Trajectory]") -> "Trajectory":
        """One trajectory of parts that follow each other: the first row of each is the last one of that before it.

        Raises InvalidValueError for what is no sequence of trajectories, or an empty one.
        """
        bound = "must be trajectories that follow each other, at least one"
        parts = validation.sequence("parts", parts, bound)
        if not parts or not all(isinstance(part, Trajectory) for part in parts):
            raise InvalidValueError("parts", parts, bound)
        last = parts[-1]
        arrays: dict[str, np.ndarray | None] = {}
        for name in ARRAYS:
            found = [getattr(part, name) for part in parts]
            if name == "step_rows":
                starts = np.cumsum([0, *(len(part) - 1 for part in parts[:-1])])
                found = [rows + start for rows, start in zip(found, starts, strict=True)]
            elif name != "dense":
                found = found[:1] + [array if array is None else array[1:] for array in found[1:]]
            there = [array for array in found if array is not None]
            arrays[name] = np.concatenate(there) if there else None
        arrays["switches"] = np.concatenate([part.switches for part in parts]).view(np.recarray)
        return replace(last, made={name: partial(arrays.pop, name) for name in list(arrays)}, in_part={})

    @classmethod
    def load(cls, path: str | PathLike) -> "Trajectory":
        """Read what `save` wrote: all but derivatives, which files do not keep.

        path  str or path

        Raises InvalidValueError for a file that is not a trajectory, or a damaged one: names, shapes, types, that all
        numbers are finite, and checksums are verified, and the error names the array. OSError where it cannot be read.
        """
        stored = trajectory_files.read(validation.file_path("path", path))
        with trajectory_files.refusing_damage(path):
            described = stored.description
            vehicle = Vehicle(**described["vehicle"])
            effects = [kind_of(entry.pop("kind"))(**entry) for entry in map(dict, described["effects"])]
            arrays = stored.arrays | {"switches": stored.switches.view(np.recarray)}
            return cls(
                vehicle=vehicle,
                effects=EffectSet.checked(effects, vehicle),
                **{name: described[name] for name in DESCRIPTION if name != "stats"},
                stats=Stats(described["stats"]),
                made={name: partial(arrays.pop, name) for name in arrays},
                is_read=True,
            )

"""A session: a run of the compiled engine that goes on step by step, so that a loop can be closed from outside.

A step ends in a pause, which changes nothing: the motion is that of one run, whatever the steps. What happens at the
instant of a pause, such as a controller's sample, happens at the start of the next step; what that step is given is
known then. A torque or a voltage that differs from the one before is an event, as a knot of a table is.
"""

import pickle
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.alone import Alone
from omniroll.effects.effect_set import DRIVES
from omniroll.effects.numbers import plain_numbers, read_only
from omniroll.effects.torque import with_torque
from omniroll.engine.compiled_engine import check_can_run
from omniroll.engine.sensitivities import check_names
from omniroll.engine.simulate import checked_task
from omniroll.engine.stepped_deviations import SteppedDeviations
from omniroll.engine.stepped_run import SteppedRun
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
from omniroll.results.measurements import Instruments, Moments, checked_instruments, readings_of, true_values
from omniroll.results.slipping import Contacts
from omniroll.results.trajectory import Sensitivity, Trajectory
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle

FORMAT = 3  # of what save() gives
START = ("nu", "chi", "spins", "pose")
ARGUMENTS = (*START, "start_time", "roller_model", "switching", "accuracy", "effects")
NOT_IN_SESSIONS = ("duration", "engine", "memory", "progress", "control")  # arguments of simulate


class Described(Protocol):
    """A scene: a vehicle, and the other arguments of omniroll.simulate."""

    vehicle: Vehicle
    options: dict[str, Any]


@dataclass(frozen=True)
class Saved:
    """A session at one instant, which pickle can keep.

    made_for  what must be the same in a session that restores it, in words
    memory    the engine's memory, as bytes
    clock     the time since the start in s, and what its rounding has left over
    effects   what the effects remember, where the engine asks them, as bytes that pickle reads
    deviations  where they have come, in the same way; empty where none are followed
    """

    made_for: Mapping[str, str]
    memory: bytes
    clock: tuple[float, float]
    effects: bytes
    deviations: bytes = b""


class Session:
    """A vehicle that is moved step by step.

    subject  Vehicle, or a scene as omniroll.load_scene gives it
    driven   bool: whether steps may give torques. The vehicle then has a drive whose torque is 0 at first. Without one
             among the effects, False leaves it out
    options  arguments of omniroll.simulate, which stand before those of a scene: nu (at rest where it is not given),
             chi, spins, pose, start_time, roller_model, switching, effects, and accuracy, to which a step is made

    sensitivities  names of numbers by which the motion is to be differentiated, as for simulate; `sensitivity` gives
             the derivatives. torque, voltage and target are what is held from the start on, whatever steps make of it

    A step takes a torque, a voltage or a target and holds it until another is given. A torque replaces that of a
    Torque; a voltage needs a Motor whose voltage is constant, a target a Controller whose target is constant, and each
    takes the place of that.

    Raises InvalidValueError as simulate does, KernelsMissingError where the compiled engine cannot run the vehicle with
    these effects. Warns as simulate does of effects that look wrong. A session belongs to one thread: a step, a reset,
    a save or a restore while another one lasts is refused with an OmnirollError.
    """

    def __init__(
        self, subject: Vehicle | Described, *, driven: bool = True, sensitivities: Sequence[str] = (), **options: Any
    ):
        vehicle, options = _asked(subject, options)
        if validation.truth("driven", driven):
            options["effects"] = with_torque(options.get("effects", ()))
        self._options = options
        self.vehicle = vehicle
        self._task = replace(checked_task(vehicle, **options, duration=0), engine="compiled")
        for doubt in self._task.effects.doubts(vehicle):
            warnings.warn(doubt, stacklevel=2)
        check_can_run(self._task)
        names = validation.sequence("sensitivities", sensitivities, "must be a sequence of names")
        if names:
            check_names(self._task, names)
        self._deviations = SteppedDeviations(tuple(names)) if names else None
        self._run = SteppedRun(self._task, self._task.accuracy, self._follow if names else None)
        self._elapsed, self._rest, self._alone = 0.0, 0.0, Alone("a session")
        self._nu, self._chi, self._pose, self._contact = map(
            read_only, (self._run.nu, self._run.chi, self._run.pose, self._run.contact)
        )
        self._made_for = self._what_must_agree()

    # Going on

    def step(
        self,
        duration: float,
        torque: ArrayLike | None = None,
        voltage: ArrayLike | None = None,
        target: ArrayLike | None = None,
    ) -> None:
        """Go on for a time.

        duration  in s, not negative
        torque    in N m at the axles, one number or (N,), from now on; None: as before
        voltage   in V of the motors, one number or (N,), from now on; None: as before
        target    (3,) nu that a controller tracks from its next sample on; None: as before

        Raises InvalidValueError for numbers that make no sense, and where nothing takes what is given;
        SimulationStopped where the motion cannot go on: the session is then at the instant where it stopped.
        """
        if not (type(duration) is float and 0 <= duration <= validation.LARGEST):
            duration = validation.not_negative("duration", duration)
        given = (("torque", torque), ("voltage", voltage), ("target", target))
        wanted = [(name, self._checked(name, value)) for name, value in given if value is not None]
        if not self._alone.lock.acquire(False):  # as `with` would, in fewer calls
            raise self._alone.refusal()
        try:
            for name, numbers in wanted:
                self._hold(name, numbers)
            before, added = self._elapsed, duration + self._rest
            elapsed = before + added
            try:
                self._run.go_on(elapsed)
            except BaseException:
                self._elapsed, self._rest = self._run.run.state.elapsed, 0.0
                raise
            part = elapsed - before
            self._elapsed, self._rest = elapsed, (before - (elapsed - part)) + (added - part)
        finally:
            self._alone.lock.release()

    def _follow(self, piece: Trajectory) -> None:
        self._deviations.follow(piece, self._run.held)

    def sensitivity(self, name: str) -> Sensitivity:
        """The derivative of the motion now by a number that `sensitivities` named: of one run, whatever the steps.

        name  as it was named

        Raises InvalidValueError for another name, NoDerivativeError where the motion has had none since its start.
        """
        if self._deviations is None:
            raise InvalidValueError("name", name, "the session was not asked for it; name it in sensitivities=(...)")
        state = State(self._nu, self._chi, self._pose, self._contact)
        if self._task.kernel.has_spins:
            state = state.with_free_axial(self._run.axial_now())
        return self._deviations.at(self._task, name, self.time, state)

    def _checked(self, name: str, given: ArrayLike) -> list[float]:
        """What is given for a value that one effect holds. Raises InvalidValueError."""
        there = self._run.held.get(name, ())
        if len(there) != 1:
            bound = "is taken by no effect of this session" if not there else "is taken by more than one effect"
            raise InvalidValueError(name, given, bound)
        shape, one_for_all = there[0].shape, name in self._run.names
        numbers = plain_numbers(given, shape[0]) if one_for_all or type(given) is not float else None
        return _spread(name, given, shape, one_for_all).tolist() if numbers is None else numbers

    def _hold(self, name: str, numbers: list[float]) -> None:
        """Hold a value from now on. The same one again is no event."""
        (held,) = self._run.held[name]
        if numbers != held.tolist():
            held[:] = numbers
            if name in self._run.names:
                self._run.change_what_acts()

    def reset(self, **start: ArrayLike) -> None:
        """Go back to the start, to the bit.

        start  nu, chi, spins and pose, as simulate takes them, in the place of those of the start

        Raises InvalidValueError for what is no such state.
        """
        validation.known(start, START, "reset")
        task = checked_task(self.vehicle, **self._options | start, duration=0) if start else None
        with self._alone:
            self._run.go_to_start()
            if self._deviations is not None:
                self._deviations.reached = None
            self._elapsed, self._rest = 0.0, 0.0
            if task is not None:
                self._run.start(task)

    def save(self) -> Saved:
        """The session as it is now, for `restore`; pickle can keep it.

        Raises InvalidValueError where an effect does not say what it remembers, TypeError or another error of pickle
        where that cannot be kept.
        """
        with self._alone:
            effects = pickle.dumps([process.saved() for process in self._run.asked])
            deviations = b""
            if self._deviations is not None:
                deviations = pickle.dumps((self._run.forgotten, self._deviations.reached))
            return Saved(self._made_for, self._run.memory.read(), (self._elapsed, self._rest), effects, deviations)

    def restore(self, saved: Saved) -> None:
        """Go back, or forth, to what `save` gave: all that follows is the same to the bit.

        saved  Saved, of this session or of one with the same vehicle, effects and options. Like all that pickle reads
               it must come from somebody whom you trust

        Raises InvalidValueError for what another session has saved.
        """
        if not isinstance(saved, Saved):
            raise InvalidValueError("saved", saved, "must be what save() gave")
        for name, value in self._made_for.items():
            other = saved.made_for.get(name)
            if other != value:
                raise InvalidValueError("saved", other, f"was saved by a session whose {name} is not {value}")
        with self._alone:
            self._run.go_back(saved.memory, pickle.loads(saved.effects))
            if self._deviations is not None:
                self._run.forgotten, self._deviations.reached = pickle.loads(saved.deviations)
            self._elapsed, self._rest = saved.clock

    def _what_must_agree(self) -> dict[str, str]:
        """What two sessions must agree in so that one can go on where the other was."""
        task = self._task
        return {
            "format": str(FORMAT),
            "vehicle": repr(task.vehicle),
            "roller_model": task.kernel.roller_model,
            "switching": task.switching,
            "accuracy": repr(task.accuracy),
            "start_time": repr(task.start_time),
            "effects": repr(task.effects.effects),
            "memory": f"{self._run.memory.size} bytes",
            "sensitivities": repr(() if self._deviations is None else self._deviations.names),
        }

    # The state: views of the engine's own memory, which follow the motion

    @property
    def time(self) -> float:
        """Time in s on the session's clock."""
        return self._task.start_time + self._elapsed

    @property
    def elapsed(self) -> float:
        """Time in s since the start: the sum of the steps, rounded once."""
        return self._elapsed

    @property
    def nu(self) -> np.ndarray:
        """(3,) in 1/s. This view and the next three cannot be written; the next step changes what they show."""
        return self._nu

    @property
    def chi(self) -> np.ndarray:
        """(N,) in rad, |chi| <= pi/n."""
        return self._chi

    @property
    def pose(self) -> np.ndarray:
        """(3,) x, y in m, theta in rad."""
        return self._pose

    @property
    def contact(self) -> np.ndarray:
        """(N,) int, the physical roller in contact, 0..n-1."""
        return self._carry.contact if self._task.kernel.has_phases or self._run.pieces.several else self._contact

    # Outputs: computed when they are read

    @property
    def wheel_speeds(self) -> np.ndarray:
        """(N,) in rad/s, the rates of chi: (2.2), or where wheels may slip their own."""
        contacts = self._contacts
        return self._phase_kernel.wheel_speeds(self._nu, self._chi) if contacts is None else contacts.rates

    @property
    def contact_spin(self) -> np.ndarray:
        """(N,) in rad/s, the spins of the rollers in contact: (2.1), or where wheels may slip their own."""
        contacts = self._contacts
        if contacts is not None:
            return contacts.spins(self._nu, self._chi)
        return self._task.kernel.wheel_rates(self._nu, self._chi)[1]

    @property
    def spins(self) -> np.ndarray | None:
        """(N, n-1) in rad/s, of the free rollers j = 2..n relative to their disks; None but for "free" rollers."""
        bound, contacts = self._phase_kernel, self._contacts
        if not bound.has_spins:
            return None
        found = bound.spins_from_axial(self._nu, self._chi, self._run.axial_now())
        return found if contacts is None else found - contacts.carried(self._nu, self._chi)

    @property
    def energy(self) -> float:
        """Kinetic energy in J, (3.2)."""
        bound, contacts = self._phase_kernel, self._contacts
        if contacts is not None:
            return float(contacts.energy(self._nu, self._chi, self.spins))
        return float(bound.energy(self._nu, self._chi, *bound.spins_or_nothing(self.spins)))

    @property
    def slip(self) -> np.ndarray | None:
        """(N, 2) in m/s, velocities of the contacts on the ground, along the axle and along the rolling direction; None
        where wheels cannot slip."""
        return None if self._contacts is None else self._contacts.forces(self._nu, self._chi)[0]

    @property
    def ground_force(self) -> np.ndarray | None:
        """(N, 2) in N, forces of the ground on the wheels, along the same; None where wheels cannot slip."""
        return None if self._contacts is None else self._contacts.forces(self._nu, self._chi)[1]

    @property
    def _carry(self) -> Carry:
        """What carries the vehicle now."""
        return Carry.of_numbers(self._contact, self.vehicle.rollers_per_wheel)

    @property
    def _phase_kernel(self) -> Kernel:
        """The kernel with the rows that carry now."""
        return kernel_in_phase(self._task.kernel, self._carry)

    @property
    def _contacts(self) -> Contacts | None:
        """The contacts as they are now, where wheels may slip."""
        if not self._task.effects.slips:
            return None
        task = self._task
        states = self._run.integrated(self._run.space.core)
        stands = self._carry.pivots
        return Contacts(self._phase_kernel, states, task.effects.grip(task.kernel.vehicle), self._beside, stands)

    def _beside(self) -> dict[str, np.ndarray]:
        """What the forces of contacts that stick ask for beside the state."""
        free = {"axial": self._run.axial_now()} if self._task.kernel.has_spins else {}
        return {"heading": self._pose[2], **self._run.signals_now(), **free, **self._run.massless_modes()}

    @property
    def outputs(self) -> dict[str, np.ndarray]:
        """What the effects give, by name: a new dict.

        Of drives torque in N m, of motors damping in N m s, voltage in V and currents in A, of axles that may stick
        bearing_torque in N m, of contacts that may stick on the ground sticks (1 or 0) and slip_heading as
        Trajectory.quantity has them, where rollers may stick beside these bearing_cos and bearing_sin in N m, what free
        rollers' bearings do to their wheel's momenta, (N,) each: as they act before this instant's events, and so 0
        before the first step. What the effects integrate: drive_work, axle_loss, roller_loss in J, and others as
        Trajectory.quantity has them.
        """
        signals = self._run.signals_now()
        found = signals | self._run.integrated(self._run.space.core)
        for process in self._run.acting.processes:
            found |= process.readings(self._nu, found)
        return found

    def measure(self, instruments: Instruments | None = None) -> dict[str, np.ndarray]:
        """What instruments on the robot read now, by the names of omniroll.vocabulary.MEASUREMENTS.

        instruments  Instruments; None: without errors. Their noise depends on their seed and on the time

        Arrays (N,), (2,) or (), as `outputs` before this instant's events. There is no odometry, which would depend on
        when it was read before, and of tracking wheels there are the rates alone. Mecanum wheels and two rows have no
        accelerometer.
        """
        instruments = checked_instruments(instruments)
        signals = {name: value[None] for name, value in self._run.signals_now().items() if name in DRIVES}
        spins = self.spins
        moments = Moments(
            self._nu[None], self._chi[None], self._pose[None], self.contact[None],
            None if spins is None else spins[None], signals, self._run.passes[None],
            self.wheel_speeds[None] if self._task.kernel.pivots else None,
        )  # fmt: skip
        model = self._task.kernel.roller_model
        effects = self._task.effects
        true = true_values(self.vehicle, model, effects, moments, instruments, readings_of(self.vehicle, effects, None))
        rng = np.random.default_rng([instruments.seed, *np.frombuffer(np.float64(self._elapsed).tobytes(), np.uint32)])
        return instruments.read({name: value[0] for name, value in true.items()}, rng)

    def __repr__(self) -> str:
        bound = self._task.kernel
        return (
            f"<Session: {bound.roller_model}, {self._task.switching}, N={bound.wheels}, n={bound.rollers_per_wheel}, "
            f"t = {self.time:g}>"
        )


def _asked(subject: Vehicle | Described, options: dict[str, Any]) -> tuple[Vehicle, dict[str, Any]]:
    """The vehicle and the arguments of simulate that a session has."""
    for name in options:
        if name in NOT_IN_SESSIONS:
            raise InvalidValueError(name, options[name], "is not for a session")
    validation.known(options, ARGUMENTS, "a session")
    if isinstance(subject, Vehicle):
        return subject, {"nu": (0, 0, 0)} | options
    if not isinstance(getattr(subject, "vehicle", None), Vehicle) or not hasattr(subject, "options"):
        raise InvalidValueError("subject", subject, "must be a Vehicle or a scene")
    given = {name: value for name, value in subject.options.items() if name not in NOT_IN_SESSIONS}
    return subject.vehicle, given | options


def _spread(name: str, given: ArrayLike, shape: tuple[int, ...], one_for_all: bool) -> np.ndarray:
    """What is given as an array of this shape; `one_for_all`: one number may stand for all of them."""
    values = validation.real_array(name, given)
    if values.shape != shape and (values.ndim or not one_for_all):
        raise InvalidValueError(name, given, f"must have the shape {shape}" + " or be one number" * one_for_all)
    return np.broadcast_to(values, shape)

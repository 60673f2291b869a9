"""simulate(): checks what is asked, and has it run."""

import warnings
from collections.abc import Callable, Sequence
from functools import wraps
from os import PathLike
from typing import ParamSpec

import numpy as np
from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.effects.effect import Effect
from omniroll.effects.effect_set import EffectSet
from omniroll.engine.compiled_engine import check_can_run
from omniroll.engine.control import accuracy_doubts, controlled_run, one_run
from omniroll.engine.outlook import shown_bytes
from omniroll.engine.runs import MEMORY, Progress, Task, flow_at_start
from omniroll.engine.sensitivities import check_names, with_sensitivities
from omniroll.errors import InvalidValueError
from omniroll.kernels.kernel import Kernel
from omniroll.kernels.neutral_kernel import best_backend
from omniroll.results.trajectory import Trajectory
from omniroll.vehicles import checks as states
from omniroll.vehicles.state import State
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import ROLLER_MODEL, RUN, STATE, SWITCHING, by_name, documented

P = ParamSpec("P")
ENTRIES = by_name(RUN)
NUMBERS_OF_A_WHEEL = 20  # in a row and in a step, where rollers need none; a step has 16 nodes
LEAST_STATES = 100  # with free rollers each state has every roller's speed
ROWS_OF_FRICTION = (("axle_sticking", 1), ("contact_coulomb", 2))  # that may stick, of a wheel
BACKEND_OF = {"specialised": "compiled", "python": "python"}  # engine: backend of its kernels
COUPLINGS = 6  # matrices between all that may stick, in the compiled engine
USUAL = 1e10  # numbers up to this, and down to its inverse, are far inside the number range


def of_a_vehicle(function: Callable[P, Trajectory]) -> Callable[P, Trajectory]:
    """The function, which says what a scene in the place of a vehicle needs before it misses other arguments."""

    @wraps(function)
    def checked(*args: P.args, **named: P.kwargs) -> Trajectory:
        for vehicle in args[:1]:
            check_vehicle(vehicle)
        return function(*args, **named)

    return checked


@of_a_vehicle
@documented(*STATE, *RUN, ROLLER_MODEL, SWITCHING)
def simulate(
    vehicle: Vehicle,
    *,
    nu: ArrayLike,
    chi: ArrayLike = 0,
    spins: ArrayLike = 0,
    pose: ArrayLike = (0, 0, 0),
    duration: float,
    start_time: float = 0,
    roller_model: str = "free",
    switching: str = "impact",
    accuracy: float = 1e-9,
    engine: str = "compiled",
    memory: float = MEMORY,
    progress: Progress | None = None,
    effects: Sequence[Effect] = (),
    control: bool = True,
    sensitivities: Sequence[str] = (),
) -> Trajectory:
    """Simulate a vehicle with N wheels of n rollers from a given state.

    vehicle       Vehicle, with N wheels of n rollers; roller 0 of each wheel has contact at the start
    effects       what acts on the vehicle besides its rolling, a sequence of effects: Torque, TorqueTable, Motor,
                  Controller, FunctionController, PathFollower, Bearings, Slope, Weight, Contact, Springs
    {entries}
    progress      function that is called as progress(time done, duration) now and then, or None
    control       True: compare with a second, coarser run from a start moved by 1e-12; its distance is the measure
                  of the error (stats["error_estimate"]), and where it is too large the run is made again with a
                  tighter tolerance. stats["sensitivity"] is how much larger a small error of the start becomes; two
                  further runs measure it when it is first read. The estimate is never below eps times that.
                  False: both are None
    sensitivities  names of numbers by which the motion is to be differentiated, see docs/sensitivities.md:
                  "nu[0]", "mass", "wheel_viscous[1]", ...; Trajectory.sensitivity gives the derivatives

    The motion between switches is (3.4) with (2.1) and (2.2); omniroll.engine.switching says what a switch does.
    Returns a Trajectory. Raises InvalidValueError (a ValueError) with the field, its value and the bound;
    SimulationStopped, which has the trajectory so far, when switches follow each other without progress in time, or
    when the steps have filled the memory, or would fill it many times at their present pace: it names the term that
    makes them short; KernelsMissingError for the compiled engine where no C kernels were built. Warns with
    AccuracyWarning where the error estimate stays above the accuracy, and with UnstableControllerWarning.
    """
    task = checked_task(
        vehicle, nu=nu, chi=chi, spins=spins, pose=pose, duration=duration, start_time=start_time,
        roller_model=roller_model, switching=switching, accuracy=accuracy, engine=engine, memory=memory,
        progress=progress, effects=effects,
    )  # fmt: skip
    validation.truth("control", control)
    for doubt in task.effects.doubts(vehicle):
        warnings.warn(doubt, stacklevel=2)
    sensitivities = validation.sequence("sensitivities", sensitivities, "must be a sequence of names")
    if sensitivities:
        check_names(task, sensitivities)
    controlled = control and task.duration > 0
    trajectory = controlled_run(task) if controlled else one_run(task, task.accuracy)
    for doubt in accuracy_doubts(task, trajectory) if controlled else ():
        warnings.warn(doubt, stacklevel=2)
    return with_sensitivities(trajectory, sensitivities) if sensitivities else trajectory


def checked_task(
    vehicle: Vehicle,
    *,
    nu: ArrayLike,
    chi: ArrayLike = 0,
    spins: ArrayLike = 0,
    pose: ArrayLike = (0, 0, 0),
    duration: float,
    start_time: float = 0,
    roller_model: str = "free",
    switching: str = "impact",
    accuracy: float = 1e-9,
    engine: str = "compiled",
    memory: float = MEMORY,
    progress: Progress | None = None,
    effects: Sequence[Effect] = (),
) -> Task:
    """The arguments of simulate, checked. Raises InvalidValueError."""
    check_vehicle(vehicle)
    ROLLER_MODEL.checked(roller_model)
    SWITCHING.checked(switching)
    ENTRIES["engine"].checked(engine)
    if engine == "python":
        states.refuse_moving_rows(vehicle, "engine", engine, "take engine='compiled'")
        states.refuse_kinds(vehicle, "engine", engine, "take engine='compiled'")
    memory = ENTRIES["memory"].checked(memory)
    _check_memory(vehicle, roller_model, memory)
    if progress is not None:
        validation.function("progress", progress, "done", "duration")
    acting = EffectSet.checked(effects, vehicle)
    _refuse_beside_kinds(vehicle, acting, engine)
    backend = best_backend(roller_model) if engine == "compiled" else BACKEND_OF[engine]
    bound = acting.kernel(vehicle, roller_model, backend)
    _check_friction(bound, memory)
    task = Task(
        vehicle=vehicle,
        kernel=bound,
        state=acting.begin(bound, _initial_state(bound, nu, chi, spins, pose)),
        duration=ENTRIES["duration"].checked(duration),
        start_time=ENTRIES["start_time"].checked(start_time),
        switching="slip" if acting.slips else switching,
        accuracy=ENTRIES["accuracy"].checked(accuracy),
        engine=engine,
        progress=progress,
        effects=acting,
        memory=memory,
    )
    if engine != "python":
        check_can_run(task)
    if not _far_inside(task):
        _check_range(task)
    return task


def _check_memory(vehicle: Vehicle, roller_model: str, memory: float) -> None:
    """Refuse a vehicle of which not even a few states have room."""
    numbers = vehicle.wheels * (vehicle.rollers_per_wheel if roller_model == "free" else NUMBERS_OF_A_WHEEL)
    _refuse_memory(memory, 8 * numbers * LEAST_STATES, "for {}", vehicle, roller_model)


def _check_friction(bound: Kernel, memory: float) -> None:
    """Refuse friction that sticks in so many places that what couples them has no room."""
    rollers = 1 if bound.roller_model == "massless" else bound.rollers_per_wheel
    rows = bound.wheels * sum(count for name, count in (*ROWS_OF_FRICTION, ("roller_sticking", rollers))
                              if name in bound.effects)  # fmt: skip
    what, instead = f"where friction may stick in {rows} places of {{}}", "; or give [bearings] a roller_speed"
    _refuse_memory(memory, 8 * COUPLINGS * float(rows) ** 2, what, bound.vehicle, bound.roller_model, instead)


def _refuse_memory(
    memory: float, least: float, what: str, vehicle: Vehicle, roller_model: str, instead: str = ""
) -> None:
    """Raise InvalidValueError where memory has no room for the least that there must be, in these words."""
    if least > memory:
        size = f"{vehicle.wheels} wheels of {vehicle.rollers_per_wheel} {roller_model} rollers"
        bound = f"must be at least {least:.3g} {what.format(size)}: {shown_bytes(least)}{instead}"
        raise InvalidValueError("memory", memory, bound)


def _refuse_beside_kinds(vehicle: Vehicle, acting: EffectSet, engine: str) -> None:
    """Refuse what wheels of other kinds than the paper's do not have."""
    names = acting.names()
    if engine == "python":
        states.refuse_two_rows(vehicle, "engine", engine, "choose engine='compiled'")
    if "axle_sticking" in names or "roller_sticking" in names:
        bound = "give Bearings a wheel_speed and a roller_speed, below which friction fades, or rows = 1"
        states.refuse_two_rows(vehicle, "effects", "Bearings that stick", bound)
        states.refuse_kinds(vehicle, "effects", "Bearings that stick", "give Bearings a wheel_speed and a roller_speed")
    if acting.slips:
        states.refuse_kinds(vehicle, "effects", "Contact", "leave it out, so that wheels roll")
    if 0 in vehicle.by_wheel["roller_inertia"] and {"roller_viscous", "roller_coulomb"} & {*names}:
        bound = "does not go with a kind whose roller_inertia is 0: give it one, or leave out the rollers' friction"
        raise InvalidValueError("effects", "Bearings of rollers", bound)
    if "contact_springs" in names:
        for refuse in (states.refuse_two_rows, states.refuse_moving_rows):
            refuse(vehicle, "effects", "Springs", "leave them out for the loads of the vehicle at rest")


def check_vehicle(given: object) -> None:
    """Raises InvalidValueError for something that is no vehicle."""
    if not isinstance(given, Vehicle):
        shown, bound = given, "must be a Vehicle"
        if isinstance(given, str | PathLike):
            bound += "; omniroll.run(omniroll.load_scene(file)) runs the file of a scene"
        elif isinstance(getattr(given, "vehicle", None), Vehicle):  # a scene
            shown, bound = getattr(given, "name", type(given).__name__), f"{bound}; omniroll.run(scene) runs a scene"
        raise InvalidValueError("vehicle", shown, bound)


def _initial_state(bound: Kernel, nu: ArrayLike, chi: ArrayLike, spins: ArrayLike, pose: ArrayLike) -> State:
    plain = states.plain_state(bound.vehicle, bound.roller_model, nu, chi, spins)
    nu, chi, *spins = _checked_state(bound, nu, chi, spins) if plain is None else plain
    axial = None
    if spins:
        axial = np.zeros((bound.wheels, bound.rollers_per_wheel))
        axial[:, 1:] = bound.axial_speeds(nu, chi, *spins)  # contact is 0, so that j and the physical number agree
    pose = validation.real_array("pose", pose, (3,))
    return State(nu.copy(), chi.copy(), pose, np.zeros(bound.wheels, int), axial)


def _checked_state(bound: Kernel, nu: ArrayLike, chi: ArrayLike, spins: ArrayLike) -> tuple[np.ndarray, ...]:
    """nu, chi and for free rollers spins. Raises InvalidValueError."""
    vehicle = bound.vehicle
    nu = states.speeds(validation.real_array("nu", nu, (3,)))
    chi = states.wheel_angles_in_contact(chi, vehicle)
    if chi.ndim != 1:
        raise InvalidValueError("chi", chi.tolist(), f"must have the shape ({vehicle.wheels},)")
    spins = states.free_spins(spins, vehicle, bound.roller_model)
    if spins is None:
        return nu, chi
    if spins.ndim != 2:
        shape = (vehicle.wheels, vehicle.rollers_per_wheel - 1)
        raise InvalidValueError("spins", spins.tolist(), f"must have the shape {shape}")
    return nu, chi, spins


def _far_inside(task: Task) -> bool:
    """Whether all numbers are so far inside the number range that nothing can leave it at once.

    The rates are products of a few of these numbers, and of the sharpness of the rollers' tips, which is not large.
    """
    bound, state = task.kernel, task.state
    if bound.vehicle.has_layout or bound.sharp or task.duration > USUAL:
        return False
    if task.effects and not task.effects.plan(bound, task.start_time).largest < USUAL:
        return False
    smallest, largest = bound.magnitudes
    moving = [*state.nu.tolist(), *(() if state.axial is None else state.axial.ravel().tolist())]
    return 1 / USUAL < smallest and largest < USUAL and max(map(abs, moving)) < USUAL


def _check_range(task: Task) -> None:
    """Refuse what would leave the number range at once: energy, rates, or the way that they make."""
    state, bound = task.state, task.kernel
    free = state.free_axial()
    with np.errstate(all="ignore"):
        spins = () if free is None else (bound.spins_from_axial(state.nu, state.chi, free),)
        energy = bound.energy(state.nu, state.chi, *spins)
        flow, y = flow_at_start(task.effects, bound, state, task.start_time)
        rates = flow(0.0, y)
        way = rates[: 6 + bound.wheels] * task.duration
    if not states.seem_finite(rates, energy, *spins):
        states.refuse_unless_finite("rates and the energy", state.nu, rates, energy, *spins)
    if not max(map(abs, way.tolist())) <= validation.LARGEST:
        raise InvalidValueError("duration", task.duration, "too long at these speeds: the way leaves the number range")

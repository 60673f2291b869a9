"""Calls of public functions in which one argument is wrong, or two are; or in which up to three are others."""

import warnings
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from datetime import date
from decimal import Decimal
from fractions import Fraction
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

import omniroll
from omniroll.errors import OmnirollError, SimulationStopped

VEHICLE = omniroll.Vehicle.paper()
SCENE = Path(__file__).resolve().parents[2] / "scenes/motion-3.toml"
MOTION = {"nu": (1.0, 0.0, 1.0), "duration": 0.02, "control": False, "memory": 1e6}  # what is long fills it soon
PARTS = {
    "wheels": 3, "rollers_per_wheel": 5, "platform_radius": 0.15, "wheel_radius": 0.07, "platform_mass": 1.0,
    "platform_inertia": 0.01, "hub_mass": 0.15, "hub_axial_inertia": 2e-4, "hub_transverse_inertia": 1e-4,
    "roller_mass": 0.05, "roller_axial_inertia": 2e-6, "roller_transverse_inertia": 2e-5,
}  # fmt: skip
FITTED = {"nu": (1, 0, 1), "roller_model": "massless", "effects": [omniroll.Bearings(wheel_viscous=2e-3)]}
SHEET = {
    "wheels": 4, "rollers_per_wheel": 9, "platform_radius": 0.15, "mass": 12.0, "wheel_diameter": 0.1,
    "roller_diameter": 0.022, "roller_length": 0.025, "gear_ratio": 1.0, "rotor_mass": 0.0,
}  # fmt: skip
KINDS = {
    "two rows": omniroll.robot("open-base").vehicle.replace(rows=2, row_offset=-0.0055),
    "mecanum": omniroll.robot("mecanum-trio").vehicle,
    "profile": VEHICLE.replace(meridian_radius=VEHICLE.wheel_radius - VEHICLE.roller_axis_radius),
    "layout": VEHICLE.replace(
        wheel_places=((0.15, 0.01), (-0.07, 0.14), (-0.08, -0.12)), center_of_mass=(0.005, -0.01)
    ),
}
STEPS = {
    "chi": (0.1, 0.0, -0.1), "pose": (0.0, 0.0, 0.0), "roller_model": "free", "switching": "impact", "accuracy": 1e-6,
}  # fmt: skip


class Odd:
    """Something with a name that no one expects."""

    def __repr__(self) -> str:
        return "<odd>"


class Spiteful:
    """Something that cannot even be shown."""

    def __repr__(self) -> str:
        raise RuntimeError("no repr")

    def __array__(self, *_: Any, **__: Any) -> np.ndarray:
        raise RuntimeError("no array")

    def __eq__(self, other: object) -> bool:
        raise RuntimeError("no comparison")

    __hash__ = None


def itself() -> list:
    """A list that holds itself."""
    made: list = []
    made.append(made)
    return made


WILD = (
    None, True, False, 0, -1, 1, 2.5, -0.0, 1e-320, -1e-300, 1e200, 1e308, 10**30, -(10**30), 10**400, float("nan"),
    float("inf"), -float("inf"), 1j, "", "one", "1.0", "free", b"x", bytearray(b"xy"), [], [1], [1, 2], [1, 2, 3],
    [[1], [2, 3]], [[1, 2, 3]], [1, [2, 3], 4], [None] * 3, ["a", "b", "c"], [float("nan")] * 3, [1e308] * 3, (), {},
    {"a": 1}, {1, 2, 3}, {1: 2}, range(3), object, Odd, Odd(), Spiteful(), print, len, lambda: None, itself(),
    np.float32(1), np.int8(-1), np.bool_(True), np.nan, np.array([]), np.zeros(3), np.zeros((3, 3)), np.zeros((2, 0)),
    np.array(["a"]), np.array([1j]), np.array([None, 1]), np.array([1, 2], dtype="datetime64[s]"), np.ma.masked,
    np.zeros(3, dtype=[("a", float)]), np.datetime64("2026-01-01"), np.full(3, np.nan), np.ones(3, bool), Decimal(1),
    Fraction(1, 3), date(2026, 1, 1), Path("."), slice(1), ..., NotImplemented, type, ValueError("x"), Future(),
    (x for x in (1, 2)), memoryview(b"abc"), [Odd()], [[[[[]]]]], [10**400], 2**63, 2**64, -(2**63) - 1,
    "99999999999999999999999", np.longdouble(1), np.array(2.0, dtype=object), VEHICLE, [VEHICLE],
)  # fmt: skip

WORDS = (
    ("free", "massless", "locked"), ("impact", "smooth"), ("compiled", "python"), ("linear", "hold"),
    ("torque", "voltage"), ("viscous", "regularised", "coulomb"), ("robot-soccer-kit", "open-base", "tigers-2020"),
    ("mass", "yaw_inertia", "wheel_radius"),
)  # fmt: skip


@dataclass(frozen=True)
class Call:
    """A public function, and arguments that are good.

    rare  the part of its draws in which it is called: one that takes a second is called less often
    """

    name: str
    function: Callable
    good: dict[str, Any] = field(default_factory=dict)
    rare: float = 1.0


@cache
def many() -> omniroll.Many:
    return omniroll.simulate_many(VEHICLE, nu=np.ones((2, 3)), duration=0.1)


@cache
def run() -> omniroll.Trajectory:
    return omniroll.simulate(VEHICLE, nu=(1, 0, 1), duration=0.5)


@cache
def sensitive_session() -> omniroll.Session:
    followed = omniroll.Session(VEHICLE, nu=(1, 0, 1), sensitivities=["mass"])
    followed.step(0.2)
    return followed


@cache
def sensitive_run() -> omniroll.Trajectory:
    return omniroll.simulate(VEHICLE, nu=(1, 0, 1), duration=0.2, sensitivities=["nu[0]"])


def session(method: str, **arguments: Any) -> None:
    """A method of a session, and a step after it: what was refused has left no trace."""
    made = omniroll.Session(VEHICLE, nu=(1, 0, 1))
    try:
        getattr(made, method)(**arguments)
    finally:
        made.step(0.001)
        finite(made.nu)


def of_kind(kind: str, **arguments: Any) -> Any:
    return omniroll.simulate(KINDS[kind], **MOTION, **arguments)


def batch(**arguments: Any) -> Any:
    split = {name: arguments.pop(name) for name in ("nu", "chi")}
    return omniroll.Batch(**arguments).accelerations(**split)


def acting(kind: type, beside: Any = None, on: omniroll.Vehicle = VEHICLE, **arguments: Any) -> Any:
    """An effect, which may be refused only where it meets a vehicle, with another one beside it."""
    effects = [kind(**arguments)] if beside is None else [beside, kind(**arguments)]
    return omniroll.simulate(on, nu=(1, 0, 1), duration=0.01, effects=effects, control=False, memory=1e6)


@cache
def scene() -> omniroll.Scene:
    return omniroll.load_scene(SCENE)


@cache
def linear_model() -> omniroll.LinearModel:
    return omniroll.linearise(VEHICLE, roller_model="massless")


@cache
def page() -> omniroll.View:
    return omniroll.view(run())


@cache
def log() -> omniroll.Log:
    times = np.linspace(0.01, 0.1, 10)
    motion = omniroll.simulate(VEHICLE, duration=0.1, **FITTED)
    return omniroll.Log(motion.measure(times, names=["wheel_rate"]) | {"t": times})


@cache
def fitted() -> omniroll.Fit:
    return omniroll.fit(VEHICLE, log(), ["wheel_viscous"], **FITTED)


CALLS = (
    Call("Vehicle", omniroll.Vehicle, VEHICLE.as_dict()),
    Call("Vehicle.paper", omniroll.Vehicle.paper, {"wheels": 3, "rollers_per_wheel": 5}),
    Call("Vehicle.from_parts", omniroll.Vehicle.from_parts, PARTS),
    Call("Vehicle.from_parts, data sheet", omniroll.Vehicle.from_parts, SHEET),
    Call("Vehicle.replace", VEHICLE.replace, {"mass": 1.0, "wheel_angles": None}),
    Call("cylinder", omniroll.cylinder, {"mass": 1.0, "radius": 0.1, "length": 0.1}),
    Call("simulate", omniroll.simulate, {
        "vehicle": VEHICLE, "sensitivities": (), **MOTION, "chi": 0, "spins": 0, "pose": (0, 0, 0), "start_time": 0.0,
        "roller_model": "free", "switching": "impact", "accuracy": 1e-6, "engine": "compiled", "progress": None,
        "effects": (),
    }),
    Call("simulate_many", omniroll.simulate_many, {
        "vehicles": VEHICLE, **MOTION, "chi": 0, "spins": 0, "pose": (0, 0, 0), "start_time": 0.0,
        "roller_model": "free", "switching": "impact", "accuracy": 1e-6, "engine": "compiled", "progress": None,
        "effects": (), "times": None, "executor": None,
    }),
    *(Call(f"simulate, {kind}", partial(of_kind, kind), STEPS) for kind in KINDS),
    Call("accelerations", omniroll.accelerations, {
        "vehicle": VEHICLE, "nu": (1, 0, 1), "chi": 0, "spins": None, "roller_model": "free"}),
    Call("kernel", omniroll.kernel, {"vehicle": VEHICLE, "roller_model": "free", "backend": "python"}),
    Call("Session", omniroll.Session, {
        "subject": VEHICLE, "driven": True, "nu": (1, 0, 1), "chi": 0, "pose": (0, 0, 0), "effects": (),
        "accuracy": 1e-6}),
    Call("Session, sensitivities", omniroll.Session, {"subject": VEHICLE, "sensitivities": ("mass",)}),
    Call("Session.sensitivity", lambda name: sensitive_session().sensitivity(name), {"name": "mass"}),
    Call("Session.step", partial(session, "step"), {"duration": 0.01, "torque": 0.0}),
    Call("Session.step, voltage", partial(session, "step"), {"duration": 0.01, "voltage": None, "target": None}),
    Call("Session.reset", partial(session, "reset"), {"nu": (1, 0, 0), "chi": 0, "spins": 0, "pose": (0, 0, 0)}),
    Call("Session.restore", partial(session, "restore"), {"saved": None}),
    Call("Session.measure", partial(session, "measure"), {"instruments": None}),
    Call("Torque", partial(acting, omniroll.Torque), {"torque": 0.1}),
    Call("TorqueTable", partial(acting, omniroll.TorqueTable), {
        "times": (0, 1), "torque": ((0, 0, 0), (1, 1, 1)), "interpolation": "linear"}),
    Call("Motor", partial(acting, omniroll.Motor), {
        "voltage": 1.0, "torque_constant": 0.02, "resistance": 1.5, "gear_ratio": 4, "back_emf": 0.02,
        "current_limit": 1.0, "rotor_inertia": 0.0, "times": None, "interpolation": "linear"}),
    Call("Motor.from_data_sheet", omniroll.Motor.from_data_sheet, {
        "voltage": 1.0, "rated_voltage": 24.0, "stall_torque": 0.9, "free_speed": 650.0}),
    Call("Controller", partial(acting, omniroll.Controller), {
        "target": (1, 0, 0), "proportional": 0.01, "sample_time": 0.01, "integral": 0.0, "output": "torque",
        "limit": None, "times": None}),
    Call("FunctionController", omniroll.FunctionController, {
        "function": print, "sample_time": 0.01, "output": "torque"}),
    Call("register_controller", omniroll.register_controller, {"name": "fuzzed"}),
    Call("Bearings", partial(acting, omniroll.Bearings), {
        "wheel_viscous": 1e-3, "wheel_coulomb": None, "wheel_speed": None, "wheel_break_away": None,
        "roller_viscous": None, "roller_coulomb": None, "roller_speed": None}),
    Call("Springs", partial(acting, omniroll.Springs, beside=omniroll.Contact(law="coulomb", friction=0.4)), {
        "height": 0.05, "deflection": 1e-4, "damping_ratio": 0.3, "most_tilt": 0.1, "normal_gravity": 9.80665}),
    Call("Slope", partial(acting, omniroll.Slope), {"angle": 0.1, "direction": 0.0, "gravity": 9.8}),
    Call("Weight", partial(acting, omniroll.Weight, on=KINDS["profile"]), {"gravity": 9.8}),
    Call("Contact", partial(acting, omniroll.Contact), {
        "coefficient": 100.0, "law": "viscous", "friction": None, "speed": None, "load": None, "normal_gravity": None,
        "wheel_rates": None, "contact_spins": None}),
    Call("Contact, coulomb", partial(acting, omniroll.Contact), {
        "law": "coulomb", "friction": 0.4, "static_friction": None, "normal_gravity": None, "wheel_rates": 0}),
    Call("Contact, regularised", partial(acting, omniroll.Contact), {
        "law": "regularised", "friction": (0.5, 0.4), "speed": 0.01, "load": None, "normal_gravity": None}),
    Call("PathFollower", partial(acting, omniroll.PathFollower), {
        "times": (0, 1), "poses": ((0, 0, 0), (1, 0, 0)), "sample_time": 0.01, "bandwidth": 1.0, "output": "torque",
        "limit": None}),
    Call("robot", omniroll.robot, {"name": "robot-soccer-kit"}),
    Call("Robot.motor", omniroll.robot("robot-soccer-kit").motor, {
        "voltage": 1.0, "gear_ratio": 4, "current_limit": None, "times": None}),
    Call("LinearModel.select", lambda state, **outputs: linear_model().select(state, **outputs), {
        "state": "nu", "outputs": None}),
    Call("LinearModel.to_mat", lambda path: linear_model().to_mat(path), {"path": "model.mat"}),
    Call("to_fmu", lambda path, **options: omniroll.to_fmu(VEHICLE, path, **options), {
        "path": "a.fmu", "version": 2, "name": None, "stop": 1.0, "nu": (1.0, 0.0, 1.0)}, rare=0.2),
    Call("to_casadi", lambda folder, **options: omniroll.to_casadi(VEHICLE, folder, **options), {
        "folder": ".", "name": "rates", "scene": "", "nu": (1.0, 0.0, 1.0)}, rare=0.02),
    Call("to_mjcf", omniroll.to_mjcf, {
        "vehicle": VEHICLE, "step": 1e-3, "friction": 1.0, "spheres": 3, "gravity": (0, 0, -9.8), "armature": 0.0,
        "roller_damping": 0.0, "bodies": None}),
    Call("to_urdf", omniroll.to_urdf, {"vehicle": VEHICLE, "spheres": 3, "bodies": None}),
    Call("import_vehicle", omniroll.import_vehicle, {"path": "robot.urdf"}),
    Call("register_effect", lambda name, kind: omniroll.register_effect(name)(kind), {"name": "fuzzed", "kind": Odd}),
    Call("Instruments", omniroll.Instruments, {
        "counts_per_turn": 4096.0, "place": (0.0, 0.0), "seed": 0, "resolution": {"gyro": 0.1}, "noise": {},
        "bias": {}, "tracking_places": ((0, 0.1), (0.1, 0)), "tracking_directions": (0, 1), "tracking_radius": 0.02,
        "tracking_counts_per_turn": 2000.0}),
    Call("Instruments.counts", omniroll.Instruments().counts, {"wheel_angle": 1.0}),
    Call("linearise", omniroll.linearise, {
        "what": VEHICLE, "nu": (1, 0, 1), "chi": 0, "spins": 0, "pose": (0, 0, 0), "roller_model": "massless",
        "effects": None, "outputs": ("nu", "pose", "accelerometer"), "place": (0.1, 0.0)}),
    Call("LinearModel.discrete", lambda step: linear_model().discrete(step), {"step": 0.01}),
    Call("Kernel.call", omniroll.kernel(VEHICLE).call, {"name": "wheel_speeds"}),
    Call("Kernel.energy", lambda **state: omniroll.kernel(VEHICLE).energy(*state.values()) is None, {
        "nu": (1, 0, 1), "chi": (0, 0, 0), "spins": np.zeros((3, 4))}),
    Call("Batch.accelerations", batch, {
        "vehicles": VEHICLE, "roller_model": "locked", "nu": np.ones((3, 2)), "chi": np.zeros((3, 2))}),
    Call("reactions", omniroll.reactions, {
        "trajectory": None, "height": 0.1, "friction": None, "gravity": None, "wheel_mass": None,
        "platform_products": (0, 0), "spin_inertia": None}),
    Call("impulses", omniroll.impulses, {"trajectory": None}),
    Call("Trajectory.sample", lambda t: run().sample(t), {"t": 0.1}),
    Call("Trajectory.physical_roller", lambda j: run().physical_roller(j), {"j": 1}),
    Call("Trajectory.place_of_roller", lambda roller: run().place_of_roller(roller), {"roller": 1}),
    Call("Trajectory.quantity", lambda name: run().quantity(name), {"name": "drive_work"}),
    Call("Trajectory.measure", lambda t, instruments: run().measure(t, instruments), {
        "t": (0.1, 0.2), "instruments": None}),
    Call("Trajectory.save", lambda path, dense: run().save(path, dense=dense), {"path": "run.npz", "dense": True}),
    Call("Trajectory.load", omniroll.Trajectory.load, {"path": "run.npz"}),
    Call("Trajectory.joined", omniroll.Trajectory.joined, {"parts": ()}),
    Call("load_scene", omniroll.load_scene, {"path": SCENE}),
    Call("run", lambda given, **changes: omniroll.run(given, **changes), {"given": None, **MOTION}),
    Call("Scene.sample_times", lambda end: scene().sample_times(end), {"end": 1.0}),
    Call("Trajectory.arrays", lambda **at: run().arrays(**at), {"t": (0.1, 0.2), "instruments": None}),
    Call("Trajectory.to_pandas", lambda **at: run().to_pandas(**at), {"t": (0.1, 0.2), "instruments": None}),
    Call("Trajectory.to_xarray", lambda **at: run().to_xarray(**at), {"t": (0.1, 0.2), "instruments": None}),
    Call("Trajectory.plot", lambda what, **title: run().plot(what, **title), {"what": "motion", "title": ""}, rare=0.2),
    Call("Many.to_pandas", lambda axes: many().to_pandas(axes), {"axes": None}),
    Call("Many.to_xarray", lambda axes: many().to_xarray(axes), {"axes": None}),
    Call("Trajectory.to_parquet", lambda **at: run().to_parquet(**at), {
        "path": "run.parquet", "t": (0.1, 0.2), "instruments": None}),
    Call("Results.parts", lambda **times: list(omniroll.Results(None, {}).parts(**times)), {"start": 0.0, "end": 1.0}),
    Call("load_results", omniroll.load_results, {"folder": "."}),
    Call("unfinished", omniroll.unfinished, {"folder": "."}),
    Call("view", lambda runs, **options: omniroll.view(runs, **options), {
        "runs": None, "labels": None, "reactions": None, "title": None}),
    Call("View.save", lambda path: page().save(path), {"path": "page.html"}),
    Call("Trajectory.sensitivity", lambda name, t: sensitive_run().sensitivity(name, t), {"name": "nu[0]", "t": 0.1}),
    Call("gradient", lambda trajectory, **loss: omniroll.gradient(trajectory, **loss), {
        "trajectory": None, "names": ("nu[0]",), "t": (0.1, 0.2), "nu": np.ones((2, 3)), "chi": None, "pose": None}),
    Call("tau", omniroll.tau, {"t": 1.0, "h": 0.1}),
    Call("Log", omniroll.Log, {
        "data": {"t": (0.0, 0.1), "gyro": (1.0, 2.0)}, "noise": {}, "start": {}, "drive": None, "name": "log",
        "gap": 10.0, "lines": None, "readings": None}),
    Call("Log, columns", lambda **data: omniroll.Log(data), {"t": (0.0, 0.1), "gyro": (1.0, 2.0)}),
    Call("Log.read", omniroll.Log.read, {"path": "log.csv"}),
    Call("Log.line", lambda row: log().line(row), {"row": 0}),
    Call("Log.beginning", lambda rows: log().beginning(rows), {"rows": 2}),
    Call("Number", omniroll.Number, {"name": "mass", "start": None, "least": None, "most": None, "prior": None}),
    Call("fit", omniroll.fit, {
        "what": VEHICLE, "logs": None, "free": ("wheel_viscous",), "loss": "linear", "instruments": None, **FITTED},
        rare=0.2),
    Call("fit, number", lambda **number: omniroll.fit(VEHICLE, log(), [omniroll.Number(**number)], **FITTED), {
        "name": "wheel_viscous", "start": 1e-3, "least": 0.0, "most": 1.0, "prior": None}, rare=0.3),
    Call("Fit.interval", lambda **of: fitted().interval(**of), {"name": "wheel_viscous", "level": 0.9}),
    Call("Fit.save", lambda path: fitted().save(path), {"path": "fitted.toml"}),
    Call("Fit.picture", lambda path: fitted().picture(path), {"path": "left.png"}, rare=0.1),
    Call("Fit.experiments", lambda **drives: fitted().experiments(**drives), {
        "candidates": {"slow": FITTED["effects"]}, "duration": 0.1, "step": 0.01}, rare=0.3),
)  # fmt: skip


def finite(*values: Any) -> None:
    """Fail where a result holds a number that is not finite."""
    for value in values:
        array = np.asarray(value) if isinstance(value, (int, float, np.ndarray)) else np.zeros(0)
        assert array.dtype.kind != "f" or np.isfinite(array).all(), value


def results_of(made: Any) -> tuple:
    """The numbers that a call has given."""
    if isinstance(made, omniroll.Trajectory):
        return made.nu, made.chi, made.pose, made.energy, made.t
    if isinstance(made, tuple):
        return made
    return (made,)


def beside(value: Any, rng: np.random.Generator) -> Any:
    """A value like a good one: numbers are up to ten times as small or large, a word is another of its list."""
    if isinstance(value, bool):
        return bool(rng.random() < 0.5)
    if isinstance(value, int):
        return value + int(rng.integers(0, 3))
    if isinstance(value, float):
        return value * 10 ** rng.uniform(-1, 1)
    if isinstance(value, np.ndarray):
        return value * 10 ** rng.uniform(-1, 1)
    if isinstance(value, tuple):
        return tuple(beside(one, rng) for one in value) if rng.random() < 0.5 else value
    known = next((words for words in WORDS if isinstance(value, str) and value in words), (value,))
    return known[rng.integers(len(known))]


def good_of(call: Call) -> dict[str, Any]:
    """Its good arguments; those that take a moment to make are made when they are asked for first."""
    ready = {"trajectory": run, "runs": run, "given": scene, "logs": log}
    return {name: ready[name]() if name in ready else value for name, value in call.good.items()}


def call_of(seed: int, mild: float = 0.0) -> tuple[Call, dict[str, Any], dict[str, Any]]:
    """The call of this number, the arguments that it has, and those that are not the good ones.

    mild  the part of the calls in which these are other numbers and words, and no wild values
    """
    rng = np.random.default_rng(seed)
    call = CALLS[rng.integers(len(CALLS))]
    good = good_of(call)
    names = rng.choice(sorted(good), size=min(len(good), 1 + (rng.random() < 0.2)), replace=False)
    changed = {str(name): WILD[rng.integers(len(WILD))] for name in names}
    if rng.random() < mild:
        while rng.random() > call.rare:
            call = CALLS[rng.integers(len(CALLS))]
        good = good_of(call)
        names = rng.choice(sorted(good), size=min(len(good), rng.integers(1, 4)), replace=False)
        changed = {str(name): beside(good[str(name)], rng) for name in names}
    return call, good | changed, changed


def try_call(seed: int, mild: float = 0.0) -> str:
    """Make the call of this number, once; what came of it in a word. It may write files into the working folder.

    Raises AssertionError for any error but a typed one.
    """
    call, arguments, wrong = call_of(seed, mild)
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            finite(*results_of(call.function(**arguments)))
    except SimulationStopped:
        return "stopped"
    except (OmnirollError, OSError) as error:
        assert str(error) and len(str(error)) < 10_000
        return "refused"
    except Exception as error:
        raise AssertionError(f"call {seed}: {call.name} of {_shown(wrong)}: {type(error).__name__}: {error}") from error
    return "done"


def _shown(wrong: dict[str, Any]) -> str:
    return ", ".join(f"{name} = {type(value).__name__}" for name, value in wrong.items())

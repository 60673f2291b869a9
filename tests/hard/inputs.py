"""Any vehicle, any state: refused by name, or run to something finite that satisfies the invariants."""

import struct
import warnings
from typing import Any

import numpy as np

import omniroll
from hard.attempts import Attempt, broken, tried
from hard.case import Cases, Measurement, Scale
from hard.setting import DOUBLE, ENGINES, JOINT, LAWS, MODELS, PAPER, speeds_of_wheels
from omniroll import AccuracyWarning, InvalidValueError, SimulationStopped, Trajectory, Vehicle, kernel

CASES = Cases("Input")
PATIENCE = 60  # s of the processor, for one input
MOST_PHASES = 4  # of an accepted run, about
FIELDS = {name: value for name, value in PAPER.as_dict().items() if isinstance(value, float)}
WILD = (0, -1.0, 1e-320, 1e-160, 1e160, 1e308, float("nan"), float("inf"), "one", None, True, [], [1])


def any_float(random: np.random.Generator) -> float:
    return struct.unpack("d", random.bytes(8))[0]


def with_something_wild(values: dict[str, Any], random: np.random.Generator) -> dict[str, Any]:
    """Half of them as they are, half with one value replaced by anything."""
    anything = (WILD[random.integers(len(WILD))], any_float(random), [any_float(random) for _ in range(3)])
    wild = {str(random.choice(sorted(values))): anything[random.integers(3)]}
    return values | wild if random.random() < 0.5 else values


def vehicle(random: np.random.Generator) -> dict[str, Any]:
    """Fields of a vehicle with one to six wheels; up to three numbers are not the paper's."""
    size = int(random.integers(1, 7)), int(random.integers(4, 41))
    made = Vehicle.paper(*size).as_dict() | {"wheel_angles": None}
    for name in random.choice(sorted(FIELDS), random.integers(4), replace=False):
        factor = random.uniform(0.7, 1.4) if random.random() < 0.5 else 10 ** random.uniform(-3, 3)
        made[str(name)] = FIELDS[name] * float(factor)
    return with_something_wild(made, random)


def state(random: np.random.Generator) -> dict[str, Any]:
    """Arguments of simulate for the paper's vehicle, but for the duration."""

    def some(low: float, high: float, *special: float) -> float:
        """A number between two, or every third time one that is special."""
        return float(random.choice(special) if random.random() < 1 / 3 else random.uniform(low, high))

    model = str(random.choice(MODELS))
    chi = [some(-JOINT, JOINT, JOINT, -JOINT, 0.0) for _ in range(3)]
    made = {
        "nu": [some(-3, 3, 0.0, 1.0, -0.25) for _ in range(3)],
        "chi": chi if random.random() < 0.5 else chi[0],
        "pose": random.uniform(-1e3, 1e3, 3).tolist(),
        "spins": some(-5, 5, 0.0) if model == "free" else 0.0,
        "start_time": some(-1e9, 1e9, 0.0),
        "roller_model": model,
        "switching": str(random.choice(LAWS)),
        "engine": str(random.choice(ENGINES)),
        "accuracy": float(10 ** random.uniform(-13, -3)),
    }
    return with_something_wild(made, random)


def phases_long(vehicle: Vehicle, nu: object, spins: object = 0) -> float:
    """A duration of about MOST_PHASES, or as many turns of the rollers; 1 where these are no speeds."""
    try:
        with np.errstate(all="ignore"):
            per_nu = speeds_of_wheels(kernel(vehicle, "massless", "python"))
            nu, spins = np.asarray(nu, float), np.asarray(spins, float)
            rate = float(np.abs(nu @ per_nu).max() + np.abs(nu).max() + np.abs(spins).max())
        duration = MOST_PHASES * np.pi / vehicle.rollers_per_wheel / rate
        return duration if np.isfinite(duration) and duration > 0 else 1.0
    except (TypeError, ValueError, ArithmeticError):
        return 1.0


def check_run(run: Trajectory) -> None:
    """The invariants of a result."""
    for name in ("t", "nu", "chi", "pose", "contact_spin", "energy"):
        assert np.isfinite(getattr(run, name)).all(), name
    assert run.spins is None or np.isfinite(run.spins).all()
    assert np.abs(run.chi).max() <= np.pi / run.vehicle.rollers_per_wheel, "beyond the joint"
    assert ((run.contact >= 0) & (run.contact < run.vehicle.rollers_per_wheel)).all(), "no roller"
    assert (np.diff(run.t) >= 0).all() and (np.diff(run.elapsed) >= 0).all(), "back in time"
    assert (run.energy >= 0).all(), "negative energy"
    if run.switching == "impact" and len(run.switches):  # Carnot
        assert run.switches.energy_jump.max() <= 1e-12 * run.energy.max(), "an impact adds energy"


def outcome(vehicle: Vehicle, may_be_wrong: tuple[str, ...], **task: Any) -> str:
    """What came of a run, which keeps what is promised: it ends well, names what is wrong, or says why it stopped."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyWarning)
            check_run(omniroll.simulate(vehicle, **task, control=False))
    except SimulationStopped as stopped:
        assert stopped.reason and np.isfinite(stopped.t) and set(stopped.state) == {"nu", "chi", "pose", "contact"}
        assert stopped.trajectory.t[-1] == stopped.t
        return "stopped"
    except InvalidValueError as refused:
        assert refused.field in may_be_wrong, refused.field
        return "refused"
    return "done"


def try_vehicle(seed: int) -> str:
    fields = vehicle(np.random.default_rng([1, seed]))
    try:
        made = Vehicle(**fields)
    except InvalidValueError as refused:
        assert refused.field in fields, refused.field
        return "refused"
    nu = (1.0, 0.3, 0.8)
    task = {"nu": nu, "duration": phases_long(made, nu), "accuracy": 1e-6}
    return [outcome(made, ("nu", "duration"), roller_model=model, **task) for model in MODELS][-1]


def try_state(seed: int) -> str:
    task = state(np.random.default_rng([2, seed]))
    duration = phases_long(PAPER, task["nu"], task["spins"])
    return outcome(PAPER, (*task, "duration", "spins"), **task, duration=duration)


def measured(attempt: Attempt, count: int, on: str) -> list[Measurement]:
    lines = tried(attempt, count, PATIENCE)
    return [Measurement(f"promises broken by {count} inputs", on, DOUBLE, "", broken(lines), 0)]


@CASES.case(
    "any-vehicle",
    "Any vehicle",
    promise="either refused by the name of the wrong field, or the runs are finite and satisfy the invariants",
)
def any_vehicle(scale: Scale) -> list[Measurement]:
    return measured(try_vehicle, scale.of(60, 2000), "compiled, all roller models")


@CASES.case(
    "any-state",
    "Any start",
    promise="as above; no run takes longer than a minute, and one that is stopped keeps its trajectory",
)
def any_state(scale: Scale) -> list[Measurement]:
    return measured(try_state, scale.of(80, 3000), "both engines")

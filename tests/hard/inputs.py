"""Any vehicle, any state: refused by name, or run to something finite that satisfies the invariants."""

import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

import omniroll
from hard.case import Case, Measurement
from hard.setting import DOUBLE, ENGINES, LAWS, MODELS, PAPER, speeds_of_wheels
from omniroll import AccuracyWarning, InvalidValueError, SimulationStopped, Trajectory, Vehicle, kernel

SECTION = "Input"
SCENES = sorted((Path(__file__).resolve().parents[2] / "scenes").glob("*.toml"))
PATIENCE, ASLEEP = 60, 600  # s, for one input
MOST_PHASES = 4  # of an accepted run, about

FIELDS = {name: value for name, value in PAPER.as_dict().items() if isinstance(value, float)}
WILD = st.sampled_from([0, -1.0, 1e-320, 1e-160, 1e160, 1e308, float("nan"), float("inf"), "one", None, True, [], [1]])
FACTORS = st.floats(-3, 3).map(lambda power: 10.0**power)


def with_something_wild(usual: st.SearchStrategy) -> st.SearchStrategy:
    """Half of them as they are, half with one value replaced by anything."""

    def replaced(values: dict) -> st.SearchStrategy:
        anything = st.one_of(WILD, st.floats(), st.lists(st.floats(), max_size=5))
        return st.dictionaries(st.sampled_from(sorted(values)), anything, max_size=1).map(lambda wild: values | wild)

    return usual.flatmap(replaced)


def near(value: float) -> st.SearchStrategy:
    """Near the paper's vehicle's, or anything positive."""
    return st.one_of(st.floats(0.7, 1.4).map(lambda factor: value * factor), FACTORS.map(lambda factor: value * factor))


def vehicles() -> st.SearchStrategy:
    """Fields of a vehicle with one to six wheels; up to three numbers are not the paper's."""
    sizes = st.fixed_dictionaries({"wheels": st.integers(1, 6), "rollers_per_wheel": st.integers(4, 40)})
    changes = st.lists(st.sampled_from(sorted(FIELDS)), max_size=3, unique=True).flatmap(
        lambda chosen: st.fixed_dictionaries({name: near(FIELDS[name]) for name in chosen})
    )

    def merged(parts: tuple[dict, dict]) -> dict:
        base = Vehicle.paper(**parts[0]).as_dict() | {"wheel_angles": None}
        return base | parts[1]

    return with_something_wild(st.tuples(sizes, changes).map(merged))


def states() -> st.SearchStrategy:
    """Arguments of simulate for the paper's vehicle, but for the duration."""
    joint = np.pi / PAPER.rollers_per_wheel
    speed = st.one_of(st.floats(-3, 3), st.sampled_from([0.0, 1.0, -0.25]))
    angle = st.one_of(st.floats(-joint, joint), st.sampled_from([joint, -joint, 0.0]))
    three = {"min_size": 3, "max_size": 3}
    return with_something_wild(
        st.fixed_dictionaries(
            {
                "nu": st.lists(speed, **three),
                "chi": st.one_of(angle, st.lists(angle, **three)),
                "pose": st.lists(st.floats(-1e3, 1e3), **three),
                "spins": st.one_of(st.just(0.0), st.floats(-5, 5)),
                "start_time": st.one_of(st.just(0.0), st.floats(-1e9, 1e9)),
                "roller_model": st.sampled_from(MODELS),
                "switching": st.sampled_from(LAWS),
                "engine": st.sampled_from(ENGINES),
                "accuracy": st.floats(1e-13, 1e-3),
            }
        )
    )


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
    joint = np.pi / run.vehicle.rollers_per_wheel
    assert np.abs(run.chi).max() <= joint
    assert ((run.contact >= 0) & (run.contact < run.vehicle.rollers_per_wheel)).all()
    assert (np.diff(run.t) >= 0).all() and (np.diff(run.elapsed) >= 0).all()
    assert (run.energy >= 0).all()
    if run.switching == "impact" and len(run.switches):  # Carnot
        assert run.switches.energy_jump.max() <= 1e-12 * run.energy.max()


def check_stopped(stopped: SimulationStopped) -> None:
    assert stopped.reason and np.isfinite(stopped.t) and set(stopped.state) == {"nu", "chi", "pose", "contact"}
    assert stopped.trajectory.t[-1] == stopped.t


def check_vehicle(fields: dict) -> None:
    try:
        vehicle = Vehicle(**fields)
    except InvalidValueError as refused:
        assert refused.field in fields, refused.field
        return
    nu = (1.0, 0.3, 0.8)
    for model in MODELS:
        try:
            run = omniroll.simulate(
                vehicle, nu=nu, duration=phases_long(vehicle, nu), roller_model=model, accuracy=1e-6, control=False
            )
        except SimulationStopped as stopped:
            check_stopped(stopped)
        except InvalidValueError as refused:
            assert refused.field in ("nu", "duration"), refused.field
        else:
            check_run(run)


def check_state(arguments: dict) -> None:
    duration = phases_long(PAPER, arguments["nu"], arguments["spins"])
    try:
        run = omniroll.simulate(PAPER, **arguments, duration=duration, control=False)
    except SimulationStopped as stopped:
        check_stopped(stopped)
    except InvalidValueError as refused:
        assert refused.field in (*arguments, "duration", "spins"), refused.field
    else:
        check_run(run)


@contextmanager
def in_time() -> Iterator[None]:
    """An error where the body takes more than PATIENCE of the processor's time, whatever else runs on the machine; or,
    where it only waits, more than ASLEEP."""

    def ring(*_):
        raise AssertionError(f"no result within {PATIENCE} s of work, or {ASLEEP} s")

    timers = (signal.ITIMER_PROF, signal.SIGPROF, PATIENCE), (signal.ITIMER_REAL, signal.SIGALRM, ASLEEP)
    before = [signal.signal(number, ring) for _, number, _ in timers]
    for timer, _, limit in timers:
        signal.setitimer(timer, limit)
    try:
        yield
    finally:
        for (timer, number, _), handler in zip(timers, before, strict=True):
            signal.setitimer(timer, 0)
            signal.signal(number, handler)


def broken(check: Callable, strategy: st.SearchStrategy, examples: int) -> int:
    """0 where the check holds for so many inputs; else 1, with the smallest input that breaks it on stderr."""

    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
        phases=(Phase.explicit, Phase.generate, Phase.shrink),
    )
    @given(strategy)
    def hold(value):
        with in_time(), warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyWarning)
            check(value)

    try:
        hold()
    except Exception as error:  # whatever it is, it is not what was promised
        print(*getattr(error, "__notes__", []), repr(error), sep="\n", file=sys.stderr)
        return 1
    return 0


def measured(check: Callable, strategy: st.SearchStrategy, examples: int, on: str) -> list[Measurement]:
    what = f"promises broken by {examples} inputs"
    return [Measurement(what, on, DOUBLE, "", broken(check, strategy, examples), 0)]


CASES = [
    Case(
        name="any-vehicle",
        section=SECTION,
        title="Any vehicle",
        naive="",
        promise="either refused by the name of the wrong field, or the runs are finite and satisfy the invariants",
        run=lambda scale: measured(check_vehicle, vehicles(), scale.of(60, 2000), "compiled, all roller models"),
    ),
    Case(
        name="any-state",
        section=SECTION,
        title="Any start",
        naive="",
        promise="as above; no run takes longer than a minute, and one that is stopped keeps its trajectory",
        run=lambda scale: measured(check_state, states(), scale.of(80, 3000), "both engines"),
    ),
]

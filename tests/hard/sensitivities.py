"""Derivatives of runs: over switches, beside runs in 28 digits, at ties, at a joint, where a wheel grazes its joint."""

from collections.abc import Iterator

import numpy as np

import omniroll
from hard import rounding, true_sensitivities
from hard.case import Cases, Measurement, Scale
from hard.effect_kernels import with_effects
from hard.sampling import Sample, sample
from hard.setting import DOUBLE, EPS, JOINT, PAPER, Setting, settings, speeds_of_wheels
from hard.switches_together import one_behind
from omniroll import NoDerivativeError, Trajectory
from omniroll.kernels.kernel import SHARP, VEHICLE_SCALARS

CASES = Cases("Switches")
SPEEDS = ("nu[0]", "nu[1]", "nu[2]")
ACCURACY = 1e-12
LONGEST = {  # s, for 10^5 switches
    "massless, smooth": 30e3, "massless, impact": 30e3, "locked, smooth": 30e3, "locked, impact": 90e3,
    "free, smooth": 19e3, "free, impact": 130e3,
}  # fmt: skip


def followed(setting: Setting, names: tuple[str, ...], **task) -> Trajectory:
    return omniroll.simulate(PAPER, **setting.options(**task), accuracy=ACCURACY, control=False, sensitivities=names)


@CASES.case(
    "derivatives-over-switches",
    "Derivatives of a run by its start, over up to 10^5 switches",
    naive="differentiates each phase and each impact, and leaves out that the switch comes at another time",
    promise="1e-9 of the largest derivative; over 10^5 switches ten times the accuracy times that, the growth",
)
def faster(scale: Scale) -> Iterator[Measurement]:
    """A start k times as fast makes the same motion k times as fast: the derivatives by nu add up to t times the rates.

    The error is over the growth of the motion beside the run, the largest of the derivatives. The run misses by its
    accuracy times the growth, and the derivatives by as much.
    """
    many = "10^5 switches: error over the largest derivative"
    for setting in settings(engines=("compiled",)):
        error, _, _ = of_faster_start(setting, scale.of(20.0, 600.0))
        yield setting.measurement("error over the largest derivative", error, 1e-9)
        error, growth, switches = of_faster_start(setting, scale.of(300.0, LONGEST[setting.name]))
        allowed = max(1e-9, 10 * ACCURACY * growth)
        by = f"{setting.name}, {switches} switches, growth {growth:.1e}"
        yield Measurement(many, "compiled", DOUBLE, by, error, allowed)


def of_faster_start(setting: Setting, duration: float) -> tuple[float, float, int]:
    """The error over the growth, the growth, and how many switches there are."""
    run = followed(setting, SPEEDS, nu=(1.0, 0.3, 0.8), chi=(0.1, -0.2, 0.15), duration=duration)
    nu, end = run.nu[0], {name: run.sensitivity(name, duration) for name in SPEEDS}
    rates = {"pose": run.kernel.pose_rates(run.nu[-1], run.pose[-1, 2]), "chi": run.kernel.wheel_speeds(run.nu[-1])}
    growth = max(np.abs(getattr(end[name], part)).max() for name in SPEEDS for part in ("nu", "chi", "pose"))
    error = 0.0
    for part, rate in rates.items():
        along = sum(nu[k] * getattr(end[name], part) for k, name in enumerate(SPEEDS))
        error = max(error, float(np.abs(along - duration * rate).max()))
    return error / growth, float(growth), len(run.switches)


VISCOUS = omniroll.Bearings(wheel_viscous=1e-6, roller_viscous=1e-9)
REGULARISED = omniroll.Bearings(wheel_coulomb=1e-5, wheel_speed=0.5)
STICKING = omniroll.Bearings(wheel_coulomb=0.01)
MOTORS = omniroll.Motor(voltage=(0.02, 0.05, -0.03), torque_constant=0.02, resistance=1.5)
MASSLESS, LOCKED, FREE = "massless", "locked", "free"
TRUE_RUNS = (  # roller model, law, effects, number; every second one in `make test-long`
    (FREE, "impact", (), "roller_inertia"),
    (MASSLESS, "smooth", (), "nu[0]"),
    (LOCKED, "smooth", (), "nu[0]"),
    (LOCKED, "impact", (), "nu[0]"),
    (LOCKED, "impact", (REGULARISED,), "mass"),
    (FREE, "smooth", (), "nu[0]"),
    (MASSLESS, "impact", (STICKING,), "wheel_coulomb"),
    (FREE, "impact", (), "chi[1]"),
    (MASSLESS, "smooth", (omniroll.Slope(0.01),), "wheel_angles[1]"),
    (LOCKED, "impact", (STICKING,), "mass"),
    (LOCKED, "smooth", (), "wheel_radius"),
    (FREE, "impact", (VISCOUS,), "wheel_viscous"),
    (FREE, "smooth", (MOTORS,), "mass"),
)
SWITCHES = 3, 20  # in the tests, in full; axles that stick end their runs before
SPINS = np.random.default_rng(0).normal(size=(3, PAPER.rollers_per_wheel - 1))


@CASES.case(
    "derivatives-beside-true-runs",
    "Derivatives of a run against differences of runs in 28 digits",
    naive="leaves out that the switch comes at another time; differentiates friction that is smoothed, which creeps on",
    promise="1e-9 of the largest derivative over up to 20 switches; zero for nu where a run sticks at its end",
)
def beside_true_runs(scale: Scale) -> list[Measurement]:
    """The derivatives at the end of runs against central differences of runs in 28 digits."""
    runs = scale.of(TRUE_RUNS[::2], TRUE_RUNS)
    return [m for run in runs for m in beside_true_run(*run, most=scale.of(*SWITCHES))]


def beside_true_run(model: str, law: str, effects: tuple, number: str, most: int) -> list[Measurement]:
    """Of one run with so many switches, the growth of the motion beside it said: the largest of the derivatives."""
    setting = Setting(model, law, "compiled")
    start = {"nu": (1.0, 0.3, 0.8), "chi": (0.1, -0.2, 0.15), "spins": SPINS, "effects": effects}
    start["duration"] = duration_of(setting, start, most)
    run = followed(setting, (number,), **start)
    own = run.sensitivity(number, start["duration"])
    parts = ("nu", "chi", "pose", *(["spins"] if setting.model == FREE else []))
    true = true_sensitivities.derivative(setting.task(**start), run, number)
    error = np.abs(np.concatenate([getattr(own, part).ravel() for part in parts]) - true).max()
    growth = np.abs(true).max()
    acting = "".join(f", {type(effect).__name__}" for effect in effects)
    by = f"{setting.name}{acting}, by {number}, {len(run.switches)} switches, growth {growth:.1e}"
    found = [Measurement("error over the largest derivative", "compiled", DOUBLE, by, float(error / growth), 1e-9)]
    if not run.nu[-1].any():
        largest = float(np.abs(own.nu).max())
        found.append(Measurement("derivative of nu at rest", "compiled", DOUBLE, by, largest, 0))
    return found


def duration_of(setting: Setting, start: dict, switches: int) -> float:
    """How long a run takes that has so many switches, or as many as it has in 800 s."""
    duration = 1.0
    while len(run := setting.run(**start, duration=duration).switches) <= switches and duration < 800:
        duration *= 2
    if len(run) <= switches:
        return duration
    return float(run.t[switches - 1] + run.t[switches]) / 2


def refusal(setting: Setting, name: str, start: dict) -> tuple[tuple[int, ...], float] | None:
    """The wheels and the time of the instant at which a run has no derivative by a number; None where it has one."""
    try:
        followed(setting, (name,), **start)
    except NoDerivativeError as error:
        return error.wheels, error.t
    return None


@CASES.case(
    "derivatives-at-ties",
    "Derivatives where two wheels are no time, 1 ulp, tau/10 and 10 tau apart",
    naive="projects the wheels in the order of their numbers, and gives that map's derivative",
    promise="a number that keeps the wheels together has a derivative; one that parts them is refused, by instant",
)
def ties(scale: Scale) -> Iterator[Measurement]:
    """Turning on the spot, wheel 1 behind by an ulp, tau/10, 10 tau: what parts the wheels, and what does not."""
    for setting in settings(models=("locked", "free"), laws=("impact",), engines=("compiled",)):
        random = np.random.default_rng(2)
        wrong, count = 0, scale.of(2, 20)
        for _ in range(count):
            behind_by = one_behind(random, setting)
            for gap in (0, "ulp", 0.1, 10):
                start = behind_by(gap)
                wrong += refusal(setting, "nu[2]", start) is not None
                if gap != 10:  # else wheels 0 and 2 alone are together, and chi[0] parts these
                    wrong += refusal(setting, "chi[0]", start) != ((0, 1, 2), setting.run(**start).switches.t[0])
        yield setting.measurement(f"starts judged wrongly, of {7 * count}", wrong, 0)


@CASES.case(
    "derivatives-from-a-joint",
    "Derivatives of a run that starts on a joint",
    naive="takes the switch for a part of the start, which no number moves",
    promise="the limit of starts inside the roller",
)
def at_the_joint(scale: Scale) -> list[Measurement]:
    """A start on the joint, outwards: the derivative is that of starts a little inside, as these come closer."""
    found = []
    for setting in settings(laws=("impact",), engines=("compiled",)):
        nu = np.array([1.0, 0.3, 0.8])
        side = np.sign(nu @ speeds_of_wheels(setting.task(nu=nu, duration=0).kernel)[:, 1])

        def end(inside: float, setting=setting, nu=nu, side=side) -> np.ndarray:
            start = {"nu": nu, "chi": (0.1, side * (JOINT - inside), -0.1), "duration": 1.0}
            run = followed(setting, ("chi[1]", "mass"), **start)
            ends = [run.sensitivity(name, 1.0) for name in ("chi[1]", "mass")]
            return np.concatenate([getattr(one, part) for one in ends for part in ("nu", "chi", "pose")])

        near, nearer, there = end(2e-6), end(1e-6), end(0.0)
        error = np.abs(2 * nearer - near - there).max() / np.abs(there).max()
        found.append(setting.measurement("distance to the limit from inside", float(error), 1e-9))
    return found


@CASES.case(
    "derivatives-at-grazing",
    "Derivatives where a wheel grazes its joint",
    naive="divides by the wheel's rate, and gives what comes of that",
    promise="refused below a millionth of the fastest wheel's rate, by wheel and time; given above",
)
def grazing(scale: Scale) -> Iterator[Measurement]:
    """A wheel that passes its joint at so small a part of the fastest wheel's rate."""
    for setting in settings(laws=("impact",), engines=("compiled",)):
        random, wrong, count = np.random.default_rng(3), 0, scale.of(3, 30)
        rows = speeds_of_wheels(setting.task(nu=(1, 0, 0), duration=0).kernel).T
        for _ in range(count):
            wheel = int(random.integers(3))
            still = np.linalg.svd(rows[[wheel]])[2][1:]  # in which the wheel rests
            nu = random.normal(size=2) @ still
            outwards = rows[wheel] / (rows[wheel] @ rows[wheel]) * np.abs(rows @ nu).max()
            chi = random.uniform(-0.5, 0.5, size=3)
            chi[wheel] = JOINT
            for share in (1e-10, 1e-8, 0.9e-6, 1.1e-6, 1e-4, 1e-2):
                start = {"nu": nu + share * outwards, "chi": chi, "duration": 1e-6}
                passes = len(setting.run(**start).switches)  # none where the wheel turns back before it has passed
                grazes = passes > 0 and share < 1e-6
                if passes <= 1:  # else impacts send the wheel to and fro, ever more slowly
                    wrong += refusal(setting, "mass", start) != (((wheel,), 0.0) if grazes else None)
        yield setting.measurement(f"starts judged wrongly, of up to {6 * count}", wrong, 0)


@CASES.case(
    "derivatives-of-sharp-tips",
    "Linear models of vehicles whose rollers end in sharp tips",
    naive="differentiates elimination in M*: the generated derivatives of the accelerations",
    promise="64 ulp times the condition",
)
def near_sharp_tips(scale: Scale) -> list[Measurement]:
    """A and B of linearise for vehicles with sharp tips, against the generated derivatives in balls."""
    set_name, name = "locked_sharp+drive+derivatives", "forward_dynamics_derivatives"
    part = sample(60, scale.of(40, 1000), 3, 5, closest_tip=1e-9)
    part = with_effects(part.at(np.flatnonzero(part.sharpness() > SHARP)), set_name, 160)
    outputs = [argument.name for argument in rounding.functions(set_name, part)[name].outputs]
    found = np.array([linearised(part, row, outputs) for row in range(len(part))]).T
    judge = rounding.judged_by(part, set_name, [name])[name]
    worst = float(np.nanmax(judge.units(found, EPS)[0]))
    return [Setting("locked", "sharp tips", "python").measurement("error / ulp cond", worst, 64)]


def linearised(part: Sample, row: int, outputs: list[str]) -> np.ndarray:
    """nu' and its derivatives of one state, as the generated function puts them."""
    numbers = {name: part.vehicle[name][row] for name in VEHICLE_SCALARS} | {
        "wheel_angles": part.vehicle["wheel_angles"][row]
    }
    vehicle = omniroll.Vehicle(wheels=part.wheels, rollers_per_wheel=part.rollers, **numbers)
    state = {name: part.state[name][row] for name in ("nu", "chi")}
    torque = omniroll.Torque(part.state["torque"][row])
    model = omniroll.linearise(vehicle, **state, roller_model="locked", effects=(torque,))
    parts = {
        "nu_dot": model.rates[:3], "nu_dot_by_nu": model.A[:3, :3].T,
        "nu_dot_by_chi": model.A[:3, 3 : 3 + part.wheels].T, "nu_dot_by_torque": model.B[:3].T,
    }  # fmt: skip
    return np.concatenate([parts[name].ravel() for name in outputs])

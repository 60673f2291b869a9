"""Impacts that send a wheel back, and a wheel that both rollers send to its joint."""

from collections.abc import Iterator

import numpy as np

from hard.case import Cases, Measurement, Scale
from hard.setting import ENGINES, EPS, JOINT, PAPER, Setting, settings, speeds_of_wheels
from omniroll import SimulationStopped, Trajectory

CASES = Cases("Switches")
HEAVY = PAPER.replace(roller_inertia=5 * PAPER.roller_inertia)


def slow_arrival(random: np.random.Generator, model: str) -> dict:
    """Wheel 0 stands on its joint and moves outwards slowly: what its impact takes may be more than it has."""
    nu = random.normal(size=3)
    per_nu = speeds_of_wheels(Setting(model, "impact", "python").task(nu=nu, duration=0).kernel)[:, 0]
    nu[2] += (10 ** random.uniform(-5, -3) - nu @ per_nu) / per_nu[2]
    chi, spins = np.append(JOINT, random.uniform(-0.5, 0.5, 2)), random.normal(size=(3, 4))
    return {"nu": nu, "chi": chi, "spins": spins, "duration": 1.0}


@CASES.case(
    "sent-back",
    "An impact that reverses the wheel which caused it",
    promise="the law is applied again at the same instant until no wheel moves outwards; energy never rises",
)
def sent_back(scale: Scale) -> Iterator[Measurement]:
    for model in ("locked", "free"):
        random = np.random.default_rng(41)
        starts = [slow_arrival(random, model) for _ in range(scale.of(6, 15))]
        runs = {engine: [_run(Setting(model, "impact", engine), s) for s in starts] for engine in ENGINES}
        assert any(_reverses(run) for run in runs["compiled"])
        apart = max(
            float(np.abs(a.pose[-1] - b.pose[-1]).max()) for a, b in zip(*(runs[e] for e in ENGINES), strict=True)
        )
        for engine in ENGINES:
            setting = Setting(model, "impact", engine)
            rise = max(float(r.switches.energy_jump.max(initial=0)) / r.energy[0] for r in runs[engine])
            unfinished = sum(run.t[-1] < 1.0 for run in runs[engine])
            yield setting.measurement("runs that lose a wheel or give up, in %", 100 / len(starts) * unfinished, 0)
            yield setting.measurement("largest gain of energy, relative", rise, 1e-15)
            yield setting.measurement("distance of the engines' ends", apart, 10 * EPS**0.5)


def _run(setting: Setting, start: dict) -> Trajectory:
    """A run, or what there is of one that gave up."""
    try:
        return setting.run(**start)
    except SimulationStopped as stopped:
        return stopped.trajectory


def _reverses(run) -> bool:
    """Whether a wheel switches back over its joint at the instant at which it came."""
    s = run.switches
    return bool(((np.diff(s.t) == 0) & (np.diff(s.wheel) == 0) & (s.direction[1:] == -s.direction[:-1])).any())


def held_states(model: str, tries: int) -> list[dict]:
    """States at rest on the joint of wheel 0, where it accelerates outwards before and after a smooth switch."""
    random = np.random.default_rng(42)
    kernel = Setting(model, "smooth", "python").task(HEAVY, nu=(1, 0, 0), duration=0).kernel
    nu = np.column_stack([random.normal(size=tries), np.zeros((tries, 2))])  # the speed of wheel 0 is exactly 0
    chi, axial = random.uniform(-JOINT, JOINT, (tries, 3)), random.normal(size=(tries, 3, 4))
    momenta = (kernel.momenta(axial),) if model == "free" else ()
    chi[:, 0] = JOINT
    outwards = kernel.forward_dynamics(nu, chi, *momenta) @ speeds_of_wheels(kernel)[:, 0] > 0
    chi[:, 0] = -JOINT
    back = kernel.forward_dynamics(nu, chi, *momenta) @ speeds_of_wheels(kernel)[:, 0] < 0
    chi[:, 0] = JOINT
    held = np.flatnonzero(outwards & back)
    spins = kernel.spins_from_axial(nu[held], chi[held], axial[held]) if model == "free" else np.zeros((len(held), 1))
    return [{"nu": nu[k], "chi": chi[k], "spins": s} for k, s in zip(held, spins, strict=True)]


@CASES.case(
    "held-on-the-joint",
    "A wheel that is driven onto its joint from both sides (chattering)",
    naive="runs in an endless loop",
    promise="the run goes on, or the watchdog stops it, names time, wheel and state, and keeps the trajectory",
)
def held_on_the_joint(scale: Scale) -> Iterator[Measurement]:
    for setting in settings(models=("free",), laws=("smooth",)):
        states = held_states(setting.model, 40_000)[: scale.of(2, 20)]
        assert states
        unclear = sum(not _ends_or_says_why(setting, state) for state in states)
        yield setting.measurement("runs that neither end nor say when, where and why", unclear, 0)


def _ends_or_says_why(setting: Setting, state: dict) -> bool:
    try:
        run = setting.run(HEAVY, **state, duration=1e-3)
        return run.t[-1] == 1e-3
    except SimulationStopped as stopped:
        kept = stopped.trajectory
        return (
            "without progress" in stopped.reason
            and stopped.wheel == 0
            and set(stopped.state) == {"nu", "chi", "pose", "contact"}
            and kept.t[-1] == stopped.t
            and len(kept.switches) > 0
        )

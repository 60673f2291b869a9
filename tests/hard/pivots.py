"""Mecanum wheels and wheels with two rows of rollers reverse while the vehicle turns: they stand on their joints."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from mecanum import corners
from rows import reversals
from scipy.integrate import solve_ivp

import omniroll
from hard.case import Case, Measurement, Scale
from omniroll.kernels.kernel import kernel

LAWS = ("impact", "smooth")
ROUNDING = 1e-13  # of the largest energy


def turned(scale: Scale, is_mecanum: bool) -> list[Measurement]:
    """Random vehicles, every second one driven by torques."""
    found = []
    laws, rare = (LAWS[:1], 3) if is_mecanum else (LAWS, 2)
    count = scale.of(6, 340 // len(laws))
    for model in reversals.MODELS:
        for law in laws:
            stopped, rise, at_once, stands = 0, 0.0, 0, 0
            for seed in range(count):
                random = np.random.default_rng([seed, reversals.MODELS.index(model)])
                task = reversals.task(random, seed % 2 == 1, is_mecanum)
                try:
                    run = omniroll.simulate(**task, roller_model=model, switching=law, control=False)
                except omniroll.SimulationStopped:
                    stopped += 1
                    continue
                rise = max(rise, reversals.rises(run))
                at_once = max(at_once, reversals.most_at_once(run))
                stands += int((np.diff(run.pivots, axis=0) > 0).sum())
            setting = f"{model}, {law}, {count} vehicles"

            def said(what: str, measured: float, bound: float, setting: str = setting) -> Measurement:
                return Measurement(what, "compiled", "double", setting, measured, bound)

            found.append(said("runs that stop", stopped, 0))
            found.append(said("transitions at one instant, for each wheel", at_once, 4))
            if law == "impact":
                found.append(said("rise of energy at a transition / largest energy", rise, ROUNDING))
            if count > 99:  # of a few vehicles it is chance whether one comes to stand
                found.append(said("vehicles for each wheel that comes to stand", count / max(stands, 1), rare))
    return found


ATTRACTING = "two wheels at attracting joints"
STARTS = {
    ATTRACTING: (corners.trio(), corners.two_stand()),
    "a rate that vanishes at the joint": (corners.usual(), corners.vanishing_rate(0.4)),
    **{name: (vehicle, corners.TURNING) for name, vehicle in corners.CORNERS.items()},
}
PATIENCE, PIECES = 50, 300  # switches of the naive integrator at one instant; and how often it begins again


def naive_at_once(vehicle: omniroll.Vehicle, nu: Sequence[float], chi: Sequence[float], duration: float) -> int:
    """The most switches at one instant, up to PATIENCE, of an integrator that knows no wheel that stands: massless
    rollers, SciPy's DOP853 with an event for each joint, and speeds that a switch leaves as they are."""
    bound, wheels, joint = kernel(vehicle, "massless", "python"), vehicle.wheels, np.pi / vehicle.rollers_per_wheel
    events = [lambda _, y, i=i, sign=sign: sign * y[3 + i] - joint for i in range(wheels) for sign in (1, -1)]
    for event in events:
        event.terminal, event.direction = True, 1
    time, y, most, at_once = 0.0, np.array([*nu, *chi], float), 0, 0

    def rates(_, y):
        return np.concatenate([bound.forward_dynamics(y[:3], y[3:]), bound.wheel_speeds(y[:3], y[3:])])

    for _ in range(PIECES):
        if time >= duration or at_once == PATIENCE:
            break
        outward = np.flatnonzero((np.abs(y[3:]) >= joint) & (y[3:] * rates(time, y)[3:] > 0))
        if len(outward):
            y[3 + outward] *= -1
            at_once += 1
            most = max(most, at_once)
            continue
        found = solve_ivp(rates, (time, duration), y, "DOP853", rtol=1e-9, atol=1e-12, events=events)
        at_once = at_once if found.t[-1] - time < 1e-9 else 0
        time, y = found.t[-1], found.y[:, -1]
        for i, hits in enumerate(found.t_events):
            if len(hits):
                y[3 + i // 2] = joint * (1, -1)[i % 2]
    return most


def cornered(scale: Scale) -> list[Measurement]:
    """Each corner under each roller model."""
    found = []
    for name, (vehicle, start) in STARTS.items():
        naive = naive_at_once(vehicle, **start, duration=0.5) if scale.compares and name == ATTRACTING else None
        for model in reversals.MODELS:
            run = omniroll.simulate(vehicle, **start, roller_model=model, duration=1.0, accuracy=1e-9, control=False)
            setting, massless = f"{name}, {model}", model == "massless"
            at_once, rise = reversals.most_at_once(run), reversals.rises(run)
            found += [
                Measurement("switches at one instant, for each wheel", "compiled", "double", setting, at_once, 4,
                            naive if massless else None),
                Measurement("rise of energy / largest energy", "compiled", "double", setting, rise, ROUNDING),
            ]  # fmt: skip
    return found


CASES = [
    Case(
        name="mecanum_corners",
        section="Switches",
        title="Mecanum wheels: two at attracting joints, an O layout, three rollers, 89 degrees, nearly sharp tips, a "
        "rate that vanishes at the joint",
        naive=f"switches at one instant without end, here {PATIENCE} times and more, where both rollers push a wheel "
        "back",
        promise="each runs to its end under impact; a wheel that both rollers push back stands on its joint; energy "
        "never rises",
        run=cornered,
    ),
    Case(
        name="pivots",
        section="Switches",
        title="Wheels with two rows of rollers reverse while the vehicle turns",
        naive="passes on and back for ever at one instant, or loses its turning",
        promise="no run stops, and none switches without progress; under impact energy never rises",
        run=partial(turned, is_mecanum=False),
    ),
    Case(
        name="mecanum_pivots",
        section="Switches",
        title="Mecanum wheels reverse while the vehicle turns, under impact",
        naive="passes on and back for ever at one instant, or loses its turning",
        promise="no run stops, none switches without progress, and energy never rises; smooth switches, which may gain "
        "energy, do so without bound there",
        run=partial(turned, is_mecanum=True),
    ),
]

"""Mecanum wheels and wheels with two rows of rollers reverse while the vehicle turns: they stand on their joints."""

from functools import partial

import numpy as np
from rows import reversals

import omniroll
from hard.case import Case, Measurement, Scale

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


CASES = [
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

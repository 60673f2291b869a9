"""Wheels with two rows of rollers that reverse while the vehicle turns: they stand on their joints."""

import numpy as np
from rows import reversals

import omniroll
from hard.case import Case, Measurement, Scale

LAWS = ("impact", "smooth")
ROUNDING = 1e-13  # of the largest energy


def turned(scale: Scale) -> list[Measurement]:
    """Random vehicles, every second one driven by torques."""
    found = []
    count = scale.of(6, 170)
    for model in reversals.MODELS:
        for law in LAWS:
            stopped, rise, at_once, stands = 0, 0.0, 0, 0
            for seed in range(count):
                random = np.random.default_rng([seed, reversals.MODELS.index(model)])
                task = reversals.task(random, driven=seed % 2 == 1)
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
                found.append(said("vehicles for each wheel that comes to stand", count / max(stands, 1), 2))
    return found


CASES = [
    Case(
        name="pivots",
        section="Switches",
        title="Wheels with two rows of rollers reverse while the vehicle turns",
        naive="passes on and back for ever at one instant, or loses its turning",
        promise="no run stops, and none switches without progress; under impact energy never rises",
        run=turned,
    ),
]

"""Derivatives of runs in which axles stick against central differences of runs in 40 digits, which find the instants at
which axles stop and break away by another way (omniroll.studies.accuracy.sticking)."""

import numpy as np
import pytest
from hard import true_sensitivities
from hard.setting import Setting

from omniroll import Bearings
from tests.sensitivities.differences import SPINS, START, VEHICLE, Case, derivative
from tests.sensitivities.test_sticking import AT_REST, HELD_LONGER, RAMP, modes

BREAKING_AWAY = Case("locked", effects=(RAMP, HELD_LONGER), start=AT_REST, duration=2.2)
STOPPING = Case("free", effects=(Bearings(wheel_coulomb=0.005),), duration=3.2)


@pytest.mark.long
@pytest.mark.parametrize("case, number, sets", [
    (BREAKING_AWAY, "mass", {"111", "000"}), (STOPPING, "wheel_coulomb[1]", {"000", "100", "110"})
], ids=["breaking away", "stopping"])  # fmt: skip
def test_they_are_the_differences_of_runs_in_40_digits(case, number, sets):
    pytest.importorskip("flint")
    run = case.run(sensitivities=(number,), accuracy=1e-12)
    assert sets <= modes(run) and len(run.switches) >= 4
    start = START | ({"spins": SPINS} if case.roller_model == "free" else {}) | case.start
    setting = Setting(case.roller_model, case.switching, "compiled")
    task = setting.task(VEHICLE, **start, effects=case.effects, duration=case.duration)
    true = true_sensitivities.derivative(task, run, number)
    assert np.abs(derivative(run, number) - true).max() <= 1e-9 * np.abs(true).max()

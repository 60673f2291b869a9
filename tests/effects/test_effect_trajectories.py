"""Trajectories with effects: files and stops."""

import numpy as np
import pytest
from held_wheel import CHI, torques_that_hold

from omniroll import (
    Bearings,
    Controller,
    Motor,
    SimulationStopped,
    Slope,
    TorqueTable,
    Trajectory,
    Vehicle,
    simulate,
)

PAPER = Vehicle.paper()
MOTOR = Motor((3.0, -2.0, 1.0), 0.02, 1.5, gear_ratio=3, current_limit=0.7, rotor_inertia=1e-6)
VISCOUS = Bearings(wheel_viscous=1e-3, roller_viscous=1e-5)
COULOMB = Bearings(wheel_coulomb=1e-3, wheel_speed=0.5, roller_coulomb=1e-5, roller_speed=0.5)
SETS = {
    "driven": [MOTOR, Controller((0.5, 0, 0.5), 1.0, 0.07, output="voltage")],
    "viscous": [TorqueTable([0.2, 0.9], [[0, 0, 0], [0.03, 0, -0.02]]), VISCOUS],
    "Coulomb on a slope": [COULOMB, Slope(0.1, 0.5)],
}
START = {"nu": (1.0, 0.2, 0.8), "spins": 0.4, "chi": (0.1, -0.3, 0.2)}
FIELDS = (
    "t", "elapsed", "nu", "chi", "contact", "contact_spin", "spins", "pose", "energy", "dense", "step_rows", "added",
)  # fmt: skip


# Files


@pytest.mark.parametrize("name, ending, dense", [
    ("driven", ".npz", True), ("driven", ".csv", True), ("viscous", ".csv", False),
    ("Coulomb on a slope", ".npz", False),
])  # fmt: skip
def test_files_keep_every_bit_and_the_effects(tmp_path, name, ending, dense):
    run = simulate(PAPER, **START, duration=0.5, start_time=0.1, accuracy=1e-7, effects=SETS[name], control=False)
    run.save(tmp_path / f"run{ending}", dense=dense)
    again = Trajectory.load(tmp_path / f"run{ending}")
    for field in FIELDS:
        expected = None if field == "dense" and not dense else getattr(run, field)
        assert (expected is None) == (getattr(again, field) is None)
        assert expected is None or (getattr(again, field) == expected).all(), field
    assert again.effects == run.effects and again.vehicle == run.vehicle and again.stats == run.stats
    assert again.ledger == run.ledger
    if dense:
        times = np.linspace(0.1, 0.6, 7)
        assert (again.sample(times).spins == run.sample(times).spins).all()


# Stops


@pytest.mark.long
@pytest.mark.parametrize(("engine", "longest"), [("python", 0.0), ("compiled", 1e-4)])
def test_what_was_done_before_a_stop_is_kept(tmp_path, engine, longest):
    """At rest on its joint until the torques come that hold it there; the compiled engine sees it within 0.1 ms."""
    table = TorqueTable([0.0, 0.1], [[0, 0, 0], torques_that_hold("locked")], interpolation="hold")
    start = {"nu": (0, 0, 0), "chi": CHI, "roller_model": "locked", "duration": 1, "accuracy": 1e-6}
    with pytest.raises(SimulationStopped) as stopped:
        simulate(PAPER, **start, effects=[table, VISCOUS], engine=engine)
    run = stopped.value.trajectory
    assert run.t[0] == 0 and 0.1 <= run.t[-1] == stopped.value.t <= 0.1 + longest
    assert np.abs(run.nu).max() <= longest and not run.nu[run.t < 0.1].any()
    run.save(tmp_path / "part.npz")
    again = Trajectory.load(tmp_path / "part.npz")
    assert (again.added == run.added).all() and again.ledger == run.ledger

"""Derivatives behind a let-go on a slope: the force that holds rises also because gravity's direction turns with the
heading."""

import numpy as np
import pytest

from omniroll import Bearings, Contact, Slope, TorqueTable, Vehicle, simulate

VEHICLE = Vehicle.paper()
NAMES = ("mass", "nu[2]")
GROUND = Contact(law="coulomb", friction=0.25, static_friction=0.35, normal_gravity=9.6)
HELD = Bearings(wheel_coulomb=0.02, wheel_break_away=0.05)


def run(start, torque, mass=VEHICLE.mass, bearings=(), rollers="massless", **further):
    drive = TorqueTable((0.0, 0.4), ((0, 0, 0), tuple(torque)))
    return simulate(
        VEHICLE.replace(mass=mass), nu=tuple(start), duration=0.4, roller_model=rollers, control=False, accuracy=1e-12,
        effects=[GROUND, Slope(0.2, 0.3), drive, *bearings], **further,
    )  # fmt: skip


@pytest.mark.parametrize(("rollers", "bearings"), [("massless", ()), ("massless", (HELD,)), ("free", ())])
def test_derivatives_are_differences_of_runs(rollers, bearings):
    rng = np.random.default_rng(5)
    changes = 0
    for _ in range(4):
        start, torque = rng.normal(size=3) * (0.5, 0.5, 2), rng.normal(size=3) * 0.4
        found = run(start, torque, bearings=bearings, rollers=rollers, sensitivities=NAMES)
        changes += np.count_nonzero(found.sticks[1:] < found.sticks[:-1])
        ends = []
        for number in range(2):
            by = 5e-6 * (VEHICLE.mass if number == 0 else 1)  # with less, roundings of runs weigh more than what bends
            beside = [
                run(start + (0, 0, side * number), torque, VEHICLE.mass + side * (1 - number), bearings, rollers).nu[-1]
                for side in (by, -by)
            ]
            ends.append((beside[0] - beside[1]) / (2 * by))
        for name, end in zip(NAMES, ends, strict=True):
            np.testing.assert_allclose(found.sensitivity(name).nu[-1], end, rtol=0, atol=3e-8 * abs(end).max())
    assert changes >= 2  # contacts did let go

"""Tracking wheels in fits: what wheels that may slip do not tell, passive ones do."""

import numpy as np
import pytest

import omniroll

ROBOT = omniroll.Vehicle.paper().replace(mass=2.4)
DRIVE = omniroll.TorqueTable([0, 1, 2], 0.04 * np.array([[0, 0, 0], [1, -1, 2], [-1, 2, 1]]))
POSITION = {"tracking_places": [(0, 0.1), (0, -0.1), (-0.12, 0)], "tracking_directions": [0, 0, np.pi / 2]}
INSTRUMENTS = omniroll.Instruments(tracking_radius=0.024, **POSITION)
TIMES = np.linspace(0.02, 2, 100)
OPTIONS = {"nu": (0, 0, 0), "roller_model": "massless"}


@pytest.fixture(scope="module")
def log():
    run = omniroll.simulate(ROBOT, duration=2, effects=[DRIVE, omniroll.Contact(4.0)], **OPTIONS)
    return omniroll.Log(run.measure(TIMES, INSTRUMENTS, ["tracking_count"]) | {"t": TIMES})


def test_counts_of_tracking_wheels_tell_the_ground_and_the_mass(log):
    acting = [DRIVE, omniroll.Contact(3.0)]
    fit = omniroll.fit(
        omniroll.Vehicle.paper(), log, ["mass", "coefficient"], effects=acting, instruments=INSTRUMENTS, **OPTIONS
    )
    assert fit.differenced == () and not fit.undetermined
    assert abs(fit["mass"] - 2.4) < 3 * fit.deviations[0] < 1e-3
    assert abs(fit["coefficient"] - 4.0) < 3 * fit.deviations[1] < 1e-2


def test_a_reading_that_the_model_lacks_is_named(log):
    with pytest.raises(omniroll.InvalidValueError, match="tracking_places"):
        omniroll.fit(omniroll.Vehicle.paper(), log, ["mass"], effects=[DRIVE], **OPTIONS)
    currents = omniroll.Log({"t": TIMES, "motor_current": log.data["tracking_count"]})
    with pytest.raises(omniroll.InvalidValueError, match="a Motor as the only drive"):
        omniroll.fit(omniroll.Vehicle.paper(), currents, ["mass"], effects=[DRIVE], **OPTIONS)

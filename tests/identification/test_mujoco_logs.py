"""Fits to logs of MuJoCo's model with a body for each roller, which is not the model that is fitted."""

import pytest

from identification.mujoco_logs import DRIVES, FEW_SPHERES, FRICTION, VEHICLE, errors, fit_of

pytest.importorskip("mujoco")
WHEEL_AS_MASS, WHEEL_AS_YAW_INERTIA = 506.2, 33.94  # of a wheel_inertia, driving straight and turning on the spot


@pytest.mark.long
@pytest.mark.parametrize("seed", range(0, DRIVES, 4))
def test_each_number_is_found_within_5_percent(seed):
    assert all(abs(error) < 0.05 for error in errors(fit_of(seed)).values())


@pytest.mark.long
@pytest.mark.parametrize("seed", [4])
def test_what_the_motion_feels_is_found_and_the_residuals_tell_of_the_model(seed):
    """Rollers of few spheres: the whole inertia ahead and around, and friction. How the inertia parts into body and
    wheels is worse."""
    fit = fit_of(seed, FEW_SPHERES)
    ahead, around = (
        number(fit.vehicle) / number(VEHICLE) - 1
        for number in (
            lambda vehicle: vehicle.mass + WHEEL_AS_MASS * vehicle.wheel_inertia,
            lambda vehicle: vehicle.yaw_inertia + WHEEL_AS_YAW_INERTIA * vehicle.wheel_inertia,
        )
    )
    assert abs(ahead) < 0.05 and abs(around) < 0.05
    assert fit["wheel_viscous"] == pytest.approx(FRICTION, rel=0.05)
    # The intervals hold noise alone, and are too narrow; the residuals say that the model misses something.
    assert any("residuals are 1." in doubt for doubt in fit.doubts)
    assert any("each residual goes with the one before it" in doubt for doubt in fit.doubts)

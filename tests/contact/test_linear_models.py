"""Linear models of wheels that may slip, against the sensitivities of runs, which differences hold."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll import Bearings, Contact, InvalidValueError, Motor, Torque, Vehicle, linearise, simulate
from omniroll.kernels.kernel import kernel

VEHICLE, MODELS = Vehicle.paper(), ("massless", "free")
DAMPING, FRICTION, LOAD, FADE_SPEED = (3.7, 1.9), (0.7, 0.3), 8.5, 0.02
GROUNDS = {"viscous": Contact(DAMPING), "regularised": Contact(law="regularised", friction=FRICTION, speed=FADE_SPEED,
           load=LOAD)}  # fmt: skip
LEVEL = {"viscous": Contact(30), "regularised": Contact(law="regularised", friction=(0.6, 0.4), speed=0.05)}
BEARINGS = Bearings(wheel_viscous=1e-3, wheel_coulomb=2e-3, wheel_speed=0.5, roller_coulomb=1e-4, roller_speed=2.0)


def places(names, part):
    return [k for k, name in enumerate(names) if name.split("[")[0] == part]


@pytest.mark.parametrize("ground", [*GROUNDS.values(), *LEVEL.values()], ids=lambda own: f"{own.law}, {own.load}")
@pytest.mark.parametrize("model", MODELS)
def test_from_sample_to_sample_they_are_the_sensitivities_of_a_run_at_rest(model, ground):
    """There a run stays where it is, and what its deviations follow is the linear model itself. The step is short: a
    run at rest takes it as one, in which slips that die out much faster would not be resolved."""
    step, chi, zero = 2e-4, np.array([0.1, -0.2, 0.05]), (0.0, 0.0, 0.0)
    spins = {"contact_spins": zero} if model == "free" else {}
    effects = [replace(ground, wheel_rates=zero, **spins), BEARINGS, Torque(0.0)]
    start = {"nu": zero, "chi": chi, "roller_model": model, "effects": effects}
    numbers = ("nu", "chi", "pose", "wheel_rates", *spins, "torque")
    names = [f"{number}[{k}]" for number in numbers for k in range(3)]
    run = simulate(VEHICLE, **start, duration=step, sensitivities=names, accuracy=1e-12, control=False)
    linear = linearise(VEHICLE, **start).discrete(step)
    assert linear.rates == pytest.approx(0, abs=1e-15)
    rolling = kernel(VEHICLE, model, "python")

    def moved(number, k):
        """Where the states begin, by a number of the start."""
        unit, begun = np.eye(3)[k], np.zeros(len(linear.states))
        own = {"wheel_rates": "rates", "contact_spins": "contact_omega"}.get(number, number)
        begun[places(linear.states, own)] = unit
        if number == "nu" and model == "free":  # spins relative to their disks stay: rollers are taken round
            begun[places(linear.states, "contact_omega")] = unit[2] / VEHICLE.yaw_scale * np.sin(chi)
            no_spins = np.zeros((3, VEHICLE.rollers_per_wheel - 1))
            begun[places(linear.states, "axial")] = rolling.axial_speeds(unit, chi, no_spins).ravel()
        return begun

    for number in numbers:
        for k in range(3):
            found = run.sensitivity(f"{number}[{k}]")
            ended = np.concatenate([found.nu[-1], found.chi[-1], found.pose[-1]])
            wanted = linear.B[:9, k] if number == "torque" else (linear.A @ moved(number, k))[:9]
            assert ended == pytest.approx(wanted, rel=1e-8, abs=1e-9 * np.abs(wanted).max()), (number, k)


def test_names_inputs_and_readings_are_there():
    motor = Motor(voltage=(1, 2, 3), torque_constant=0.02, resistance=1.5, gear_ratio=4)
    outputs = ("wheel_rates", "wheel_rate", "gyro", "motor_current", "accelerometer")
    given = {"nu": (1, 0.5, 0.2), "outputs": outputs, "roller_model": "free"}
    linear = linearise(VEHICLE, effects=[Contact(30, wheel_rates=(1, 2, 3)), motor], **given)
    assert linear.states[9:12] == ("rates[0]", "rates[1]", "rates[2]") and linear.states[12] == "contact_omega[0]"
    assert linear.states[-1] == "momenta[2][1]" and linear.inputs[0] == "voltage[0]"
    assert linear.outputs_at[:6].tolist() == [1, 2, 3, 1, 2, 3]
    assert (linear.C[:3] == np.eye(3, 21, 9)).all() and (linear.C[3:6] == linear.C[:3]).all()
    current = linear.C[7:10, 9:12]  # falls with the wheel's own rate
    assert current == pytest.approx(-np.eye(3) * 0.02 * 4 / 1.5) and linear.D[7:10] == pytest.approx(np.eye(3) / 1.5)


def test_a_motor_whose_slipping_wheel_takes_it_to_its_limit_does_not_answer():
    """It is the wheel's own rate that counts: where the wheels rolled, no current would be at its limit."""
    motor = Motor(voltage=1, torque_constant=0.02, resistance=1.0, gear_ratio=4, current_limit=2)
    given = {"nu": (0, 0, 0), "outputs": ("motor_current",), "roller_model": "massless"}
    rolls, slips = (linearise(VEHICLE, effects=[Contact(30, wheel_rates=rates), motor], **given)
                    for rates in (None, (0, -50, 0)))  # fmt: skip
    assert (np.abs(rolls.B).max(axis=0) > 0).all()
    assert (np.abs(slips.B).max(axis=0) > 0).tolist() == [True, False, True]
    assert slips.outputs_at == pytest.approx([1, 2, 1]) and not slips.D[1].any() and not slips.C[1].any()


@pytest.mark.parametrize(("effects", "options", "said"), [
    ([Contact(law="coulomb", friction=0.3)], {}, "stick"),
    ([Contact(30), Bearings(wheel_coulomb=0.1)], {}, "axles that stick"),
    ([Contact(30), Bearings(roller_coulomb=0.1)], {}, "rollers that stick"),
    ([Contact(30)], {"roller_model": "locked"}, "locked"),
    ([Contact(30)], {"outputs": ("odometry",)}, "wheels that roll"),
])  # fmt: skip
def test_what_has_no_derivative_is_refused(effects, options, said):
    with pytest.raises(InvalidValueError, match=said):
        linearise(VEHICLE, effects=effects, **options)

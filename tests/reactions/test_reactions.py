"""omniroll.reactions on runs: closed forms, margins, warnings and refusals."""

import numpy as np
import pytest

import omniroll
from omniroll.errors import InvalidValueError, RollingWarning

GRAVITY = 9.80665
PAPER = omniroll.Vehicle.paper()
WEIGHT = PAPER.mass * GRAVITY


def at_start(vehicle=PAPER, nu=(0, 0, 0), model="locked", effects=(), **options):
    """Reactions of the first row of a run."""
    run = omniroll.simulate(vehicle, nu=nu, duration=0, roller_model=model, effects=effects, engine="python")
    return omniroll.reactions(run, **({"height": 0.05} | options))


# At rest


def test_three_wheels_at_rest_carry_a_third_each():
    found = at_start()
    assert found.load == pytest.approx(np.full((1, 3), WEIGHT / 3), rel=1e-14)
    assert found.contact_force == pytest.approx(np.zeros((1, 3, 2)), abs=1e-14)
    assert found.load_rule == "determinate" and found.doubts == ()
    assert found.tip_margin == pytest.approx(PAPER.platform_radius / 2, rel=1e-14), "the triangle's inner circle"


# Speeding up


def push(torque):
    """Torques that push along xi: wheel i turns with the rate that xi demands, sin(alpha_i) v/l."""
    return omniroll.Torque(torque * np.sin(PAPER.wheel_angles))


def acceleration(torque):
    """1.5 torque/l moves the mass and, in effect, 1.5 J/l^2: the squares of three sines add up to 1.5."""
    return 1.5 * torque / PAPER.wheel_radius / (PAPER.mass + 1.5 * PAPER.wheel_inertia / PAPER.wheel_radius**2)


@pytest.mark.parametrize("torque", [0.05, -0.08])
def test_speeding_up_and_braking_shift_the_loads(torque):
    a, sines, cosines = acceleration(torque), np.sin(PAPER.wheel_angles), np.cos(PAPER.wheel_angles)
    radius, high = PAPER.wheel_radius, 0.07
    found = at_start(model="massless", effects=[push(torque)], height=high, friction=1.0)
    rolling = (PAPER.wheel_inertia * a / radius - torque) * sines / radius
    assert found.contact_force[0, :, 1] == pytest.approx(rolling, rel=1e-12, abs=1e-15)
    assert found.contact_force[0, :, 0] == pytest.approx(0, abs=1e-15)
    moment = -(PAPER.mass * high + 1.5 * PAPER.wheel_inertia / radius) * a
    wanted = WEIGHT / 3 + 2 * moment * cosines / (3 * PAPER.platform_radius)
    assert found.load[0] == pytest.approx(wanted, rel=1e-12)
    assert found.pressure_point[0] == pytest.approx([moment / WEIGHT, 0], rel=1e-12, abs=1e-15)
    assert found.slip_margin[0] == pytest.approx(wanted - abs(rolling), rel=1e-12)
    assert found.needed_friction[0] == pytest.approx(abs(rolling) / wanted, rel=1e-12, abs=1e-15)


def test_beyond_friction_the_warning_names_time_and_wheels():
    """Wheel 0 is not driven; the other two need the same friction."""
    needed = at_start(model="massless", effects=[push(0.1)]).needed_friction[0]
    enough, little = 1.01 * float(needed.max()), 0.99 * float(needed.max())
    assert at_start(model="massless", effects=[push(0.1)], friction=enough).doubts == ()
    with pytest.warns(RollingWarning, match=r"t = 0, wheel 2: rolling needs friction 0\.\d+ \(and 1 more"):
        found = at_start(model="massless", effects=[push(0.1)], friction=little)
    assert [(doubt.wheel, doubt.reason) for doubt in found.doubts] == [(1, "slip"), (2, "slip")]
    assert found.doubts[1].worst == pytest.approx(needed[2], rel=1e-12)


# A slope


def test_a_vehicle_too_high_for_its_slope_tips():
    angle = 0.3
    effects = [omniroll.Slope(angle=angle, direction=np.pi)]  # down is where the triangle has an edge
    edge = PAPER.platform_radius / 2 / np.tan(angle)  # the height from which on it tips, were it held
    sines = np.sin(PAPER.wheel_angles)
    held = omniroll.Torque(WEIGHT * np.sin(angle) * PAPER.wheel_radius / 1.5 * sines)
    assert at_start(effects=[*effects, held], height=0.99 * edge).tip_margin[0] > 0
    with pytest.warns(RollingWarning, match=r"t = 0, wheel 1: rolling needs a load of -.* the ground only pushes"):
        found = at_start(effects=[*effects, held], height=1.01 * edge)
    assert found.tip_margin[0] == pytest.approx(-0.01 * PAPER.platform_radius / 2, rel=1e-10)
    assert found.load[0, 0] < 0 and np.isinf(found.needed_friction[0, 0])


# A motor


def test_the_forces_of_a_motor_are_those_of_its_torque_and_its_rotor():
    """A motor's torque at speed, as the oracle's torque on the wheel; its rotor as a body of its own."""
    motor = omniroll.Motor(
        voltage=(3.0, -5.0, 1.0), torque_constant=0.01, resistance=2.0, gear_ratio=10.0, rotor_inertia=4e-6
    )
    bare = at_start(nu=(1, 0.5, 2), effects=[motor])
    rates = omniroll.kernel(PAPER, "locked", "python").wheel_speeds(np.array([1, 0.5, 2.0]))
    torque = 10 * 0.01 * (np.array([3.0, -5.0, 1.0]) - 0.01 * 10 * rates) / 2.0
    geared = PAPER.replace(wheel_inertia=PAPER.wheel_inertia + 100 * 4e-6)
    spin = PAPER.wheel_inertia + 10 * 4e-6
    same = at_start(geared, nu=(1, 0.5, 2), effects=[omniroll.Torque(torque)], spin_inertia=spin)
    assert bare.contact_force == pytest.approx(same.contact_force, rel=1e-12)
    assert bare.load == pytest.approx(same.load, rel=1e-12)


# A whole run


def driven_run():
    """Two motors' voltages that ramp, and one that is held; wheels switch on the way."""
    voltage = np.array([(0, 3, 1), (6, -3, 1), (1, 2, 1.0)])
    motor = omniroll.Motor(voltage=voltage, times=(0, 0.5, 1), torque_constant=0.02, resistance=1.0, gear_ratio=5)
    return omniroll.simulate(PAPER, nu=(1, 0, 1), duration=1, roller_model="free", effects=[motor], engine="python")


def test_every_row_remembers_what_the_drives_gave():
    run = driven_run()
    assert len(run.switches) > 0
    voltage = np.stack([np.interp(run.t, (0, 0.5, 1), u) for u in [(0, 6, 1), (3, -3, 2), (1, 1, 1)]], axis=1)
    assert run.drive[:, 0] == pytest.approx(5 * 0.02 * voltage, rel=1e-9, abs=1e-12)
    assert run.drive[:, 1] == pytest.approx(np.full((len(run.t), 3), (5 * 0.02) ** 2), rel=1e-14)


@pytest.mark.long
@pytest.mark.parametrize("ending", ["npz", "csv"])
def test_a_run_from_a_file_has_the_same_reactions(tmp_path, ending):
    run = driven_run()
    run.save(tmp_path / f"run.{ending}")
    loaded = omniroll.Trajectory.load(tmp_path / f"run.{ending}")
    found, same = (omniroll.reactions(trajectory, height=0.06) for trajectory in (run, loaded))
    assert np.array_equal(found.contact_force, same.contact_force) and np.array_equal(found.load, same.load)
    assert np.ptp(found.contact_force[:, :, 1]) > 0.1, "the motors are felt"


def test_doubts_are_stretches_of_rows():
    run = omniroll.simulate(PAPER, nu=(8, 0, 30), duration=0.6)
    quiet = omniroll.reactions(run, height=0.06)
    coefficient = float(np.median(quiet.needed_friction))
    with pytest.warns(RollingWarning, match=r"\(and \d+ more, in Reactions.doubts\)"):
        found = omniroll.reactions(run, height=0.06, friction=coefficient)
    covered = np.zeros(quiet.load.shape, bool)
    for doubt in found.doubts:
        rows = (run.t >= doubt.t_first) & (run.t <= doubt.t_last)
        assert doubt.worst == pytest.approx(quiet.needed_friction[rows, doubt.wheel].max(), rel=1e-12)
        covered[rows, doubt.wheel] = True
    assert covered[quiet.needed_friction > coefficient].all()
    assert [d.t_first for d in found.doubts] == sorted(d.t_first for d in found.doubts)


# Refusals


@pytest.mark.parametrize("vehicle, options, field", [
    (omniroll.Vehicle.paper(wheels=2), {}, "wheels"),
    (PAPER, {"height": 0}, "height"),
    (PAPER, {"friction": -1}, "friction"),
    (PAPER, {"gravity": 0}, "gravity"),
    (PAPER, {"spin_inertia": 0}, "spin_inertia"),
    (PAPER, {"spin_inertia": (1, 2)}, "spin_inertia"),
    (PAPER, {"platform_products": 1}, "platform_products"),
    (PAPER, {"wheel_mass": PAPER.mass / 3}, "wheel_mass"),
    (PAPER.replace(center_of_mass=(0.01, 0)), {}, "wheel_mass"),
    (PAPER.replace(wheel_angles=(0, 1, 2)), {}, "wheel_mass"),
    (PAPER.replace(wheel_places=((0.1, 0), (0.2, 0), (-0.3, 0))), {}, "wheel_places"),
])  # fmt: skip
def test_what_makes_no_sense_is_refused_by_name(vehicle, options, field):
    with pytest.raises(InvalidValueError) as caught:
        at_start(vehicle, **options)
    assert caught.value.field == field


def test_gravity_must_be_that_of_the_slope():
    with pytest.raises(InvalidValueError, match="must be that of the run's slope"):
        at_start(effects=[omniroll.Slope(angle=0.1)], gravity=3.7)
    with pytest.raises(InvalidValueError, match="must be a Trajectory"):
        omniroll.reactions(None, height=1)

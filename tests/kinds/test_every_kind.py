"""What holds of runs on wheels of each other kind: rollers at angles, in two rows, with a meridian of their
own, and wheels of several kinds on a vehicle."""

import json
from dataclasses import dataclass, field
from profile.test_runs import BALLS, BARRELS, CYLINDERS, PAPER, ROUNDED

import numpy as np
import pytest
from mecanum.corners import trio, two_stand, usual

import omniroll
from kinds.test_runs import TRACKED, TWO
from omniroll import Bearings, Contact, Controller, InvalidValueError, Motor, Slope, Torque, Vehicle
from omniroll.effects import Weight
from omniroll.kernels.kernel import kernel
from omniroll.kernels.phases import Carry, kernel_in_phase

MODELS = ("massless", "locked", "free")
MODELS_AND_LAWS = [*((model, "impact") for model in MODELS), ("free", "smooth")]
ROWS = Vehicle.paper(4, 8).replace(rows=2, row_offset=0.004, yaw_scale=1.0)


@dataclass(frozen=True)
class Subject:
    vehicle: Vehicle
    start: dict = field(default_factory=lambda: {"nu": (3.0, -2.0, 2.5)})

    def run(self, duration=1.0, **options):
        return omniroll.simulate(self.vehicle, duration=duration, **self.start,
                                 **{"accuracy": 1e-12, "control": False} | options)  # fmt: skip


SUBJECTS = {
    "mecanum": Subject(usual(), {"nu": (0.5, 0.8, 0.6)}), "two rows": Subject(ROWS), "two kinds": Subject(TWO),
    "a tracking wheel": Subject(TRACKED), "kinds of mecanum": Subject(TWO.replace(roller_angle=[0.7, 0, -0.7, 0])),
    "spheres": Subject(BALLS), "mecanum barrels": Subject(BARRELS), "cylinders": Subject(CYLINDERS),
    "mecanum, rounded": Subject(ROUNDED),
}  # fmt: skip
STANDS = {"mecanum, two stand": Subject(trio(), two_stand())}
each = pytest.mark.parametrize("name", SUBJECTS)
each_and_standing = pytest.mark.parametrize("name", SUBJECTS | STANDS)


@each
@pytest.mark.parametrize(("model", "law"), MODELS_AND_LAWS)
def test_energy_changes_at_switches_alone(name, model, law):
    found = SUBJECTS[name].run(roller_model=model, switching=law, accuracy=1e-13)
    jumps, inside = found.switches.energy_jump, (found.switches.direction == 0).sum()
    assert (inside > 20) == (found.vehicle.roller_profile is not None) and len(jumps) - inside > 10
    assert found.stats["phase_energy_drift"] < 1e-13
    assert abs(found.energy[-1] - found.energy[0] - jumps.sum()) < 1e-13 * found.energy[0] * len(jumps)
    assert law == "smooth" or jumps.max() < 1e-14 * found.energy[0]
    if model == "free":
        assert not found.spins[:, ~omniroll.vehicles.checks.rollers_there(found.vehicle)].any()


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", ["mecanum", "two rows", "two kinds", "spheres"])
def test_drives_friction_slope_and_a_controller_keep_the_ledger(name, model):
    motor = Motor(3.0, torque_constant=0.02, resistance=1.0, gear_ratio=10.0, rotor_inertia=1e-7)
    controller = Controller((0.5, 0, 0.2), sample_time=0.01, proportional=0.05, integral=0.2, output="voltage")
    bearings = Bearings(wheel_viscous=1e-4, wheel_coulomb=1e-3, wheel_speed=0.1)
    found = SUBJECTS[name].run(roller_model=model, effects=(motor, controller, bearings, Slope(0.1)))
    assert abs(found.ledger.residual) < 1e-9 * found.ledger.scale
    assert {"drive_work", "axle_loss", "slope_work"} <= found.ledger.contributions.keys()


@each_and_standing
def test_a_session_goes_as_a_run_does(name):
    subject, steps, effects = (SUBJECTS | STANDS)[name], 5, [] if name in STANDS else [Torque(0.01 * np.eye(4)[0])]
    duration = 0.06 if name in STANDS else 0.5
    run = subject.run(duration, roller_model="free", effects=effects)
    session = omniroll.Session(subject.vehicle, roller_model="free", effects=effects, accuracy=1e-12, driven=False,
                               **subject.start)  # fmt: skip
    for _ in range(steps):
        session.step(duration / steps)
        there = run.sample(session.time)
        for field_name in ("nu", "pose", "spins"):
            np.testing.assert_allclose(getattr(session, field_name), getattr(there, field_name), rtol=1e-6, atol=1e-6)
        assert session.energy == pytest.approx(float(there.energy), rel=1e-7)
        assert (session.contact == there.contact).all()
        rates = run.measure([session.time], names=("wheel_rate",))["wheel_rate"][0]
        np.testing.assert_allclose(session.wheel_speeds, rates, atol=1e-5)


@each_and_standing
def test_numbers_survive_text_and_runs_files(name, tmp_path):
    subject = (SUBJECTS | STANDS)[name]
    again = Vehicle(**json.loads(json.dumps(subject.vehicle.as_dict())))
    assert again == subject.vehicle and hash(again) == hash(subject.vehicle)
    assert eval(repr(again), {"Vehicle": Vehicle}) == again
    run = subject.run(0.06, roller_model="free")
    for file in ("run.npz", "run.csv"):
        run.save(tmp_path / file)
        kept = omniroll.Trajectory.load(tmp_path / file)
        assert kept.vehicle == subject.vehicle and np.array_equal(kept.pivots, run.pivots)
        for field_name in ("spins", "energy", "pose"):
            np.testing.assert_array_equal(
                getattr(kept.sample([0.01, 0.05]), field_name), getattr(run.sample([0.01, 0.05]), field_name)
            )


@each_and_standing
def test_many_runs_end_where_one_does(name):
    subject = (SUBJECTS | STANDS)[name]
    options = subject.start | {"duration": 0.01 if name in STANDS else 0.3, "roller_model": "massless"}
    many, one = omniroll.simulate_many(subject.vehicle, **options), omniroll.simulate(subject.vehicle, **options)
    assert (one.pivots is not None and one.pivots[-1].any()) == (name in STANDS)
    np.testing.assert_array_equal(many.end.contact, one.contact[-1])
    np.testing.assert_array_equal(many.end.pose, one.pose[-1])
    assert many.end.energy == one.energy[-1]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", ["mecanum", "two rows", "two kinds"])
def test_a_linear_model_is_that_of_differences(name, model):
    """Of two rows the outer one; with the momenta of free rollers as they are."""
    vehicle, (nu, chi) = SUBJECTS[name].vehicle, (np.array([0.5, 0.8, 0.6]), np.array([0.1, -0.2, 0.05, 0.3]))
    found = omniroll.linearise(vehicle, roller_model=model, nu=nu, chi=chi, outputs=("wheel_rate",))
    first = np.zeros(4, int)
    bound = kernel_in_phase(kernel(vehicle, model, effects=("drive",)), Carry(first, first))
    momenta = ()
    if model == "free":
        momenta = (bound.momenta(bound.axial_speeds(nu, chi, np.zeros((4, vehicle.rollers_per_wheel - 1)))),)

    def rates(x):
        turning = bound.wheel_speeds(x[:3], x[3:7])
        return np.concatenate([bound.forward_dynamics(x[:3], x[3:7], *momenta, x[7:]), turning])

    x = np.concatenate([nu, chi, np.zeros(4)])
    np.testing.assert_allclose(found.rates[:7], rates(x), rtol=1e-12, atol=1e-14)
    slopes = np.array([(rates(x + step) - rates(x - step)) / 2e-6 for step in 1e-6 * np.eye(11)]).T
    size = np.abs(slopes).max()
    np.testing.assert_allclose(np.hstack([found.A[:7, :7], found.B[:7]]), slopes, rtol=1e-6, atol=1e-7 * size)
    np.testing.assert_allclose(found.C[:4, :7], found.A[3:7, :7], rtol=1e-12)


def in_kinds(vehicle):
    """The same with two kinds of wheels, of equal data."""
    same = {name: getattr(vehicle, name) for name in ("wheel_radius", "roller_axis_radius", "wheel_inertia")}
    kinds = {"a": {"roller_inertia": vehicle.roller_inertia}, "b": same}
    return vehicle.replace(kinds=kinds, wheel_kinds=["a", "b"] * 2)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("vehicle, same", [
    (PAPER, PAPER.replace(meridian_radius=PAPER.wheel_radius)), (PAPER, in_kinds(PAPER)),
    *((own, in_kinds(own)) for own in (PAPER.replace(roller_angle=0.5), ROWS)),
], ids=["round meridian", "kinds", "kinds of mecanum", "kinds in rows"])  # fmt: skip
def test_numbers_that_say_nothing_new_change_nothing(vehicle, same, model):
    effects = (Slope(0.2), Torque(0.002), Bearings(wheel_viscous=1e-4))
    plain, own = (Subject(one).run(0.5, roller_model=model, effects=effects) for one in (vehicle, same))
    np.testing.assert_allclose(own.pose[-1], plain.pose[-1], rtol=1e-10, atol=1e-11)
    assert len(own.switches.t) == len(plain.switches.t) > 10
    nu, chi = (3.0, -2.0, 2.5), np.array([0.1, -0.2, 0.05, 0.3])
    inputs = (np.full((4, 2), 1e-4),) if model == "free" else ()
    one, other = (kernel(v, model, "compiled").forward_dynamics(nu, chi, *inputs) for v in (vehicle, same))
    np.testing.assert_allclose(other, one, rtol=0, atol=1e-13 * np.abs(one).max())


SEVERAL = "wheels of several kinds|wheel_kinds = .*is not derived"
SLIPS, STICKS, RUBS = Contact(coefficient=30.0), Bearings(wheel_coulomb=1e-3), Bearings(roller_viscous=1e-6)


@pytest.mark.parametrize("name, options, words", [
    ("mecanum", {"effects": (RUBS,)}, "roller_angle = .*rollers' bearings"),
    ("mecanum", {"effects": (STICKS,)}, "roller_angle = .*axles' bearings, which sticks; give Bearings a wheel_speed"),
    ("mecanum", {"engine": "python"}, "engine = 'python'.*mecanum"),
    ("two rows", {"engine": "python"}, "two rows of rollers"),
    ("two rows", {"effects": (STICKS,)}, "two rows of rollers"),
    ("two rows", {"sensitivities": ("mass",)}, "two rows of rollers"),
    ("two kinds", {"engine": "python"}, SEVERAL),
    ("two kinds", {"effects": (SLIPS,)}, SEVERAL),
    ("two kinds", {"effects": (STICKS,)}, SEVERAL),
    ("two kinds", {"sensitivities": ("mass",)}, SEVERAL),
    ("a tracking wheel", {"effects": (RUBS,)}, "kind whose roller_inertia is 0"),
    ("spheres", {"effects": (SLIPS,)}, "meridian_radius = .*does not go with"),
    ("spheres", {"effects": (RUBS,)}, "meridian_radius = .*does not go with"),
    ("spheres", {"engine": "python"}, "does not go with a roller_profile or meridian_radius"),
    ("spheres", {"effects": (Weight(), Slope(0.1))}, "loads of level ground"),
    ("two rows", {"effects": (Weight(),)}, "two rows|wheels that stay round"),
])  # fmt: skip
def test_what_is_not_derived_is_refused_in_a_sentence(name, options, words):
    with pytest.raises(InvalidValueError, match=words):
        SUBJECTS[name].run(0.1, **options)


@pytest.mark.parametrize("vehicle, changes, words", [
    (usual(), {"wheel_inertia": 1e-6, "roller_inertia": 1e-6}, "wheel_inertia = .*sin"),
    (PAPER, {"meridian_radius": 0}, "positive"), (PAPER, {"meridian_radius": "round"}, "real number"),
    (PAPER, {"meridian_radius": 2.0}, "touch the ground|above the ground"),
])  # fmt: skip
def test_numbers_that_make_no_wheel(vehicle, changes, words):
    with pytest.raises(InvalidValueError, match=words):
        vehicle.replace(**changes)

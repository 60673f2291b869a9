"""Loads from springs: the platform heaves and tilts on its wheels, and contacts leave the ground and come back.

A box that tips does so as its closed form says; with stiffer and stiffer springs loads become those of rigid bodies;
the energy's account closes. test_all_bodies.py has the accelerations.
"""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import omniroll

GRAVITY = 9.80665
# A box on four contacts at (R, 0), (0, R), (-R, 0), (0, -R), without friction, which heaves and pitches
BOX = {"height": 0.3, "deflection": 2e-3, "damping_ratio": 0.1, "tilt_inertia": 0.2}


class Box:
    """Heave, pitch and their rates are linear in time in each set of contacts that press, and mode by mode exact."""

    def __init__(self, vehicle: omniroll.Vehicle):
        self.mass, self.reach = vehicle.mass, vehicle.platform_radius
        self.inertia = BOX["tilt_inertia"] - 2 * vehicle.wheel_inertia  # two wheels turn about the axis of the pitch
        self.places = self.reach * np.array([1.0, 0.0, -1.0, 0.0])
        self.load = self.mass * GRAVITY / 4
        self.stiffness = self.load / BOX["deflection"]
        self.damping = 2 * BOX["damping_ratio"] * self.load / np.sqrt(BOX["deflection"] * GRAVITY)
        rise = np.stack([np.ones(4), -self.places], axis=-1)
        self.margins = -np.concatenate([self.stiffness * rise, self.damping * rise], axis=1)  # beside the load at rest

    def system(self, presses: np.ndarray) -> np.ndarray:
        """(5, 5) of the state and a one behind it."""
        found = np.zeros((5, 5))
        found[:2, 2:4] = np.eye(2)
        lift = np.concatenate([self.margins, np.full((4, 1), self.load)], axis=1)[presses]
        found[2] = lift.sum(axis=0) / self.mass
        found[2, 4] -= GRAVITY
        found[3] = -self.places[presses] @ lift / self.inertia
        found[3, 1] += self.mass * GRAVITY * BOX["height"] / self.inertia
        return found

    def loads(self, state: np.ndarray) -> np.ndarray:
        return self.load + self.margins @ state[:4]

    def beyond(self, elapsed: float, system, state, presses, most_tilt: float, event=slice(None)) -> np.ndarray:
        """What is positive where a wheel lifts, comes down, or the box has tipped, so long after a state."""
        at = expm(system * elapsed) @ state
        return np.append(np.where(presses, -1, 1) * self.loads(at), abs(at[1]) - most_tilt)[event]

    def after(self, rate: float, duration: float, most_tilt: float) -> tuple[float, np.ndarray, int]:
        """The time, the state and the number of events, at the duration or where it has tipped."""
        state, time, events = np.array([0, 0, 0, rate, 1.0]), 0.0, 0
        presses = self.loads(state) > 0
        while time < duration:
            system = self.system(presses)
            step = min(1e-4, duration - time)
            at_ends = [self.beyond(elapsed, system, state, presses, most_tilt) for elapsed in (0.0, step)]
            first = np.flatnonzero((at_ends[1] > 0) & (at_ends[0] < 1e-9))
            for event in first:
                given = (system, state, presses, most_tilt, event)
                step = min(step, brentq(self.beyond, 0.0, step, args=given, xtol=1e-15))
            state, time = expm(system * step) @ state, time + step
            tips = first.size and abs(state[1]) > most_tilt - 1e-12
            if tips:
                return time, state, events
            if first.size:
                presses = np.where(np.abs(self.loads(state)) < 1e-7, ~presses, presses)
                events += 1
        return time, state, events


def box_run(rate: float, duration: float, most_tilt: float = 0.2, law: str = "regularised"):
    vehicle = omniroll.Vehicle.paper(4, 5)
    springs = omniroll.Springs(**BOX, normal_gravity=GRAVITY, tilt_rate=(0, 0, rate), most_tilt=most_tilt)
    ground = omniroll.Contact(law=law, friction=1e-12, speed=1.0 if law == "regularised" else None)
    return vehicle, lambda: omniroll.simulate(
        vehicle, nu=(0, 0, 0), duration=duration, roller_model="massless", effects=[ground, springs], accuracy=1e-11,
    )  # fmt: skip


def test_a_wheel_lifts_and_comes_back_as_the_closed_form_says():
    vehicle, run = box_run(0.8, 0.3)
    found = run()
    _, state, events = Box(vehicle).after(0.8, 0.3, 0.2)
    assert events >= 4
    last = np.array([*found.quantity("tilt")[-1, [0, 2]], *found.quantity("tilt_rate")[-1, [0, 2]]])
    assert np.abs(last - state[:4]).max() < 1e-8
    assert (~found.presses).any() and found.presses[-1].any()
    assert found.ground_load.min() > -1e-9


@pytest.mark.parametrize("law", ["regularised", "coulomb"])
def test_a_box_tips_when_the_closed_form_says(law):
    vehicle, run = box_run(6.0, 1.0, most_tilt=0.15, law=law)
    time, state, _ = Box(vehicle).after(6.0, 1.0, 0.15)
    with pytest.raises(omniroll.SimulationStopped, match="tips") as stopped:
        run()
    assert abs(stopped.value.t - time) < 1e-8
    assert abs(stopped.value.trajectory.quantity("tilt")[-1, 2] - state[1]) < 1e-8


def turning_run(deflection: float):
    """A vehicle that turns as it goes: the ground holds it on its way, and loads move outwards. Nothing jumps."""
    ground = omniroll.Contact(law="regularised", friction=0.5, speed=0.05)
    springs = omniroll.Springs(height=0.06, deflection=deflection, damping_ratio=0.7)
    return omniroll.simulate(
        omniroll.Vehicle.paper(), nu=(3, 1, 6), duration=0.2, roller_model="massless", effects=[ground, springs],
        accuracy=1e-9,
    )  # fmt: skip


def orders_of_loads(run_of, height):
    """With which power of the springs' deflection loads at the end tend to those of rigid bodies."""
    distances = []
    for deflection in (1e-3, 1e-4, 1e-5, 1e-6):
        run = run_of(deflection)
        rigid = omniroll.reactions(run, height=height).load[-1]
        assert np.ptp(rigid) > 0.1
        distances.append(np.abs(run.ground_load[-1] - rigid).max())
    return -np.diff(np.log10(distances))


def test_loads_tend_to_those_of_rigid_bodies_at_first_order():
    orders = orders_of_loads(turning_run, 0.06)
    assert np.abs(orders - 1).max() < 0.05
    assert abs(orders[-1] - 1) < 0.01


BRAKE = omniroll.Motor(0.0, torque_constant=0.05, resistance=0.4, gear_ratio=2.0)


def braking_run(ground, deflection: float, duration: float, roller_model: str = "massless", along=(0.0, 1.0)):
    """A vehicle of four wheels that is braked from 0.8 m/s, sideways unless said."""
    vehicle = omniroll.Vehicle.paper(4, 5)
    springs = omniroll.Springs(height=0.08, deflection=deflection, damping_ratio=0.7)
    nu = 0.8 / vehicle.platform_radius * np.array([*along, 0.0])
    return omniroll.simulate(
        vehicle, nu=tuple(nu), duration=duration, roller_model=roller_model, effects=[ground, springs, BRAKE],
        accuracy=1e-9, control=False,
    )  # fmt: skip


@pytest.mark.parametrize("along", [(1.0, 0.0), (0.0, 1.0)])
def test_loads_of_a_braking_vehicle_whose_contacts_stick_tend_to_those_of_rigid_bodies(along):
    def run_of(deflection):
        run = braking_run(omniroll.Contact(law="coulomb", friction=1.0), deflection, 0.15, along=along)
        assert run.sticks[-1].all()
        return run

    orders = orders_of_loads(run_of, 0.08)
    assert np.abs(orders[1:] - 1).max() < 0.05


def test_the_account_of_contacts_that_stick_on_springs_closes():
    for roller_model in ("massless", "free"):
        run = braking_run(omniroll.Contact(law="coulomb", friction=0.2), 1e-3, 0.12, roller_model)
        assert abs(run.ledger.residual) < 1e-8 * run.ledger.scale
        assert run.ledger.contributions["damper_loss"] < 0 and run.ledger.contributions["ground_loss"] < 0


def test_the_account_closes_with_what_springs_store_and_dampers_take():
    _, run = box_run(0.8, 0.3)
    for found in (run(), turning_run(1e-3)):
        ledger = found.ledger
        assert abs(ledger.residual) < 1e-8 * ledger.scale
        assert ledger.contributions["damper_loss"] < 0
        assert (np.diff(found.contributions()["damper_loss"]) < 1e-12).all()


@pytest.mark.parametrize("law", ["regularised", "coulomb"])
def test_an_accelerometer_feels_the_tilt(law):
    """Of a place that sways: differences of where it is, and the weight along the axes that the platform has there."""
    place, height = np.array([0.03, -0.02]), 0.12
    fading = {"speed": 0.02} if law == "regularised" else {}
    run = omniroll.simulate(
        omniroll.Vehicle.paper(), nu=(0.5, 0.2, 1.0), duration=0.3, accuracy=1e-10,
        effects=[
            omniroll.Torque((0.3, -0.3, 0.05)), omniroll.Springs(height=0.05, deflection=5e-3),
            omniroll.Contact(law=law, friction=0.4, wheel_rates=0, contact_spins=0, **fading),
        ],
    )  # fmt: skip
    vector = run.effects.state_vector(run.effects.kernel(run.vehicle, "free", "python"))

    def along(vectors, heading):
        cosine, sine = np.cos(heading), np.sin(heading)
        x, y = vectors.T
        return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)

    def there(times):
        """Where the place is in the plane, the heading and the tilt; and the rows before the times."""
        y, rows = run.state_and_row(times)
        pose, tilt = vector.view(y, "pose"), vector.view(y, "tilt")
        aside = place + height * np.stack([tilt[:, 2], -tilt[:, 1]], axis=-1)
        return pose[:, :2] + along(aside, pose[:, 2]), pose[:, 2], tilt, rows

    step, times = 2e-5, np.array([0.011, 0.043, 0.087, 0.135, 0.211, 0.262])
    (before, _, _, first), (now, heading, tilt, _), (after, _, _, last) = (
        there(times + way) for way in (-step, 0.0, step)
    )
    assert np.array_equal(first, last), "no event lies between"
    moving = along((before - 2 * now + after) / step**2, -heading)
    weight = 9.80665 * np.stack([-tilt[:, 2], tilt[:, 1]], axis=-1)
    read = run.measure(times, omniroll.Instruments(place=place, place_height=height))["accelerometer"]
    assert np.abs(read - moving - weight).max() < 1e-4 * np.abs(read).max()
    assert np.abs(weight).max() > 0.02 * np.abs(read).max()
    lower = run.measure(times, omniroll.Instruments(place=place))["accelerometer"]
    assert np.abs(lower - read).max() > 1e-2 * np.abs(read).max()

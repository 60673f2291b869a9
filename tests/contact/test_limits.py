"""Limits of friction on the ground: a strong one is rolling, light rollers are massless ones; any number of wheels."""

from dataclasses import replace

import numpy as np
import pytest

from omniroll import Bearings, Contact, Vehicle, simulate
from omniroll.kernels.kernel import kernel
from omniroll.results.comparison import distance_at

PAPER, CROSS = Vehicle.paper(), Vehicle.paper(4, 4)
# Five switches in a second, the closest of them 0.06 s apart; the slowest layer of slip at 100 N s/m lasts 2 ms.
START = {"nu": (1.7, 0.1, 0.0), "chi": (-0.09, 0.2, -0.05)}
COEFFICIENTS = np.array([1e2, 1e4, 1e6])


def test_rolling_with_impact_is_the_limit_of_a_strong_ground():
    """The distance falls as 1/coefficient; that to the law smooth does not fall. Broken where the switch jumps."""
    rolling = {
        law: simulate(PAPER, **START, duration=1.0, switching=law, accuracy=1e-12, control=False)
        for law in ("impact", "smooth")
    }
    switches = rolling["impact"].switches.t
    times = np.append((switches[1:] + switches[:-1]) / 2, 1.0)
    assert len(switches) >= 5 and np.diff(switches).min() > 0.05
    runs = [simulate(PAPER, **START, duration=1.0, accuracy=1e-10, effects=[Contact(c)], control=False)
            for c in COEFFICIENTS]  # fmt: skip
    distances = {law: np.array([distance_at(run, other, times) for run in runs]) for law, other in rolling.items()}
    slope, _ = np.polyfit(np.log10(COEFFICIENTS), np.log10(distances["impact"]), 1)
    assert slope == pytest.approx(-1.0, abs=0.02)
    assert distances["impact"][-1] < 1e-6 and distances["smooth"].min() > 0.02
    assert_forces_are_those_of_rolling(runs[-1])


def assert_forces_are_those_of_rolling(run):
    """At the end, long after a switch: coefficient times slip is the reaction of rolling in that state."""
    bound = kernel(PAPER, "free", "python", effects=("reactions",))
    nu, chi = run.nu[-1], run.chi[-1]
    momenta = bound.momenta(bound.axial_speeds(nu, chi, run.spins[-1]))
    wanted = bound.call("contact_forces", nu, chi, momenta, bound.forward_dynamics(nu, chi, momenta))
    assert run.ground_force[-1] == pytest.approx(wanted, rel=1e-4, abs=1e-4 * np.abs(wanted).max())


def test_free_rollers_tend_to_massless_ones_as_their_inertia_goes_to_zero():
    """At first order of their inertia, of a vehicle whose contacts all slip and whose rollers begin to turn."""
    end, ground = 0.03, Contact(law="coulomb", friction=0.4, wheel_rates=0)
    effects = [ground, Bearings(roller_coulomb=0.04, wheel_coulomb=30.0)]
    options = {"nu": (1.0 / CROSS.platform_radius, 0.8 / CROSS.platform_radius, 3.0), "duration": end, "control": False}
    limit = simulate(CROSS, effects=effects, accuracy=1e-10, roller_model="massless", **options)
    assert (np.abs(limit.contact_spin[-1]) > 1).any() and not limit.sticks[-1].all()
    times = np.linspace(0, end, 11)

    def distance(inertia):
        from_disks = [replace(ground, contact_spins=0.0), *effects[1:]]  # where massless ones begin
        vehicle = replace(CROSS, roller_inertia=inertia)
        own = options | {"accuracy": 1e-9, "roller_model": "free"}
        run = simulate(vehicle, effects=from_disks, **own)
        return distance_at(run, limit, times)

    far, near = distance(1e-6), distance(1e-7)
    assert far < 1e-2
    assert 0.9 <= np.log10(far / near) <= 1.1


@pytest.mark.long
@pytest.mark.parametrize("wheels, rollers", [(1, 5), (2, 4), (5, 7)])
def test_any_number_of_wheels(wheels, rollers):
    """In other numbers than those whose loops are unrolled; a viscous ground asks for no loads."""
    task = {"nu": (2, -1, 1), "duration": 0.5, "effects": [Contact(20)], "control": False}
    fine, coarse = (simulate(Vehicle.paper(wheels, rollers), **task, accuracy=a) for a in (1e-11, 1e-8))
    assert len(fine.switches) >= 1 and distance_at(fine, coarse, np.linspace(0, 0.5, 5)) < 1e-8

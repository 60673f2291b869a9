"""What a switch does to the speeds, against the projection as it is written and the paper's smooth map."""

import numpy as np
import pytest
from flint import ctx
from oracle import PRECISION, lagrange, switch
from oracle.bridge import row_speeds, simulated, switch_rows
from oracle.states import ordinary_vehicle, random_state, time_for_switches

LAWS = {"smooth": switch.smooth, "impact": switch.impact_literal}


@pytest.fixture(autouse=True)
def sixty_digits():
    with ctx.workprec(PRECISION):
        yield


def run(vehicle, nu, chi, spins, model, law, switches):
    duration = time_for_switches(vehicle, nu, switches)
    return simulated(vehicle, nu, chi, spins, model, law, pose=(0.1, 0.2, 0.6), accuracy=1e-9, duration=duration)


def check_rows(vehicle, trajectory, before, after, moves, model, law):
    """The row after a switch is the law's image of the row before it; what the law leaves alone stays."""
    theta, chi, dq = row_speeds(vehicle, trajectory, before, model)
    chi, dq = switch.relabel(vehicle, chi, dq, moves)
    wanted = LAWS[law](vehicle, theta, chi, dq, model=model)
    _, chi_found, found = row_speeds(vehicle, trajectory, after, model)
    for i in range(vehicle.wheels):
        assert abs(float(chi[i] - chi_found[i])) <= 4e-16
    scale = max(abs(float(v)) for v in wanted.flat())
    gaps = [abs(float(a - b)) for a, b in zip(found.flat(), wanted.flat(), strict=True)]
    assert max(gaps) <= 1e-13 * scale
    assert np.array_equal(trajectory.pose[before], trajectory.pose[after])
    energy = lambda speeds: float(  # noqa: E731
        lagrange.kinetic_energy(vehicle, theta, chi_found, speeds, model="free" if model == "locked" else model)
    )
    if law == "impact":
        lost = lagrange.Speeds.unflat(vehicle, [a - b for a, b in zip(dq.flat(), wanted.flat(), strict=True)])
        drop = trajectory.energy[before] - trajectory.energy[after]
        assert drop == pytest.approx(energy(lost), rel=1e-6, abs=1e-13 * trajectory.energy[before])  # Carnot


@pytest.mark.parametrize("law", list(LAWS))
@pytest.mark.parametrize("model", ["massless", "locked", "free"])
@pytest.mark.parametrize("wheels, rollers", [(2, 3), (3, 5), (4, 9)])
def test_single_switches(wheels, rollers, model, law):
    rng = np.random.default_rng([1, wheels, rollers])
    vehicle = ordinary_vehicle(rng, wheels, rollers)
    trajectory = run(vehicle, *random_state(rng, vehicle, filled=0.9), model, law, 10)
    found = switch_rows(trajectory)
    assert len(found) >= 4
    for before, after, moves in found:
        check_rows(vehicle, trajectory, before, after, moves, model, law)


@pytest.mark.parametrize("law", list(LAWS))
@pytest.mark.parametrize("model", ["locked", "free"])
def test_joint_switches(model, law):
    """The same turning speed and angle on all wheels: they switch together, at first by symmetry."""
    rng = np.random.default_rng(2)
    vehicle = ordinary_vehicle(rng, 4, 6).with_(wheel_angles=tuple(float(a) for a in np.pi / 2 * np.arange(4)))
    spins = np.tile(rng.normal(size=5), (4, 1))
    trajectory = run(vehicle, np.array([0.0, 0.0, 3.0]), np.full(4, 0.1), spins, model, law, 12)
    found = switch_rows(trajectory)
    assert found and len(found[0][2]) == 4
    for before, after, moves in found:
        check_rows(vehicle, trajectory, before, after, moves, model, law)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("model", ["locked", "free"])
def test_start_at_the_joint(model, direction):
    """A wheel that starts at its joint and moves outwards switches before anything else."""
    rng = np.random.default_rng(3)
    vehicle = ordinary_vehicle(rng, 3, 5)
    _, _, spins = random_state(rng, vehicle)
    nu = np.array([0.2, 0.1, -3.0 * direction])
    chi = np.array([0.1, direction * np.pi / 5, -0.2])
    trajectory = run(vehicle, nu, chi, spins, model, "impact", 2)
    before, after, moves = switch_rows(trajectory)[0]
    assert trajectory.t[before] == 0 and moves == {1: direction}
    check_rows(vehicle, trajectory, before, after, moves, model, "impact")
    assert trajectory.chi[after][1] == -direction * np.pi / 5

"""Energy: (3.2) in every row, constant between switches, and never rising under the impact law."""

import numpy as np
import pytest
from oracle.bridge import phases, simulated, switch_rows, switch_table
from oracle.lagrange import MODELS
from oracle.states import ordinary_vehicle, random_state, time_for_switches


def run(rng, wheels, rollers, model, law, accuracy, switches, engine="compiled"):
    vehicle = ordinary_vehicle(rng, wheels, rollers)
    nu, chi, spins = random_state(rng, vehicle, filled=0.9)
    duration = time_for_switches(vehicle, nu, switches)
    return simulated(vehicle, nu, chi, spins, model, law, duration=duration, accuracy=accuracy, engine=engine)


@pytest.mark.long
@pytest.mark.parametrize("engine", ["compiled", "python"])
@pytest.mark.parametrize("law", ["smooth", "impact"])
@pytest.mark.parametrize("model", MODELS)
def test_energy_is_constant_between_switches(model, law, engine):
    for seed, (wheels, rollers) in enumerate([(2, 3), (3, 5), (4, 12)]):
        rng = np.random.default_rng([1, seed])
        trajectory = run(rng, wheels, rollers, model, law, 1e-13, 6, engine)
        assert len(switch_table(trajectory)) >= 2
        for rows in phases(trajectory):
            energy = trajectory.energy[rows]
            assert np.ptp(energy) <= 1e-12 * energy[0]


@pytest.mark.parametrize("model", MODELS)
def test_impact_never_adds_energy(model):
    """Over many switches; the reported jumps are those between the rows."""
    for seed, (wheels, rollers) in enumerate([(2, 3), (3, 5), (4, 8), (6, 20)]):
        trajectory = run(np.random.default_rng([3, seed]), wheels, rollers, model, "impact", 1e-8, 40)
        energy = np.asarray(trajectory.energy)
        assert np.all(np.diff(energy) <= 1e-7 * energy[0])  # between rows of one phase: the accuracy
        jumps = np.array([jump for *_, jump in switch_table(trajectory)])
        assert len(jumps) >= 5
        if model == "massless":
            assert np.all(np.abs(jumps) <= 1e-15 * energy[0])
        else:
            assert np.all(jumps <= 1e-15 * energy[0]) and np.all(jumps < 0)
        between = sum(energy[after] - energy[before] for before, after, _ in switch_rows(trajectory))
        assert abs(between - jumps.sum()) <= 1e-13 * energy[0]


def test_smooth_law_moves_energy_both_ways():
    """The paper's law does not keep the energy of locked rollers: some switches raise it, some lower it."""
    rng = np.random.default_rng(4)
    trajectory = run(rng, 3, 5, "locked", "smooth", 1e-8, 30)
    jumps = np.array([jump for *_, jump in switch_table(trajectory)])
    assert jumps.max() > 1e-6 * trajectory.energy[0] and jumps.min() < -1e-6 * trajectory.energy[0]

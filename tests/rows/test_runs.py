"""Runs on two rows of rollers: switches, wheels that stand on their joint, what goes with them and what does not."""

from dataclasses import replace

import numpy as np
import pytest
from mecanum.all_bodies import after_impact, mass_matrix
from mecanum.vehicles import coordinates, drawn, free_places, platform_rates, rolling_rates

import omniroll
from rows import reversals

DURATION = 2.0
SEEDS = (41, 44, 47, 48)  # in which wheels stand


def free_run(seed, model, **options):
    """Bodies with two rows and their run, in which wheels reverse while the vehicle turns."""
    bodies, vehicle, *_ = drawn("rows", seed, 3 + seed % 2, 6, model)
    run = omniroll.simulate(
        vehicle, nu=(1.2, -0.8, 1.5 * vehicle.yaw_scale), chi=0.3 * np.pi / bodies.rollers, duration=DURATION,
        roller_model=model, **{"control": False, "accuracy": 1e-10} | options,
    )  # fmt: skip
    return bodies, run


def bodies_in(bodies, run, row):
    """The bodies in a row of a run, the rates of all coordinates, and which wheels stand."""
    here, stands = replace(bodies, contact=run.contact[row]), np.flatnonzero(run.pivots[row])
    spins = np.zeros((bodies.wheels, bodies.rollers - 1)) if run.spins is None else run.spins[row]
    return here, rolling_rates(here, run.vehicle, run.nu[row], run.chi[row], spins, stands), stands


@pytest.mark.parametrize("model", reversals.MODELS)
def test_every_change_is_the_impact_of_all_bodies(model):
    """Wheels that pass on, that stop and that go on, as they come in runs."""
    seen = set()
    for seed in SEEDS:
        bodies, run = free_run(seed, model)
        for row in np.flatnonzero(np.diff(run.elapsed) == 0):
            _, before, _ = bodies_in(bodies, run, row)
            here, _, stands = bodies_in(bodies, run, row + 1)
            for wheel in range(bodies.wheels):  # the roller that comes is roller 0 now
                places = [bodies.place(wheel, j) for j in range(bodies.rollers)]
                before[places] = np.roll(before[places], run.contact[row, wheel] - run.contact[row + 1, wheel])
            q = coordinates(here, run.chi[row + 1])
            wanted = after_impact(here, q, before, [] if model == "free" else free_places(here), stands)
            size, mass = np.abs(run.nu[row]).max(), mass_matrix(here, q).real
            found = platform_rates(run.vehicle, run.nu[row + 1])
            assert np.abs(wanted[:3] - found).max() < 1e-10 * size
            energy, left, lost = (rates @ mass @ rates / 2 for rates in (before, wanted, before - wanted))
            assert abs(energy - left - lost) < 1e-12 * energy
            assert abs(run.energy[row] - run.energy[row + 1] - lost) < 1e-11 * energy
            seen |= set((run.pivots[row + 1] - run.pivots[row]).tolist())
    assert seen == {-1, 0, 1}


@pytest.mark.parametrize("model", reversals.MODELS)
def test_a_wheel_stands_while_both_rows_push_it_back(model):
    """By the velocity of its middle: from where its roller brings it to the joint to where a row lets it go."""
    stood, let_go = 0, 0
    for seed in SEEDS:
        bodies, run = free_run(seed, model)
        vehicle, places = run.vehicle, bodies.places
        across = np.stack([-np.sin(bodies.axles), np.cos(bodies.axles)], axis=-1)
        yaw = run.nu[:, 2:] / vehicle.yaw_scale
        moved = np.stack([vehicle.platform_radius * run.nu[:, :1] - yaw * places[:, 1],
                          vehicle.platform_radius * run.nu[:, 1:2] + yaw * places[:, 0]], axis=-1)  # fmt: skip
        ratio = (moved * across).sum(axis=-1) / (vehicle.row_offset * yaw)
        stands = run.pivots > 0
        for row in (run.step_rows, run.step_rows + 1):  # others are between two changes at one instant
            assert (np.abs(ratio[row][stands[run.step_rows]]) < 1 + 1e-8).all()
        assert (np.abs(run.chi[stands]) == np.pi / bodies.rollers).all()
        changes = run.step_rows[:-1] + 1
        changes = changes[(np.diff(run.contact + 99 * stands, axis=0)[changes] != 0).sum(axis=1) == 1]
        ends = stands[changes] & ~stands[changes + 1]  # of one wheel alone, at the end of a step
        assert np.abs(np.abs(ratio[changes][ends]) - 1).max(initial=0) < 1e-8
        let_go += ends.sum()
        stood += run.times_on_joints().sum()
    assert stood > 0.05
    assert let_go


def test_controllers_know_the_middle_of_the_wheels():
    """Their targets of the wheels are those of a vehicle with one row; what they measure is what the wheels do."""
    vehicle = omniroll.Vehicle.paper(rollers_per_wheel=12).replace(yaw_scale=1.0)
    vehicle = vehicle.replace(rows=2, row_offset=0.2 * vehicle.wheel_radius)
    seen = []

    def controller(time, state):
        seen.append(state.wheel_speeds.copy())
        return 0.05 * (wanted - state.wheel_speeds)

    target = (0.5, 0.0, 0.6)
    wanted = omniroll.simulate(vehicle.replace(rows=1, row_offset=0), nu=target, duration=0).kernel.wheel_speeds(target)
    mine = omniroll.FunctionController(controller, 0.01)
    given = omniroll.Controller(target=target, proportional=0.05, integral=0.0, sample_time=0.01)
    runs = [omniroll.simulate(vehicle, nu=(0, 0, 0.1), duration=1.0, effects=(one,), control=False)
            for one in (mine, given)]  # fmt: skip
    np.testing.assert_allclose(runs[0].nu[-1], runs[1].nu[-1], atol=1e-8)
    np.testing.assert_allclose(runs[0].nu[-1], target, atol=0.1)
    assert len(seen) > 90

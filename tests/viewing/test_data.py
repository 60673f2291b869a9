"""What stands on the page is the run: poses, places and spins of rollers, forces, energies."""

import numpy as np
import pytest

import omniroll
from omniroll.vehicles.state import by_roller
from viewing.runs import RUNS, layout, locked, slipping, soccer_kit, times
from viewing.unpacking import Pieces, unpacked

NEAR = 3e-8  # rad, and R: what rounds off on the way is small against the 1e-6 that is promised


def arrays_of(run: omniroll.Trajectory, **options) -> dict[str, np.ndarray]:
    _, arrays = unpacked(omniroll.view(run, **options).html)
    return {name.removeprefix("0/"): array for name, array in arrays.items()}


def angles(chi: np.ndarray, contact: np.ndarray, rollers: int) -> np.ndarray:
    """(N, n) angles of all rollers from straight down."""
    return chi[:, None] + 2 * np.pi * (np.arange(rollers) - contact[:, None]) / rollers


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """The largest distance of angles."""
    return float(np.abs((one - other + np.pi) % (2 * np.pi) - np.pi).max())


@pytest.fixture(params=RUNS)
def run(request):
    return RUNS[request.param]()


def test_poses_speeds_and_places_of_rollers_are_those_of_the_run(run):
    pieces, wheels, rollers = Pieces(arrays_of(run)), run.vehicle.wheels, run.vehicle.rollers_per_wheel
    radius = run.vehicle.platform_radius
    for elapsed in times(run, 60):
        piece, _, columns = pieces.at(elapsed)
        sample = run.sample(run.start_time + elapsed)
        contact = pieces.arrays["contact"][piece]
        assert np.abs(columns[:2] - sample.pose[:2] / radius).max() < NEAR
        assert abs(columns[2] - sample.pose[2]) < NEAR
        here = angles(columns[6 : 6 + wheels], contact, rollers)
        assert apart(here, angles(sample.chi, sample.contact, rollers)) < NEAR
        if (contact == sample.contact).all():  # speeds jump at a switch
            assert np.abs(columns[3:6] - sample.nu).max() < 3e-5 * np.abs(run.nu).max()


def test_the_page_knows_every_switch(run):
    arrays = arrays_of(run)
    assert len(arrays["switch_time"]) == len(run.switches)
    np.testing.assert_allclose(run.start_time + arrays["switch_time"], run.switches.t, rtol=0, atol=1e-12)
    assert sorted(arrays["switch_wheel"]) == sorted(run.switches.wheel)
    assert set(arrays["switch_time"]) <= set(arrays["start"])  # a jump to a switch lands on the piece after it


@pytest.mark.parametrize("run_of, tolerance", [(lambda: soccer_kit(3.0), 1e-4), (layout, 3e-2)])
def test_spins_of_free_rollers_follow_from_their_axial_speeds(run_of, tolerance):
    """Axial speeds are linear in a piece: exactly so without friction in the rollers' axles, roughly with it."""
    run = run_of()
    arrays = arrays_of(run)
    pieces, vehicle = Pieces(arrays), run.vehicle
    for elapsed in times(run, 30):
        piece, x, columns = pieces.at(elapsed)
        sample = run.sample(run.start_time + elapsed)
        contact = arrays["contact"][piece]
        if (contact != sample.contact).any():
            continue
        first, last = np.moveaxis(arrays["axial"][..., piece], 2, 0)
        chi = columns[6 : 6 + vehicle.wheels]
        inclined = np.sin(angles(chi, contact, vehicle.rollers_per_wheel))
        spins = first + (last - first) * x - columns[5] / vehicle.yaw_scale * inclined
        truth = by_roller(np.concatenate([sample.contact_spin[:, None], sample.spins], axis=1), sample.contact)
        off_ground = np.arange(vehicle.rollers_per_wheel) != contact[:, None]
        assert np.abs(spins - truth)[off_ground].max() < tolerance * np.abs(truth).max()


def test_the_roller_in_contact_turns_as_it_does_in_the_run(run):
    """The angle that it has turned since the start of the piece, against Gauss's rule for its spin."""
    pieces, wheels = Pieces(arrays_of(run)), run.vehicle.wheels
    nodes, weights = np.polynomial.legendre.leggauss(20)
    for elapsed in times(run, 20):
        piece, _, columns = pieces.at(elapsed)
        start = pieces.arrays["start"][piece]
        inside = run.start_time + start + (elapsed - start) * (nodes + 1) / 2
        if elapsed - start < 1e-6:
            continue
        turned = (elapsed - start) / 2 * weights @ run.sample(inside).contact_spin
        assert np.abs(columns[6 + wheels :] - turned).max() < 2e-3


def test_energies_are_those_of_the_run():
    run = layout()
    description, _ = unpacked(omniroll.view(run).html)
    arrays = arrays_of(run)
    account = run.ledger
    entries = dict(zip(description["runs"][0]["ledger_words"], arrays["ledger"][:, -1], strict=True))
    assert entries.keys() == account.contributions.keys()
    for name, value in account.contributions.items():
        assert abs(entries[name] - value) < 1e-6 * account.scale
    assert abs(arrays["energy"][-1] - account.end) < 1e-6 * account.scale
    assert arrays["energy_time"][-1] == pytest.approx(run.elapsed[-1])


def test_forces_stand_at_both_ends_of_each_piece():
    run = soccer_kit(3.0)
    reactions = omniroll.reactions(run, height=0.04)
    forces = arrays_of(run, reactions=reactions)["forces"]
    first, last = run.step_rows, run.step_rows + 1
    for rows, there in zip((first, last), forces[:, :-1], strict=True):
        np.testing.assert_allclose(there[..., :2], reactions.contact_force[rows], rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(there[..., 2], reactions.load[rows], rtol=1e-6)
    assert "forces" not in arrays_of(run) and "slip" not in arrays_of(run)


def test_loads_and_tilt_of_a_vehicle_on_springs_stand_at_both_ends_of_each_piece():
    ground = omniroll.Contact(law="regularised", friction=0.3, speed=0.1)
    run = omniroll.simulate(
        omniroll.Vehicle.paper(), nu=(2, 1, 0), duration=0.05, roller_model="massless",
        effects=[ground, omniroll.Springs(height=0.06, deflection=1e-3)],
    )  # fmt: skip
    arrays = arrays_of(run)
    for k, rows in enumerate((run.step_rows, run.step_rows + 1)):
        np.testing.assert_allclose(arrays["tilt"][k, :-1], run.quantity("tilt")[rows], rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(arrays["forces"][k, :-1, :, 2], run.ground_load[rows], rtol=1e-6)
    assert "tilt" not in arrays_of(locked())


def test_slip_and_the_forces_against_it_stand_at_both_ends_of_each_piece():
    run = slipping()
    arrays = arrays_of(run)
    for k, rows in enumerate((run.step_rows, run.step_rows + 1)):
        np.testing.assert_allclose(arrays["slip"][k, :-1], run.slip[rows], rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(arrays["forces"][k, :-1, :, :2], run.ground_force[rows], rtol=1e-6, atol=1e-12)
    assert not arrays["forces"][..., 2].any(), "no loads are known"

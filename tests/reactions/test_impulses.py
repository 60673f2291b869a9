"""Impulses at the contacts against the oracle's balance of momentum in all coordinates."""

import numpy as np
import pytest
from flint import arb_mat
from oracle.balls import arb, working_precision
from oracle.bridge import oracle_vehicle, row_speeds, switch_rows
from oracle.switch import Balance, relabel

import omniroll
from omniroll.errors import InvalidValueError

PAPER = omniroll.Vehicle.paper()


@working_precision
def by_balance(vehicle, run, before, moves):
    """(N, 2) impulses along axles and rolling directions: the oracle's multipliers, turned from the fixed axes."""
    theta, chi, dq = row_speeds(vehicle, run, before, run.roller_model)
    chi, dq = relabel(vehicle, chi, dq, moves)
    balance = Balance(vehicle, theta, chi, dq, run.roller_model)
    keys = balance.keys()
    matrix = arb_mat([[balance.rows[a].get(b, arb(0)) for b in keys] for a in keys])
    solved = matrix.solve(arb_mat([[balance.right.get(key, arb(0))] for key in keys]))
    found = {key: solved[k, 0] for k, key in enumerate(keys)}
    rows = []
    for i in range(vehicle.wheels):
        heading = theta + vehicle.axle_angle(i)
        x, y = (found["impulse", i, k] for k in (0, 1))
        rows.append((float(x * heading.cos() + y * heading.sin()), float(y * heading.cos() - x * heading.sin())))
    return np.array(rows)


@pytest.mark.parametrize("model", ["locked", "free"])
@pytest.mark.parametrize("nu", [(1.0, 0.3, 0.8), (1.0, 0.0, 0.0)])
def test_impulses_agree_with_the_balance_of_momentum(model, nu):
    """The second motion switches two wheels at one instant."""
    run = omniroll.simulate(PAPER, nu=nu, duration=4, roller_model=model)
    found, switches = omniroll.impulses(run), switch_rows(run)
    assert found.row.tolist() == [after for _, after, _ in switches] and len(switches) > 5
    vehicle, scale = oracle_vehicle(PAPER), np.abs(found.contact).max()
    for impulse, (before, _, moves) in zip(found.contact, switches, strict=True):
        wanted = by_balance(vehicle, run, before, moves)
        assert impulse == pytest.approx(wanted, rel=1e-9, abs=1e-11 * scale)
    assert any(len(moves) > 1 for _, _, moves in switches) == (nu[2] == 0)


def test_massless_rollers_have_no_impulses():
    run = omniroll.simulate(PAPER, nu=(1, 0, 1), duration=2, roller_model="massless")
    found = omniroll.impulses(run)
    assert len(found.t) == len(run.switches) and not found.contact.any()
    assert not found.contact.flags.writeable


def test_a_run_without_switches_has_none():
    assert omniroll.impulses(omniroll.simulate(PAPER, nu=(0, 0, 0), duration=1)).contact.shape == (0, 3, 2)


def test_the_smooth_law_is_refused():
    run = omniroll.simulate(PAPER, nu=(1, 0, 1), duration=1, switching="smooth")
    with pytest.raises(InvalidValueError, match="this law has no impulses"):
        omniroll.impulses(run)
    with pytest.raises(InvalidValueError, match="must be a Trajectory"):
        omniroll.impulses(3)

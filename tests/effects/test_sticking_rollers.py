"""Rollers that stick in their bearings: what reactions and instruments have of it.

The accelerations under given torques of bearings are held to bodies in test_effect_kernels.py, the laws to every row of
the corpus, and the motion to Moreau's scheme in contact/test_time_stepping.py.
"""

import numpy as np
import pytest

from omniroll import Bearings, Instruments, Torque, Vehicle, reactions, simulate
from omniroll.results.accelerations import torques_of_free_rollers, with_accelerations
from omniroll.results.reactions import modes_of_free_rollers

PAPER = Vehicle.paper()
TASK = {"accuracy": 1e-9, "control": False}


@pytest.mark.long
@pytest.mark.parametrize("model", ["massless", "locked", "free"])
def test_reactions_and_instruments_have_what_the_rollers_bearings_take(model):
    """Those of the regularised law tend to them; without the friction they would be far from them."""
    start = {"nu": (0.5, 0.1, 0.5), "chi": (0.1, 0.2, -0.1), "duration": 0.3, "roller_model": model, **TASK}

    def felt(*acting):
        run = simulate(PAPER, **start, effects=acting)
        found = reactions(run, height=0.1, friction=5.0)
        accelerometer = run.measure([0.2999], Instruments(place=(0.05, 0.02)))["accelerometer"]
        return np.concatenate([found.contact_force[-1].ravel(), found.load[-1], accelerometer.ravel()])

    limit, free = felt(Bearings(roller_coulomb=3e-3)), felt()
    near = [np.abs(felt(Bearings(roller_coulomb=3e-3, roller_speed=w)) - limit).max() for w in (1e-2, 1e-3)]
    assert near[1] < 0.3 * near[0] and near[0] < 0.01 * np.abs(free - limit).max()


def test_reactions_take_each_free_roller_as_it_sticks_or_turns():
    """Where nu' of the reactions is that of the rows' polynomials, the torques are those of the run."""
    acting = [Bearings(roller_coulomb=2e-6, roller_break_away=3e-6), Torque((2e-3, 0, -1e-3))]
    run = simulate(PAPER, nu=(0.4, 0.1, 2.0), duration=1.0, effects=acting, **TASK)
    signs = np.sign(np.where(np.abs(run.spins) < 1e-12, 0, run.spins))
    assert {-1.0, 0.0, 1.0} <= set(signs.ravel().tolist()) and len(run.switches)
    values = {"nu": run.nu, "chi": run.chi, "spins": run.spins, "heading": run.pose[:, 2]}
    values |= {name: run.drive[:, k] for k, name in enumerate(run.effects.drives())}
    bound = run.effects.kernel(PAPER, "free", "python", also=("reactions",))
    values |= torques_of_free_rollers(bound, run.effects, values, modes_of_free_rollers(run))
    found = with_accelerations(bound, values)["nu_dot"][run.step_rows]
    h = np.diff(run.elapsed)[run.step_rows]
    degree = run.dense.shape[1] - 1
    slopes = degree * (run.dense[:, 1, :3] - run.dense[:, 0, :3]) / h[:, None]
    np.testing.assert_allclose(found, slopes, rtol=0, atol=1e-6 * np.abs(slopes).max())
    assert (np.abs(values["free_bearing"]) <= 3e-6 * (1 + 1e-9)).all()

"""Derivatives of a run at rest, one long step in which slips beside it decay fast, against the matrix exponential."""

import pickle

import numpy as np
import pytest
from scipy.linalg import expm

import omniroll
from omniroll import Contact, Vehicle
from omniroll.engine import sensitivities

AT_REST, DURATION = {"nu": (0.0, 0.0, 0.0), "chi": (0.1, -0.2, 0.15)}, 0.02
COEFFICIENTS = {10: 72.0, 100: 750.0, 400: 3000.0}  # N s/m, by about how many times the fastest rate fits into the run


@pytest.mark.parametrize("in_python", [False, True], ids=["compiled", "python"])
@pytest.mark.parametrize("decay", COEFFICIENTS)
def test_fast_decays_beside_a_run_at_rest_are_those_of_the_matrix_exponential(decay, in_python, monkeypatch):
    if in_python:
        monkeypatch.setattr(sensitivities, "library_of", lambda motion: None)
    law = Contact(COEFFICIENTS[decay], wheel_rates=(0.0, 0.0, 0.0))
    scene = AT_REST | {"roller_model": "massless", "effects": (law,)}
    run = omniroll.simulate(
        Vehicle.paper(), duration=DURATION, accuracy=1e-13, control=False, sensitivities=("nu[0]",), **scene
    )
    model = omniroll.linearise(Vehicle.paper(), **scene)
    assert len(run.step_rows) == 1
    assert abs(np.abs(np.linalg.eigvals(model.A)).max() * DURATION / decay - 1) < 0.05
    anew = pickle.loads(pickle.dumps(run.followed))  # which looks again at what is cut
    for t in (DURATION, DURATION / 4) if decay > 10 else (DURATION,):
        wanted = expm(model.A * t)[:3, model.states.index("nu[0]")]
        for own in (run.followed, anew):
            found = own.at(run, "nu[0]", t).nu
            np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9 * np.abs(wanted).max())

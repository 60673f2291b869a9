"""Derivatives of runs that are calm, whose steps are long, while what is beside them decays fast: against the matrix
exponential of the run's linearisation, which knows no steps."""

import pickle
from functools import cache

import numpy as np
import pytest
from scipy.linalg import expm

import omniroll
from omniroll import Bearings, Contact, TorqueTable, Vehicle

VEHICLE = Vehicle.paper()
AT_REST = {"nu": (0.0, 0.0, 0.0), "chi": (0.1, -0.2, 0.15)}
SPINS = np.zeros((VEHICLE.wheels, VEHICLE.rollers_per_wheel - 1))
DECAYS = (1, 10, 21, 41, 103, 413, 1000)  # the largest rate times the run's duration
NAMES = ("nu[0]", "nu[1]", "chi[1]")


def slipping(**given):
    return Contact(40.0, wheel_rates=(0.0, 0.0, 0.0), **given)


BRAKED, STICKING = Bearings(wheel_viscous=0.5), Contact(law="coulomb", friction=0.5)
# By name the rollers and the effects, and where these cannot be linearised the same of a motion that is no other.
SCENES = {
    "massless": ("massless", (slipping(),)),
    "free": ("free", (slipping(contact_spins=0.0),)),
    "locked, bearings": ("locked", (BRAKED,)),
    "free, bearings": ("free", (Bearings(wheel_viscous=0.5, roller_viscous=1e-4),)),
    "sticking contacts": ("massless", (STICKING, BRAKED)),
    "sticking contacts, free": ("free", (STICKING, BRAKED)),
}
SAME = {"sticking contacts": ("massless", (BRAKED,)), "sticking contacts, free": ("free", (BRAKED,))}


def scene_of(rollers, effects):
    return AT_REST | {"roller_model": rollers, "effects": effects} | ({"spins": SPINS} if rollers == "free" else {})


@cache
def linear_model(name):
    return omniroll.linearise(VEHICLE, **scene_of(*SAME.get(name, SCENES[name])))


def duration_of(name, decay):
    return decay / np.abs(np.linalg.eigvals(linear_model(name).A)).max()


def run_of(name, decay, *effects):
    rollers, own = SCENES[name]
    scene, duration = scene_of(rollers, (*own, *effects)), duration_of(name, decay)
    return omniroll.simulate(VEHICLE, duration=duration, accuracy=1e-13, control=False, sensitivities=NAMES, **scene)


def wrong_by(run, name, followed, t):
    """The largest error of derivatives of speeds and angles, of each number over its largest derivative."""
    model, found = linear_model(name), []
    places = [model.states.index(f"{kind}[{k}]") for kind in ("nu", "chi") for k in range(3)]
    for number in NAMES:
        wanted = expm(model.A * t)[places, model.states.index(number)]
        own = followed.at(run, number, t)
        found.append(np.abs(np.concatenate([own.nu, own.chi]) - wanted).max() / np.abs(wanted).max())
    return max(found)


@pytest.mark.parametrize("decay", DECAYS)
@pytest.mark.parametrize("name", ["massless", "free"])
def test_at_rest_they_are_those_of_the_matrix_exponential(name, decay):
    is_exact(name, decay)


@pytest.mark.long
@pytest.mark.parametrize("decay", DECAYS[1::3])
@pytest.mark.parametrize("name", list(SCENES)[2:])
def test_with_other_effects_too(name, decay):
    is_exact(name, decay)


def is_exact(name, decay):
    run = run_of(name, decay)
    assert len(run.step_rows) == 1
    anew = pickle.loads(pickle.dumps(run.followed))  # which looks again at what is too fast
    for followed in (run.followed, anew):
        assert wrong_by(run, name, followed, run.t[-1]) <= 1e-10
        for part in (0.01, 0.25, 0.7):
            assert wrong_by(run, name, followed, part * run.t[-1]) <= 1e-9


@pytest.mark.parametrize("first", [41, 103])
def test_longer_steps_behind_a_first_one_that_is_cut_are_exact_too(first):
    name, decay = "massless", 1000
    knot = duration_of(name, first)
    run = run_of(name, decay, TorqueTable((0.0, knot, 1.0), ((0.0,) * 3,) * 3))
    assert knot in run.t[run.step_rows] and len(run.step_rows) < 8
    for t in (knot, 2 * knot, 5 * knot, run.t[-1]):
        assert wrong_by(run, name, run.followed, t) <= 1e-9

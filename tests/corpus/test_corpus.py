"""Scenes of every kind of friction go on as the corpus has kept them, but for those that are named with their reason.

`python -m corpus` from tests/ runs all of them.
"""

import numpy as np
import pytest

from corpus import files
from corpus.kinds import KINDS, name_of, scene
from corpus.record import row_behind
from corpus.replay import DIFFERS, differences, unexplained
from omniroll import simulate

QUICK = [("rolling", "free", "both"), ("viscous", "massless", "rollers"), ("coulomb", "free", "both"),
         ("coulomb", "massless", "both")]  # fmt: skip
ALL = [pytest.param(kind, marks=() if kind in QUICK else pytest.mark.long) for kind in KINDS]
FEW = 3  # scenes of a kind
FOLLOWED = [("rolling", "locked", "axles"), ("regularised", "free", "both"), ("coulomb", "free", "both"),
            ("coulomb", "massless", "both")]  # fmt: skip  # kinds whose derivatives are compared here
MOST = 4e6  # bytes


def assert_as_kept(kind, place, followed=False):
    kept = files.read(kind)
    numbers = [number for number, record in kept.items() if (len(record.derivatives) > 0) == followed]
    assert unexplained(kind, differences(kind, numbers[place : place + FEW])) == {}


@pytest.mark.parametrize("kind", ALL, ids=name_of)
def test_scenes_go_on_as_kept(kind):
    assert_as_kept(kind, 0)


@pytest.mark.long
@pytest.mark.parametrize("kind", FOLLOWED, ids=name_of)
def test_derivatives_are_those_that_are_kept(kind):
    assert_as_kept(kind, 0, followed=True)


def test_a_short_step_behind_an_event_moves_no_kept_state():
    """In this scene steps of 1.5e-10 s and 7.7e-10 s follow where an axle starts to turn."""
    assert differences(("viscous", "free", "both and viscous"), [20]) == {}


def test_bearings_that_rest_have_torques_in_the_row_in_which_others_break_away():
    vehicle, task = scene(("rolling", "locked", "axles"), 16)
    assert ((run := simulate(vehicle, **task)).drive[:, run.effects.drives().index("bearing_torque")] != 0).all()


@pytest.mark.parametrize(("at", "row"), [(0.1, 3), (0.1 + 1e-10, 3), (0.15, 6), (0.3, 7)])
def test_the_row_of_an_event_is_the_last_at_its_time(at, row):
    """Two sides at 0.1 s and once more 1e-10 s later, which is at once; short steps follow; one row alone at 0.15 s."""
    t = np.array([0, 0.1, 0.1 + 1e-10, 0.1 + 1e-10, 0.1 + 3e-10, 0.1 + 9e-10, 0.15, 0.3])
    assert row_behind(t, np.array([0, 0.1 + 1e-10, 0.3]), at) == row


def test_the_corpus_has_every_kind_and_stays_small():
    assert all(len(files.read(kind)) >= 20 for kind in KINDS)
    assert sum(file.stat().st_size for file in files.FOLDER.iterdir()) <= MOST


def test_what_differs_is_kept_and_explained():
    for kind, scenes in DIFFERS.items():
        assert scenes.keys() <= files.read(kind).keys() and all(len(why) > 20 for _, why in scenes.values())

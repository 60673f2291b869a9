"""Ordinary manoeuvres that once stopped or ended elsewhere, by their numbers in hard/manoeuvres.py."""

import pytest
from hard.ground_laws import measured
from hard.manoeuvres import ordinary, outcome

ONCE = {
    396: "the end of a stiff step was damped with the directions that slips have at its start: off by 1e-4",
    448: "the finer run stopped: a decision took the direction of a slip of 5e-10 m/s for better than the step's",
    470: "two wheels let go 1e-10 s apart, and the first one's slip was rounding until then",
    895: "the same of a wheel whose twin used its friction up an iteration's rest later",
    998: "three wheels on a torque ramp: a slip of 2e-12 m/s turned as its rounding did",
}


@pytest.mark.parametrize("number", ONCE)
def test_manoeuvre_ends_accurately_and_obeys_the_laws(number: int) -> None:
    assert outcome(number)[1] == "ends", ONCE[number]


STOPPED = {
    64: "loads on springs: an iterate slipped against its direction, and its directions never settled",
    257: "a roller came to rest, which turned the slip of its wheel by 1e-3 rad; its direction stayed",
    364: "the corrector of the solver swung a light roller from bound to bound: no mode was decided",
    1867: "of two wheels alike one broke away, as static friction is above sliding friction: beside axles that stick",
    1894: "rollers of a wheel let go together: the next one's instant was sought beyond the rounding of time",
}


@pytest.mark.parametrize("number", STOPPED)
def test_ordinary_scene_ends(number: int) -> None:
    assert outcome(number, ordinary)[1] == "ends", STOPPED[number]


@pytest.mark.parametrize("number", [401, 3884])
def test_session_ends_where_the_run_does(number: int) -> None:
    """Two slips of a vehicle that can only turn come to rest together, each with a rest across its direction: that
    of one counted as a slip where steps leave less than rounding."""
    found = measured(number)
    assert found["nu at the end of a session, relative"] <= 1e-8

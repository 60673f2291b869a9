"""Ordinary manoeuvres that once stopped or ended elsewhere, by their numbers in hard/manoeuvres.py."""

import pytest
from hard.manoeuvres import outcome

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

"""Ordinary manoeuvres that once stopped or ended elsewhere, by their numbers in hard/manoeuvres.py."""

import re

import numpy as np
import pytest
from hard.ground_anywhere import SEED
from hard.ground_laws import controlled, measured, stepped
from hard.manoeuvres import ordinary, outcome

from omniroll import SimulationStopped

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
    490: "an axle slower than 16 times what the iterations of all steps may leave was at rest, and passed zero unseen",
    1198: "the same on viscous ground: friction drove the axle on until the step's end, and the law was missed by 24",
    364: "the corrector of the solver swung a light roller from bound to bound: no mode was decided",
    1867: "of two wheels alike one broke away, as static friction is above sliding friction: beside axles that stick",
    1894: "rollers of a wheel let go together: the next one's instant was sought beyond the rounding of time",
}


@pytest.mark.parametrize("number", STOPPED)
def test_ordinary_scene_ends(number: int) -> None:
    assert outcome(number, ordinary)[1] == "ends", STOPPED[number]


def test_a_stop_names_the_wheel_the_time_the_cause_and_what_to_change() -> None:
    """It named no wheel. The session stops where the run of the same scene goes on: when, and how fast its friction is
    there, goes by the last bits, and so by the processor."""
    vehicle, task = controlled(2942)
    with pytest.raises(SimulationStopped) as stopped:
        stepped(vehicle, task, np.random.default_rng([SEED, 4, 2942]))
    assert stopped.value.wheel is not None
    assert re.match(
        r"stopped at t = \d\.\d+e-08, wheel [1-3]: the step became too small: \w+ changes faster than a step can "
        r"follow(: Contact has a time constant of .* s, .* times shorter than the motion's)?; change what acts on the "
        r"wheel, the start or the accuracy",
        str(stopped.value),
    )


@pytest.mark.parametrize("number", [401, 3884])
def test_session_ends_where_the_run_does(number: int) -> None:
    """Two slips of a vehicle that can only turn come to rest together, each with a rest across its direction: that
    of one counted as a slip where steps leave less than rounding."""
    found = measured(number)
    assert found["nu at the end of a session, relative"] <= 1e-8

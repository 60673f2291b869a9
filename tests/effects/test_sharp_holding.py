"""Axles that stick on rollers with sharp tips: no digit is lost. In full: the hard case kernels-with-effects."""

import numpy as np
import pytest
from hard import rounding
from hard.effect_kernels import with_effects
from hard.kernel_errors import BOUND, EPS, worst
from hard.sampling import sample

from omniroll.kernels.kernel import SHARP

HELD = {"held_dynamics": ("axle_sticking",), "held_accelerations": ("axle_sticking", "roller_coulomb")}


def errors(states, base, judge):
    """(K,) of the judged function as the kernel of `base` computes it, in ulp times the condition."""
    found = rounding.values(states, rounding.set_key(base, HELD[judge.name]), judge.name)
    return judge.units(found, EPS["double"])[0]


@pytest.mark.parametrize("name", HELD)
def test_what_holds_keeps_its_digits(name):
    sharp = rounding.set_key("free_sharp", HELD[name])
    states = sample(71, 160, 3, 5, closest_tip=1e-9)
    states = with_effects(states.at(np.flatnonzero(states.sharpness() > SHARP)), sharp, 171)
    judge = rounding.judged_by(states, sharp, [name])[name]
    assert worst(errors(states, "free_sharp", judge)) <= BOUND
    assert worst(errors(states, "free", judge)) > 10 * BOUND, "the usual form would do"

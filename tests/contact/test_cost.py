"""What wheels that slip and contacts that stick cost on the compiled engine: evaluations, and instructions."""

import numpy as np
import pytest
from costs.contacts import AS_BUILT, SPRUNG, STICKING
from costs.counting import counted, missing

from omniroll import Contact, Motor, Springs, Vehicle, simulate

PAPER = Vehicle.paper()


def set_valued(friction):
    return Contact(law="coulomb", friction=friction, wheel_rates=0)


def regularised(speed):
    return Contact(law="regularised", friction=0.3, speed=speed, wheel_rates=0)


BARE = ()
ON_SPRINGS = [((set_valued(0.3), Springs(height=0.06, deflection=size)), BARE, most)
              for size, most in ((1e-3, 4), (1e-5, 7))]  # fmt: skip


@pytest.mark.parametrize("effects, beside, most", [
    ((regularised(1e-6),), (regularised(1e-2),), 5), ((Contact(3.0, wheel_rates=0),), BARE, 10),
    ((Contact(1e4, wheel_rates=0),), BARE, 16), *(((set_valued(friction),), BARE, 4) for friction in (0.1, 0.3, 1.0)),
    *ON_SPRINGS,
])  # fmt: skip
def test_wheels_that_slip_against_others(effects, beside, most):
    """In evaluations: a small named speed against a large one; slip against the bare vehicle, whose steps are long:
    behind each of six switches a roller spins up, contacts come to rest, the platform swings."""
    motion = {"nu": (2.0, 1.0, 0.0), "duration": 1.0, "control": False}
    counts = [simulate(PAPER, **motion, effects=own).stats["evaluations"] for own in (effects, beside)]
    assert counts[0] <= most * counts[1]


@pytest.mark.long
@pytest.mark.skipif(bool(missing()), reason=f"counting needs {missing()}")
def test_instructions_against_those_of_rolling():
    """One process counts all: where contacts slip, free rollers' directions are solved for beside the rates; where all
    contacts stick, nothing switches. `python -m costs.contacts` has all."""
    slips = {friction: f"free|coulomb, friction {friction}|static loads" for friction in ("0.1", "1")}
    built = {name: f"{name}{AS_BUILT}" for name in slips.values()}
    resting = [f"free|sticking|{ground}" for ground in STICKING]
    swings = f"free|coulomb, friction 0.3|{SPRUNG}{AS_BUILT}"
    found = counted("costs.contacts", ["free||", *slips.values(), *built.values(), *resting, swings])
    rolling = found["free||"].instructions
    for name in slips.values():
        assert 1e5 < rolling < found[name].instructions <= 10 * rolling
        assert found[name].rejected_steps <= found[name].steps / 4
        assert found[built[name]].instructions <= 1.35 * found[name].instructions
    assert found[swings].instructions <= 40 * rolling
    rolls, sticks = (found[name] for name in resting)
    assert rolls.switches == sticks.switches == 0
    assert 1e5 < rolls.instructions <= sticks.instructions <= 2 * rolls.instructions


@pytest.mark.parametrize("accuracy", [1e-9, 1e-13])
@pytest.mark.parametrize("rollers", ["massless", "free"])
def test_contacts_that_stick_beside_motors_against_rolling_with_them(rollers, accuracy):
    """The back-EMF damps the wheels' rates, which follow nu where contacts stick: the iteration must solve for nu as in
    rolling, and not for each wheel as if it turned by itself."""
    drive = Motor((0.3, -0.2, 0.1), torque_constant=0.02, resistance=0.5, gear_ratio=12)
    rolling, sticking = [
        simulate(PAPER, nu=(0, 0, 0), duration=0.3, roller_model=rollers, control=False, effects=effects,
                 accuracy=accuracy)
        for effects in ((drive,), (Contact(law="coulomb", friction=50.0), drive))
    ]  # fmt: skip
    assert sticking.sticks.all()
    assert sticking.stats["phases"] == rolling.stats["phases"] == 1
    assert sticking.stats["evaluations"] <= 2 * rolling.stats["evaluations"]
    assert np.abs(sticking.nu[-1] - rolling.nu[-1]).max() <= 2 * accuracy * np.abs(rolling.nu).max()


def test_slips_come_to_rest_whatever_the_accuracy():
    """On the way to rest directions turn ever faster, and are known the less the slower a slip is: steps
    that asked for more than that never ended."""
    random = np.random.default_rng(5)
    for _ in range(6):
        nu, friction = random.normal(size=3), random.uniform(0.05, 1)
        ends = []
        for accuracy in (1e-13, 1e-12, 1e-10, 1e-8):
            options = {"duration": 0.5, "control": False, "accuracy": accuracy, "effects": (set_valued(friction),)}
            run = simulate(PAPER, nu=nu, **options)
            assert run.stats["evaluations"] <= 1e5
            ends.append(np.concatenate([run.nu[-1], run.pose[-1]]))
            assert np.abs(ends[-1] - ends[0]).max() <= 10 * accuracy

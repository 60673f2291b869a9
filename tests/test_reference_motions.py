"""omniroll.simulate against motions in Taylor series of the full-coordinate equations (26 digits and
more).
"""

import numpy as np
import pytest
from oracle import references
from oracle.bridge import error, simulated, switch_table

CASES = references.load()
NAMES = [f"{c['name']}: {c['model']}, {c['law']}" for c in CASES]


def run(case, **options):
    options |= case["start"] | {"duration": case["duration"]}
    return simulated(case["vehicle"], model=case["model"], law=case["law"], **options)


def floats(values):
    return np.array(values, dtype=float)


def gap(case, pose, nu, wanted):
    return error(case["vehicle"], case["start"]["nu"], pose, nu, floats(wanted["pose"]), floats(wanted["nu"]))


def check_switches(case, trajectory, accuracy):
    """Order, wheels, directions, times and jumps of energy; wheels that switch together have one time."""
    found = switch_table(trajectory)
    wanted = [(s, int(i), d) for s in case["switches"] for i, d in s["moves"].items()]
    assert len(found) == len(wanted)
    energy = trajectory.energy[0]
    used = 0
    for s in case["switches"]:
        rows = found[used : used + len(s["moves"])]
        used += len(rows)
        assert {str(wheel): direction for _, wheel, direction, _ in rows} == s["moves"]
        assert len({t for t, *_ in rows}) == 1
        assert abs(rows[0][0] - float(s["t"])) <= 100 * accuracy * case["duration"]
        assert sum(jump for *_, jump in rows) == pytest.approx(float(s["energy_jump"]), abs=100 * accuracy * energy)


def check_end(case, trajectory, accuracy):
    end, n = case["end"], case["vehicle"].rollers_per_wheel
    turned = (np.asarray(trajectory.contact[-1]) - trajectory.contact[0]) % n
    assert turned.tolist() == end["contact"]
    assert np.abs(trajectory.chi[-1] - floats(end["chi"])).max() <= 100 * accuracy
    for name, wanted in (("contact_spin", end["contact_spin"]), ("spins", end["spins"])):
        if wanted is not None:
            wanted = floats(wanted)
            scale = max(1.0, np.abs(wanted).max())
            assert np.abs(getattr(trajectory, name)[-1] - wanted).max() <= 1000 * accuracy * scale
    assert trajectory.energy[-1] == pytest.approx(float(end["energy"]), rel=100 * accuracy)


@pytest.mark.parametrize("case", CASES, ids=NAMES)
def test_reference_motion(case):
    """The error that `accuracy` promises, in the norm in which it is stated, at the end and at any time between."""
    accuracy = 1e-9
    trajectory = run(case, accuracy=accuracy)
    assert trajectory.t[0] == 0 and trajectory.t[-1] == case["duration"]
    check_switches(case, trajectory, accuracy)
    check_end(case, trajectory, accuracy)
    assert trajectory.stats["phase_energy_drift"] <= 10 * accuracy
    assert gap(case, trajectory.pose[-1], trajectory.nu[-1], case["end"]) <= accuracy
    found = trajectory.sample([float(s["t"]) for s in case["samples"]])
    for k, wanted in enumerate(case["samples"]):
        assert gap(case, found.pose[k], found.nu[k], wanted) <= accuracy


@pytest.mark.long
@pytest.mark.parametrize("accuracy", [1e-4, 1e-11])
def test_the_python_engine_keeps_its_accuracy(accuracy):
    """Coarse and fine, on the motions with scattered numbers."""
    for case in CASES:
        if case["name"].startswith("paper") or case["model"] == "massless":
            continue
        trajectory = run(case, accuracy=accuracy, engine="python")
        assert len(switch_table(trajectory)) == sum(len(s["moves"]) for s in case["switches"])
        assert gap(case, trajectory.pose[-1], trajectory.nu[-1], case["end"]) <= accuracy


@pytest.mark.long
def test_references_can_be_made_again():
    """One short case, computed anew with fewer digits, is what is kept."""
    case = next(
        c for c in CASES if c["name"].startswith("2 wheels") and c["model"] == "locked" and c["law"] == "impact"
    )
    fresh = references.solve(
        case["vehicle"], case["start"], case["duration"], case["model"], case["law"], digits=16, order=20
    )
    assert len(fresh["switches"]) == len(case["switches"]) >= 3
    for name in ("pose", "nu", "chi"):
        np.testing.assert_allclose(floats(fresh["end"][name]), floats(case["end"][name]), rtol=1e-13, atol=1e-14)
    for a, b in zip(fresh["switches"], case["switches"], strict=True):
        assert a["moves"] == b["moves"] and float(a["t"]) == pytest.approx(float(b["t"]), rel=1e-13)

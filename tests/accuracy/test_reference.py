"""The reference solutions of `omniroll accuracy` against the oracle's, which know nothing of the kernels."""

import numpy as np
import pytest
from oracle import references
from oracle.bridge import project_vehicle

from omniroll.accuracy.reference import Extrapolated, Taylor, digits, distance, follow
from omniroll.simulate import checked_task

flint = pytest.importorskip("flint")
CASES = [c for c in references.load() if c["name"].startswith(("2 wheels", "paper 2")) and c["model"] != "massless"]


@pytest.mark.parametrize("case", CASES, ids=lambda c: f"{c['name']} {c['model']} {c['law']}")
def test_references_agree_with_the_oracle(case):
    start = dict(case["start"])
    if case["model"] != "free":
        del start["spins"]
    task = checked_task(
        project_vehicle(case["vehicle"]), **start, duration=case["duration"],
        roller_model=case["model"], switching=case["law"],
    )  # fmt: skip
    times = np.array([float(s["t"]) for s in case["samples"]] + [case["duration"]])
    with digits():
        one = follow(Taylor(task), task, times)
        wanted = [flint.arb(v) for v in (*case["end"]["nu"], *case["end"]["chi"], *case["end"]["pose"])]
        # Wheels that are meant to switch together come some 1e-16 s apart, as their rounded angles have it.
        most = 5e-16 if case["name"].startswith("paper") else 1e-18
        assert max(abs(float(a - b)) for a, b in zip(one.exact_end, wanted, strict=True)) < most
    other = follow(Extrapolated(task), task, times[-1:])
    with digits():
        assert distance(one, other, 1.0, 1.0) < 5e-16
    assert [s[1:] for s in one.switches] == [s[1:] for s in other.switches]
    moves = [(int(i), d) for s in case["switches"] for i, d in s["moves"].items()]
    assert sorted(s[1:] for s in one.switches) == sorted(moves)
    for row, sample in zip(one.y, case["samples"], strict=False):
        np.testing.assert_allclose(row[:3], np.array(sample["nu"], float), atol=1e-15)


def test_the_precision_of_flint_is_put_back():
    before = flint.ctx.prec, flint.ctx.cap
    with digits():
        assert flint.ctx.prec > 64
    assert (flint.ctx.prec, flint.ctx.cap) == before

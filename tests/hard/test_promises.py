"""The promises of the hard cases hold. What is measured in full is in docs/hard-cases.md."""

import pytest

from hard.case import Scale
from hard.collection import all_cases

pytestmark = pytest.mark.long

CASES = all_cases()


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_promise(case):
    measurements = list(case.run(Scale.TEST))
    assert measurements, "nothing was measured"
    broken = [m for m in measurements if not m.kept]
    assert not broken, "\n".join(f"{m.what}, {m.on}, {m.setting}: {m.measured:.3g} > {m.bound:.3g}" for m in broken)

"""The naive runs that the page shows beside ours are the same mechanics: where nothing is hard, both agree.

`make hard` measures them in every case; test_promises holds bounds, which no naive number has.
"""

import numpy as np
import pytest

from hard import naive
from hard.setting import LAWS, MODELS, Setting


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("model", MODELS)
def test_scipy_makes_the_same_run(model, law):
    setting = Setting(model, law, "compiled")
    start = {"nu": (1.0, 0.2, 0.5), "chi": (0.1, -0.2, 0.3), "spins": np.full((3, 4), 0.25), "duration": 1.0}
    run, motion = setting.run(**start), naive.simulate(setting.task(**start))
    assert len(run.switches) > 1
    assert [wheel for _, wheel, _ in motion.switches] == run.switches.wheel.tolist()
    np.testing.assert_allclose(motion.y, np.concatenate([run.nu[-1], run.chi[-1], run.pose[-1]]), rtol=0, atol=1e-9)

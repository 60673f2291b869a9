"""simulate_many where a worker of the pool dies: only its own run is lost."""

import os
import signal
from concurrent.futures import ProcessPoolExecutor

import numpy as np

import omniroll
from omniroll.sweeps import sweep

PAPER = omniroll.Vehicle.paper()


@omniroll.register_controller("tests.faults.deadly")
def deadly(time, state):
    """Ends its process where the vehicle turns to the right."""
    if state.nu[2] < 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return 0.0


def test_a_dead_worker_loses_only_its_own_run(monkeypatch):
    monkeypatch.setattr(sweep, "CHUNKS_PER_WORKER", 1)  # so that others are in its chunk
    monkeypatch.setattr(sweep, "cores", lambda: 2)
    nu = np.array([(1, 0, 1), (0.5, 0, 1), (1, 0, -1), (0.2, 0, 1), (0, 0, 1)])
    controller = omniroll.FunctionController(deadly, sample_time=0.05)
    # The first run is checked here, in this process: it does not turn to the right.
    with ProcessPoolExecutor(2) as executor:
        found = omniroll.simulate_many(
            PAPER, nu=nu, duration=0.1, effects=[controller], engine="python", control=False, executor=executor
        )
    assert list(found.reasons) == [(2,)] and "its worker died" in found.reasons[2,]
    assert found.stopped.tolist() == [False, False, True, False, False]
    for k in (0, 1, 3, 4):
        alone = omniroll.simulate(PAPER, nu=nu[k], duration=0.1, effects=[controller], engine="python", control=False)
        assert np.array_equal(found.end.pose[k], alone.pose[-1])
    assert np.isnan(found.end.pose[2]).all()

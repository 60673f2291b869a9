"""Kernels that tests make on demand are kept beside what they were built with, not in the user's own cache.

They are compiled without optimisation, in a quarter of the time: their numbers are the same to the bit, and most of
them run for milliseconds. Each test's processor time is recorded (processor_time.py).
"""

import os
import sys
from pathlib import Path

import processor_time
import pytest

os.environ.setdefault("OMNIROLL_CACHE", str(Path(sys.prefix, "omniroll-kernels")))
os.environ.setdefault("OMNIROLL_CFLAGS", "-O0")

STARTED = pytest.StashKey[float]()
TAKEN: dict[str, float] = {}  # processor seconds by test
MINUTES = ("tests/test_proofs.py", "tests/codegen/test_what_if.py")


def pytest_collection_modifyitems(items):
    """Tests that take minutes each come first: at the end one process would do them, and the others wait."""
    items.sort(key=lambda item: not item.nodeid.startswith(MINUTES))


@pytest.fixture
def fresh_cache(tmp_path, monkeypatch):
    """An empty folder for kernels, and no kernel remembered."""
    from omniroll.effects import effect_set
    from omniroll.kernels import kernel, sets

    monkeypatch.setenv("OMNIROLL_CACHE", str(tmp_path / "kernels"))
    remembered = (sets._loaded, sets._opened_pair, sets._opened_engine, kernel.kept_kernel, kernel.signatures,
                  effect_set._checked)  # fmt: skip
    for cached in remembered:
        cached.cache_clear()
    yield tmp_path / "kernels"
    for cached in remembered:
        cached.cache_clear()


@pytest.fixture
def bouncing(monkeypatch):
    """A law, for the Python engine, that sends every fast wheel back to where it came from: endless switches."""
    from dataclasses import replace

    from omniroll.engine.switching import SwitchingModel

    apply = SwitchingModel.apply

    def bounce(model, state, directions):
        after = apply(model, state, directions)
        return replace(after, nu=-state.nu) if abs(state.nu).max() > 0.75 else after

    monkeypatch.setattr(SwitchingModel, "apply", bounce)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item):
    item.stash[STARTED] = processor_time.used()
    yield


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    outcome = yield
    if call.when == "teardown":
        outcome.get_result().user_properties.append((processor_time.KEY, processor_time.used() - item.stash[STARTED]))


def pytest_runtest_logreport(report):
    found = dict(report.user_properties).get(processor_time.KEY)
    if report.when == "teardown" and found is not None:
        TAKEN[report.nodeid] = found


def pytest_sessionfinish(session):
    if not hasattr(session.config, "workerinput") and TAKEN:  # workers tell the process that started them
        processor_time.keep(TAKEN)

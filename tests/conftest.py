"""Kernels that tests make on demand are kept beside what they were built with, not in the user's own cache."""

import os
import sys
from pathlib import Path

import pytest

os.environ.setdefault("OMNIROLL_CACHE", str(Path(sys.prefix, "omniroll-kernels")))

MINUTES = ("tests/test_proofs.py", "tests/codegen/test_what_if.py")


def pytest_collection_modifyitems(items):
    """Tests that take minutes each come first: at the end one process would do them, and the others wait."""
    items.sort(key=lambda item: not item.nodeid.startswith(MINUTES))


@pytest.fixture
def fresh_cache(tmp_path, monkeypatch):
    """An empty folder for kernels, and no kernel remembered."""
    from omniroll.kernels import kernel, sets

    monkeypatch.setenv("OMNIROLL_CACHE", str(tmp_path / "kernels"))
    remembered = (sets._loaded, sets._opened_pair, sets._opened_engine, kernel.kept_kernel, kernel.signatures)
    for cached in remembered:
        cached.cache_clear()
    yield tmp_path / "kernels"
    for cached in remembered:
        cached.cache_clear()

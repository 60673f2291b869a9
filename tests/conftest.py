"""Kernels that tests make on demand are kept beside what they were built with, not in the user's own cache."""

import os
import sys
from pathlib import Path

import pytest

os.environ.setdefault("OMNIROLL_CACHE", str(Path(sys.prefix, "omniroll-kernels")))


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

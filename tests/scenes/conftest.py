"""Scenes for tests."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from omniroll.scenes import costs, explanation

SHORT = 0.5  # s


@pytest.fixture
def quick_timing(monkeypatch) -> None:
    """For tests that do not ask how long an evaluation takes: few evaluations, timed once, and no time is too long."""
    monkeypatch.setattr(explanation, "ALLOWED", 1e9)
    monkeypatch.setattr(costs, "MANY", {"compiled": 200, "Python": 20})
    monkeypatch.setattr(costs, "ENOUGH", 0.0)


@pytest.fixture
def shortened(tmp_path) -> Callable[..., Path]:
    """Makes a copy of a scene that runs for SHORT seconds, with more lines in [run]; logs stand beside it."""

    def make(scene: Path, more: str = "") -> Path:
        lines = scene.read_text().splitlines()
        text = "\n".join(f"duration = {SHORT}" if line.startswith("duration") else line for line in lines)
        for log in scene.parent.glob("*.csv"):
            shutil.copy(log, tmp_path)
        path = tmp_path / scene.name
        path.write_text(text.replace("[run]", f"[run]\n{more}") + "\n")
        return path

    return make

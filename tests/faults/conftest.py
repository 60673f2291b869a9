"""Scenes and folders for tests that inject faults."""

import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

MEMORY = Path("/dev/shm")  # a file system on which waiting for the disk costs nothing


@pytest.fixture(scope="session")
def quick_folder() -> Iterator[Path]:
    place = Path(tempfile.mkdtemp(dir=MEMORY if MEMORY.is_dir() else None))
    yield place
    shutil.rmtree(place, ignore_errors=True)


@pytest.fixture(scope="session")
def two_scenes(quick_folder: Path) -> tuple[Path, Path]:
    """Two short scenes that leave different files: the first one samples."""
    text = Path("scenes/motion-3-impact.toml").read_text()
    paths = quick_folder / "before.toml", quick_folder / "new.toml"
    for path, run in zip(paths, ("duration = 0.3\nstep = 0.1", "duration = 0.4"), strict=True):
        path.write_text(re.sub(r"duration = .*", run, text))
    return paths

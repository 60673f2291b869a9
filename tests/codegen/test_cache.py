"""The folder of what is kept, and its lock."""

import pytest

from codegen import cache


def test_a_folder_that_cannot_be_written_gives_way_to_one_of_the_process(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    monkeypatch.setenv("OMNIROLL_CACHE", str(tmp_path / "file"))
    with pytest.warns(RuntimeWarning, match="OMNIROLL_CACHE"):
        kept = cache.folder()
    assert kept.is_dir() and kept == cache.folder() and not kept.is_relative_to(tmp_path)


def test_the_lock_goes_with_an_error(tmp_path):
    with pytest.raises(ValueError), cache.lock(tmp_path / "thing"):
        raise ValueError
    with cache.lock(tmp_path / "thing").acquire(timeout=1):
        pass

"""Files that appear whole or not at all, and what is no file and stays what it is."""

import errno
import os
import stat
import threading

import pytest

from omniroll.durable import whole_file


def test_a_file_keeps_what_it_held_where_the_writing_fails(tmp_path):
    path = tmp_path / "kept.txt"
    path.write_text("before")
    with pytest.raises(RuntimeError), whole_file(path) as file:
        file.write("after")
        raise RuntimeError
    assert path.read_text() == "before" and list(tmp_path.iterdir()) == [path]


def test_a_pipe_is_written_to_and_stays_a_pipe(tmp_path):
    pipe, read = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()), daemon=True)
    reader.start()
    with whole_file(pipe) as file:
        file.write("through")
    reader.join(timeout=10)
    assert read == ["through"] and stat.S_ISFIFO(pipe.stat().st_mode)
    assert list(tmp_path.iterdir()) == [pipe]


def test_a_full_disk_names_the_file(tmp_path, monkeypatch):
    """The system's error has no name where a file that is open is written to."""

    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*/kept.txt'"), whole_file(tmp_path / "kept.txt"):
        pass

"""Progress on standard error: a bar, lines, a function, or nothing."""

import sys

import pytest

from omniroll import progress


def test_lines_come_now_and_then(capsys):
    """The pace is that since the first report: what came before it is other work."""
    now = iter((100.0, 101.0, 106.0, 107.0)).__next__
    report = progress.lines("s", now)
    for done in (1.0, 2.0, 4.0, 4.5):
        report(done, 20.0)
    assert capsys.readouterr().err == "4 of 20 s done, 0.5 s a second, 32 s left\n"


def test_work_beyond_a_day_is_announced_once_and_first(capsys):
    now = iter((10.0, 11.0, 13.0)).__next__
    report = progress.forewarning("s", now)
    for done in (1.0, 3.0, 7.0, 8.0):
        report(done, 1e6)
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "at its present pace this takes 5.79 days" in said
    report = progress.forewarning("s", iter((0.0, 3.0)).__next__, keeps=False)
    for done in (0.0, 3.0):
        report(done, 8e6)
    assert capsys.readouterr().err.endswith("Ctrl-C ends it\n")
    report = progress.forewarning("s", iter((0.0, 3.0)).__next__)
    for done in (0.0, 3.0):
        report(done, 8e4)
    assert capsys.readouterr().err == ""


def test_a_bar_on_a_terminal_and_lines_elsewhere(monkeypatch, capsys):
    pytest.importorskip("tqdm")

    def shown() -> str:
        with progress.reporting(None, 2.0, "s") as report:
            report(1.0, 2.0)
            report(2.0, 2.0)
        return capsys.readouterr().err

    assert shown() == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert "2/2 s" in shown()
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)  # as if it were not installed
    assert shown() == ""

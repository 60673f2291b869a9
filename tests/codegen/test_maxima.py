"""A failed claim, an error, a hang or half a file stops the run, and the message says what it was."""

import multiprocessing
import os
import shutil
import time
from pathlib import Path

import pytest

from codegen import maxima
from codegen.maxima import Maxima, MaximaError

pytestmark = pytest.mark.long


def is_at_hand() -> bool:
    """Whether a whole Maxima is there: none is installed for a test."""
    own = os.environ.get("MAXIMA") or shutil.which("maxima")
    return bool((own and Maxima.at(Path(own)).is_whole()) or maxima.wheel_program(maxima.pinned_folder()))


needs_maxima = pytest.mark.skipif(not is_at_hand(), reason="no Maxima here; none is installed for a test")
PROVE = """prove(name, claim, e) :=
    if e # 0 then error("identity is not zero:", name, "-", claim, "- residual:", e)$
"""
WRITE = 's: openw(output_file)$ printf(s, "~a", "{}")$ close(s)$\n'


def derive(folder, text, timeout=60.0):
    """(lines reported, the output's text)."""
    script, output, lines = folder / "derive.mac", folder / "out put.json", []
    script.write_text(text)
    Maxima.find().derive(script, output, lines.append, timeout)
    return lines, output.read_text()


@needs_maxima
def test_progress_comes_through_and_data_is_written(tmp_path):
    lines, text = derive(tmp_path, 'printf(true, "maxima: ~a~%", "geometry")$\n' + WRITE)
    assert lines == ["maxima: geometry"]
    assert text == "{}"


@needs_maxima
def test_a_failed_claim_stops_the_run_and_is_named(tmp_path):
    text = PROVE + 'prove("sum", "a = a", a - a)$ prove("energy: platform", "a = b", a - b)$\nprint("after")$\n' + WRITE
    with pytest.raises(
        MaximaError, match="identity is not zero: energy: platform - a = b - residual: a ?- ?b"
    ) as raised:
        derive(tmp_path, text)
    assert "after" not in str(raised.value)
    assert not (tmp_path / "out put.json").exists()


@needs_maxima
@pytest.mark.parametrize("text, message", [
    ("f(x := 1$\n", r"(derive)?\.mac:(1:\d+:)?\s*incorrect syntax"),
    ("1/0$\n" + WRITE, "zero|undefined: 0 to a negative"),
    ('load("./not_there.mac")$\n', "not_there"),
    ("x: 1$\n", "wrote no data"),
    ("quit()$\n", "stopped"),
    (WRITE + 'error("late")$\n', "late"),
])  # fmt: skip
def test_every_way_to_stop_early_is_an_error(tmp_path, text, message):
    with pytest.raises(MaximaError, match=message):
        derive(tmp_path, text)


@needs_maxima
def test_time_is_limited(tmp_path):
    start = time.monotonic()
    with pytest.raises(MaximaError, match="stopped after 8 s(.|\n)*last words"):
        derive(tmp_path, 'print("last words")$ for k: 1 while true do k$\n', timeout=8.0)
    assert time.monotonic() - start < 60


@needs_maxima
def test_the_users_own_settings_are_ignored(tmp_path, monkeypatch):
    home = tmp_path / "home"
    for folder in (home, home / ".maxima", tmp_path):
        folder.mkdir(exist_ok=True)
        (folder / "maxima-init.mac").write_text('error("init file was read")$\n')
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("MAXIMA_USERDIR", str(home))
    monkeypatch.setenv("LC_ALL", "ru_RU.UTF-8")
    _, text = derive(tmp_path, WRITE)
    assert text == "{}"


def test_a_program_that_is_not_maxima_is_refused(monkeypatch):
    monkeypatch.setenv("MAXIMA", shutil.which("true"))
    with pytest.raises(MaximaError, match="does not run"):
        Maxima.find()


@pytest.fixture
def without_libraries(tmp_path, monkeypatch) -> Path:
    """A Maxima on PATH that finds none of its libraries, as one without Debian's maxima-share."""
    program = tmp_path / "maxima"
    program.write_text("#!/bin/sh\n[ \"$1\" = --version ] && echo Maxima 5.46.0\necho 'stringproc not found'\n")
    program.chmod(0o755)
    monkeypatch.delenv("MAXIMA", raising=False)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    return program


def test_the_pinned_one_takes_the_place_of_one_without_libraries(without_libraries, tmp_path, monkeypatch):
    pinned, said = tmp_path / "pinned", []
    pinned.write_text("#!/bin/sh\necho Maxima 5.50.0\n")
    pinned.chmod(0o755)
    monkeypatch.setattr(maxima, "installed", lambda report: pinned)
    assert Maxima.find(said.append) == Maxima(pinned, "5.50.0")
    (line,) = said
    assert f"{without_libraries} lacks its library stringproc" in line and "maxima-share" in line


def test_one_without_libraries_that_is_named_is_refused(without_libraries, monkeypatch):
    monkeypatch.setenv("MAXIMA", str(without_libraries))
    with pytest.raises(MaximaError, match="lacks its library"):
        Maxima.find()


def fake_install(place):
    """What install() leaves, without a network; counts its calls."""
    with (place.parent / "calls").open("a") as file:
        file.write("call\n")
    time.sleep(0.3)
    building = place.with_suffix(".part")
    program = building / "lib/python3.11/site-packages/sage_wheels/bin/maxima"
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    building.rename(place)


def install_once(cache):
    os.environ["XDG_CACHE_HOME"] = str(cache)
    maxima.install = fake_install
    maxima.installed(lambda line: None)


def test_two_runs_install_once(tmp_path):
    context = multiprocessing.get_context("fork")
    runs = [context.Process(target=install_once, args=(tmp_path,)) for _ in range(3)]
    for process in runs:
        process.start()
    for process in runs:
        process.join()
    assert [process.exitcode for process in runs] == [0, 0, 0]
    assert (tmp_path / "omniroll/calls").read_text() == "call\n"


def test_a_failed_installation_leaves_nothing_that_counts(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(maxima.venv, "create", lambda place, with_pip: Path(place).mkdir())
    with pytest.raises(MaximaError, match="could not be installed"):
        maxima.installed(lambda line: None)
    monkeypatch.setattr(maxima, "install", fake_install)
    (next(tmp_path.glob("omniroll/*.part"))).rmdir()
    assert maxima.installed(lambda line: None).is_file()


def test_lines_of_the_derivation_end_at_120():
    files = sorted((Path(maxima.__file__).parent.parent / "maxima").rglob("*.mac"))
    lines = ((file, number, line) for file in files for number, line in enumerate(file.read_text().splitlines(), 1))
    assert files and not [f"{file.name}:{number}" for file, number, line in lines if len(line) > 120]

"""Extras: each has programs that need it, and without its packages one line says what to install. `make test-extras`
installs each alone."""

import importlib.util
import sys
import tomllib
from pathlib import Path

import pytest

import omniroll

SPEC = importlib.util.spec_from_file_location("extras_programs", Path(__file__).with_name("extras.py"))
extras = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(extras)
IN_PROCESS = [
    pytest.param(extra, package, program, id=f"{extra}-{name}")
    for extra, programs in extras.PROGRAMS.items()
    for name, (package, program) in programs.items()
    if extra != "gymnasium"  # tests/gym does it, in an interpreter that has not imported it
]


def test_every_extra_has_programs_that_need_its_packages():
    declared = tomllib.loads((extras.ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert set(extras.PROGRAMS) == set(declared) - {"test"}
    assert {extra for extra, programs in extras.PROGRAMS.items() if not programs} == set(extras.ALONE)


@pytest.mark.long
@pytest.mark.parametrize("extra, package, program", IN_PROCESS)
def test_without_it_one_line_says_what_to_install(extra, package, program, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name in [name for name in sys.modules if name.split(".")[0] == package] + [package]:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises((omniroll.MissingPackageError, SystemExit)) as raised:
        exec(program, {"omniroll": omniroll, "__name__": "__main__"})
    said = capsys.readouterr().err if raised.type is SystemExit else f"{raised.value}\n"
    lines = [line for line in said.splitlines() if extras.line_of(extra, package).search(line)]
    assert len(lines) == 1 and "Traceback" not in said

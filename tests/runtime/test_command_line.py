"""The command line: what it prints and its exit codes."""

import subprocess
import sys

import pytest

import omniroll
from omniroll import cli


def test_version(capsys):
    with pytest.raises(SystemExit) as raised:
        cli.main(["--version"])
    assert raised.value.code == 0 and capsys.readouterr().out == f"omniroll {omniroll.__version__}\n"


def test_unknown_commands_are_refused():
    done = subprocess.run([sys.executable, "-m", "omniroll", "dance"], capture_output=True, text=True)
    assert done.returncode == 2 and "dance" in done.stderr


def test_every_command_has_what_a_command_has():
    """Each module of omniroll.commands, as omniroll.cli says."""
    import importlib
    import pkgutil

    from omniroll import commands

    for found in pkgutil.iter_modules(commands.__path__):
        module = importlib.import_module(f"omniroll.commands.{found.name}")
        assert isinstance(module.SUMMARY, str) and callable(module.add_arguments) and callable(module.run)

"""The command line: what it prints and its exit codes."""

import importlib
import pkgutil
import shlex
import subprocess
import sys
import warnings

import pytest

from omniroll import cli, commands

MODULES = {
    found.name: importlib.import_module(f"omniroll.commands.{found.name}")
    for found in pkgutil.iter_modules(commands.__path__)
}


@pytest.mark.parametrize("name", MODULES)
def test_every_command_has_what_a_command_has(name, capsys):
    """Each module of omniroll.commands, as that says. Its examples are calls that the parser takes, and the help has
    them."""
    module = MODULES[name]
    assert isinstance(module.SUMMARY, str) and callable(module.add_arguments) and module.EXAMPLES
    with pytest.raises(SystemExit):
        cli.main([name, "--help"])
    shown = capsys.readouterr().out
    for call, effect in module.EXAMPLES:
        program, *arguments = shlex.split(call.split(">")[0])
        assert program == "omniroll" and cli.parser().parse_args(arguments).run is module.run
        assert call in shown and effect in shown


@pytest.mark.parametrize("shell, wanted", [("bash", "--view"), ("zsh", "#compdef omniroll"), ("fish", "-l view")])
def test_shells_complete_every_command(shell, wanted, capsys):
    assert cli.main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert wanted in script and all(name in script for name in MODULES)


def test_an_interruption_while_commands_are_imported_is_one_line(monkeypatch, capsys):
    def parser():
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "parser", parser)
    assert cli.main([]) == 130
    assert capsys.readouterr().err == "omniroll: interrupted\n"
    light = "import sys, omniroll.cli; sys.exit('numpy' in sys.modules)"  # what comes before main() takes no time
    assert subprocess.run([sys.executable, "-c", light]).returncode == 0


def test_a_warning_is_one_line(monkeypatch, capsys):
    """Without the line of source that gave it."""
    monkeypatch.setattr(cli, "_run", lambda _: print(warnings.formatwarning("odd", RuntimeWarning, "a.py", 3)))
    cli.main([])
    assert capsys.readouterr().out == "warning: odd\n\n"
    assert "a.py:3" in warnings.formatwarning("odd", RuntimeWarning, "a.py", 3)

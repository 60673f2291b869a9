"""The command `omniroll`. omniroll.commands says what a command is, and which exit codes there are.

What takes long to import is imported once main() runs, which says in a line that it was interrupted.
"""

import argparse
import importlib
import io
import os
import pkgutil
import sys
import warnings
from collections.abc import Sequence

import omniroll
from omniroll import commands
from omniroll.commands import BAD_CALL, CLOSED, FAILED, INTERRUPTED, STOPPED
from omniroll.errors import InvalidValueError, OmnirollError, SimulationStopped

EXIT_CODES = (
    "Exit code: 0 done, 1 failed, 2 bad call or scene, 3 the simulation stopped, 4 a fit of another model, "
    "130 interrupted, 141 output closed, 143 terminated."
)
CODES = {InvalidValueError: BAD_CALL, SimulationStopped: STOPPED}


def parser() -> argparse.ArgumentParser:
    """The parser of the command line, with every command that omniroll.commands has."""
    top = argparse.ArgumentParser(prog="omniroll", description=omniroll.__doc__.splitlines()[0])
    top.add_argument("--version", action="version", version=f"omniroll {omniroll.__version__}")
    top.add_argument(
        "--import", dest="modules", action="append", default=[], metavar="MODULE",
        help="import a Python module first, for instance one that registers controllers for scenes; may be repeated",
    )  # fmt: skip
    subparsers = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for entry in sorted(pkgutil.iter_modules(commands.__path__), key=lambda module: module.name):
        module = importlib.import_module(f"omniroll.commands.{entry.name}")
        command = subparsers.add_parser(
            entry.name, help=module.SUMMARY, description=module.SUMMARY, epilog=_epilog(module.EXAMPLES),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )  # fmt: skip
        module.add_arguments(command)
        command.set_defaults(run=module.run, parser=top)
    return top


def _epilog(examples: Sequence[tuple[str, str]]) -> str:
    """What stands below the help of a command: (call, what it does), and the exit codes."""
    shown = (f"  {call}\n      {effect}" for call, effect in examples)
    return "\n".join(["examples:", *shown, "", EXIT_CODES])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; its exit code."""
    formatted = warnings.formatwarning
    warnings.formatwarning = lambda message, *_, **__: f"warning: {message}\n"  # without a line of source
    try:
        return _run(arguments)
    except KeyboardInterrupt:
        print("omniroll: interrupted", file=sys.stderr)
        return INTERRUPTED
    finally:
        warnings.formatwarning = formatted


def _run(arguments: Sequence[str] | None) -> int:
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a name that the terminal's encoding has not is no reason to end
            stream.reconfigure(errors="backslashreplace")
    given = parser().parse_args(arguments)
    try:
        _import(given.modules)
        code = given.run(given)
        sys.stdout.flush()
        return code
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for what Python writes at its own end
        return CLOSED
    except (OmnirollError, OSError) as error:
        if isinstance(error, omniroll.SceneError):  # each of its lines begins with the file's name
            print(error, file=sys.stderr)
            return BAD_CALL
        of_file = isinstance(error, OSError) and error.filename is not None and error.strerror
        print(f"omniroll: {f'{error.filename}: {error.strerror}' if of_file else error}", file=sys.stderr)
        return next((code for kind, code in CODES.items() if isinstance(error, kind)), FAILED)


def _import(modules: Sequence[str]) -> None:
    """Import modules by name, also those of the working folder. Raises OmnirollError where one is not found."""
    if modules:
        sys.path.insert(0, "")  # as python -m does
    for name in modules:
        try:
            importlib.import_module(name)
        except ImportError as error:
            raise OmnirollError(f"--import {name}: {error}") from error


if __name__ == "__main__":
    sys.exit(main())

"""The command `omniroll`. Each command is a module of omniroll.commands.

Such a module has
    SUMMARY                    one line for the help
    add_arguments(parser)      its arguments, on an argparse parser
    run(arguments) -> int      the work; returns the exit code
Its name is the command's. Exit codes, which main() makes of errors that a command lets pass:
    0  done
    1  something that the work needs is missing or cannot be written
    2  the call or the scene makes no sense
    3  the simulation stopped before its end
    130  interrupted
"""

import argparse
import importlib
import pkgutil
import sys
from collections.abc import Sequence

import omniroll
from omniroll import commands
from omniroll.errors import InvalidValueError, OmnirollError, SimulationStopped
from omniroll.scenes import SceneError

FAILED, BAD_CALL, STOPPED, INTERRUPTED = 1, 2, 3, 130
EXIT_CODES = "Exit code: 0 done, 1 failed, 2 bad call or scene, 3 the simulation stopped, 130 interrupted."
CODES = {InvalidValueError: BAD_CALL, SimulationStopped: STOPPED}


def parser() -> argparse.ArgumentParser:
    """The parser of the command line, with every command that omniroll.commands has."""
    top = argparse.ArgumentParser(prog="omniroll", description=omniroll.__doc__.splitlines()[0])
    top.add_argument("--version", action="version", version=f"omniroll {omniroll.__version__}")
    subparsers = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for found in sorted(pkgutil.iter_modules(commands.__path__), key=lambda module: module.name):
        module = importlib.import_module(f"omniroll.commands.{found.name}")
        command = subparsers.add_parser(found.name, help=module.SUMMARY, description=module.SUMMARY)
        module.add_arguments(command)
        command.epilog = EXIT_CODES
        command.set_defaults(run=module.run)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; its exit code."""
    given = parser().parse_args(arguments)
    try:
        return given.run(given)
    except SceneError as error:  # each of its lines begins with the file's name
        print(error, file=sys.stderr)
        return BAD_CALL
    except (OmnirollError, OSError) as error:
        print(f"omniroll: {error}", file=sys.stderr)
        return next((code for kind, code in CODES.items() if isinstance(error, kind)), FAILED)
    except KeyboardInterrupt:
        print("omniroll: interrupted", file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())

"""The command `omniroll`. Each command is a module of omniroll.commands.

Such a module has
    SUMMARY                    one line for the help
    add_arguments(parser)      its arguments, on an argparse parser
    run(arguments) -> int      the work; returns the exit code
Its name is the command's. Exit codes: 0 done, 1 the work failed, 2 the call made no sense.
"""

import argparse
import importlib
import pkgutil
import sys
from collections.abc import Sequence

import omniroll
from omniroll import commands
from omniroll.errors import InvalidValueError, OmnirollError


def parser() -> argparse.ArgumentParser:
    """The parser of the command line, with every command that omniroll.commands has."""
    top = argparse.ArgumentParser(prog="omniroll", description=omniroll.__doc__.splitlines()[0])
    top.add_argument("--version", action="version", version=f"omniroll {omniroll.__version__}")
    subparsers = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for found in sorted(pkgutil.iter_modules(commands.__path__), key=lambda module: module.name):
        module = importlib.import_module(f"omniroll.commands.{found.name}")
        command = subparsers.add_parser(found.name, help=module.SUMMARY, description=module.SUMMARY)
        module.add_arguments(command)
        command.set_defaults(run=module.run)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; its exit code."""
    given = parser().parse_args(arguments)
    try:
        return given.run(given)
    except InvalidValueError as error:
        print(f"omniroll: {error}", file=sys.stderr)
        return 2
    except (OmnirollError, OSError) as error:
        print(f"omniroll: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())

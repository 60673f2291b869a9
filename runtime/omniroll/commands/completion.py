"""omniroll completion SHELL: what makes the shell complete commands, options and files."""

import argparse

import shtab

SHELLS = ("bash", "zsh", "fish")
SUMMARY = "print what makes a shell complete omniroll's commands, options and files"
EXAMPLES = (
    (
        "omniroll completion bash > ~/.local/share/bash-completion/completions/omniroll",
        "for bash, from the next shell on",
    ),
    ("omniroll completion zsh > ~/.zsh/completions/_omniroll", "for zsh, with that folder in fpath"),
    ("omniroll completion fish > ~/.config/fish/completions/omniroll.fish", "for fish"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=SHELLS, help="the shell")


def run(arguments: argparse.Namespace) -> int:
    """0 where it was printed. `arguments.parser` is the parser of the whole command line."""
    print(shtab.complete(arguments.parser, arguments.shell))
    return 0

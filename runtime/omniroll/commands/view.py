"""omniroll view RUN ...: a page on which runs move."""

import argparse
from pathlib import Path

from shtab import FILE

from omniroll.scenes.kept_runs import shown_runs
from omniroll.viewer.page import view_of

PAGE = "runs.html"  # no name of a file of a run's results: those have checksums
SUMMARY = "write one HTML file on which runs move in 3-D, beside their speeds, energy and ledger"
EXAMPLES = (
    ("omniroll view out/run/motion-3 --open", "one run"),
    ("omniroll view out/run/motion-3 out/run/motion-3-impact", "two runs beside each other"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "runs",
        nargs="+",
        type=Path,
        metavar="RUN",
        help="a folder that omniroll run has written, or a trajectory as .npz or .csv; up to four on one page",
    ).complete = FILE
    parser.add_argument(
        "--output", type=Path, metavar="FILE", help=f"default: {PAGE} beside the first run"
    ).complete = FILE
    parser.add_argument("--title", help="what stands above the page; default: the runs' names")
    parser.add_argument("--open", action="store_true", help="open the page in the browser")


def run(arguments: argparse.Namespace) -> int:
    """0 where the page was written. Raises InvalidValueError for what holds no run, OSError where files fail."""
    shown = shown_runs(arguments.runs)
    first = arguments.runs[0]
    output = arguments.output or (first if first.is_dir() else first.parent) / PAGE
    page = view_of(shown, arguments.title or ", ".join(one.label for one in shown))
    page.open(output) if arguments.open else page.save(output)
    print(output)
    return 0

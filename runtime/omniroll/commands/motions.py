"""omniroll motions [FOLDER]: the motions of the paper's section 5, beside what the paper says of them."""

import importlib.util
from argparse import ArgumentParser, Namespace
from pathlib import Path

from omniroll.errors import OmnirollError

SUMMARY = "run the motions of the paper's section 5; write pictures, data and a page"


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("folder", nargs="?", type=Path, default="out/motions", help="default: %(default)s")


def run(arguments: Namespace) -> int:
    """0 where all was written. Raises OmnirollError where matplotlib is missing."""
    if importlib.util.find_spec("matplotlib") is None:
        raise OmnirollError("motions draws with matplotlib, which is missing: pip install 'omniroll[plots]'")
    from omniroll.studies.motions.writing import write_all

    write_all(arguments.folder)
    return 0

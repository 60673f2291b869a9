"""omniroll motions [FOLDER]: the motions of the paper's section 5, beside what the paper says of them."""

from argparse import ArgumentParser, Namespace
from pathlib import Path

from shtab import DIRECTORY

from omniroll import extras

SUMMARY = "run the motions of the paper's section 5; write pictures, data and a page"
EXAMPLES = (("omniroll motions", "into out/motions/; begin with index.html"),)


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument(
        "folder", nargs="?", type=Path, default="out/motions", help="default: %(default)s"
    ).complete = DIRECTORY


def run(arguments: Namespace) -> int:
    """0 where all was written. Raises MissingPackageError where matplotlib is missing."""
    extras.needed("matplotlib", "plots", "motions")
    from omniroll.studies.motions.writing import write_all

    write_all(arguments.folder)
    return 0

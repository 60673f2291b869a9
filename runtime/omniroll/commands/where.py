"""omniroll where SYMBOL: the way of a symbol from the paper to the engine."""

import json
import shutil
import sys
import textwrap
from argparse import ArgumentParser, Namespace

from omniroll.kernels.origins import MOST_PLACES, Place, way

SUMMARY = "follow a symbol from the paper's equation to the line of the engine that uses it"
EXAMPLES = (
    ("omniroll where m13", "an entry of the mass matrix; m*_13 and 7.1:m13 are the same"),
    ("omniroll where 3.4", "an equation of the paper"),
    ("omniroll where '\\rho_i'", "a symbol as LaTeX has it"),
    ("omniroll where forward_dynamics --json", "a function, as data"),
)


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument(
        "symbol",
        metavar="SYMBOL",
        help="a symbol as the paper, LaTeX or the code has it (m*_13, \\rho_i, nu_3), an equation (3.4), a formula "
        "(7.1:m13), a function (forward_dynamics) or an effect",
    )
    parser.add_argument("--all", action="store_true", help="every place, however many there are")
    parser.add_argument("--json", action="store_true", help="an object with all places")


def run(arguments: Namespace) -> int:
    """0 where the way was shown. Raises InvalidValueError for an unknown name."""
    found = way(arguments.symbol)
    if arguments.json:
        json.dump(found.as_dict(), sys.stdout, indent=1)
        print()
        return 0
    print(f"{found.name}{': ' + found.meaning if found.meaning else ''}")
    if not found.stations["paper"]:
        print("No equation of the paper is known to have it.")
    hops = [(station, places) for station, places in found.stations.items() if places]
    for number, (station, places) in enumerate(hops, 1):
        print(f"\n{number}. {station}")
        shown = places if arguments.all else places[: MOST_PLACES[station]]
        for place in shown:
            print(line(place))
        if len(shown) < len(places):
            print(f"   ... and {len(places) - len(shown)} more; --all shows them")
    return 0


def line(place: Place) -> str:
    """One place on one line of the terminal."""
    where = f"{place.file}:{place.line}" if place.line else place.file
    width = max(60, shutil.get_terminal_size((120, 24)).columns)
    return textwrap.shorten(f"   {where}  {place.text}", width, placeholder=" ...").replace(where, f"   {where}", 1)

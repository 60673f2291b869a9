"""What twelve derivatives cost: instructions of `simulate` with them over those without, for each run of
sensitivities/costs.py. `python -m costs.derivatives [RUN ...]` from tests/ prints the table of the page."""

import sys

from sensitivities.costs import TASKS

from .counting import CONTROLLED, DERIVED, FOLLOWED, counted_parts

PARTS = CONTROLLED, FOLLOWED, DERIVED


def row(name: str) -> str:
    """Millions of instructions of a run with its control, and of the same with derivatives; of these what C does for
    the derivatives, and what Python does; with them over without."""
    counts = counted_parts("sensitivities.costs", [name], PARTS)[name]
    plain, followed, derived = (count / 1e6 for count in counts)
    cells = [f"{cell:.1f}" for cell in (plain, plain + derived, followed, derived - followed)]
    return f"| {name} | {' | '.join(cells)} | {1 + derived / plain:.1f} |"


def main(*names: str) -> None:
    print("| run | plain | with 12 | of these C | Python | ratio |\n" + "| --- " * 6 + "|")
    for name in names or TASKS:
        print(row(name), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])

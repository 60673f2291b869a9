"""`python -m benchmarks [question ...]` from tests/: asks the questions, all or those named, for docs/benchmarks.md.

The page is written anew where all are asked. One that is asked alone takes its own section of the page, on which the
others stay.
"""

import sys
from functools import reduce

import matplotlib

matplotlib.use("Agg")

from . import (  # noqa: E402
    batch,
    calls,
    derivatives,
    driven,
    environments,
    limit,
    motion,
    prices,
    right_hand_side,
    sweeps,
    switch_cost,
)
from .common import ROOT  # noqa: E402
from .page import page, section, with_answer  # noqa: E402

QUESTIONS = {
    "right_hand_side": right_hand_side,
    "batch": batch,
    "motion": motion,
    "switch_cost": switch_cost,
    "calls": calls,
    "sweeps": sweeps,
    "environments": environments,
    "derivatives": derivatives,
    "driven": driven,
    "prices": prices,
    "limit": limit,
}
PAGE = ROOT / "docs/benchmarks.md"


def main() -> int:
    names = sys.argv[1:] or list(QUESTIONS)
    unknown = [name for name in names if name not in QUESTIONS]
    if unknown:
        print(f"unknown: {', '.join(unknown)}; there are: {', '.join(QUESTIONS)}", file=sys.stderr)
        return 2
    answers = []
    for name in names:
        print(f"... {name}", file=sys.stderr, flush=True)
        answers.append(QUESTIONS[name].answer())
        print(section(answers[-1]), flush=True)
    if names == list(QUESTIONS):
        text = page(answers)
    else:
        text = reduce(with_answer, answers, PAGE.read_text(encoding="utf-8"))
    PAGE.write_text(text, encoding="utf-8")
    print("written: docs/benchmarks.md", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""`python -m benchmarks [question ...]` from tests/: runs the questions and writes docs/benchmarks.md.

With questions named, only these run and their part is printed; the page is not written.
"""

import sys

import matplotlib

matplotlib.use("Agg")

from . import batch, motion, mujoco_vehicle, right_hand_side, switch_cost  # noqa: E402
from .common import ROOT  # noqa: E402
from .page import page, section  # noqa: E402

QUESTIONS = {
    "right_hand_side": right_hand_side,
    "batch": batch,
    "motion": motion,
    "mujoco_vehicle": mujoco_vehicle,
    "switch_cost": switch_cost,
}


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
    if not sys.argv[1:]:
        (ROOT / "docs/benchmarks.md").write_text(page(answers), encoding="utf-8")
        print("written: docs/benchmarks.md", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())

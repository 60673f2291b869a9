"""`python -m benchmarks [question ...]` from tests/: asks the questions, all or those named, for docs/benchmarks.md.

Answers are kept in out/benchmarks/, so that one question can be asked again; the page is written when all are there.
"""

import pickle
import sys

import matplotlib

matplotlib.use("Agg")

from . import batch, calls, environments, motion, mujoco_vehicle, right_hand_side, sweeps, switch_cost  # noqa: E402
from .common import ROOT  # noqa: E402
from .page import page, section  # noqa: E402

QUESTIONS = {
    "right_hand_side": right_hand_side,
    "batch": batch,
    "motion": motion,
    "mujoco_vehicle": mujoco_vehicle,
    "switch_cost": switch_cost,
    "calls": calls,
    "sweeps": sweeps,
    "environments": environments,
}


KEPT = ROOT / "out/benchmarks"


def main() -> int:
    names = sys.argv[1:] or list(QUESTIONS)
    unknown = [name for name in names if name not in QUESTIONS]
    if unknown:
        print(f"unknown: {', '.join(unknown)}; there are: {', '.join(QUESTIONS)}", file=sys.stderr)
        return 2
    KEPT.mkdir(parents=True, exist_ok=True)
    for name in names:
        print(f"... {name}", file=sys.stderr, flush=True)
        answer = QUESTIONS[name].answer()
        (KEPT / f"{name}.pickle").write_bytes(pickle.dumps(answer))
        print(section(answer), flush=True)
    kept = [KEPT / f"{name}.pickle" for name in QUESTIONS]
    missing = [path.stem for path in kept if not path.exists()]
    if missing:
        print(f"not written, no answers yet: {', '.join(missing)}", file=sys.stderr)
        return 0
    (ROOT / "docs/benchmarks.md").write_text(page([pickle.loads(path.read_bytes()) for path in kept]), encoding="utf-8")
    print("written: docs/benchmarks.md", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())

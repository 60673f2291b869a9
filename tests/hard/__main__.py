"""`python -m hard [case ...]` from tests/: measures the cases in full, all or those named, and writes what it finds
into docs/hard-cases.md after each; what the page holds of others stays.
"""

import sys
import time
from pathlib import Path

from .case import Scale
from .collection import all_cases
from .page import page

PAGE = Path(__file__).resolve().parents[2] / "docs/hard-cases.md"


def main() -> int:
    cases = {case.name: case for case in all_cases()}
    names = sys.argv[1:] or list(cases)
    unknown = [name for name in names if name not in cases]
    if unknown:
        print(f"unknown: {', '.join(unknown)}; there are: {', '.join(cases)}", file=sys.stderr)
        return 2
    is_kept = True
    for place, name in enumerate(names, start=1):
        start = time.perf_counter()
        print(f"... {place}/{len(names)} {name}", file=sys.stderr, end="", flush=True)
        measurements = list(cases[name].run(Scale.FULL))
        PAGE.write_text(
            page(cases.values(), [(cases[name], measurements)], PAGE.read_text(encoding="utf-8")), encoding="utf-8"
        )
        broken = [m for m in measurements if not m.kept]
        is_kept = is_kept and not broken
        verdict = "NOT KEPT" if broken else "kept"
        print(f": {verdict}, {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)
    return 0 if is_kept else 1


if __name__ == "__main__":
    sys.exit(main())

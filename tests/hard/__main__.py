"""`python -m hard [case ...]` from tests/: measures the cases in full and writes docs/hard-cases.md.

With cases named, only these run and their part is printed; the page is not written.
"""

import sys
import time
from pathlib import Path

from .case import Scale
from .collection import all_cases
from .page import page, section

PAGE = Path(__file__).resolve().parents[2] / "docs/hard-cases.md"


def main() -> int:
    cases = {case.name: case for case in all_cases()}
    names = sys.argv[1:] or list(cases)
    unknown = [name for name in names if name not in cases]
    if unknown:
        print(f"unknown: {', '.join(unknown)}; there are: {', '.join(cases)}", file=sys.stderr)
        return 2
    results = []
    for place, name in enumerate(names, start=1):
        start = time.perf_counter()
        print(f"... {place}/{len(names)} {name}", file=sys.stderr, end="", flush=True)
        measurements = cases[name].run(Scale.FULL)
        results.append((cases[name], measurements))
        verdict = "kept" if all(m.kept for m in measurements) else "NOT KEPT"
        print(f": {verdict}, {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)
    if sys.argv[1:]:
        for result in results:
            print(section(result[0].section, [result]))
    else:
        PAGE.write_text(page(results), encoding="utf-8")
        print("written: docs/hard-cases.md", file=sys.stderr)
    return 0 if all(m.kept for _, measurements in results for m in measurements) else 1


if __name__ == "__main__":
    sys.exit(main())

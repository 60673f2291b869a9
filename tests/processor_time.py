"""Processor time of tests: recorded by the conftest for each test, children included, and held to a budget by folder.

`python tests/processor_time.py` prints what was recorded by folder, and the tests that take most; it fails where a
folder takes more than its budget.
"""

import json
import resource
import sys
import tomllib
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RECORD = ROOT / "out/tests/processor-time.json"
BUDGETS = ROOT / "tests/budgets.toml"
KEY = "processor time"
SHOWN = 30
MINUTE = 60  # s


def used() -> float:
    """Seconds of this process and of its children that have ended."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in both)


def keep(seconds: dict[str, float]) -> None:
    """Add what a session took, by test; an earlier time of the same test is replaced."""
    kept = recorded()
    kept.update({name: round(value, 3) for name, value in seconds.items()})
    RECORD.parent.mkdir(parents=True, exist_ok=True)
    RECORD.write_text(json.dumps(kept, indent=0, sort_keys=True), encoding="utf-8")


def recorded() -> dict[str, float]:
    """Seconds by test; empty where nothing was recorded."""
    try:
        return json.loads(RECORD.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def budgets() -> dict[str, float]:
    """Minutes by folder of tests/; "tests" are the files beside the folders."""
    return tomllib.loads(BUDGETS.read_text(encoding="utf-8"))["minutes"]


def folder_of(test: str) -> str:
    parts = test.split("::")[0].split("/")[1:-1]
    return parts[0] if parts else "tests"


def by_folder(seconds: dict[str, float]) -> dict[str, float]:
    """Minutes."""
    found: Counter[str] = Counter()
    for test, value in seconds.items():
        found[folder_of(test)] += value / MINUTE
    return dict(found)


def main() -> int:
    seconds, allowed = recorded(), budgets()
    minutes = by_folder(seconds)
    for folder in sorted(minutes, key=minutes.__getitem__, reverse=True):
        over = "  more than its budget" if minutes[folder] > allowed.get(folder, 0) else ""
        print(f"{folder:20} {minutes[folder]:6.2f} of {allowed.get(folder, 0):5.1f} min{over}")
    print(f"{'all':20} {sum(minutes.values()):6.2f} of {sum(allowed.values()):5.1f} min\n")
    for test in sorted(seconds, key=seconds.__getitem__, reverse=True)[:SHOWN]:
        print(f"{seconds[test]:7.1f} s  {test}")
    return int(any(value > allowed.get(folder, 0) for folder, value in minutes.items()))


if __name__ == "__main__":
    sys.exit(main())

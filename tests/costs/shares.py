"""Where the engine's instructions go: callgrind's counts of motion 3 by the file that each line stands in, inlined or
not."""

import re
from collections import Counter
from pathlib import PurePath

import omniroll

from .counting import under_callgrind

MODELS, NU, LENGTH, ACCURACY = ("locked", "free"), (1.0, 0.0, 1.0), 20.0, 1e-6
PARTS = {
    "kernel_in_lanes.h": "the kernel",
    "nodes.h": "sums over the nodes",
    "collocation.c": "the iteration",
    "lanes.h": "the iteration",
    "events.c": "where the step ends",
    "steps.c": "steps",
    "instant.c": "steps",
    "run.c": "steps",
    "transitions.c": "transitions",
    "rows.c": "rows and polynomials for the caller",
}
REST = "the rest"
FILE = re.compile(r"(?:fl|fi|fe|cfi|cfl)=\((\d+)\)(?: (.*))?$")
COST = re.compile(r"(?:[+-]?\d+|\*) (\d+)$")


def by_file(text: str) -> Counter:
    """{name of a file: instructions of its lines}, of what callgrind has written. A line that costs what a call costs
    stands after the call and is left out."""
    names: dict[str, str] = {}
    found, current, called = Counter(), "", False
    for line in text.splitlines():
        if entry := FILE.match(line):
            if entry[2]:
                names[entry[1]] = PurePath(entry[2]).name
            if not line.startswith("c"):
                current = names[entry[1]]
        elif line.startswith("calls="):
            called = True
        elif entry := COST.match(line):
            found[current] += 0 if called else int(entry[1])
            called = False
    return found


def task(roller_model):
    """The arguments of a run."""
    return {
        "vehicle": omniroll.Vehicle.paper(), "nu": NU, "duration": LENGTH, "roller_model": roller_model,
        "switching": "smooth", "accuracy": ACCURACY,
    }  # fmt: skip


def shares() -> dict[str, dict[str, float]]:
    """{roller model: {part of the engine: its share of the instructions}}, the largest first."""
    _, texts = under_callgrind("costs.shares", list(MODELS), flags="-g")
    found = {}
    for name in MODELS:
        parts = Counter()
        for file, count in by_file(texts[name]).items():
            parts[PARTS.get(file, REST)] += count
        found[name] = {part: count / parts.total() for part, count in parts.most_common()}
    return found

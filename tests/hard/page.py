"""The page of results, docs/hard-cases.md."""

import math
import platform
import sys
from pathlib import Path

import numpy as np

from .case import SECTIONS, Case, Measurement

CORNERS = Path(__file__).with_name("corners.md")
INTRODUCTION = """# Hard cases

Written by `make hard` (tests/hard/, one file a subject). Each case is held to a number: a promise is a bound, and
`make test` fails where one is broken. A cell shows the worst of all settings as *measured* <= *bound*, with the
setting where it was; naive is the same number from a naive implementation of the same case, its best setting first.
"""


def number(value: float) -> str:
    if not math.isfinite(value):
        return "no answer" if value > 0 else str(value)
    return f"{value:.0f}" if value == int(value) and abs(value) < 1e5 else f"{value:.2g}"


def groups(measurements: list[Measurement]) -> list[list[Measurement]]:
    """By quantity, engine or kernel, and number type."""
    found: dict[tuple, list[Measurement]] = {}
    for m in measurements:
        found.setdefault((m.what, m.on, m.number_type), []).append(m)
    return list(found.values())


def measured_cell(group: list[Measurement]) -> str:
    worst = max(group, key=lambda m: (m.share, m.measured))
    shown = (
        f"{number(worst.measured)} <= {number(worst.bound)}"
        if worst.kept
        else (f"**{number(worst.measured)} > {number(worst.bound)}**")
    )
    return f"{shown} ({worst.setting})" if worst.setting else shown


def naive_cell(group: list[Measurement]) -> str:
    values = sorted(m.naive for m in group if m.naive is not None)
    if not values:
        return ""
    least, most = number(values[0]), number(values[-1])
    return least if least == most else f"{least} ... {most}"


def rows(case: Case, measurements: list[Measurement]) -> list[list[str]]:
    """A line for each quantity on each engine or kernel; the words of the case stand in the first."""
    found = []
    for group in groups(measurements):
        words = [f"**{case.title}**", case.naive, case.promise] if not found else ["", "", ""]
        m = group[0]
        found.append([*words, m.what, f"{m.on}, {m.number_type}", measured_cell(group), naive_cell(group)])
    return found


def table(headings: list[str], lines: list[list[str]]) -> str:
    cells = [" | ".join(cell.replace("|", "\\|") for cell in line) for line in [headings, *lines]]
    return "\n".join(["| " + cells[0] + " |", "|" + " --- |" * len(headings), *("| " + c + " |" for c in cells[1:])])


HEADINGS = ["case", "a naive implementation", "promise", "quantity", "on", "measured", "naive"]


def section(title: str, results: list[tuple[Case, list[Measurement]]]) -> str:
    lines = [line for case, measurements in results for line in rows(case, measurements)]
    return f"## {title}\n\n{table(HEADINGS, lines)}\n"


def summary(results: list[tuple[Case, list[Measurement]]]) -> str:
    broken = [case.title for case, measurements in results if not all(m.kept for m in measurements)]
    count = sum(len(measurements) for _, measurements in results)
    where = f"{platform.system()} on {platform.machine()}, Python {sys.version.split()[0]}, NumPy {np.__version__}"
    kept = "All promises are kept." if not broken else f"**Not kept: {'; '.join(broken)}.**"
    return f"{len(results)} cases, {count} measurements, {where}. {kept}\n"


def page(results: list[tuple[Case, list[Measurement]]]) -> str:
    parts = [INTRODUCTION, summary(results)]
    for title in SECTIONS:
        own = [result for result in results if result[0].section == title]
        if own:
            parts.append(section(title, own))
    return "\n".join([*parts, CORNERS.read_text(encoding="utf-8")])

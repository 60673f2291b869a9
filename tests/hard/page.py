"""The page of results, docs/hard-cases.md."""

import math
import platform
import re
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from .case import SECTIONS, Case, Measurement

CORNERS = Path(__file__).with_name("corners.md")
INTRODUCTION = """# Hard cases

Written by `make hard` (tests/hard/, one file a subject). Each case is held to a number: a promise is a bound, and
`make test-long` fails where one is broken. A cell shows the worst of all settings as *measured* <= *bound*, with the
setting where it was; naive is the same number from the formulas as they are printed, its best setting first.
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


HEADINGS = ["case", "a naive implementation", "promise", "quantity", "on", "measured", "naive"]
OF_A_CASE = re.compile(r"\| \*\*(.*?)\*\* \|")  # the first line of its rows
BROKEN = re.compile(r"\| \*\*(no answer|\S+) > \S+\*\*")  # a cell whose bound is not kept


def line(cells: list[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def blocks(text: str) -> dict[str, list[str]]:
    """The lines of each case that a page holds, by its title as it is written there."""
    found: dict[str, list[str]] = {}
    own: list[str] | None = None
    for written in text.splitlines():
        first = OF_A_CASE.match(written)
        if first:
            own = found.setdefault(first[1], [])
        if own is not None and written.startswith("|"):
            own.append(written)
        else:
            own = None
    return found


def summary(held: dict[str, list[str]]) -> str:
    broken = [title for title, lines in held.items() if any(BROKEN.search(written) for written in lines)]
    where = f"{platform.system()} on {platform.machine()}, Python {sys.version.split()[0]}, NumPy {np.__version__}"
    kept = "All promises are kept." if not broken else f"**Not kept: {'; '.join(broken)}.**"
    return f"{len(held)} cases, {where}. {kept}\n"


def page(cases: Iterable[Case], results: list[tuple[Case, list[Measurement]]], before: str = "") -> str:
    """The page, where cases that were measured take the place of what the page held of them.

    cases   all that there are; what the page holds of others goes
    before  the page as it is
    """
    measured = {case.name: [line(row) for row in rows(case, measurements)] for case, measurements in results}
    written, held, sections = blocks(before), {}, {title: [] for title in SECTIONS}
    for case in cases:
        lines = measured.get(case.name) or written.get(case.title.replace("|", "\\|"))
        if lines:
            held[case.title] = lines
            sections[case.section] += lines
    heading = [line(HEADINGS), "|" + " --- |" * len(HEADINGS)]
    tables = ["\n".join([f"## {title}\n", *heading, *lines, ""]) for title, lines in sections.items() if lines]
    return "\n".join([INTRODUCTION, summary(held), *tables, CORNERS.read_text(encoding="utf-8")])

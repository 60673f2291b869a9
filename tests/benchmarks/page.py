"""The page of results, docs/benchmarks.md."""

import re

from .common import Answer, Target, machine

INTRODUCTION = """# Benchmarks

Written by `make bench` (tests/benchmarks/, one file a question). All numbers of a table are from one run on one
machine; times are those of the one thread that computes, minima with medians in parentheses, and each stands beside
an error. A peer that is missing fails the run; none is left out.
"""


def table(headings: list[str], rows: list[list[str]]) -> str:
    lines = ["| " + " | ".join(headings) + " |", "|" + " --- |" * len(headings)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def section(answer: Answer) -> str:
    parts = [f"## {answer.title}", answer.text, table(answer.headings, answer.rows)]
    if answer.closing:
        parts.append(answer.closing)
    if answer.targets:
        missed = [target for target in answer.targets if not target.reached]
        parts.append(f"Targets of this question: {len(answer.targets) - len(missed)} reached, {len(missed)} not.")
    parts += [f"![{answer.title}]({name})" for name in answer.figures]
    return "\n\n".join(parts) + "\n"


def goal(target: Target) -> list[str]:
    return [target.claim, target.measured, "yes" if target.reached else "**no**"]


def page(answers: list[Answer]) -> str:
    goals = table(["target", "measured", "reached"], [goal(target) for answer in answers for target in answer.targets])
    parts = [INTRODUCTION, table(["machine", ""], [list(row) for row in machine()]) + "\n"]
    parts += ["## What was to be reached\n", goals + "\n", *(section(answer) for answer in answers)]
    return "\n".join(parts)


def with_answer(text: str, answer: Answer) -> str:
    """A page with one question asked again: its section, and its rows among the targets; the others stay."""
    head, *sections = re.split(r"^(?=## \d+\. )", text, flags=re.MULTILINE)
    kept = [part for part in sections if not part.startswith(f"## {answer.title.split('.')[0]}. ")]
    new = [f"| {' | '.join(goal(target))} |" for target in answer.targets]
    claims = tuple(f"| {target.claim} |" for target in answer.targets)
    rows = [line for line in head.rstrip().splitlines() if not (claims and line.startswith(claims))]
    ordered = sorted([*kept, section(answer) + "\n"], key=lambda part: int(re.match(r"## (\d+)", part)[1]))
    return "\n".join([*rows, *new]) + "\n\n" + "".join(f"{part.rstrip()}\n\n" for part in ordered).rstrip() + "\n"

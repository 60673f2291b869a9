"""The page of results, docs/benchmarks.md."""

from .common import Answer, machine

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


def page(answers: list[Answer]) -> str:
    targets = [target for answer in answers for target in answer.targets]
    goals = table(
        ["target", "measured", "reached"],
        [[target.claim, target.measured, "yes" if target.reached else "**no**"] for target in targets],
    )
    parts = [INTRODUCTION, table(["machine", ""], [list(row) for row in machine()]) + "\n"]
    parts += ["## What was to be reached\n", goals + "\n", *(section(answer) for answer in answers)]
    return "\n".join(parts)

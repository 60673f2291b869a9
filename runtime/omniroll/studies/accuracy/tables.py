"""A study as text for the terminal, and as a page in Markdown."""

import math
import os
import platform
from importlib.metadata import version

from omniroll.studies.accuracy.study import Point, Study

COLUMNS = ("", "setting", "us/s", "evaluations", "end", "whole", "switches", "energy")
WIDTHS = (-20, 8, 9, 11, 8, 8, 8, 8)  # negative: from the left
MEANING = """\
"setting" is the tolerance, or of `RK4 fixed` the number of steps between two of the 41 samples; "us/s" are
microseconds per simulated second. Errors at the end and over the whole trajectory are in the norm of `accuracy`; that
of the switches is in seconds, with "-" where other switches were made; that of the energy is relative. "-" in the other
columns means that the motion grew without bound"""
INTEGRATORS = "Numerical accuracy"
PRICES = "each effect left out: the error, and the time over that of all effects"
PRICE_COLUMNS = ("left out", "error", "time")


def text(study: Study) -> str:
    """The tables, the laws and the advice."""
    lines = [_title(study), _reference(study), MEANING, "", INTEGRATORS, _line(COLUMNS)]
    lines += [*map(_line, _rows(study.points)), *_left_out(study)]
    lines += [f"not done: {line}" for line in study.failed]
    lines += ["", "error = C tol^E"] if study.laws else []
    lines += [f"  {name:<20} C = {c:8.2g}  E = {e:.2f}" for name, (c, e) in study.laws.items()]
    lines += ["", _models(study), _line(COLUMNS), *map(_line, _rows(study.models))]
    prices = _prices(study)
    lines += ["", PRICES, *("  {:<20} {:>8} {:>8}".format(*row) for row in (PRICE_COLUMNS, *prices))] if prices else []
    if study.advice is not None:
        lines += ["", *_advice(study.advice)]
    return "\n".join(lines)


def markdown(study: Study, figure: str | None = None) -> str:
    """The same as a page, with the machine; `figure` is the name of the picture's file."""
    laws = [(name, f"{c:.2g}", f"{e:.2f}") for name, (c, e) in study.laws.items()]
    picture = f"![Error against time, one curve per integrator and per model]({figure})\n\n" if figure else ""
    parts = [
        f"# {_title(study)}\n", f"Written by `omniroll accuracy`. {_machine()}. Compare times only within this page.\n",
        f"{_sentence(_reference(study))} {_sentence(MEANING)}\n", f"{picture}## {INTEGRATORS}\n",
        _table(COLUMNS, _rows(study.points)),
        "".join(f"{_sentence(line)}\n" for line in _left_out(study)),
        _table(("error = C tol^E", "C", "E"), laws) if laws else "",
        "".join(f"Not done: {line}.\n" for line in study.failed),
        f"## {_models(study)}\n", _table(COLUMNS, _rows(study.models)),
        f"{_sentence(PRICES)}\n\n{_table(PRICE_COLUMNS, _prices(study))}" if _prices(study) else "",
        "## Advice\n\n" + "".join(f"- {line}\n" for line in _advice(study.advice)) if study.advice else "",
    ]  # fmt: skip
    return "\n".join(part for part in parts if part)


def fullest(study: Study) -> str:
    """The model that the others are measured against."""
    return "free rollers, all effects" if study.effects else "free rollers"


def _title(study: Study) -> str:
    return f"{study.scene}: {study.model} rollers, {study.law} switches, {study.duration:g} s"


def _reference(study: Study) -> str:
    return (
        f"reference: two solutions in extended precision, {study.confirmed:.1e} apart; "
        f"an error below 100 times that distance, {study.floor:.1e}, is shown as {study.floor:.1e}"
    )


def _left_out(study: Study) -> list[str]:
    """Integrators that do not run scenes with effects."""
    return [f"without effects only, and not run here: {', '.join(study.left_out)}"] if study.left_out else []


def _models(study: Study) -> str:
    return (
        f"Model accuracy: against {fullest(study)} "
        f"(an error below {study.models_floor:.1e} is shown as {study.models_floor:.1e})"
    )


def _prices(study: Study) -> list[tuple[str, str, str]]:
    """What is left out, the error of that, and the time over that of the fullest model, at the finest tolerance."""
    finest = {point.series: point for point in study.models}
    return [
        (name.removeprefix("without "), f"{p.trajectory:.1e}", f"{p.microseconds / finest['free'].microseconds:.2f}")
        for name, p in finest.items()
        if name.startswith("without")
    ]


def _machine() -> str:
    return (
        f"{platform.system()} on {platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, "
        f"SciPy {version('scipy')}"
    )


def _sentence(words: str) -> str:
    return words[0].upper() + words[1:].replace("\n", " ") + "."


def _rows(points: list[Point]) -> list[tuple[str, ...]]:
    rows, last = [], None
    for p in points:
        name, last = ("" if p.series == last else p.series), p.series
        setting = f"{p.setting:.0e}" if p.setting < 1 else f"{p.setting:.0f}"
        errors = (p.end, p.trajectory, p.switch_times, p.energy)
        shown = ("-" if math.isnan(value) else f"{value:.1e}" for value in errors)
        rows.append((name, setting, f"{p.microseconds:.1f}", str(p.evaluations), *shown))
    return rows


def _line(cells: tuple[str, ...]) -> str:
    pairs = zip(cells, WIDTHS, strict=True)
    return " ".join(cell.ljust(-width) if width < 0 else cell.rjust(width) for cell, width in pairs).rstrip()


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ("---", *("---:" for _ in head[1:])), *rows]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def _advice(advice: dict) -> list[str]:
    now, then, finest = advice["cheapest"], advice["next_digit"], advice["finest"]
    if now is None:
        return [f"An error of {advice['wanted']:g} cannot be met here. The smallest measured: {_offer(finest)}"]
    lines = [f"For an error of {advice['wanted']:g}: {_offer(now)}"]
    if then is None:
        lines.append(f"The next digit cannot be had here. The smallest error measured: {_offer(finest)}")
    elif then == now:
        lines.append("The next digit costs nothing: this setting has it.")
    else:
        lines.append(f"The next digit takes {advice['times']:.2f} times as long: {_offer(then)}")
    return [*lines, "The times of omniroll's own engines are those of simulate(..., control=False)."]


def _offer(offer: dict | None) -> str:
    if offer is None:
        return "nothing was"
    words = ("{unit} {setting:g}" if offer["unit"] == "tolerance" else "{setting:g} {unit}").format_map(offer)
    return (
        f"{_model(offer['model'])}, {offer['integrator']}, {words}: "
        f"error {offer['error']:.1e}, {offer['microseconds']:.0f} us/s"
    )


def _model(name: str) -> str:
    return f"free rollers {name}" if name.startswith("without") else f"{name} rollers"

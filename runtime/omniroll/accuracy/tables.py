"""A study as text for the terminal."""

from omniroll.accuracy.study import Point, Study

HEAD = f"{'':<18} {'setting':>8} {'us/s':>9} {'evaluations':>11} {'end':>8} {'whole':>8} {'switches':>8} {'energy':>8}"


def text(study: Study) -> str:
    """The tables, the laws and the advice."""
    lines = [
        f"{study.scene}: {study.model} rollers, {study.law} switches, {study.duration:g} s",
        f"reference: confirmed to {study.confirmed:.1e}; errors below {study.floor:.1e} are shown as that",
        "us/s: microseconds per simulated second; end, whole: error at the end and over the trajectory in the",
        "norm of `accuracy`; switches: of their times in s, - where they are others; energy: relative",
        "", "Numerical accuracy" + (", without the scene's effects" if study.effects else ""), HEAD,
        *_rows(study.points),
    ]  # fmt: skip
    lines += [f"not done: {line}" for line in study.failed]
    lines += ["", "error = C tol^E"]
    lines += [f"  {name:<16} C = {c:8.2g}  E = {e:.2f}" for name, (c, e) in study.laws.items()]
    lines += ["", f"Model accuracy: against {fullest(study)}", HEAD, *_rows(study.models)]
    if study.advice is not None:
        lines += ["", *_advice(study.advice)]
    return "\n".join(lines)


def fullest(study: Study) -> str:
    """The model that the others are measured against."""
    return "free rollers, all effects" if study.effects else "free rollers"


def _rows(points: list[Point]) -> list[str]:
    lines, last = [], None
    for p in points:
        name, last = ("" if p.series == last else p.series), p.series
        times = f"{p.switch_times:8.1e}" if p.switch_times == p.switch_times else f"{'-':>8}"
        setting = f"{p.setting:8.0e}" if p.setting < 1 else f"{p.setting:8.0f}"
        lines.append(
            f"{name:<18} {setting} {p.microseconds:9.1f} {p.evaluations:11d} {p.end:8.1e} {p.trajectory:8.1e} "
            f"{times} {p.energy:8.1e}"
        )
    return lines


def _model(name: str) -> str:
    return f"free rollers {name}" if name.startswith("without") else f"{name} rollers"


def _advice(advice: dict) -> list[str]:
    def said(offer: dict | None) -> str:
        if offer is None:
            return "nothing that was measured"
        return (
            f"{_model(offer['model'])}, {offer['integrator']}, setting {offer['setting']:g}: "
            f"error {offer['error']:.1e}, {offer['microseconds']:.0f} us/s"
        )

    lines = [f"For an error of {advice['wanted']:g}: {said(advice['cheapest'])}"]
    lines.append(f"The next digit: {said(advice['next_digit'])}")
    if advice["cheapest"] and advice["next_digit"]:
        ratio = advice["next_digit"]["microseconds"] / advice["cheapest"]["microseconds"]
        lines.append(f"It costs {ratio:.2f} times as much.")
    return lines

"""python -m codegen.what_if: what follows from a changed assumption.

Runs the derivation of maxima/ as it stands in the working tree. Proofs that fail do not stop it; they are listed with
what is left of their claims, in the order of the derivation: the first ones say where the change comes in, the others
follow. The equations that have changed are printed, old and new, and all equations are written as LaTeX; a text file
beside that has what is too long for the terminal. Nothing in generated/ changes. With --only-paper the steps of
maxima/paper/ are run alone: the same equations, and the proofs about them.
"""

import argparse
import json
import re
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from .__main__ import ROOT, SCRIPT, say
from .expressions import Canonical, Expression, Order, Power
from .infix import Infix
from .latex import Latex
from .maxima import Maxima, MaximaError
from .rendering import template

LONGEST = 300  # characters of a residual or an equation that are printed
REPEATED = re.compile(r"(?<![\w^])(\w+(?:\(\w+\))?)(?:\*\1(?![\w(^]))+")  # R*R*R


@dataclass(frozen=True)
class Change:
    """An equation, as it was and as it follows now; None where it is not there."""

    id: str
    title: str
    source: str
    left: str
    old: Expression | None
    new: Expression | None


class Plain(Infix):
    """Expressions as plain text."""

    def symbol(self, name: str) -> str:
        return name

    def call(self, function: str, argument: str) -> str:
        return f"{function}({argument})"

    def ratio(self, p: int, q: int) -> str:
        return f"{p}/{q}"

    def expression(self, e: Expression) -> str:
        if isinstance(e, Power) and e.exponent > 0:
            return f"{self.factor(e.base)}^{e.exponent}"
        return super().expression(e)


def main(arguments: list[str] | None = None) -> int:
    """Exit code: 0 whatever follows, 2 where Maxima itself failed."""
    parser = argparse.ArgumentParser(prog="python -m codegen.what_if", description=__doc__)
    parser.add_argument("--script", type=Path, default=SCRIPT, metavar="FILE", help="the derivation's entry")
    parser.add_argument("--old", type=Path, default=ROOT / "generated/data/equations.json", metavar="FILE")
    parser.add_argument("--only-paper", action="store_true", help="run the steps of maxima/paper/ alone")
    parser.add_argument("--output", type=Path, default=ROOT / "out/what-if/equations.tex", metavar="FILE")
    options = parser.parse_args(arguments)
    try:
        found = derive(options.script, options.only_paper)
    except MaximaError as problem:
        print(f"codegen: {problem}", file=sys.stderr)
        return 2
    order = Order(found["symbols"])
    changes = compared(json.loads(options.old.read_text(encoding="utf-8"))["equations"], found["equations"], order)
    say("\n".join(map(shortened, report(found, changes))))
    options.output.parent.mkdir(parents=True, exist_ok=True)
    in_full = options.output.with_suffix(".txt")
    in_full.write_text("\n".join([*report(found, changes), ""]), encoding="utf-8")
    options.output.write_text(latex_text(found["symbols"], changes), encoding="utf-8")
    say(f"\nthe same in full: {in_full}\nLaTeX, old and new: {options.output}")
    return 0


def derive(script: Path, only_paper: bool) -> dict:
    flags = ("collect_failures", "only_paper") if only_paper else ("collect_failures",)
    with tempfile.TemporaryDirectory(prefix="omniroll-") as folder:
        output = Path(folder) / "what-if.json"
        Maxima.find(say).derive(script, output, lambda line: None, flags=flags)
        return json.loads(output.read_text(encoding="utf-8"))


def compared(old: list[dict], new: list[dict], order: Order) -> list[Change]:
    """Every equation that is on either side, in the new order, with both of its forms."""
    read = Canonical(order).read
    before, after = ({entry["id"]: entry for entry in entries} for entries in (old, new))

    def change(name: str) -> Change:
        entry = after.get(name) or before[name]
        forms = (read(side[name]["expr"]) if name in side else None for side in (before, after))
        return Change(name, entry["title"], entry["source"], entry["left"], *forms)

    return [change(name) for name in dict.fromkeys([*after, *before])]


def report(found: dict, changes: list[Change]) -> list[str]:
    """Lines: what failed, and the equations that are not what they were."""
    failures, stopped = found["failures"], found["stopped"]
    lines = [f"{found['proofs']} proofs hold, {len(failures)} fail"]
    for failure in failures:
        lines += [
            f"  {failure['name']} ({failure['file']}): {failure['claim']}",
            f"    leaves {failure['residual']}",
        ]
    for stop in stopped:
        lines += [f"{stop['file']} stopped before its end: {stop['error']}"]
    changed = [change for change in changes if change.old != change.new]
    lines += ["", f"{len(changed)} of {len(changes)} equations change"]
    for change in changed:
        lines += [f"  {change.id}, {change.title}", f"    old {plain(change.old)}", f"    new {plain(change.new)}"]
    return lines


def plain(e: Expression | None) -> str:
    return "none" if e is None else REPEATED.sub(as_power, Plain().expression(e))


def as_power(found: re.Match) -> str:
    return f"{found[1]}^{found[0].count(found[1])}"


def shortened(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."


def latex_text(symbols: dict, changes: list[Change]) -> str:
    latex = Latex({name: entry["latex"] for name, entry in symbols.items()})
    return template("what_if.tex", latex=latex, changes=changes)


if __name__ == "__main__":
    sys.exit(main())

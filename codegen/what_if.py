"""python -m codegen.what_if: what follows from a changed assumption.

Runs the derivation of maxima/ as it stands in the working tree. Proofs that fail do not stop it. Of each file of
maxima/paper/ the first that fails is printed, with what is left of its claim: the first of all says where the change
comes in, the others follow. Of the other folders they are counted: the forms there are those of the old assumption. The
equations that have changed are printed, old and new, and all equations are written as LaTeX; a text file beside that
has every proof that fails, and what is too long for the terminal. Nothing in generated/ changes. With --only-paper the
steps of maxima/paper/ are run alone: the same equations, and the proofs about them.

With --run SCENE the equations are written as a Python kernel, and the scene's vehicle moves by them, without what acts
on it in the scene, beside its motion by the old ones; a picture shows both. Symbols that the vehicle does not have get
their numbers by --number NAME=VALUE.
"""

import argparse
import json
import math
import re
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

from .__main__ import ROOT, SCRIPT, say
from .expressions import SUMS, Call, Canonical, Expression, Order, Power, symbols
from .infix import Infix
from .latex import Latex, summands, symbol_names
from .maxima import Maxima, MaximaError
from .rendering import template
from .what_if_kernel import kernel_text

GENERAL = ("paper", "machinery")  # folders whose steps hold for any assumption
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
    parser.add_argument("--run", type=Path, metavar="SCENE", help="simulate the scene's bare vehicle by both equations")
    parser.add_argument("--number", type=number, action="append", default=[], metavar="NAME=VALUE", help="of a symbol")
    options = parser.parse_args(arguments)
    if options.run and not options.run.is_file():
        parser.error(f"argument --run: {options.run}: no such file; give a scene, for instance scenes/motion-3.toml")
    if options.number and not options.run:
        parser.error("argument --number: a number is one of the motion; give --run SCENE, too")
    try:
        found = derive(options.script, options.only_paper)
    except MaximaError as problem:
        print(f"codegen: {problem}", file=sys.stderr)
        return 2
    order = Order(found["symbols"])
    changes = compared(json.loads(options.old.read_text(encoding="utf-8"))["equations"], found["equations"], order)
    new = new_symbols(changes)
    say("\n".join(map(shortened, ["", *first_failures(found), *new, *changed_equations(changes, LONGEST)])))
    options.output.parent.mkdir(parents=True, exist_ok=True)
    in_full = options.output.with_suffix(".txt")
    in_full.write_text("\n".join([*every_failure(found), *new, *changed_equations(changes), ""]), encoding="utf-8")
    options.output.write_text(latex_text(found, changes), encoding="utf-8")
    say(f"\nthe same in full: {in_full}\nLaTeX, old and new: {options.output}")
    return run(options, changes) if options.run else 0


def number(text: str) -> tuple[str, float]:
    """The name and the value of NAME=VALUE. Raises argparse.ArgumentTypeError."""
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} must be NAME=VALUE, one number, as in g=9.81") from None


def run(options: argparse.Namespace, changes: list[Change]) -> int:
    """The motions by the old and by the new equations, and their picture."""
    from omniroll import OmnirollError, load_scene
    from omniroll.studies import what_if as study

    folder, motions = options.output.parent, {}
    try:
        scene = load_scene(options.run)
        for word, of_change in (("old", attrgetter("old")), ("new", attrgetter("new"))):
            kernel = folder / f"kernel_{word}.py"
            equations = {change.id: of_change(change) for change in changes if of_change(change) is not None}
            kernel.write_text(kernel_text(equations), encoding="utf-8")
            motions[word] = study.by_scene(study.loaded(kernel), scene, dict(options.number))
            say(f"{word}: {study.described(motions[word])}")
    except (OmnirollError, ValueError) as problem:
        print(f"codegen: {problem}", file=sys.stderr)
        return 2
    drawn = study.picture(motions, folder / "motion.png", f"{scene.name}: old and changed assumption")
    say(f"kernels: {folder / 'kernel_new.py'}, kernel_old.py\npicture: {drawn}")
    return 0


def derive(script: Path, only_paper: bool) -> dict:
    flags = ("collect_failures", "only_paper") if only_paper else ("collect_failures",)
    with tempfile.TemporaryDirectory(prefix="omniroll-") as folder:
        output = Path(folder) / "what-if.json"
        Maxima.find(say).derive(script, output, say, flags=flags)
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


def first_failures(found: dict) -> list[str]:
    """Lines: how many proofs fail; of each file of paper/ the first, with how many more there are; of other folders how
    many.
    """
    lines = [counted(found)]
    of_files: dict[str, list[dict]] = {}
    for failure in found["failures"]:
        of_files.setdefault(failure["file"], []).append(failure)
    for file, (first, *more) in of_files.items():
        if file.split("/")[0] in GENERAL:
            others = ", ".join(failure["name"] for failure in more)
            lines += [*failed(first), *([f"    and {len(more)} more of this file: {others}"] if more else [])]
    elsewhere = Counter(folder for file in of_files.values() for folder in folders_of(file) if folder not in GENERAL)
    if elsewhere:
        counts = ", ".join(f"{number} of {folder}/" for folder, number in elsewhere.items())
        lines += [f"  {counts}: written for the old assumption; the text file has them"]
    return [*lines, *stops(found)]


def folders_of(failures: list[dict]) -> list[str]:
    return [failure["file"].split("/")[0] for failure in failures]


def every_failure(found: dict) -> list[str]:
    """Lines: how many proofs fail, and which."""
    return [counted(found), *(line for failure in found["failures"] for line in failed(failure)), *stops(found)]


def counted(found: dict) -> str:
    return f"{found['proofs']} proofs hold, {len(found['failures'])} fail"


def failed(failure: dict) -> list[str]:
    return [
        f"  {failure['name']} ({failure['file']}): {failure['claim']}",
        f"    leaves {failure['residual']}",
    ]


def stops(found: dict) -> list[str]:
    return [f"{stop['file']} stopped before its end: {stop['error']}" for stop in found["stopped"]]


def new_symbols(changes: list[Change]) -> list[str]:
    """A line: the symbols that come in. What is missing here has dropped out, or means something in maxima/ already."""
    old, new = (
        {name for change in changes if side(change) is not None for name in symbols(side(change))}
        for side in map(attrgetter, ("old", "new"))
    )
    names = sorted(new - old)
    return [f"new in the equations: {', '.join(names)}"] if names else []


def changed_equations(changes: list[Change], longest: float = math.inf) -> list[str]:
    """Lines: the equations that are not what they were; of those that are longer than `longest` letters the terms that
    go and come.
    """
    changed = [change for change in changes if change.old != change.new]
    lines = ["", f"{len(changed)} of {len(changes)} equations change"]
    for change in changed:
        old, new = plain(change.old), plain(change.new)
        both = [f"    old {old}", f"    new {new}"]
        lines += [f"  {change.id}, {change.title}", *(both if max(len(old), len(new)) <= longest else terms_of(change))]
    return lines


def terms_of(change: Change) -> list[str]:
    """Lines: the terms that an equation loses and gains."""
    old, new = (dict.fromkeys(terms(side)) for side in (change.old, change.new))
    lost = [f"    loses {term}" for term in old if term not in new]
    return lost + [f"    gains {term}" for term in new if term not in old]


def terms(e: Expression | None) -> list[str]:
    """The terms of an expression in plain text, those under a sum each with its sum."""
    if e is None:
        return []
    match e:
        case Call(function, inner) if function in SUMS:
            return [f"{function}({term})" for term in terms(inner)]
    parts = summands(e)
    return [plain(e)] if parts == (e,) else [term for part in parts for term in terms(part)]


def plain(e: Expression | None) -> str:
    return "none" if e is None else REPEATED.sub(as_power, Plain().expression(e))


def as_power(found: re.Match) -> str:
    return f"{found[1]}^{found[0].count(found[1])}"


def shortened(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."


def latex_text(found: dict, changes: list[Change]) -> str:
    latex = Latex(symbol_names(found["symbols"], found))
    return template("what_if.tex", latex=latex, changes=changes)


if __name__ == "__main__":
    sys.exit(main())

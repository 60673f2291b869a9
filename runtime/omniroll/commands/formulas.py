"""omniroll formulas [ID]: the paper's formulas, compared with the derivation."""

import difflib
import json
import shutil
import sys
import textwrap
from argparse import ArgumentParser, Namespace
from importlib import resources

from omniroll.errors import InvalidValueError, OmnirollError

SUMMARY = "show which of the paper's formulas agree with the derivation, and what the others should say"
EXAMPLES = (
    ("omniroll formulas", "the list, in the paper's order"),
    ("omniroll formulas --counts", "how many have each verdict, and where all are read"),
    ("omniroll formulas 7.1:m33", "one formula in full"),
    ("omniroll formulas --verdict misprint", "only those with this verdict"),
)
WIDTH = 100  # of a terminal that does not say how wide it is
VERDICTS = (
    "misprint", "fails", "ambiguous", "undefined", "agrees-if", "holds-if", "agrees", "holds", "not judged",
)  # fmt: skip


def add_arguments(parser: ArgumentParser) -> None:
    parser.add_argument("id", nargs="?", metavar="ID", help="one entry in full, for instance 7.1:m33")
    parser.add_argument("--verdict", choices=VERDICTS, help="only the entries with this verdict")
    parser.add_argument("--counts", action="store_true", help="how many entries have each verdict, without the list")
    parser.add_argument("--json", action="store_true", help="a list of objects, mathematics as LaTeX")


def run(arguments: Namespace) -> int:
    """0 where the entries were shown. Raises InvalidValueError for an unknown id."""
    records = chosen(load(), arguments.id, arguments.verdict)
    if arguments.json:
        json.dump(records, sys.stdout, indent=1)
        print()
    elif arguments.id:
        print(entry(records[0], columns()))
    elif arguments.counts:
        print(f"{counted(records)}\nall of them: generated/formulas/formulas.md, or omniroll formulas")
    else:
        print(table(records, columns()))
    return 0


def load() -> list[dict]:
    """The records of generated/formulas/formulas.json."""
    file = resources.files("omniroll.generated").joinpath("formulas", "formulas.json")
    try:
        return json.loads(file.read_text(encoding="utf-8"))["formulas"]
    except FileNotFoundError:
        raise OmnirollError("the comparison with the paper is not installed: make formulas") from None


def chosen(records: list[dict], name: str | None, verdict: str | None) -> list[dict]:
    """The records with that id and that verdict; all where they are None."""
    if name is not None:
        known = [record["id"] for record in records]
        if name not in known:
            raise InvalidValueError("ID", name, f"no such formula; {nearest(name, known)}")
        records = [record for record in records if record["id"] == name]
    return [record for record in records if verdict in (None, record["verdict"])]


def nearest(name: str, known: list[str]) -> str:
    """What may have been meant: names that begin or look alike, else where to look."""
    begun = [other for other in known if other.lower().startswith(name.lower())]
    alike = difflib.get_close_matches(name, known, n=5, cutoff=0.4)
    names = list(dict.fromkeys(begun + alike))[:5]
    return f"nearest: {', '.join(names)}" if names else "`omniroll formulas` lists them all"


def columns() -> int:
    return max(60, shutil.get_terminal_size((WIDTH, 24)).columns)


def table(records: list[dict], width: int) -> str:
    """One line or more an entry: id, verdict, what to know."""
    ids = max((len(record["id"]) for record in records), default=2)
    verdicts = max((len(record["verdict"]) for record in records), default=7)
    indent = " " * (ids + verdicts + 4)
    lines = []
    for record in records:
        head = f"{record['id']:<{ids}}  {record['verdict']:<{verdicts}}  "
        lines += filled(said_of(record), width, head, indent)
    return "\n".join([*lines, "", counted(records)])


def counted(records: list[dict]) -> str:
    """How many entries have each verdict."""
    counts = {verdict: sum(r["verdict"] == verdict for r in records) for verdict in VERDICTS}
    total = ", ".join(f"{number} {verdict}" for verdict, number in counts.items() if number)
    return f"{len(records)} entries: {total or 'none'}"


def said_of(record: dict) -> str:
    """The entry in one sentence."""
    text = record["text"]
    if record["kind"] == "formula":
        return text["title"] if record["verdict"] == "agrees" else text["summary"]
    if record["kind"] == "unjudged":
        return f"{text['printed']}: {text['note']}"
    return text["printed"] if record["verdict"] == "holds" else f"{text['printed']} {text['derived']}."


def entry(record: dict, width: int) -> str:
    """One entry in full."""
    text = record["text"]
    place = f"equation ({record['equation']})" if record["equation"] else place_of(record["section"])
    title = f", {text['title']}" if text["title"] else ""
    lines = [f"{record['id']}  {record['verdict']}  ({place}{title})", ""]
    formula = record["kind"] == "formula"
    short = formula and record["verdict"] != "agrees"
    rows = [
        ("printed" if formula else "claim", text["printed"]),
        ("should be" if record["verdict"] == "misprint" else "derived", text["derived"] if formula else ""),
        ("difference", text["difference"]),
        ("counterexample", text.get("counterexample", "")),
        ("in short", text["summary"] if short else ""),
        *((("true" if c["holds"] else "false"), case_of(c)) for c in record.get("cases", [])),
        ("note", text["note"]),
        ("shown by", f"{record['run']} in tests/formulas" if record["run"] else ""),
        ("checked", checked(record) if formula else ""),
    ]
    for name, value in rows:
        if value:
            lines += filled(value, width, f"  {name + ':':<16}", " " * 18)
    return "\n".join(lines)


def place_of(section: str) -> str:
    return f"section {section}" if section.isdigit() else section


def case_of(case: dict) -> str:
    own = " (the paper's own setting)" if case["own"] else ""
    return (case["condition"] or "as it stands") + own


def checked(record: dict) -> str:
    """How the verdict was reached."""
    if record["brute_force"]:
        wheels, rollers = record["brute_force"]
        return f"for all N and n by parts, and by brute force for N = {wheels}, n = {rollers}"
    return "for a generic wheel"


def filled(text: str, width: int, head: str, indent: str) -> list[str]:
    """Text wrapped behind a head."""
    return textwrap.wrap(
        text,
        width,
        initial_indent=head,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    ) or [head.rstrip()]

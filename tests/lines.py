"""Lines by room, blank ones and comments included, beside the budgets of budgets.toml; `make lines` prints them."""

import re
import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WRITTEN = (".c", ".h", ".py", ".mac", ".j2", ".js", ".mjs", ".css")
CONDITION = re.compile(r"^\s*#\s*(?:el)?if(?:n?def)?\b(.*)", re.MULTILINE)
NAME = re.compile(r"\b[A-Z_][A-Z0-9_]{2,}\b")
GUARD = re.compile(r"_H_?$")
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
STRUCT = re.compile(r"\bstruct\s*\w*\s*\{((?:[^{}]|\{[^{}]*\})*)\}\s*(\w*)")
SIZES = re.compile(r"\[[^\]]*\]|\([^()]*\)")  # of arrays; and what functions take


def lines(files: Iterable[Path]) -> int:
    return sum(file.read_text(encoding="utf-8").count("\n") for file in files)


def of(*folders: str) -> list[Path]:
    return [file for folder in folders for file in sorted((ROOT / folder).rglob("*"))
            if file.suffix in WRITTEN and not {"node_modules", "built", "__pycache__"} & set(file.parts)]  # fmt: skip


def conditions() -> tuple[int, set[str]]:
    """How many there are of the preprocessor in csrc, and the names they ask for; guards of headers are none."""
    asked = [told for file in of("runtime/csrc") for told in CONDITION.findall(file.read_text(encoding="utf-8"))]
    names = [{name for name in NAME.findall(told) if not GUARD.search(name)} for told in asked]
    return sum(map(bool, names)), set().union(*names)


def fields_of_structs() -> dict[str, int]:
    """How many names each struct of csrc declares; those of a struct written inside it count too."""
    found = {}
    for file in of("runtime/csrc"):
        for body, name in STRUCT.findall(COMMENT.sub("", file.read_text(encoding="utf-8"))):
            told = [names for names in SIZES.sub("", body).split(";") if names.strip()]
            found[f"{file.name}: {name}"] = sum(names.count(",") + 1 for names in told)
    return found


def main() -> int:
    allowed = tomllib.loads((ROOT / "tests/budgets.toml").read_text(encoding="utf-8"))["lines"]
    count, names = conditions()
    pages = {page: lines([page]) for page in sorted((ROOT / "docs").glob("*.md"))}
    longest = max(pages, key=pages.__getitem__)
    rows = [
        ("runtime/csrc", lines(of("runtime/csrc")), allowed["csrc"]),
        ("  #if there", count, allowed["ifs"]),
        ("  names that they ask for", len(names), allowed["names"]),
        ("  fields of the largest struct", max(fields_of_structs().values()), allowed["fields"]),
        ("omniroll/effects, engine", lines(of("runtime/omniroll/effects", "runtime/omniroll/engine")),
         allowed["effects_and_engine"]),
        ("tests", lines(of("tests")), allowed["tests"]),
        (f"docs/{longest.name}, the longest page", pages[longest], allowed["page"]),
        *((room, lines(of(room)), None) for room in ("maxima", "codegen", "runtime/omniroll", "viewer/src")),
    ]  # fmt: skip
    for name, found, most in rows:
        print(f"{name:44} {found:7}" + ("" if most is None else f" of {most:6}" + "  over" * (found > most)))
    print("names:", ", ".join(sorted(names)))
    return 0


if __name__ == "__main__":
    sys.exit(main())

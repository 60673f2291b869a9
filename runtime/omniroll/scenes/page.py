"""The tables of docs/scenes.md, written from the schema: python -m omniroll.scenes.page docs/scenes.md"""

import sys
from pathlib import Path

from omniroll.scenes.schema import (
    KIND_OF_WHEEL,
    KIND_OF_WHEELS,
    NUMBERS,
    PARTS,
    PRESET,
    SCENE,
    SHARED,
    SHEET,
    SIZES,
    WHEEL_KINDS,
    Table,
)
from omniroll.vocabulary import Entry

BEGIN, END = "<!-- written from the schema -->", "<!-- up to here -->"
WAYS = (
    ("with every vehicle", SIZES + SHARED),
    ("rollers at an angle (mecanum) or in two rows", KIND_OF_WHEELS),
    ("wheels of several kinds", WHEEL_KINDS),
    ("a preset", PRESET),
    ("or numbers", NUMBERS),
    ("or parts", PARTS),
    ("beside parts, from data sheets", SHEET),
)


def tables() -> str:
    """Every table of a scene as Markdown."""
    vehicle, *others = SCENE
    return "\n\n".join(_table(table) for table in (vehicle, KIND_OF_WHEEL, *others))


def page(text: str) -> str:
    """The page's text with its tables written anew."""
    before, rest = text.split(BEGIN)
    return f"{before}{BEGIN}\n\n{tables()}\n\n{END}{rest.split(END)[1]}"


def _table(table: Table) -> str:
    needed = " Needed." if table.needed else ""
    lines = [f"### [{table.name}]", "", table.meaning + needed]
    for title, keys in WAYS if table.name == "vehicle" else ((None, table.keys),):
        lines += ["", f"*{title}*"] if title else []
        lines += ["", "| key | unit | value | default | |", "| --- | --- | --- | --- | --- |", *map(_row, keys)]
    return "\n".join(lines)


def _row(key: Entry) -> str:
    default = "**needed**" if key.needed else key.default or "-"
    about = key.meaning + (f". {key.note}" if key.note else "")
    return f"| `{key.name}` | {key.unit or '-'} | {key.kind.shown()} | {default} | {about} |"


if __name__ == "__main__":
    file = Path(sys.argv[1])
    file.write_text(page(file.read_text(encoding="utf-8")), encoding="utf-8")

"""Writes docs/derivation.wxm, a notebook for wxMaxima, from the page maxima-session.md: its text, and what it asks."""

import re
from pathlib import Path

HERE = Path(__file__).parent
BLOCK = re.compile(r"^```text\n(.*?)^```\n", re.MULTILINE | re.DOTALL)
ASKED = re.compile(r"^\(%i\d+\) (.*[;$])$", re.MULTILINE)
FIRST = 'load("../maxima/paper.mac")$ display2d: true$'  # wxMaxima works in the folder of its file
HEAD = "/* [wxMaxima batch file version 1] [ DO NOT EDIT BY HAND! ]*/\n/* [ written from docs/maxima-session.md ] */\n"


def notebook(page: str) -> str:
    """The file's text: cells of the page's headings and paragraphs, and one of input for each line that it asks."""
    cells = []
    for number, piece in enumerate(BLOCK.split(page)):
        if number % 2:
            cells += [cell("input", asked) for asked in ASKED.findall(piece)]
        else:
            cells += [worded(text) for text in piece.strip().split("\n\n") if text]
    return HEAD + "\n".join([cells[0], cell("input", FIRST), *cells[1:]])


def worded(text: str) -> str:
    """A cell of a heading or a paragraph, without the marks of links."""
    plain = re.sub(r"\[([^\]]+)\]\([^)]+\)", r"\1", text).replace("*/", "* /").replace("\\*", "*")
    if plain.startswith("# "):
        return cell("title", plain[2:])
    return cell("section", plain[3:]) if plain.startswith("## ") else cell("comment", plain)


def cell(kind: str, text: str) -> str:
    begin = f"/* [wxMaxima: {kind:7} start ]"
    return f"{begin} */\n{text}\n/* [wxMaxima: {kind:7} end   ] */\n" if kind == "input" else (
        f"{begin}\n{text}\n   [wxMaxima: {kind:7} end   ] */\n")  # fmt: skip


if __name__ == "__main__":
    (HERE / "derivation.wxm").write_text(notebook((HERE / "maxima-session.md").read_text()))

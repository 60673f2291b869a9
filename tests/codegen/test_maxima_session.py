"""The session with Maxima in docs/: each line, asked again, is answered as the page says, and so asks the notebook."""

import re
import runpy
from pathlib import Path

import pytest

from codegen.maxima import Maxima, installed

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/maxima-session.md"
BLOCK = re.compile(r"^```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)
ASKED = re.compile(r"^\(%i\d+\) (.*[;$])$")


def answered(page: str) -> list[tuple[str, str]]:
    """(what is asked, the answer) of each line of the page."""
    found: list[tuple[str, str]] = []
    for block in BLOCK.findall(page):
        for line in block.splitlines():
            asked = ASKED.match(line)
            if asked:
                found.append((asked[1], ""))
            else:
                found[-1] = (found[-1][0], f"{found[-1][1]}{line}\n")
    return found


def script(lines: list[str]) -> str:
    """What asks the lines after each other, with a mark before each answer."""
    asked = [
        f'printf(true, "answer {number}~%")$ {line}'
        if line.endswith("$")
        else f'printf(true, "answer {number}~%~a~%", {line[:-1]})$'
        for number, line in enumerate(lines)
    ]
    written = 's: openw(output_file)$ printf(s, "~a", "{}")$ close(s)$'
    return "\n".join([f'load("{ROOT}/maxima/paper.mac")$', *asked, written])


def said(lines: list[str], folder: Path) -> list[str]:
    """What the pinned Maxima answers: others order terms differently."""
    told: list[str] = []
    (folder / "session.mac").write_text(script(lines))
    Maxima.at(installed(lambda line: None)).derive(folder / "session.mac", folder / "done.json", told.append)
    answers = "\n".join([*told, ""]).split("answer 0\n", 1)[1]
    return re.split(r"answer \d+\n", answers)


@pytest.mark.long
def test_the_page_has_what_maxima_answers(tmp_path):
    page = answered(PAGE.read_text())
    assert len(page) > 10
    assert said([asked for asked, _ in page], tmp_path) == [answer for _, answer in page]


def test_the_notebook_asks_what_the_page_asks():
    text = (ROOT / "docs/derivation.wxm").read_text()
    assert text == runpy.run_path(str(ROOT / "docs/notebook.py"))["notebook"](PAGE.read_text())
    cells = re.findall(r"input   start \] \*/\n(.*?)\n/\* \[wxMaxima: input   end", text, re.DOTALL)
    assert cells[1:] == [asked for asked, _ in answered(PAGE.read_text())]

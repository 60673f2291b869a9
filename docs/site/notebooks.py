"""Writes the tutorials as notebooks of Jupyter: python notebooks.py FOLDER. Their Python is run, and prints what the
notebooks then have as its output; an example that fails ends the command."""

import argparse
import json
import os
import re
import warnings
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[2]
PYTHON = re.compile(r"^```python\n(.*?)^```\n(?:\n```text\n.*?^```\n)?", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"!?\[([^\[\]]*)\]\([^)\s]+\)")  # pages and pictures are not beside a notebook
KERNEL = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
NEEDS = "This notebook needs the package omniroll, and beside it the folder `scenes` of its repository."


def main(folder: Path) -> list[Path]:
    """Write a notebook of each tutorial that has Python."""
    folder.mkdir(parents=True, exist_ok=True)
    found = []
    for page in sorted((ROOT / "docs/tutorials").glob("*.md")):
        text = page.read_text(encoding="utf-8")
        if PYTHON.search(text):
            found.append(folder / f"{page.stem}.ipynb")
            cells = executed([*cells_of(text)])
            whole = {"nbformat": 4, "nbformat_minor": 5, "metadata": KERNEL, "cells": cells}
            found[-1].write_text(json.dumps(whole, indent=1) + "\n", encoding="utf-8")
    return found


def cells_of(text: str) -> Iterator[dict]:
    """Cells of a page: its text, and its Python, without what the page says that it prints."""
    for number, piece in enumerate(PYTHON.split(text)):
        if number % 2:
            yield _cell("code", number, piece.strip()) | {"outputs": [], "execution_count": None}
        elif plain := LINK.sub(r"\1", piece).strip():
            yield _cell("markdown", number, plain if number else f"{plain}\n\n{NEEDS}")


def _cell(kind: str, number: int, text: str) -> dict:
    return {"cell_type": kind, "id": f"cell-{number}", "metadata": {}, "source": text}


def executed(cells: list[dict]) -> list[dict]:
    """The cells with what their Python prints, one after the other, in a folder that has scenes/ alone."""
    names: dict = {"__name__": "__main__"}
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        os.symlink(ROOT / "scenes", Path(folder, "scenes"))
        with chdir(folder):
            code = [cell for cell in cells if cell["cell_type"] == "code"]
            for count, cell in enumerate(code, 1):
                with redirect_stdout(StringIO()) as printed:
                    exec(compile(cell["source"], cell["id"], "exec"), names)
                said = {"output_type": "stream", "name": "stdout", "text": printed.getvalue()}
                cell |= {"execution_count": count, "outputs": [said] if said["text"] else []}
    return cells


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("folder", type=Path)
    main(arguments.parse_args().folder)

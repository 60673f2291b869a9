"""One Maxima process for many questions: a script of statements, its answers as a list of strings."""

import json
import re
from pathlib import Path

from codegen.maxima import Maxima

ROOT = Path(__file__).resolve().parents[2]
DERIVATION = (
    "machinery/claims", "paper/geometry", "paper/constraints", "paper/roller_sums", "paper/parts",
    "paper/kinetic_energy", "paper/momenta", "paper/brackets", "paper/equations", "paper/vehicle", "paper/free_rollers",
    "paper/roller_models", "paper/switching", "paper/omni_wheels",
)  # fmt: skip
COMPARISON = (
    "comparison/printed", "comparison/printed_section2", "comparison/printed_section3",
    "comparison/printed_section4", "comparison/printed_appendix", "comparison/compare_with_paper",
    "comparison/compare_formulas",
)  # fmt: skip


def chapter(name: str, folder: Path = ROOT / "maxima") -> str:
    return f'load("{folder / name}.mac")'


def ask(statements: list[str], questions: list[str], folder: Path) -> list[str]:
    """The answers to questions, expressions that give strings, after the statements; an error answers "error"."""
    lines = ["only_paper_wheels: true$", *(f"{statement}$" for statement in statements)]
    lines.append(f'answers_: makelist("error", k_, 1, {len(questions)})$')
    for number, question in enumerate(questions, 1):
        lines.append(f"block([r_: errcatch({question})], if r_ # [] then answers_[{number}]: first(r_))$")
    lines.append(r"""answers_out_: openw(output_file)$""")
    lines.append(
        r"""printf(answers_out_, "[~a]", simplode(map(lambda([a_], sconcat("\"", a_, "\"")), answers_), ", "))$"""
    )
    lines.append("close(answers_out_)$")
    script, output = folder / "questions.mac", folder / "answers.json"
    script.write_text("\n".join(lines))
    Maxima.find(lambda line: None).derive(script, output, lambda line: None)
    return json.loads(output.read_text())


def defined_ids(file: str) -> list[str]:
    """The ids of the statements of one file of maxima/comparison/."""
    text = (ROOT / "maxima/comparison" / file).read_text()
    return re.findall(r'^(?:printed|claim|unjudged)\("([^"]*)"', text, re.MULTILINE)

"""One Maxima process for many questions: a script of statements, its answers as a list of strings."""

import json
import re
from pathlib import Path

from codegen.maxima import Maxima

ROOT = Path(__file__).resolve().parents[2]
DERIVATION = (
    "claims", "geometry", "constraints", "roller_sums", "parts", "kinetic_energy", "momenta", "brackets",
    "equations", "free_rollers", "roller_models",
)  # fmt: skip
COMPARISON = (
    "printed", "printed_section2", "printed_section3", "printed_section4", "printed_appendix",
    "compare_with_paper", "compare_formulas",
)  # fmt: skip
CLAIMS_ONLY = "prove(name, claim, residual) := 'unproved"


def chapter(name: str, folder: Path = ROOT / "maxima") -> str:
    return f'load("{folder / name}.mac")'


def ask(statements: list[str], questions: list[str], folder: Path) -> list[str]:
    """The answers to questions, expressions that give strings, after the statements; an error answers "error"."""
    lines = [f"{statement}$" for statement in statements]
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


def flipped(name: str, old: str, new: str, folder: Path) -> Path:
    """A copy of a chapter with one place changed."""
    text = (ROOT / "maxima" / f"{name}.mac").read_text()
    assert text.count(old) == 1, f"{name}.mac: {old!r} stands {text.count(old)} times"
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.mac").write_text(text.replace(old, new))
    return folder


def defined_ids(file: str) -> list[str]:
    return re.findall(r'^(?:printed|claim|unjudged)\("([^"]*)"', (ROOT / "maxima" / file).read_text(), re.MULTILINE)

"""Changed assumptions: what is printed of each is what follows from it, by another derivation in all coordinates."""

import json
import shutil
import tempfile
from pathlib import Path

import pytest
from assumptions import LETTERS, Assumption, all_assumptions, disagreements

from codegen.maxima import Maxima

ROOT = Path(__file__).resolve().parents[2]
FEW, EACH = 1, 9  # that are derived where there is little time, and of the others each seventh

READ = ("derive.mac", "machinery", "paper", "programs/notation.mac")
UNPROVED = "prove(name, claim, residual) := 'unproved$\n"
AS_IT_STANDS = ("map(lambda([f_], in_squares_of(f_, g)), ['sin, 'cos])", "[]")  # no search for the fewest terms


def derived(assumptions: list[Assumption], folder: Path, with_proofs: bool) -> list[dict]:
    """What the derivation of what-if writes of each, by one process of Maxima."""
    lines: list[str] = []
    for number, assumption in enumerate(assumptions):
        copy = folder / str(number)
        for name in READ:
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree if (ROOT / "maxima" / name).is_dir() else shutil.copy)(ROOT / "maxima" / name, copy / name)
        file = copy / f"paper/{assumption.file}.mac"
        file.write_text(assumption.applied(file.read_text()))
        if not with_proofs:
            with (copy / "machinery/claims.mac").open("a") as claims:
                claims.write(UNPROVED)
            equations = copy / "machinery/equations.mac"
            equations.write_text(equations.read_text().replace(*AS_IT_STANDS))
        settings = f'display2d: false, only_paper: true, collect_failures: true, output_file: "{copy}.json"'
        lines.append(f'kill(values)$ ({settings}, load("{copy}/derive.mac"))$')
    (folder / "all.mac").write_text("\n".join(lines))
    last = folder / f"{len(assumptions) - 1}.json"
    Maxima.find(lambda line: None).derive(folder / "all.mac", last, lambda line: None)
    return [json.loads((folder / f"{number}.json").read_text()) for number in range(len(assumptions))]


def wrong(assumptions: list[Assumption], folder: Path, with_proofs: bool) -> list[str]:
    """What is printed and wrong; and where the proof by Lagrange's equations fails, which holds whatever is changed."""
    found = []
    for assumption, data in zip(assumptions, derived(assumptions, folder, with_proofs), strict=True):
        differ = disagreements(data["equations"], assumption, seed=len(found) + 1)
        found += [f"{assumption.place} {assumption.words}: {one}" for one in differ]
        said = [failure["name"] for failure in data["failures"] if "Lagrange" in failure["name"]]
        found += [f"{assumption.place} {assumption.words}: {one}" for one in said]
    return found


def test_the_committed_equations_are_those_of_the_independent_derivation():
    data = json.loads((ROOT / "generated/data/equations.json").read_text())
    assert disagreements(data["equations"], None, seed=1) == []


def test_a_wrong_sign_would_be_found():
    data = json.loads((ROOT / "generated/data/equations.json").read_text())
    changed = [entry | {"expr": ["*", -1, entry["expr"]]} if entry["id"] == "3.4:3" else entry
               for entry in data["equations"]]  # fmt: skip
    assert len(disagreements(changed, None, seed=1)) == 1


def test_some_changed_assumptions(tmp_path):
    assert wrong(all_assumptions()[:FEW], tmp_path, with_proofs=True) == []


@pytest.mark.long
def test_more_changed_assumptions(tmp_path):
    """`PYTHONPATH=. python tests/codegen/test_assumptions.py` derives all, and prints what is wrong."""
    assumptions = all_assumptions()
    assert len(assumptions) >= 50 and len(LETTERS) == 48
    assert wrong(assumptions[FEW::EACH], tmp_path, with_proofs=False) == []


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as own:
        print(*wrong(all_assumptions(), Path(own), with_proofs=False), sep="\n")

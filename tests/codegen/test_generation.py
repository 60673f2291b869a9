"""Update and check are one code path; a derivation that fails stops the run and says why."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from toy import derivation

from codegen.__main__ import main
from codegen.derivation import Derivation
from codegen.programs import ContractError
from codegen.rendering import render

pytestmark = pytest.mark.long

ROOT = Path(__file__).parent.parent.parent
WRONG = [{"put": ["gain"], "expr": "zeta"}]


@pytest.fixture
def folder(toy_file, tmp_path):
    assert main(["--derivation", str(toy_file), "--output", str(tmp_path / "out")]) == 0
    return tmp_path / "out"


def check(toy_file, folder):
    return main(["--derivation", str(toy_file), "--output", str(folder), "--check"])


def test_check_names_different_missing_and_surplus_files(toy_file, folder, capsys):
    (folder / "c/toy.c").write_text("/* edited */\n")
    (folder / "python/toy.py").unlink()
    (folder / "c/old.c").write_text("\n")
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    assert check(toy_file, folder) == 1
    said = capsys.readouterr().out
    assert "different: c/toy.c" in said
    assert "missing: python/toy.py" in said
    assert "surplus: c/old.c" in said
    assert before == {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}, "a check writes nothing"
    assert main(["--derivation", str(toy_file), "--output", str(folder)]) == 0
    assert check(toy_file, folder) == 0


def test_a_folder_of_someone_else_is_left_alone(toy_file, tmp_path, capsys):
    (tmp_path / "letter.txt").write_text("dear")
    assert main(["--derivation", str(toy_file), "--output", str(tmp_path)]) == 2
    assert "codegen did not write" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["letter.txt"]


def test_order_of_the_data_and_hash_seed_do_not_matter(toy_file, folder, tmp_path):
    def reversed_sums(data):
        match data:
            case ["+" | "*" as head, *parts]:
                return [head, *map(reversed_sums, reversed(parts))]
            case list():
                return [reversed_sums(d) for d in data]
            case dict():
                return {key: reversed_sums(value) for key, value in data.items()}
        return data

    other = tmp_path / "other.json"
    other.write_text(json.dumps(reversed_sums(derivation())))
    for seed in ("0", "99"):
        command = [sys.executable, "-m", "codegen", "--check", "--derivation", other, "--output", folder]
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True, env=os.environ | {"PYTHONHASHSEED": seed})


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda d: d.pop("bounds"), "parts missing: bounds"),
        (lambda d: d.update(format=1), "not of format 3"),
        (lambda d: d["bases"].pop(), "functions of unknown sets: parts"),
        (lambda d: d["functions"].append(d["functions"][0]), "stands twice"),
        (lambda d: d.update(steps={}), "wheel_rates: no group of steps wheel"),
        (lambda d: d["functions"].append(d["functions"][0] | {"body": WRONG}), "toy.prepare: .*zeta"),
    ],
)  # fmt: skip
def test_data_that_breaks_the_contract_is_named(change, message):
    data = derivation() | {"functions": list(derivation()["functions"])}
    change(data)
    with pytest.raises(ContractError, match=message):
        render(Derivation(data))


@pytest.mark.parametrize("text", ["", '{"format": 1, "symb', "[]"])
def test_half_a_file_is_refused(text, tmp_path, capsys):
    file = tmp_path / "half.json"
    file.write_text(text)
    assert main(["--derivation", str(file), "--output", str(tmp_path / "out")]) == 2
    assert "half.json" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_emitted_data_can_be_derived_from_again(folder):
    """Canonical data renders to the same kernels: specialising needs no Maxima."""
    names = ("programs", "arguments", "symbols", "effects", "equations", "proofs", "bounds")
    parts = [json.loads((folder / f"data/{name}.json").read_text()) for name in names]
    data = {"format": 3, "sets": derivation()["sets"]} | {key: value for part in parts for key, value in part.items()}
    again = render(Derivation(data))
    assert all(again[path] == (folder / path).read_bytes() for path in again)

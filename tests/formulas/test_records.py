"""generated/formulas: complete, with the fields that it promises, and the command that shows it."""

import json
import re

import pytest
from maxima_session import ROOT, defined_ids

from omniroll.cli import main

FOLDER = ROOT / "generated/formulas"
RECORDS = json.loads((FOLDER / "formulas.json").read_text())["formulas"]
BY_ID = {record["id"]: record for record in RECORDS}
ASKED_FOR = """
2.1 2.2 2.3 V 3.2 Mq M* 3.3:P1 3.3:P2 3.3:P3 3.3:Ps PL:1 PL:2 PL:3 PL:s 3.4 7.1:m11 7.1:m22 7.1:m33 7.1:m12 7.1:m13
7.1:m23 7.2:p_x 7.2:p_y 7.2:p_theta 7.2:p_chi 7.2:p_phi_k 7.2:p_phi_s 7.3:P1 7.3:P2 7.3:P3 7.3:Ps 7:PP12 7:PP13 7:PP23
7:p12 7:p13 7:p23 7:S1 7:S2 7:S3 7:PPss 4:roller-equation 4:joint-angle 4:axis-radius property:1 property:2 property:3
property:4 property:5 section5:1 section5:2 section5:3
""".split()


def test_nothing_asked_for_is_missing():
    assert [name for name in ASKED_FOR if name not in BY_ID] == []
    tables = [f"7:S{group}:{k}" for group in (1, 2, 3) for k in (1, 2, 3)]
    assert set(tables) <= set(BY_ID)


def test_every_transcribed_formula_and_claim_is_judged():
    files = ["printed_section2", "printed_section3", "printed_section4", "printed_appendix"]
    listed = [name for file in files for name in defined_ids(f"{file}.mac")]
    listed += defined_ids("compare_claims.mac") + defined_ids("formula_notes.mac")
    assert sorted(listed) == sorted(BY_ID)
    assert len(set(listed)) == len(listed)


def test_claims_have_cases():
    for record in RECORDS:
        if record["kind"] == "claim":
            true = [case["holds"] for case in record["cases"]]
            expected = {"holds": all(true), "fails": not all(true), "holds-if": any(true) and not all(true)}
            assert expected[record["verdict"]], record["id"]


def test_runs_that_are_named_exist():
    text = (ROOT / "tests/formulas/test_claims_in_motion.py").read_text()
    named = {record["run"] for record in RECORDS if record["run"]}
    assert len(named) >= 10 and all(f"def {name}(" in text for name in named)
    assert all(r["run"] for r in RECORDS if r["verdict"] == "fails" and r["section"] == "5")


@pytest.mark.parametrize("page", ["formulas.md", "formulas.html"])
def test_page_opens_with_the_misprints_and_shows_all(page):
    text = (FOLDER / page).read_text()
    first = re.search(r"^(?:## |<h2>)(.*?)(?:</h2>)?$", text, re.MULTILINE)
    assert first[1] == "Misprints"
    opening = text[first.end() : re.search(r"Claims that fail", text).start()]
    wrong = [r["id"] for r in RECORDS if r["verdict"] == "misprint"]
    assert re.findall(r"[`>]([^`<>]+)(?:`\]|</code>)", opening) == wrong
    assert all(record["id"] in text for record in RECORDS)
    end = text[text.index("What cannot be judged") :]
    assert all(r["id"] in end for r in RECORDS if r["kind"] == "unjudged")
    assert "http" not in text.replace("http://www.w3.org", "")


# The command


def test_table(capsys):
    assert main(["formulas"]) == 0
    said = capsys.readouterr().out
    assert all(re.search(rf"^{re.escape(name)} +", said, re.MULTILINE) for name in BY_ID)
    assert f"{len(RECORDS)} entries" in said


def test_one_entry(capsys):
    assert main(["formulas", "7.1:m33"]) == 0
    said = capsys.readouterr().out
    assert "misprint" in said and "1/Lambda^2 (I_S" in said and "counterexample" in said


@pytest.mark.long
def test_every_entry_prints(capsys):
    for name in BY_ID:
        assert main(["formulas", name]) == 0
        assert "\\" not in capsys.readouterr().out


def test_json(capsys):
    assert main(["formulas", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [entry["id"] for entry in listed] == [record["id"] for record in RECORDS]
    assert main(["formulas", "7.3:P3", "--json"]) == 0
    assert [entry["verdict"] for entry in json.loads(capsys.readouterr().out)] == ["misprint"]
    assert main(["formulas", "--json", "--verdict", "fails"]) == 0
    assert {entry["verdict"] for entry in json.loads(capsys.readouterr().out)} == {"fails"}


def test_unknown_id(capsys):
    assert main(["formulas", "7.1:m32"]) == 2
    said = capsys.readouterr()
    assert said.out == "" and "7.1:m33" in said.err

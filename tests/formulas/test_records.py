"""generated/formulas: complete, with the fields that it promises, and the command that shows it."""

import json
import re

import pytest
from maxima_session import ROOT, defined_ids

from omniroll.cli import main

FOLDER = ROOT / "generated/formulas"
RECORDS = json.loads((FOLDER / "formulas.json").read_text())["formulas"]
BY_ID = {record["id"]: record for record in RECORDS}
FORMULA_VERDICTS = {"agrees", "agrees-if", "misprint", "ambiguous", "undefined"}
CLAIM_VERDICTS = {"holds", "holds-if", "fails"}
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


@pytest.mark.parametrize("record", RECORDS, ids=lambda r: r["id"])
def test_fields(record):
    promised = {"id", "verdict", "equation", "printed", "derived", "difference", "note", "summary", "section", "text"}
    assert promised <= set(record)
    verdicts = {"formula": FORMULA_VERDICTS, "claim": CLAIM_VERDICTS, "unjudged": {"not judged"}}[record["kind"]]
    assert record["verdict"] in verdicts
    assert "\\" not in json.dumps(record["text"]).replace('\\"', ""), "text for a terminal has no LaTeX"
    assert record["printed"] and (record["derived"] or record["kind"] == "unjudged")


@pytest.mark.parametrize("record", [r for r in RECORDS if r["kind"] == "formula"], ids=lambda r: r["id"])
def test_what_each_verdict_brings(record):
    verdict = record["verdict"]
    assert bool(record["assumptions"]) == (verdict == "agrees-if") or verdict == "undefined"
    assert bool(record["meanings"]) == (verdict == "undefined")
    assert (record["corrected"] is not None) == (record["counterexample"] is not None) == (verdict == "misprint")
    assert bool(record["readings"]) == (verdict == "ambiguous")
    if verdict == "agrees":
        assert record["difference"] == ""
    elif record["id"] not in ("4:axis-radius", "Mq"):
        assert record["difference"]
    if verdict == "misprint":
        assert record["counterexample"]["printed"] != record["counterexample"]["derived"]
        assert record["counterexample"]["values"]
        assert record["text"]["summary"].startswith("printed: ")


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


def test_an_undefined_symbol_has_one_meaning():
    meanings = {json.dumps(m["symbol"]): m["latex"] for r in RECORDS for m in r.get("meanings", [])}
    for record in RECORDS:
        for meaning in record.get("meanings", []):
            assert meanings[json.dumps(meaning["symbol"])] == meaning["latex"]


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


def test_every_line_of_the_misprints_is_one_line():
    text = (FOLDER / "formulas.md").read_text().split("## Misprints")[1].split("##")[0]
    lines = [line for line in text.splitlines() if line]
    assert all(line.startswith("- [") and "printed:" in line and "should be:" in line for line in lines)


# The command


def test_table(capsys):
    assert main(["formulas"]) == 0
    said = capsys.readouterr().out
    assert all(re.search(rf"^{re.escape(name)} +", said, re.MULTILINE) for name in BY_ID)
    assert f"{len(RECORDS)} entries" in said


def test_counts(capsys):
    """The last line of the list, and where all are read."""
    assert main(["formulas"]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert main(["formulas", "--counts"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        last,
        "all of them: generated/formulas/formulas.md, or omniroll formulas",
    ]


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


def test_unknown_verdict():
    with pytest.raises(SystemExit) as stopped:
        main(["formulas", "--verdict", "wrong"])
    assert stopped.value.code == 2

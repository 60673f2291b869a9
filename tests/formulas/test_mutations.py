"""The comparison can fail: one change in the transcription of a formula that agrees, in the derivation or in a claim
turns the verdict.
"""

import json
from collections import defaultdict

import pytest
from maxima_session import CLAIMS_ONLY, COMPARISON, DERIVATION, ROOT, ask, chapter, flipped
from transcription import KINDS, claim_statements, flips, mutants, printed_statements, table_entries

RECORDS = json.loads((ROOT / "generated/formulas/formulas.json").read_text())["formulas"]
VERDICTS = {r["id"]: r["verdict"] for r in RECORDS if r["kind"] == "formula"}
RIGHT = [name for name, verdict in VERDICTS.items() if verdict in ("agrees", "agrees-if", "undefined")]

# Changes of one sign in the derivation: file, what stands there, what is put there; the formulas that each must turn,
# at least.
DERIVATIONS = [
    ("paper/constraints", "velocity_S: [R*nu_1, R*nu_2, 0]", "velocity_S: [R*nu_1, -R*nu_2, 0]",
     "2.1 2.2 V 3.3:P2 PL:2 7.1:m12 7.2:p_theta"),
    ("paper/constraints", "velocity_S + yaw_rate_of_nu*cross", "velocity_S - yaw_rate_of_nu*cross",
     "2.2 3.3:P3 PL:3 7:PP13 7:p23"),
    ("paper/constraints", "+ cross(chi_dot*axle, place)", "- cross(chi_dot*axle, place)",
     "2.2 V 3.3:P1 3.3:P2 3.3:P3 PL:1 PL:2 PL:3"),
    ("paper/constraints", "+ cross(phi_dot*roller_axis(chi)", "- cross(phi_dot*roller_axis(chi)",
     "2.1 V 3.3:P1 3.3:P2 7.1:m13 7.2:p_theta"),
    ("paper/geometry", "row_offset*axle - r*roller_inward", "row_offset*axle + r*roller_inward",
     "2.1 7.1:m11 7.1:m22"),
    ("paper/constraints", "[R*nu_1*cos(theta) - R*nu_2*sin(theta)", "[R*nu_1*cos(theta) + R*nu_2*sin(theta)",
     "2:pose 2.3 7.2:p_x 3.3:P2"),
    ("paper/constraints", "R*nu_1*sin(theta) + R*nu_2*cos(theta)", "R*nu_1*sin(theta) - R*nu_2*cos(theta)",
     "2:pose 2.3 7.2:p_y 3.3:P2"),
    ("paper/kinetic_energy", "inertia*(spin^2 + 2*dot", "inertia*(spin^2 - 2*dot",
     "7.1:m13 7.1:m23 7.2:p_phi_k 7:p13"),
    ("paper/parts", "disk_spin + phi_dot*roller_axis", "disk_spin - phi_dot*roller_axis",
     "3.2"),
    ("machinery/claims", "gradient(g, p) - gradient(f, p)", "gradient(g, p) + gradient(f, p)",
     "PL:1 PL:2 7:PP12"),
]  # fmt: skip

CLAIMS = ("comparison/compare_by_brute_force", "comparison/exact_state", "comparison/compare_claims")
SYMMETRIC = {"section3:potential"}  # holds with either sign: kappa and -kappa run through the same rollers


@pytest.mark.long
def test_each_change_of_the_transcription_turns_the_verdict(tmp_path):
    printed, entries = printed_statements(), table_entries()
    changed = [m for name in RIGHT for m in mutants(name, printed[name])]
    changed += [m for name in entries for m in mutants(name, entries[name])]
    questions = []
    for mutant in changed:
        name = mutant.name
        is_entry = not mutant.statement.startswith("printed(")  # S_k_a: ..., which printed(...) then reads
        asked = [mutant.statement, *([printed[name]] if is_entry else []), f'v_: verdict_of("{name}")']
        back = [entries[name]] if is_entry else []
        questions.append(f"({', '.join([*asked, *back, printed[name], 'v_'])})")
    questions += [f'verdict_of("{name}")' for name in RIGHT]
    answers = ask([chapter(name) for name in (*DERIVATION, *COMPARISON)], questions, tmp_path)
    verdicts, untouched = answers[: len(changed)], answers[len(changed) :]
    assert untouched == [VERDICTS[name] for name in RIGHT], "a change was not taken back"
    stayed = [m for m, v in zip(changed, verdicts, strict=True) if v in ("error", VERDICTS[m.name])]
    assert stayed == [], "\n".join(f"{m.name} {m.kind}: {m.statement}" for m in stayed)
    turned = defaultdict(set)
    for mutant in changed:
        turned[mutant.name].add(mutant.kind)
    assert sum(turned[name] == set(KINDS) for name in turned) >= 10


@pytest.mark.long
def test_each_change_of_the_derivation_turns_verdicts(tmp_path):
    verdicts = (
        "simplode(map(lambda([f_], block([r_: errcatch(verdict_of(first(f_)))], "
        'if r_ = [] then "error" else first(r_))), printed_formulas), ",")'
    )
    questions = []
    for number, (file, old, new, _) in enumerate(DERIVATIONS):
        folder = flipped(file, old, new, tmp_path / f"{number}")
        loads = [chapter(name, folder) if name == file else chapter(name) for name in DERIVATION]
        loads.insert(1, CLAIMS_ONLY)
        questions.append(f"({', '.join([*loads, *map(chapter, COMPARISON), verdicts])})")
    questions.append('simplode(map(first, printed_formulas), ",")')
    *answers, listed = ask([], questions, tmp_path)
    ids = listed.split(",")
    assert sorted(ids) == sorted(VERDICTS)
    turned_by_any = set()
    for (*change, expected), answer in zip(DERIVATIONS, answers, strict=True):
        found = dict(zip(ids, answer.split(","), strict=True))
        turned = {name for name in RIGHT if found[name] != VERDICTS[name]}
        stayed = sorted(set(expected.split()) - turned)
        assert stayed == [], f"{change}: {stayed} stayed"
        turned_by_any |= turned
    assert len(turned_by_any) >= 40


@pytest.mark.long
def test_one_sign_turns_the_verdict_of_a_claim(tmp_path):
    holding = {r["id"] for r in RECORDS if r["kind"] == "claim" and r["verdict"] == "holds"}
    claims = {n: text for n, text in claim_statements().items() if n in holding - SYMMETRIC and flips(text)}
    assert len(claims) >= 8
    loads = [chapter(name) for name in (*DERIVATION, *COMPARISON)]
    loads += [chapter("paper/all_coordinates"), CLAIMS_ONLY]
    loads += [chapter(name) for name in CLAIMS]
    changed = [(name, flip) for name, text in claims.items() for flip in flips(text)]
    questions = []
    for name, flip in changed:
        forget = f'claims: sublist(claims, lambda([c_], first(c_) # "{name}"))'
        asked = f'v_: errcatch(claim_verdict("{name}"))'
        answer = 'if v_ = [] then "error" else first(v_)'
        questions.append(f"({forget}, {flip}, {asked}, {forget}, {claims[name]}, {answer})")
    questions += [f'claim_verdict("{name}")' for name in claims]
    answers = ask(loads, questions, tmp_path)
    verdicts, untouched = answers[: len(changed)], answers[len(changed) :]
    assert untouched == ["holds"] * len(claims), "a change was not taken back"
    turned = {n for (n, _), v in zip(changed, verdicts, strict=True) if v in ("fails", "holds-if")}
    assert set(claims) == turned

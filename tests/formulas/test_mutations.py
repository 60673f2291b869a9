"""The comparison can fail: one change in the transcription of a formula that agrees turns the verdict."""

import json
from collections import defaultdict

import pytest
from maxima_session import COMPARISON, DERIVATION, ROOT, ask, chapter
from transcription import KINDS, mutants, printed_statements, table_entries

RECORDS = json.loads((ROOT / "generated/formulas/formulas.json").read_text())["formulas"]
VERDICTS = {r["id"]: r["verdict"] for r in RECORDS if r["kind"] == "formula"}
RIGHT = [name for name, verdict in VERDICTS.items() if verdict in ("agrees", "agrees-if", "undefined")]


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

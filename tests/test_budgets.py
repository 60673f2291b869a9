"""Processor time of tests by folder, as the last runs recorded it, against its budgets; and these against their sum."""

import tomllib

import lines
import pytest
from processor_time import BUDGETS, ROOT, budgets, by_folder, folder_of, recorded

SLACK = 0.25  # of a budget: other work on the machine costs caches


def test_every_folder_has_a_budget_and_all_together_are_within_theirs():
    folders = {folder_of(str(file.relative_to(ROOT))) for file in (ROOT / "tests").rglob("test_*.py")}
    assert folders == set(budgets())
    assert sum(budgets().values()) <= tomllib.loads(BUDGETS.read_text(encoding="utf-8"))["most"]["minutes"]


def test_no_struct_of_the_engine_has_many_fields():
    found = lines.fields_of_structs()
    assert found["engine_calls.h: omniroll_run_t"] > 10  # they are read
    most = tomllib.loads(BUDGETS.read_text(encoding="utf-8"))["lines"]["fields"]
    assert {name: count for name, count in found.items() if count > most} == {}


def test_what_was_recorded_is_within_the_budgets():
    seconds = recorded()
    if not seconds:
        pytest.skip("no run has recorded its processor time")
    allowed = budgets()
    over = {folder: minutes for folder, minutes in by_folder(seconds).items()
            if minutes > (1 + SLACK) * allowed.get(folder, 0)}  # fmt: skip
    assert over == {}

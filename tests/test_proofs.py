"""Proofs of maxima/paper/ can fail: one changed sign in what each claims stops it, by its own name.

`python tests/flips.py` asks those of all chapters.
"""

import flips
import pytest
from flips import cannot_fail, chapters_of_any_wheel

CLAIMS = "machinery/claims"
TOY = """
one: 1$
prove("sound", "a sign stops it", one - 1)$
/* A size. */
assume(size > 0)$
prove("assumed", "holds where the size is positive", sqrt(size^2) - size)$
forget(size > 0)$
other: 1$
prove("overwritten", "its name has another value behind the chapter", other - 1)$
other: 5$
"""


@pytest.mark.long
def test_every_proof_of_the_paper_fails_under_one_changed_sign(tmp_path):
    count, missed = cannot_fail(chapters_of_any_wheel(), tmp_path)
    assert count > 20 and missed == []


def test_a_question_that_fails_unchanged_says_nothing(tmp_path, monkeypatch):
    claims = (flips.ROOT / f"maxima/{CLAIMS}.mac").read_text()
    for chapter, text in ((CLAIMS, claims), ("toy", TOY)):
        path = tmp_path / f"maxima/{chapter}.mac"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.setattr(flips, "ROOT", tmp_path)
    assert cannot_fail([CLAIMS, "toy"], tmp_path) == (3, ["overwritten"])

"""Proofs of maxima/paper/ can fail: one changed sign in what each claims stops it, by its own name.

`python tests/flips.py` asks those of all chapters.
"""

import pytest
from flips import cannot_fail, chapters_of_any_wheel


@pytest.mark.long
def test_every_proof_of_the_paper_fails_under_one_changed_sign(tmp_path):
    count, missed = cannot_fail(chapters_of_any_wheel(), tmp_path)
    assert count > 20 and missed == []

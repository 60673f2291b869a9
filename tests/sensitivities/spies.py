"""Which rows of a run Python passes, where others are left to C."""

from typing import Any

import pytest


def rows_passed(monkeypatch: pytest.MonkeyPatch, deviations: type, method: str) -> list[int]:
    """The rows that a method of deviations is given from now on, in a list that grows."""
    passed: list[int] = []
    own = getattr(deviations, method)

    def noted(self: Any, row: int, *given: Any) -> Any:
        passed.append(row)
        return own(self, row, *given)

    monkeypatch.setattr(deviations, method, noted)
    return passed

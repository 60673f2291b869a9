"""The page of hard cases keeps what it holds of the cases that were not measured again."""

from .case import Case, Measurement
from .page import page


def case(name: str, section: str = "Switches") -> Case:
    return Case(name, section, f"The {name} case | once", "", "it stays", lambda scale: [])


def measured(value: float, what: str = "error") -> Measurement:
    return Measurement(what, "python", "double", "", value, 1.0)


def test_cases_that_are_not_measured_again_keep_their_rows():
    first, second, gone = case("first"), case("second", "Effects"), case("gone")
    before = page(
        [gone, first, second],
        [(gone, [measured(0.1)]), (first, [measured(0.25), measured(0.5, "time")]), (second, [measured(2)])],
    )
    assert "3 cases" in before and "**Not kept: The second case | once.**" in before
    after = page([first, second], [(second, [measured(0.75)])], before)
    assert "2 cases" in after and "All promises are kept." in after and "gone" not in after
    rows = [line for line in after.splitlines() if "<= 1" in line]
    assert [row.split(" | ")[-2] for row in rows] == ["0.25 <= 1", "0.5 <= 1", "0.75 <= 1"]
    assert page([first, second], [], after) == after

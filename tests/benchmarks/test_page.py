"""The page of the benchmarks: a question that is asked again takes its own section and rows, and no others."""

from benchmarks.common import Answer, Target
from benchmarks.page import page, with_answer


def answer(number: int, measured: str, reached: bool = True) -> Answer:
    targets = [Target(f"question {number}: fast", measured, reached)]
    return Answer(f"{number}. A question", "Text.", ["a", "b"], [[measured, "1"]], targets)


def test_a_question_asked_again_replaces_its_own_section():
    old, new = [answer(1, "10"), answer(2, "20")], answer(2, "30", False)
    text = with_answer(page(old), new)
    assert text.split("## ")[2:] == page([old[0], new]).split("## ")[2:]
    assert "| question 2: fast | 30 | **no** |" in text and "20" not in text
    assert text.count("question 1: fast") == 1 and with_answer(text, new) == text


def test_a_question_that_is_new_stands_in_its_order():
    text = with_answer(page([answer(1, "10"), answer(10, "5")]), answer(3, "7"))
    places = [text.index(f"## {number}. ") for number in (1, 3, 10)]
    assert places == sorted(places) and "| question 3: fast | 7 | yes |" in text

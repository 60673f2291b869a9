"""What a hard case is, and what measuring it gives."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from typing import TypeVar

T = TypeVar("T")
Run = TypeVar("Run", bound=Callable)
SECTIONS = ("Switches", "Effects", "Formulas", "Magnitudes and time", "Number types and compilers",
            "Input", "Files and signals")  # fmt: skip


class Scale(Enum):
    """How much is measured: TEST in `make test-long`, FULL in `make hard`."""

    TEST = "test"
    FULL = "full"

    def of(self, test: T, full: T) -> T:
        """The one of two amounts that this scale takes."""
        return test if self is Scale.TEST else full


@dataclass(frozen=True)
class Measurement:
    """One number that must not exceed its bound.

    what         the quantity, with its unit: "error of the switch time / allowed"
    on           the engine or kernel: "compiled", "python", "kernel forward_dynamics"
    number_type  "double", "float", "long double", "balls"
    setting      roller model and law, or whatever else it was measured for: "locked, impact"
    measured     the worst found; a NaN is never within a bound
    bound        what is promised
    naive        what a naive implementation gives on the same case; None where that is not measured,
                 or elsewhere
    """

    what: str
    on: str
    number_type: str
    setting: str
    measured: float
    bound: float
    naive: float | None = None

    @property
    def kept(self) -> bool:
        return self.measured <= self.bound

    @property
    def share(self) -> float:
        """Part of the bound that is used up."""
        if not self.kept:
            return float("inf")
        return self.measured / self.bound if self.bound > 0 else 0.0


def counted(what: str, wrong: list[int], every: int) -> Measurement:
    """That none of so many numbered scenes is wrong; it names those that are."""
    setting = f"numbers {', '.join(map(str, wrong))}" if wrong else f"{every} of them"
    return Measurement(what, "compiled", "double", setting, len(wrong), 0)


@dataclass(frozen=True)
class Case:
    """A case in which implementations go wrong.

    name     short and unique, for the command line and the tests: "two-wheels-together"
    section  one of SECTIONS
    title    the case, in words
    naive    what a naive implementation does
    promise  what this one promises
    run      measures it; it may yield one measurement after the other
    """

    name: str
    section: str
    title: str
    naive: str
    promise: str
    run: Callable[[Scale], Iterable[Measurement]]


class Cases(list[Case]):
    """The cases of a module, of one section, in the order of the functions that measure them."""

    def __init__(self, section: str):
        super().__init__()
        self.section = section

    def case(self, name: str, title: str, *, promise: str, naive: str = "") -> Callable[[Run], Run]:
        """Decorates the function that measures a case."""

        def kept(run: Run) -> Run:
            self.append(Case(name, self.section, title, naive, promise, run))
            return run

        return kept

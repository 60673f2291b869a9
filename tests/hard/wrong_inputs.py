"""Wrong arguments of every public function, and wrong scenes, by number."""

import contextlib
import tempfile
from collections.abc import Callable
from pathlib import Path

from fuzz.calls import try_call
from fuzz.scenes import try_scene

from hard.case import Case, Measurement, Scale
from hard.inputs import SECTION, in_time


def broken(attempt: Callable[[int], str], count: int, what: str) -> list[Measurement]:
    """How many of them ended in anything but a typed error or finite numbers; the first is printed."""
    failed = []
    for seed in range(count):
        try:
            with in_time():
                attempt(seed)
        except AssertionError as error:
            failed.append(str(error))
    for text in failed[:1]:
        print(text)
    return [Measurement("broken promises", what, "double", f"{count} seeds", len(failed), 0)]


def calls(scale: Scale) -> list[Measurement]:
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        return broken(try_call, scale.of(100, 100_000), "public functions")


def scenes(scale: Scale) -> list[Measurement]:
    with tempfile.TemporaryDirectory() as folder:

        def attempt(seed: int) -> str:
            return try_scene(seed, Path(folder), with_effects=scale is Scale.FULL)

        return broken(attempt, scale.of(100, 100_000), "scene files")


CASES = [
    Case(
        "wrong-calls", SECTION, "Wrong arguments of public functions, one or two at a time",
        "fails somewhere inside, or goes on with a NaN",
        "an error that names the argument, its value and the bound, or finite numbers; within a minute", calls,
    ),
    Case(
        "wrong-scenes", SECTION, "Shipped scenes with one to three changes in the text",
        "fails somewhere inside, or simulates something else",
        "one message that names all that is wrong, or a motion of finite numbers; within a minute", scenes,
    ),
]  # fmt: skip

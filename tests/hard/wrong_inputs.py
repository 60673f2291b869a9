"""Changed arguments of every public function, and changed scenes, by number."""

import contextlib
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from fuzz.calls import try_call
from fuzz.scenes import try_scene

from hard.attempts import Attempt, broken, tried
from hard.case import Cases, Measurement, Scale

CASES = Cases("Input")
FULL, FEW = 100_000, 100
MOST_SECONDS, MOST_MEMORY = 10, 2.0  # of the processor; GB
LEAST_RUN = 50  # % of the inputs that come to a run, or to a result
MILD = 0.8  # of the calls
ATTEMPTS: dict[str, Callable[[Path], Attempt]] = {
    "calls": lambda _: partial(try_call, mild=MILD),
    "scenes": lambda folder: partial(try_scene, folder=folder),
}


def measured(what: str, count: int) -> Iterator[Measurement]:
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        found = tried(ATTEMPTS[what](Path(folder)), count, MOST_SECONDS)
    words = Counter(line["word"] for line in found)
    seconds, seed = max((line["seconds"], line["seed"]) for line in found)
    memory = max(line["memory"] for line in found) / 2**30
    none = 100 * (1 - (words["done"] + words["stopped"]) / count)
    told = f"{count} seeds: {', '.join(f'{number} {word}' for word, number in words.most_common())}"
    yield Measurement("broken promises", what, "double", told, broken(found), 0)
    yield Measurement("that come to no run, in %", what, "double", told, none, LEAST_RUN)
    yield Measurement("processor's time of the slowest, s", what, "double", f"seed {seed}", seconds, MOST_SECONDS)
    yield Measurement("memory of a process, GB", what, "double", "", memory, MOST_MEMORY)


@CASES.case(
    "wrong-calls",
    "Changed arguments of public functions, one to three at a time",
    naive="fails somewhere inside, or goes on with a NaN",
    promise="an error that names the argument, its value and the bound, or finite numbers; within 10 s and 2 GB",
)
def wrong_calls(scale: Scale) -> Iterator[Measurement]:
    return measured("calls", scale.of(FEW, FULL))


@CASES.case(
    "wrong-scenes",
    "Shipped scenes with one to three changes, another table, model, law or vehicle",
    naive="fails somewhere inside, or simulates something else",
    promise="one message that names all that is wrong, or a motion of finite numbers; within 10 s and 2 GB; the Python "
    "engine is not asked where it steps friction in time",
)
def wrong_scenes(scale: Scale) -> Iterator[Measurement]:
    return measured("scenes", scale.of(FEW, FULL))

"""Changed arguments of every public function, and changed scenes, by number: in forked processes, by processor time.

`python -m hard.wrong_inputs [calls | scenes [count [first]]]` from tests/ tries those seeds and prints what came of
them. What was found stands in out/hard/, a line for each 2500 seeds; seeds that stand there are tried again where
one of their line broke a promise, so that a study that was cut off, or has found something, goes on from there.
"""

import contextlib
import json
import os
import resource
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from fuzz.calls import try_call
from fuzz.scenes import try_scene

from hard.case import Case, Measurement
from hard.inputs import SECTION

FOUND = Path(__file__).resolve().parents[2] / "out/hard"
CHUNK, FULL, FEW = 2500, 100_000, 100
MOST_SECONDS, MOST_MEMORY = 10, 2 * 2**30  # of the processor; bytes
LEAST_RUN = 50  # % of the inputs that come to a run, or to a result
MILD = 0.8  # of the calls
UNIT = 1024  # bytes of ru_maxrss, on Linux
Line = dict[str, Any]
Attempt = Callable[[int], str]


def in_process(attempt: Attempt, seeds: list[int], told: int, patience: int) -> None:
    """Try the seeds; a line for each into the pipe. The kernel ends a process that takes longer than that, in s."""
    for seed in seeds:
        begin = time.process_time()
        resource.setrlimit(resource.RLIMIT_CPU, (int(begin + patience + 2), resource.RLIM_INFINITY))
        try:
            word, why = attempt(seed), ""
        except AssertionError as error:
            word, why = "broken", str(error)
        line = {"seed": seed, "word": word, "why": why, "seconds": round(time.process_time() - begin, 4)}
        line["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * UNIT
        os.write(told, (json.dumps(line) + "\n").encode())


def tried(attempt: Attempt, seeds: list[int], patience: int = MOST_SECONDS) -> Iterator[Line]:
    """What came of each seed. A process that ends early has told of those before; the others go on in a new one."""
    while seeds:
        read, told = os.pipe()
        process = os.fork()
        if not process:
            os.close(read)
            try:
                in_process(attempt, seeds, told, patience)
            finally:
                os._exit(0)
        os.close(told)
        with open(read, encoding="utf-8") as lines:
            made = [json.loads(line) for line in lines]
        ended = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
        yield from made
        seeds = seeds[len(made) :]
        if seeds:
            late = {"seconds": float(patience + 2), "memory": 0}
            yield {"seed": seeds[0], "word": "broken", "why": f"the process ended with {ended}"} | late
            seeds = seeds[1:]


def summed(lines: list[Line]) -> Line:
    """What a thousand seeds come to."""
    slowest = max(lines, key=lambda line: line["seconds"])
    wrong = [line for line in lines if line["word"] == "broken" or line["seconds"] > MOST_SECONDS]
    return {
        "first": lines[0]["seed"], "count": len(lines), "words": Counter(line["word"] for line in lines),
        "slowest": [slowest["seconds"], slowest["seed"]], "seconds": sum(line["seconds"] for line in lines),
        "memory": max(line["memory"] for line in lines), "wrong": wrong,
    }  # fmt: skip


def kept(path: Path) -> dict[tuple[int, int], Line]:
    """The thousands that were tried before, by their first seed and their number, and in which nothing was wrong."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    found = {(line["first"], line["count"]): line for line in map(json.loads, lines)}
    return {key: line for key, line in found.items() if not line["wrong"]}


def study(what: str, count: int, first: int = 0) -> list[Line]:
    """What so many seeds come to, in thousands; each is kept as it is done."""
    path, found = FOUND / f"{what}.jsonl", []
    path.parent.mkdir(parents=True, exist_ok=True)
    before = kept(path) if count >= CHUNK else {}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        attempt = ATTEMPTS[what](Path(folder))
        for start in range(first, first + count, CHUNK):
            seeds = list(range(start, min(start + CHUNK, first + count)))
            line = before.get((start, len(seeds)))
            if line is None:
                line = summed(list(tried(attempt, seeds)))
                with path.open("a", encoding="utf-8") as kept_lines:
                    kept_lines.write(json.dumps(line) + "\n")
                for wrong in line["wrong"]:
                    print(what, wrong["seed"], wrong["seconds"], "s:", wrong["why"], flush=True)
            found.append(line)
    return found


ATTEMPTS: dict[str, Callable[[Path], Attempt]] = {
    "calls": lambda _: partial(try_call, mild=MILD),
    "scenes": lambda folder: partial(try_scene, folder=folder),
}


def measured(what: str, count: int, first: int = 0) -> list[Measurement]:
    found = study(what, count, first)
    words: Counter[str] = sum((Counter(line["words"]) for line in found), Counter())
    seconds, seed = max(line["slowest"] for line in found)
    come_to_run = words["done"] + words["stopped"]
    told = f"{count} seeds: {', '.join(f'{number} {word}' for word, number in words.most_common())}"
    return [
        Measurement("broken promises", what, "double", told, words["broken"], 0),
        Measurement("that come to no run, in %", what, "double", told, 100 * (1 - come_to_run / count), LEAST_RUN),
        Measurement("processor's time of the slowest, s", what, "double", f"seed {seed}", seconds, MOST_SECONDS),
        Measurement("memory of a process, GB", what, "double", "", max(line["memory"] for line in found) / 2**30,
                    MOST_MEMORY / 2**30),
    ]  # fmt: skip


def main(what: str = "scenes", count: str = str(FULL), first: str = "0") -> None:
    for one in measured(what, int(count), int(first)):
        print(f"{one.what}: {one.measured:.3g}, at most {one.bound:.3g}; {one.setting}")


CASES = [
    Case(
        "wrong-calls", SECTION, "Changed arguments of public functions, one to three at a time",
        "fails somewhere inside, or goes on with a NaN",
        "an error that names the argument, its value and the bound, or finite numbers; within 10 s and 2 GB",
        lambda scale: measured("calls", scale.of(FEW, FULL)),
    ),
    Case(
        "wrong-scenes", SECTION, "Shipped scenes with one to three changes, another table, model, law or vehicle",
        "fails somewhere inside, or simulates something else",
        "one message that names all that is wrong, or a motion of finite numbers; within 10 s and 2 GB; the Python "
        "engine is not asked where it steps friction in time",
        lambda scale: measured("scenes", scale.of(FEW, FULL)),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(*sys.argv[1:])

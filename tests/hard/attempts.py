"""Attempts by number: what comes of each, in forked processes whose time of the processor is limited."""

import json
import os
import resource
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

UNIT = 1024  # bytes of ru_maxrss, on Linux
OF_A_PROCESS = 2500
Line = dict[str, Any]  # of a seed: what came of it in a word, why, its seconds of the processor, the process's memory
Attempt = Callable[[int], str]


def in_process(attempt: Attempt, seeds: list[int], told: int, patience: int) -> None:
    """Try the seeds; a line for each into the pipe. The kernel ends a process that takes longer than that, in s."""
    for seed in seeds:
        begin = time.process_time()
        resource.setrlimit(resource.RLIMIT_CPU, (int(begin + patience + 2), resource.RLIM_INFINITY))
        try:
            word, why = attempt(seed), ""
        except Exception as error:  # whatever it is, it is not what was promised
            word, why = "broken", str(error) if isinstance(error, AssertionError) else repr(error)
        line = {"seed": seed, "word": word, "why": why, "seconds": round(time.process_time() - begin, 4)}
        line["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * UNIT
        os.write(told, (json.dumps(line) + "\n").encode())


def of_a_process(attempt: Attempt, seeds: list[int], patience: int) -> Iterator[Line]:
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


def tried(attempt: Attempt, count: int, patience: int) -> list[Line]:
    """What came of so many seeds; what broke a promise or took too long goes to stderr."""
    found: list[Line] = []
    for start in range(0, count, OF_A_PROCESS):
        seeds = list(range(start, min(start + OF_A_PROCESS, count)))
        found += of_a_process(attempt, seeds, patience)
    for line in found:
        if line["word"] == "broken" or line["seconds"] > patience:
            print(line["seed"], line["seconds"], "s:", line["why"], file=sys.stderr)
    return found


def broken(lines: list[Line]) -> int:
    return sum(line["word"] == "broken" for line in lines)

"""Works that call the engine go on in step: one call of C takes on the runs of all of them.

A thread then waits for the lock of the interpreter once, where it would wait for each run.
"""

from collections.abc import Generator, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any, NamedTuple, TypeVar

Found = TypeVar("Found")
NOBODY_ELSE = nullcontext()


class EngineCall(NamedTuple):
    """A call of omniroll_run (engine_calls.h).

    module  `ffi` and `lib` with the engine
    run     pointer to omniroll_run_t
    model   pointer to omniroll_model, of the library's kind
    """

    module: Any
    run: Any
    model: Any


# Yields calls of the engine, is sent what they return, and returns what it has found.
Work = Generator[EngineCall, int, Found]


def in_step(works: Sequence[Work[Found]], turn: AbstractContextManager = NOBODY_ELSE) -> list[Found]:
    """What each of the works returns. One that raises ends all.

    turn  a lock that is held but for the calls of the engine. Threads that share it prepare their calls one after the
          other, each while others compute. Without it they would share the lock of the interpreter, prepare at half
          the speed each, and then compute at the same time.
    """
    found: dict[int, Found] = {}
    statuses: dict[int, int | None] = dict.fromkeys(range(len(works)))
    while statuses:
        calls = {}
        with turn:
            for k, status in statuses.items():
                try:
                    calls[k] = works[k].send(status)  # type: ignore[arg-type]  # None begins it
                except StopIteration as end:
                    found[k] = end.value
        statuses = _called(calls)
    return [found[k] for k in range(len(works))]


def _called(calls: dict[int, EngineCall]) -> dict[int, int | None]:
    """The statuses of calls by their keys; those of one library are one call."""
    by_library: dict[int, list[int]] = {}
    for k, call in calls.items():
        by_library.setdefault(id(call.module), []).append(k)
    statuses: dict[int, int | None] = {}
    for keys in by_library.values():
        statuses.update(zip(keys, _of_library([calls[k] for k in keys]), strict=True))
    return statuses


def _of_library(calls: list[EngineCall]) -> list[int]:
    module = calls[0].module
    if len(calls) == 1:
        return [module.lib.omniroll_run(calls[0].run, calls[0].model)]
    statuses = module.ffi.new("int[]", len(calls))
    module.lib.omniroll_run_each(len(calls), [call.run for call in calls], [call.model for call in calls], statuses)
    return list(statuses)

"""Works that call the engine go on side by side: one call of C takes on the runs of all of them.

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


# Yields calls of the engine, is sent what each of them returns, and returns what it has found.
Work = Generator[list[EngineCall], list[int], Found]


def result_of(work: Work[Found], turn: AbstractContextManager = NOBODY_ELSE) -> Found:
    """What a work returns.

    turn  a lock that is held but for the calls of the engine. Threads that share it prepare their calls one after the
          other, each while others compute. Without it they would share the lock of the interpreter, prepare at half
          the speed each, and then compute at the same time.
    """
    statuses = None
    while True:
        with turn:
            try:
                calls = work.send(statuses)  # type: ignore[arg-type]  # None begins it
            except StopIteration as end:
                return end.value
        statuses = _called(calls)


def side_by_side(works: Sequence[Work[Found]]) -> Work[list[Found]]:
    """Several works as one, which returns what each of them does. One that raises ends all."""
    found: dict[int, Found] = {}
    statuses: dict[int, list[int] | None] = dict.fromkeys(range(len(works)))
    while statuses:
        calls: dict[int, list[EngineCall]] = {}
        for k, of_work in statuses.items():
            try:
                calls[k] = works[k].send(of_work)  # type: ignore[arg-type]  # None begins it
            except StopIteration as end:
                found[k] = end.value
        if calls:
            returned = iter((yield [call for of_work in calls.values() for call in of_work]))
        statuses = {k: [next(returned) for _ in of_work] for k, of_work in calls.items()}
    return [found[k] for k in range(len(works))]


def _called(calls: list[EngineCall]) -> list[int]:
    """What the calls return; those of one library are one call."""
    by_library: dict[int, list[int]] = {}
    for k, call in enumerate(calls):
        by_library.setdefault(id(call.module), []).append(k)
    returned: dict[int, int] = {}
    for places in by_library.values():
        returned.update(zip(places, _of_library([calls[k] for k in places]), strict=True))
    return [returned[k] for k in range(len(calls))]


def _of_library(calls: list[EngineCall]) -> list[int]:
    module = calls[0].module
    if len(calls) == 1:
        return [module.lib.omniroll_run(calls[0].run, calls[0].model)]
    statuses = module.ffi.new("int[]", len(calls))
    module.lib.omniroll_run_each(len(calls), [call.run for call in calls], [call.model for call in calls], statuses)
    return list(statuses)

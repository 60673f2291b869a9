"""The runs of a sweep, out to threads or to the workers of an executor, and what comes back of each."""

import math
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import (
    FIRST_EXCEPTION,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    as_completed,
    wait,
)
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass

import numpy as np

from omniroll.engine.works import NOBODY_ELSE, Work, result_of, side_by_side
from omniroll.progress import Report
from omniroll.sweeps.member import Found, Run, finding, shown

CHUNKS_PER_WORKER = 8  # of runs: a progress bar moves, and fast workers take more of them
GLANCE = 0.1  # s between two looks at what threads have done: each look takes the interpreter from them
TOGETHER = 0.02  # s in which a group of runs is done, so that an interruption loses little
MOST_TOGETHER = 4  # runs of a group: what they write should stay in the cache of a core


@dataclass(frozen=True)
class Chunk:
    """Some runs, as they go to a worker of an executor: plain data that pickles."""

    runs: tuple[Run, ...]
    times: np.ndarray | None
    control: bool


class Sweep:
    """Runs, and what was found of each in the same order; None of those that have not been done."""

    def __init__(self, runs: list[Run], times: np.ndarray | None, control: bool):
        self.runs, self.times, self.control = runs, times, control
        self.found: list[Found | None] = [None] * len(runs)

    def in_threads(self, report: Report) -> None:
        """In a thread for each core. What is done stays where the work is interrupted; no run is begun after that."""
        workers = min(cores(), len(self.runs))
        left, done, turn = deque(range(len(self.runs))), deque((0,)), threading.Lock()

        def work() -> None:
            for places, found in _in_groups(left, workers, self._begun, turn):
                for k, of_run in zip(places, found, strict=True):
                    self.found[k] = of_run
                done.append(len(places))

        with ThreadPoolExecutor(workers) as pool:
            working = {pool.submit(work) for _ in range(workers)}
            try:
                while working:
                    ended, working = wait(working, GLANCE, FIRST_EXCEPTION)
                    report(sum(done), len(self.runs))
                    for future in ended:
                        future.result()
            finally:
                left.clear()

    def _begun(self, k: int) -> Work[Found]:
        return finding(self.runs[k], self.times, self.control)

    def on(self, executor: Executor, report: Report) -> None:
        """On an executor: each of its workers gets chunks. What comes back of a chunk that failed is its error.

        A pool of processes breaks as a whole where one of them dies. What it did not do is done apart.
        """
        lost: list[range] = []

        def keep(places: range, future: Future) -> None:
            try:
                of_chunk = future.result()
            except BrokenExecutor:
                lost.append(places)
                return
            except Exception as error:
                of_chunk = [{"reason": f"its worker failed: {shown(error)}"} for _ in places]
            self.found[places.start : places.stop] = of_chunk

        futures: dict[Future, range] = {}
        for places in self._chunks(cores()):
            try:
                futures[executor.submit(run_chunk, self._chunk(places))] = places
            except BrokenExecutor:
                lost.append(places)
        try:
            self._collect(futures, report, keep)
        except BaseException:
            for future, places in futures.items():
                if not future.cancel() and future.done():
                    keep(places, future)
            raise
        self._apart(lost)

    def _apart(self, lost: list[range]) -> None:
        """Runs in a process beside this one, a new one where it dies; a chunk that ends it is done run by run."""
        pool = None
        while lost:
            places = lost.pop(0)
            pool = pool or ProcessPoolExecutor(1)
            try:
                self.found[places.start : places.stop] = pool.submit(run_chunk, self._chunk(places)).result()
            except BrokenExecutor as error:
                pool.shutdown()
                pool = None
                if len(places) > 1:
                    lost[:0] = [range(k, k + 1) for k in places]
                else:
                    self.found[places.start] = {"reason": f"its worker died: {shown(error)}"}
        if pool is not None:
            pool.shutdown()

    def _chunk(self, places: range) -> Chunk:
        return Chunk(tuple(self.runs[k] for k in places), self.times, self.control)

    def _chunks(self, workers: int) -> list[range]:
        count = len(self.runs)
        size = max(1, math.ceil(count / (CHUNKS_PER_WORKER * workers)))
        return [range(k, min(k + size, count)) for k in range(0, count, size)]

    def _collect(self, futures: dict[Future, range], report: Report, keep: Callable[[range, Future], None]) -> None:
        done = 0
        for future in as_completed(futures):
            keep(futures[future], future)
            done += len(futures[future])
            report(done, len(self.runs))


def cores() -> int:
    """Those that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_chunk(chunk: Chunk) -> list[Found]:
    """The work of one worker: do the runs of a chunk and keep of each what Many shows."""
    left = deque(range(len(chunk.runs)))
    groups = _in_groups(left, 1, lambda k: finding(chunk.runs[k], chunk.times, chunk.control))
    return [found for _, of_group in groups for found in of_group]


def _in_groups(
    left: deque[int], workers: int, begun: Callable[[int], Work[Found]], turn: AbstractContextManager = NOBODY_ELSE
) -> Iterator[tuple[list[int], list[Found]]]:
    """Take numbers of runs that are left, as many at a time as end within TOGETHER; what is kept of each.

    workers  how many take them: the last groups are small, so that they end together
    turn     as of result_of
    """
    size = 1
    while places := _taken(left, min(size, math.ceil(len(left) / (2 * workers)))):
        began = time.perf_counter()
        yield places, result_of(side_by_side([begun(k) for k in places]), turn)
        pace = (time.perf_counter() - began) / len(places)
        size = max(1, min(MOST_TOGETHER, int(TOGETHER / pace)))


def _taken(left: deque[int], count: int) -> list[int]:
    """The next ones; fewer, or none, where others have taken them."""
    places = []
    with suppress(IndexError):
        for _ in range(count):
            places.append(left.popleft())
    return places

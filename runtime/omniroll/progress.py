"""Progress of long work on standard error: a bar where tqdm is installed, else a line now and then."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

INTERVAL = 5.0  # s between two lines
FORMAT = "{percentage:3.0f}% |{bar}| {n:.4g}/{total:.4g} {unit} [{elapsed} < {remaining}, {rate_fmt}]"
DAY = 86400.0  # s; work that will take longer is announced
SOON = 2.0  # s of work after which there is an estimate

Report = Callable[[Any, Any], Any]  # (done, total)


@contextmanager
def reporting(wanted: bool | Report | None, total: float, unit: str, *, delay: float = 0.0) -> Iterator[Report]:
    """A function that is called as report(done, total), for `with`.

    wanted  a function: that one. True: a bar. None: a bar on a terminal, lines elsewhere. False: nothing
    total   how much there is to do, in `unit`
    delay   s before a bar is shown; a bar that is delayed goes away when the work is done
    """
    if callable(wanted):
        yield wanted
        return
    if wanted is False:
        yield lambda done, total: None
        return
    announce = forewarning(unit)
    tqdm = _tqdm()
    if tqdm is None or (wanted is None and not sys.stderr.isatty()):
        shown = lines(unit)
        yield lambda done, total: (announce(done, total), shown(done, total))
        return
    with tqdm(total=total, unit=unit, delay=delay, leave=not delay, bar_format=FORMAT, file=sys.stderr) as bar:
        yield lambda done, total: (announce(done, total), bar.update(done - bar.n))


def forewarning(unit: str, clock: Callable[[], float] = time.monotonic) -> Report:
    """A function that says once, soon after the start, that the work will take longer than a day."""
    began: float | None = clock()

    def report(done: float, total: float) -> None:
        nonlocal began
        if began is None or (took := clock() - began) < SOON:
            return
        left = _left(done, total, took)
        if left > DAY:
            text = f"at its present pace this takes {duration(left)}; Ctrl-C ends it and keeps what there is"
            print(f"{done:.4g} of {total:.4g} {unit} done: {text}", file=sys.stderr, flush=True)
        began = None

    return report


def _left(done: float, total: float, took: float) -> float:
    """Seconds to go at the present pace."""
    return (total - done) * took / done if done > 0 else float("inf")


def duration(seconds: float) -> str:
    """A time for people: 40 s, 3 min, 2.5 h, 12 days."""
    for unit, size, most in (("s", 1.0, 120.0), ("min", 60.0, 120.0), ("h", 3600.0, 48.0), ("days", DAY, 1e6)):
        if seconds < most * size:
            return f"{seconds / size:.3g} {unit}"
    return "longer than anybody will wait"


def lines(unit: str, clock: Callable[[], float] = time.monotonic) -> Report:
    """A function that prints a line every few seconds: how much is done, how fast, and the time that is left."""
    began = last = clock()

    def report(done: float, total: float) -> None:
        nonlocal last
        now = clock()
        if now - last >= INTERVAL:
            last = now
            pace = f"{done / (now - began):.3g} {unit} a second, {duration(_left(done, total, now - began))} left"
            print(f"{done:.4g} of {total:.4g} {unit} done, {pace}", file=sys.stderr, flush=True)

    return report


def _tqdm() -> Any:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return tqdm

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
def reporting(
    wanted: bool | Report | None, total: float, unit: str, *, delay: float = 0.0, keeps: bool = True
) -> Iterator[Report]:
    """A function that is called as report(done, total), for `with`.

    wanted  a function: that one. True: a bar. None: a bar on a terminal, lines elsewhere. False: nothing
    total   how much there is to do, in `unit`
    delay   s before a bar is shown; a bar that is delayed goes away when the work is done
    keeps   whether Ctrl-C keeps what there is
    """
    if callable(wanted):
        yield wanted
        return
    if wanted is False:
        yield lambda done, total: None
        return
    announce = forewarning(unit, keeps=keeps)
    tqdm = _tqdm()
    if tqdm is None or (wanted is None and not sys.stderr.isatty()):
        shown = lines(unit)
        yield lambda done, total: (announce(done, total), shown(done, total))
        return
    with tqdm(total=total, unit=unit, delay=delay, leave=not delay, bar_format=FORMAT, file=sys.stderr) as bar:
        yield lambda done, total: (announce(done, total), bar.update(done - bar.n))


class Pace:
    """How fast work goes, from its first report on: what was done before that does not count.

    clock  gives the time in s
    """

    def __init__(self, clock: Callable[[], float]):
        self.clock = clock
        self.first: tuple[float, float] | None = None  # time and what was done then
        self.done = 0.0  # at the last report
        self.took = self.rate = 0.0  # s, and units a second

    def note(self, done: float) -> None:
        """A report has come. Less is done than before where the work has begun anew."""
        now = self.clock()
        if self.first is None or done < self.done:
            self.first = now, done
        self.done = done
        self.took = now - self.first[0]
        self.rate = (done - self.first[1]) / self.took if self.took > 0 else 0.0

    def left(self, done: float, total: float) -> float:
        """Seconds to go."""
        return (total - done) / self.rate if self.rate > 0 else float("inf")


def forewarning(unit: str, clock: Callable[[], float] = time.monotonic, keeps: bool = True) -> Report:
    """A function that says once, soon after the work has begun, that it will take longer than a day. Work that begins
    anew, as a run does after the coarser one that its error estimate needs, is looked at again."""
    pace, looked, said = Pace(clock), False, False

    def report(done: float, total: float) -> None:
        nonlocal looked, said
        if said:
            return
        pace.note(done)
        if pace.took < SOON:
            looked = False
        if looked or pace.took < SOON:
            return
        looked, left = True, pace.left(done, total)
        said = left > DAY
        if said:
            ends = "Ctrl-C ends it and keeps what there is" if keeps else "Ctrl-C ends it"
            text = f"at its present pace this takes {duration(left)}; {ends}"
            print(f"{done:.4g} of {total:.4g} {unit} done: {text}", file=sys.stderr, flush=True)

    return report


def duration(seconds: float) -> str:
    """A time for people: 40 s, 3 min, 2.5 h, 12 days."""
    for unit, size, most in (("s", 1.0, 120.0), ("min", 60.0, 120.0), ("h", 3600.0, 48.0), ("days", DAY, 1e6)):
        if seconds < most * size:
            return f"{seconds / size:.3g} {unit}"
    return "longer than anybody will wait"


def lines(unit: str, clock: Callable[[], float] = time.monotonic) -> Report:
    """A function that prints a line every few seconds: how much is done, how fast, and the time that is left."""
    pace, last = Pace(clock), 0.0

    def report(done: float, total: float) -> None:
        nonlocal last
        pace.note(done)
        if pace.took < last:  # the work has begun anew
            last = 0.0
        if pace.took - last >= INTERVAL:
            last = pace.took
            left = duration(pace.left(done, total))
            text = f"{done:.4g} of {total:.4g} {unit} done, {pace.rate:.3g} {unit} a second, {left} left"
            print(text, file=sys.stderr, flush=True)

    return report


def _tqdm() -> Any:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return tqdm

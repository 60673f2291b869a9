"""Progress of long work on standard error: a bar where tqdm is installed, else a line now and then."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

INTERVAL = 5.0  # s between two lines
FORMAT = "{percentage:3.0f}% |{bar}| {n:.4g}/{total:.4g} {unit} [{elapsed} < {remaining}]"

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
    tqdm = _tqdm()
    if tqdm is None or (wanted is None and not sys.stderr.isatty()):
        yield lines(unit)
        return
    with tqdm(total=total, unit=unit, delay=delay, leave=not delay, bar_format=FORMAT, file=sys.stderr) as bar:
        yield lambda done, total: bar.update(done - bar.n)


def lines(unit: str, clock: Callable[[], float] = time.monotonic) -> Report:
    """A function that prints a line every few seconds."""
    last = clock()

    def report(done: float, total: float) -> None:
        nonlocal last
        if clock() - last >= INTERVAL:
            last = clock()
            print(f"{done:.4g} of {total:.4g} {unit} done", file=sys.stderr, flush=True)

    return report


def _tqdm() -> Any:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    return tqdm

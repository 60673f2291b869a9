"""Progress of a long run on standard error: a bar where tqdm is installed, else a line now and then."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

DELAY = 1.0  # s before anything is shown
INTERVAL = 5.0  # s between two lines

Report = Callable[[float, float], None]


@contextmanager
def progress(duration: float) -> Iterator[Report]:
    """A function for the argument `progress` of omniroll.simulate, for a run of `duration` seconds."""
    try:
        from tqdm import tqdm
    except ImportError:
        tqdm = None
    if tqdm is None or not sys.stderr.isatty():
        yield lines()
        return
    form = f"{{percentage:3.0f}}% |{{bar}}| {{n:.4g}} of {duration:.4g} s [{{elapsed}} < {{remaining}}]"
    with tqdm(total=duration, delay=DELAY, leave=False, bar_format=form, file=sys.stderr) as bar:
        yield lambda done, duration: bar.update(done - bar.n)


def lines(clock: Callable[[], float] = time.monotonic) -> Report:
    """A reporter that prints a line every few seconds."""
    last = clock()

    def report(done: float, duration: float) -> None:
        nonlocal last
        if clock() - last >= INTERVAL:
            last = clock()
            print(f"simulated {done:.4g} of {duration:.4g} s", file=sys.stderr, flush=True)

    return report

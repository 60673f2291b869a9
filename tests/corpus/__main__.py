"""`python -m corpus` from tests/: runs all that is kept again and says what differs; with names, those kinds alone.

`python -m corpus write [kind ...]` keeps what the installed engine does, of scenes in which two accuracies of it agree
to a tenth of what is allowed: others would say nothing of another engine.
"""

import itertools
import sys

from corpus import files
from corpus.kinds import KINDS, name_of
from corpus.record import NotTold, difference
from corpus.replay import differences, record_of, unexplained
from omniroll import SimulationStopped
from omniroll.errors import NoDerivativeError

SCENES, FOLLOWED = 24, 6  # of a kind; of them with derivatives
COARSER = 1e-11
ENOUGH = 0.1


def written(kind: tuple[str, str, str]) -> str:
    records, refused = {}, 0
    for number in itertools.count():
        if len(records) == SCENES:
            break
        try:
            own, coarser = (record_of(kind, number, len(records) < FOLLOWED, *rest) for rest in ((), (COARSER,)))
        except (NotTold, SimulationStopped, NoDerivativeError):
            refused += 1
            continue
        if difference(own, coarser, ENOUGH):
            refused += 1
            continue
        records[number] = own
    files.write(kind, records)
    return f"{refused} refused, {files.file_of(kind).stat().st_size} bytes"


def main(words: list[str]) -> int:
    writes, names = words[:1] == ["write"], words[1:] if words[:1] == ["write"] else words
    kinds = {name_of(kind): kind for kind in KINDS}
    is_good = True
    for name in names or kinds:
        kind = kinds[name]
        if writes:
            print(f"{name}: {written(kind)}", flush=True)
            continue
        found = differences(kind)
        others = unexplained(kind, found)
        is_good = is_good and not others
        print(f"{name}: {len(found)} differ, {len(others)} unexplained", flush=True)
        for number, told in found.items():
            print(f"  {number}: {told}", flush=True)
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Times of logs: seconds on the clock of the log, whatever unit and zero the file's clock has.

Differences are taken before numbers become floating-point: seconds since 1970 have no more than 0.2 us as such.
"""

import statistics
from collections.abc import Sequence
from datetime import UTC, datetime
from decimal import Decimal, InvalidOperation

from omniroll.conventions.units import plain

DIGITS = {"s": 0, "ms": 3, "us": 6, "ns": 9}  # of a second
EPOCHS = ((Decimal("1e17"), "ns"), (Decimal("1e14"), "us"), (Decimal("1e11"), "ms"), (Decimal("1e9"), "s"))
STEPS = ((Decimal(500_000), "ns"), (Decimal(1000), "us"), (Decimal(5), "ms"))  # least step of whole numbers in a unit
ENOUGH = 50  # rows whose times are whole numbers before another unit than s is supposed


def read_time(text: str) -> Decimal | None:
    """A number, or a date and time as ISO 8601 in s since 1970; None where it is neither, or not finite."""
    try:
        found = Decimal(text.strip())
        return found if found.is_finite() else None
    except InvalidOperation:
        pass
    try:
        moment = datetime.fromisoformat(text.strip())
    except ValueError:
        return None
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    passed = moment - datetime(1970, 1, 1, tzinfo=UTC)
    return Decimal(passed.days * 86400 + passed.seconds) + Decimal(passed.microseconds).scaleb(-6)


def seconds(times: Sequence[Decimal], unit: str | None, said: list[str]) -> list[float]:
    """Times in s; those since 1970 begin at 0.

    unit  of the times, None where the file does not say it
    said  where a sentence is added on what was supposed
    """
    if not times:
        return []
    first, known = times[0], None if unit is None else plain(unit)
    epoch = next((name for least, name in EPOCHS if abs(first) >= least), None)
    found = known or epoch or _of_steps(times) or "s"
    if known is None and found != "s":
        said.append(f"times are taken for {found}: {_first(times)}; where they are not, name the unit, as in t [s]")
    digits = DIGITS[found]
    if abs(first).scaleb(-digits) >= EPOCHS[-1][0]:
        began = datetime.fromtimestamp(float(first.scaleb(-digits)), UTC).strftime("%Y-%m-%d %H:%M:%S")
        said.append(f"times since 1970 count from the first row, {began} UTC")
        times = [time - first for time in times]
    return [float(time.scaleb(-digits)) for time in times]


def _of_steps(times: Sequence[Decimal]) -> str | None:
    """The unit of a log of many rows whose times are whole numbers with long steps; None where it may be s."""
    if len(times) < ENOUGH or any(time != time.to_integral_value() for time in times):
        return None
    steps = [later - earlier for earlier, later in zip(times, times[1:], strict=False) if later > earlier]
    usual = statistics.median(steps) if steps else Decimal(0)
    return next((unit for least, unit in STEPS if usual >= least), None)


def _first(times: Sequence[Decimal]) -> str:
    return f"the first two are {', '.join(str(time) for time in times[:2])}"

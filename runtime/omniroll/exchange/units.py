"""Units as the derivation writes them, as powers of base units."""

import re
from collections import Counter

BASE = {  # powers of kg, m, s, A, rad
    "kg": {"kg": 1}, "m": {"m": 1}, "s": {"s": 1}, "A": {"A": 1}, "rad": {"rad": 1}, "1": {},
    "N": {"kg": 1, "m": 1, "s": -2}, "J": {"kg": 1, "m": 2, "s": -2}, "W": {"kg": 1, "m": 2, "s": -3},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1}, "ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
}  # fmt: skip
FACTOR = re.compile(r"(/?)\s*(?:\(([^)]*)\)|([A-Za-z]+|1)(?:\^(\d))?)")


def powers(unit: str) -> dict[str, int]:
    """{"kg": 1, "m": 2} of "kg m^2"; what stands behind a slash, one unit or a bracket, divides."""
    found: Counter[str] = Counter()
    for slash, bracket, name, power in FACTOR.findall(unit):
        own = powers(bracket) if bracket else {base: n * int(power or 1) for base, n in BASE[name].items()}
        for base, n in own.items():
            found[base] += -n if slash else n
    return {base: n for base, n in found.items() if n}

"""Speeds as people name them, twists and wheel rates, in place of nu: [start] twist, [controller] twist, wheel_rate."""

from collections.abc import Callable
from typing import Any

import numpy as np

from omniroll.conventions.twists import nu_of_twist, nu_of_wheel_rates, wheel_rows
from omniroll.errors import InvalidValueError
from omniroll.scenes.checking import Findings
from omniroll.scenes.problems import shown
from omniroll.scenes.schema import INSTEAD
from omniroll.vehicles.vehicle import Vehicle

NU_OF: dict[str, Callable[[Vehicle, Any], np.ndarray]] = {"twist": nu_of_twist, "wheel_rate": nu_of_wheel_rates}
APART = 1e-6  # of the largest wheel rate that rates may be off those of a motion before it is said
SLIPPING = 1e-3  # the same, where wheels may slip and what they are off would make them


def speeds_as_nu(
    tables: dict[str, dict[str, Any]], vehicle: Vehicle | None, findings: Findings
) -> list[tuple[str, str, str]]:
    """Put nu in the place of other speeds; what is wrong goes into `findings`.

    Gives what is worth saying: table, key and a sentence. At rest where the vehicle is not known.
    """
    said = []
    for (table, target), names in INSTEAD.items():
        content = tables.get(table, {})
        given = [name for name in (target, *names) if name in content]
        for name in given[1:]:
            findings.add(table, name, f"cannot stand beside {given[0]}", shown(content[name]))
        if given in ([], [target]) or given[1:]:
            continue
        (name,), value = given, content[given[0]]
        try:
            moving = _laid_out(vehicle, tables.get("layout", {}))
            nu = np.zeros((*np.shape(value)[:-1], 3)) if moving is None else NU_OF[name](moving, value)
            if moving is not None and name == "wheel_rate":
                said += [(table, name, words) for words in _off(moving, np.array(value), nu, "contact" in tables)]
        except InvalidValueError as error:
            findings.add(table, name, error.bound, shown(value))
        else:
            tables[table] = {key: one for key, one in content.items() if key != name} | {target: nu.tolist()}
    return said


def _laid_out(vehicle: Vehicle | None, layout: dict[str, Any]) -> Vehicle | None:
    """The vehicle with its layout; None where it has none such, which is said elsewhere."""
    try:
        return vehicle.replace(**layout) if vehicle is not None else None
    except InvalidValueError:
        return None


def _off(vehicle: Vehicle, rates: np.ndarray, nu: np.ndarray, slips: bool) -> list[str]:
    """A sentence where no motion has these rates. Raises InvalidValueError where that would make wheels slip."""
    off = float(np.abs(rates - nu @ wheel_rows(vehicle).T).max())
    share = off / max(float(np.abs(rates).max()), 1e-300)
    if slips and share > SLIPPING:
        bound = f"must be rates of a motion of rolling wheels; they are {off:.3g} rad/s off the nearest one"
        raise InvalidValueError("wheel_rate", rates.tolist(), bound)
    return [f"rates are up to {off:.3g} rad/s off those of any motion: the nearest is wanted"] if share > APART else []

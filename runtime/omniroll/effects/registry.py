"""What the derivation's registry of effects, generated/data/effects.json, says to those who run them.

maxima/machinery/effects.mac says what stands there. An entry with a case is there only with some effects beside it, and
without others: ["axle_coulomb", "-axle_viscous"].
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from omniroll import generated_data


@dataclass(frozen=True)
class Quantity:
    """What an effect integrates.

    name     of the state
    rate     the output of a generated function that is its rate
    account  +1: work that is done on the vehicle; -1: energy that it loses; 0: neither
    size     "energy", "momentum" (kg m^2/s) or "speed" (rad/s): what its error is measured against
    """

    name: str
    rate: str
    account: int = 0
    size: str = "energy"


def quantities(names: Sequence[str], roller_model: str, present: Sequence[str] = ()) -> tuple[Quantity, ...]:
    """What these effects integrate beside nu, chi and the pose; `present` are all effects of the set, if not these."""
    states = _entries("states", names, roller_model, present)
    return tuple(
        dict.fromkeys(Quantity(s["name"], s["rate"], s["account"], s["size"]) for s in states if s["size"] != "angle")
    )


def functions(names: Sequence[str], roller_model: str, present: Sequence[str] = ()) -> tuple[str, ...]:
    """The generated functions that give the rates of these, in the order in which they are called."""
    calls = [*_entries("calls", names, roller_model, present), *_entries("states", names, roller_model, present)]
    return tuple(dict.fromkeys(call["function"] for call in calls if call.get("size") != "angle"))


def _entries(kind: str, names: Sequence[str], roller_model: str, present: Sequence[str]) -> Iterator[dict]:
    """Entries of a kind that the effects `names` have where `present` are there, or they alone."""
    present = present or names
    for effect in generated_data.load("effects")["effects"]:
        if effect["name"] in names:
            for entry in effect[kind]:
                holds = ((term.lstrip("-") in present) != term.startswith("-") for term in entry["case"])
                if roller_model in entry["models"] and all(holds):
                    yield entry

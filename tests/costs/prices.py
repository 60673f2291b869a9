"""What effects cost: instructions of an evaluation and of a phase with each effect by itself, over those of the bare
vehicle; and what a knot, a sample and a current limit cost. `python -m costs.prices` from tests/ prints the tables."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import omniroll
from omniroll import Bearings, Controller, Motor, Slope, Torque, TorqueTable
from omniroll.engine.simulate import checked_task
from omniroll.scenes.costs import operations

from .counting import Count, counted

PAPER = omniroll.Vehicle.paper()
PLACES = ((0.15, 0.01), (-0.07, 0.14), (-0.08, -0.12))
NU = (5.0, 0.0, 5.0)  # fast: friction does not stop it
LENGTHS = (0.5, 4.0)  # s; what differs between two runs is counted, so that starting up is not
ACCURACY = 1e-9
GENTLE = {"torque_constant": 0.02, "resistance": 1.5, "gear_ratio": 3.0, "rotor_inertia": 1e-6}

EFFECTS = {
    "bare": (),
    "torque": (Torque((2e-3, -1e-3, 1e-3)),),
    "linear table": (TorqueTable((0.0, 100.0), ((2e-3, 0.0, 0.0), (0.0, 2e-3, 1e-3))),),
    "slope": (Slope(0.02, 0.3),),
    "motor": (Motor((2.0, -1.0, 3.0), **GENTLE),),
    "axles, viscous": (Bearings(wheel_viscous=2e-4),),
    "rollers, viscous": (Bearings(roller_viscous=1e-6),),
    "axles, Coulomb": (Bearings(wheel_coulomb=1e-3, wheel_speed=0.5),),
    "rollers, Coulomb": (Bearings(roller_coulomb=1e-6, roller_speed=0.5),),
    "axles that stick": (Bearings(wheel_coulomb=1e-3),),
    "rollers that stick": (Bearings(roller_coulomb=1e-6),),
}
ONE_ROW = omniroll.Vehicle.paper(rollers_per_wheel=6).replace(wheel_places=PLACES)
VEHICLES = {
    "layout": PAPER.replace(wheel_places=PLACES),
    "one row of six": ONE_ROW,
    "two rows of three": ONE_ROW.replace(rows=2, row_offset=1e-3),
    "mecanum": PAPER.replace(roller_angle=0.7),
    "profile": PAPER.replace(meridian_radius=PAPER.wheel_radius - PAPER.roller_axis_radius),
    "kinds": PAPER.replace(kinds={"a": {}, "b": {"wheel_radius": 0.04}}, wheel_kinds=("a", "a", "b")),
}

# The most that an evaluation with other wheels is to cost, over one with those.
PROMISED = {
    "two rows of three": ("one row of six", 1.05),
    "mecanum": ("bare", 1.6),
    "profile": ("bare", 1.3),
    "kinds": ("bare", 1.1),
}

# Events that leave the motion as it is, and the same run without them.
EVERY = 0.01  # s
TIMES = np.arange(0, LENGTHS[1] + 2 * EVERY, EVERY)
SWINGS = np.where(np.arange(len(TIMES)) % 2, 1.0, -1.0)[:, None] * np.ones(3)  # V
IDLE = {"torque_constant": 1e-7, "resistance": 1.0, "times": tuple(TIMES)}  # it moves nothing
EVENTS = {
    "a knot": (TorqueTable(tuple(TIMES), 1e-3 * TIMES[:, None] * np.ones(3)),),
    "no knot": (TorqueTable((0.0, 100.0), 1e-3 * np.array([0.0, 100.0])[:, None] * np.ones(3)),),
    "a sample": (Controller((0, 0, 0), 1e-12, EVERY),),
    "no sample": (Torque(0.0),),
    "a limit": (Motor(SWINGS, current_limit=0.5, **IDLE),),
    "no limit": (Motor(SWINGS, **IDLE),),
}
WITHOUT = {"a knot": "no knot", "a sample": "no sample", "a limit": "no limit"}


def task(name):
    """The arguments of a run, from the name of its effect and its duration."""
    effect, _, duration = name.rpartition("|")
    return {
        "vehicle": VEHICLES.get(effect, PAPER), "nu": NU, "duration": float(duration), "accuracy": ACCURACY,
        "effects": (EFFECTS | EVENTS).get(effect, ()),
    }  # fmt: skip


def operations_of(effect):
    """Of an evaluation, as `omniroll explain` counts them."""
    options = task(f"{effect}|1")
    return sum(cost.total for cost in operations(checked_task(options.pop("vehicle"), **options)))


def measured(effects):
    """{effect: Count} of the time between the two lengths."""
    names = [f"{effect}|{length}" for effect in effects for length in LENGTHS]
    found = counted("costs.prices", names)
    return {effect: found[f"{effect}|{LENGTHS[1]}"] - found[f"{effect}|{LENGTHS[0]}"] for effect in effects}


@dataclass(frozen=True)
class Price:
    """An effect's count beside that of the bare vehicle."""

    effect: str
    count: Count
    bare: Count

    @property
    def operations(self) -> float:
        """Of an evaluation, over the bare vehicle's."""
        return operations_of(self.effect) / operations_of("bare")

    @property
    def of_evaluation(self) -> float:
        """Instructions, over the bare vehicle's."""
        return self.count.per_evaluation / self.bare.per_evaluation

    @property
    def of_phase(self) -> float:
        return self.count.per_phase / self.bare.per_phase


def prices(effects: Sequence[str] = (*EFFECTS, *VEHICLES)) -> list[Price]:
    found = measured(["bare", *(effect for effect in effects if effect != "bare")])
    return [Price(name, count, found["bare"]) for name, count in found.items()]


def prices_of_events() -> dict[str, float]:
    """Of a knot, a sample and a current limit: instructions, over those of a phase of the bare vehicle."""
    found = measured(["bare", *EVENTS])
    prices = {}
    for name, without in WITHOUT.items():
        more = found[name] - found[without]
        prices[name] = more.instructions / more.phases / found["bare"].per_phase
    return prices


def main():
    heads = "operations instr/evaluation over phases steps rejected sweeps kinstr/phase ratio".split()
    print(f"{'effect':20}" + "".join(f"{head:>14}" for head in heads))
    for price in prices():
        count = price.count
        cells = [
            f"{price.operations:.2f}", f"{price.of_evaluation:.2f}", f"{price.of_evaluation / price.operations:.2f}",
            count.phases, count.steps, count.rejected_steps, f"{count.evaluations / count.steps / 16:.1f}",
            f"{count.per_phase / 1000:.1f}", f"{price.of_phase:.2f}",
        ]  # fmt: skip
        print(f"{price.effect:20}" + "".join(f"{cell:>14}" for cell in cells))
    for name, price in prices_of_events().items():
        print(f"{name}: {price:.2f} bare phases")


if __name__ == "__main__":
    sys.exit(main())

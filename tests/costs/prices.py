"""What effects cost: instructions of an evaluation and of a phase with each effect by itself, over those of the bare
vehicle. `python -m costs.prices` from tests/ prints the tables."""

import sys
from dataclasses import dataclass

import omniroll
from omniroll import Bearings, Contact, Controller, Motor, Slope, Torque, TorqueTable
from omniroll.engine.simulate import checked_task
from omniroll.scenes.costs import operations

from .counting import counted

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
VEHICLES = {"layout": PAPER.replace(wheel_places=PLACES)}


def task(name):
    """The arguments of a run, from the name of its effect and its duration."""
    effect, _, duration = name.rpartition("|")
    return {
        "vehicle": VEHICLES.get(effect, PAPER), "nu": NU, "duration": float(duration), "accuracy": ACCURACY,
        "effects": EFFECTS.get(effect, ()),
    }  # fmt: skip


def operations_of(effect):
    options = task(f"{effect}|1")
    return sum(cost.total for cost in operations(checked_task(options.pop("vehicle"), **options)))


def measured(effects):
    """{effect: Count} of the time between the two lengths."""
    names = [f"{effect}|{length}" for effect in effects for length in LENGTHS]
    found = counted("costs.prices", names)
    return {effect: found[f"{effect}|{LENGTHS[1]}"] - found[f"{effect}|{LENGTHS[0]}"] for effect in effects}


def main():
    names = sys.argv[1:] or [*EFFECTS, *VEHICLES]
    found = measured(names if "bare" in names else ["bare", *names])
    bare, bare_operations = found["bare"], operations_of("bare")
    print(f"{'effect':22}{'ops':>6}{'ratio':>7}{'instr/ev':>9}{'ratio':>7}{'over':>6} |{'phases':>7}{'steps':>6}{'rej':>5}{'ev/step':>8}{'kinstr/ph':>10}{'ratio':>7}")
    for name, count in found.items():
        ops, each = operations_of(name), count.per_evaluation
        r_ops, r_each = ops / bare_operations, each / bare.per_evaluation
        print(f"{name:22}{ops:6}{r_ops:7.2f}{each:9.0f}{r_each:7.2f}{r_each / r_ops:6.2f} |{count.phases:7}{count.steps:6}"
              f"{count.rejected_steps:5}{count.evaluations / count.steps / 16:8.1f}{count.per_phase / 1000:10.1f}{count.per_phase / bare.per_phase:7.2f}")


if __name__ == "__main__":
    main()

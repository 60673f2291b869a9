"""What will be simulated of a scene, and why: state, effects, costs, estimates, and what looks wrong."""

import math
from dataclasses import asdict
from typing import Any

from omniroll import generated_data
from omniroll.runs import Task
from omniroll.scene.acting import MAKERS
from omniroll.scene.costs import nanoseconds, operations
from omniroll.scene.estimates import FELT, estimates
from omniroll.scene.lints import lints
from omniroll.scene.loading import Scene
from omniroll.simulate import checked_task

JOINTS = "joints of rollers: the contact passes to the next one"
UNITS = {"energy": "J", "momentum": "kg m^2/s", "speed": "rad/s"}


def explained(scene: Scene) -> dict[str, Any]:
    """All of it in plain Python types. Runs the scene for a short time."""
    task = checked_task(scene.vehicle, **scene.options)
    compared, found = estimates(scene)
    by_effect = {estimate.effect: estimate for estimate in found}
    on = effects_on(scene, task)
    costs = operations(task)
    massless = by_effect.get("massless")
    return {
        "scene": scene.name,
        "vehicle": scene.vehicle.as_dict(),
        "set": task.kernel.set_name,
        "backend": task.kernel.backend,
        "state": state_variables(task),
        "effects": [
            {
                **{name: effect[name] for name in ("name", "table", "meaning")},
                "on": effect["name"] in on,
                "called_by": called_by(scene, effect) if effect["name"] in on else [],
                "estimate": asdict(by_effect[effect["name"]]) if effect["name"] in by_effect else None,
            }
            for effect in generated_data.load("effects")["effects"]
            if effect["table"] or effect["name"] in on
        ],
        "events": [JOINTS, *(event for effect in task.effects.effects for event in effect.events())],
        "compared": compared,
        "felt": FELT,
        "operations": {"functions": [asdict(cost) for cost in costs], "total": sum(cost.total for cost in costs)},
        "time": nanoseconds(task),
        "lints": [asdict(lint) for lint in lints(scene, massless.distance if massless else None)],
    }


def effects_on(scene: Scene, task: Task) -> set[str]:
    """The effects of the registry that the scene calls for; the defaults where it says nothing."""
    asked = {"reactions"} if "reactions" in scene.tables else set()
    return {task.kernel.roller_model, task.switching, *task.kernel.effects} | asked


def called_by(scene: Scene, effect: dict[str, Any]) -> list[str]:
    """The tables of the scene that call for an effect of the registry; none where it is there by default."""
    acting = zip((table for table in MAKERS if table in scene.tables), scene.options.get("effects", ()), strict=True)
    tables = [table for table, acts in acting if effect["name"] in acts.kernel_effects()]
    return tables or [table for table in (effect["table"],) if table in scene.tables]


def state_variables(task: Task) -> list[dict[str, Any]]:
    """What is carried along the motion: name, how many numbers, unit, what they are."""
    bound = task.kernel
    wheels, places = bound.wheels, bound.rollers_per_wheel - 1
    layout = task.effects.layout(bound)
    state = [
        ("nu", 3, "1/s", "speeds of the vehicle, integrated"),
        ("chi", wheels, "rad", "wheel angles, integrated"),
        ("pose", 3, "m, m, rad", "place and heading, integrated"),
    ]
    for quantity in layout.quantities:
        kind = "integrated for the ledger" if quantity.account else "of the rollers, integrated"
        state.append((quantity.name, math.prod(layout.shapes[quantity.name]), UNITS[quantity.size], kind))
    state.append(("contact", wheels, "", "the roller in contact of each wheel, changed by switches"))
    if bound.has_spins and "axial" not in layout.shapes:
        state.append(("axial", wheels * places, "rad/s", "axial speeds of the free rollers, kept between switches"))
    names = ("name", "count", "unit", "meaning")
    return [dict(zip(names, entry, strict=True)) for entry in state]

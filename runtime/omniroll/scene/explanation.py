"""What will be simulated of a scene, and why: state, effects, costs, estimates, and what looks wrong."""

from dataclasses import asdict
from typing import Any

from omniroll import generated_data
from omniroll.kernels import Kernel, best_backend, kernel
from omniroll.scene.costs import nanoseconds, operations
from omniroll.scene.estimates import estimates
from omniroll.scene.lints import lints
from omniroll.scene.loading import Scene


def explained(scene: Scene) -> dict[str, Any]:
    """All of it in plain Python types. Runs the scene for a short time."""
    bound = bound_kernel(scene)
    compared, found = estimates(scene)
    by_effect = {estimate.effect: estimate for estimate in found}
    costs = operations(bound)
    massless = by_effect.get("massless")
    return {
        "scene": scene.name,
        "vehicle": scene.vehicle.as_dict(),
        "set": bound.set_name,
        "state": state_variables(bound),
        "effects": [
            {
                **{name: effect[name] for name in ("name", "table", "meaning")},
                "on": effect["name"] in effects_on(scene, bound),
                "estimate": asdict(by_effect[effect["name"]]) if effect["name"] in by_effect else None,
            }
            for effect in generated_data.load("effects")["effects"]
            if effect["table"]
        ],
        "compared": compared,
        "operations": {"functions": [asdict(cost) for cost in costs], "total": sum(cost.total for cost in costs)},
        "time": nanoseconds(scene),
        "lints": [asdict(lint) for lint in lints(scene, massless.distance if massless else None)],
    }


def bound_kernel(scene: Scene) -> Kernel:
    """The kernel that runs the scene."""
    backend = "python" if scene.options.get("engine") == "python" else best_backend()
    return kernel(scene.vehicle, scene.options.get("roller_model", "free"), backend)


def effects_on(scene: Scene, bound: Kernel) -> set[str]:
    """The effects of the registry that the scene calls for; the defaults where it says nothing."""
    return {bound.roller_model, scene.options.get("switching", "impact")}


def state_variables(bound: Kernel) -> list[dict[str, Any]]:
    """What is carried along the motion: name, how many numbers, unit, what they are."""
    wheels, places = bound.wheels, bound.rollers_per_wheel - 1
    state = [
        ("nu", 3, "1/s", "speeds of the vehicle, integrated"),
        ("chi", wheels, "rad", "wheel angles, integrated"),
        ("pose", 3, "m, m, rad", "place and heading, integrated"),
        ("contact", wheels, "", "the roller in contact of each wheel, changed by switches"),
    ]
    if bound.has_spins:
        state.append(("axial", wheels * places, "rad/s", "axial speeds of free rollers, changed by switches only"))
    names = ("name", "count", "unit", "meaning")
    return [dict(zip(names, entry, strict=True)) for entry in state]

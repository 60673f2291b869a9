"""Numbers of the ground's friction that no ground has, or that only cost."""

from collections.abc import Iterator

import numpy as np

from omniroll.effects.contact import Contact
from omniroll.effects.slope import Slope
from omniroll.scenes.lint import Lint
from omniroll.scenes.loading import Scene
from omniroll.vocabulary import STANDARD_GRAVITY

HEAVY = 0.25  # of the weight: given loads whose sum is farther from it are those of no vehicle at rest
GRIPPING = 3.0  # no coefficient of friction of a wheel is larger
CREEP = 1e-5  # m/s: a named speed below this costs steps, and what it changes no instrument sees


def of_ground(scene: Scene) -> Iterator[Lint]:
    """Lints of [contact]."""
    effects = scene.options.get("effects", ())
    ground = next((effect for effect in effects if isinstance(effect, Contact)), None)
    if ground is None:
        return
    for name in ("friction", "static_friction"):
        value = getattr(ground, name)
        if value is not None and np.max(value) > GRIPPING:
            yield Lint("contact", name, f"{np.max(value):g} is more than wheels have on any floor")
    if ground.speed is not None and ground.speed < CREEP:
        text = f"{ground.speed:g} m/s only costs: nobody sees so slow a creep; the law coulomb needs no such speed"
        yield Lint("contact", "speed", text)
    if ground.load is not None:
        slope = next((effect for effect in effects if isinstance(effect, Slope)), None)
        gravity = STANDARD_GRAVITY if slope is None else slope.normal_gravity
        weight, sum_of_loads = (
            scene.vehicle.mass * gravity,
            float(np.broadcast_to(ground.load, scene.vehicle.wheels).sum()),
        )
        if abs(sum_of_loads - weight) > HEAVY * weight:
            text = f"the loads add up to {sum_of_loads:.3g} N; the vehicle presses on the ground with {weight:.3g} N"
            yield Lint("contact", "load", text)

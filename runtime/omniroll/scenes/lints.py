"""Numbers of a vehicle, and choices of a scene, that are allowed and yet look wrong.

The inertias that mass and size allow at most come from the generated functions of parts: a ring has all of its
mass as far out as it can be.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from omniroll import generated_data
from omniroll.scenes.loading import Scene
from omniroll.vehicles.parts import cylinder, evaluate
from omniroll.vehicles.vehicle import Vehicle

FAR = 2.0  # the mass of a vehicle lies at most this many times as far from S as its wheels reach
BLUNT = 0.05  # least height of a roller's axis above the ground at the joint, over that in the middle of the roller
NEGLIGIBLE = 1e-4  # where massive rollers change the motion by less than this, massless ones would do
PART_ARGUMENTS = tuple(
    argument["name"]
    for function in generated_data.load("kernels")["functions"]
    if "parts" in function["sets"] and function["name"] == "inertias"
    for argument in function["arguments"]
    if argument["role"] == "in"
)


@dataclass(frozen=True)
class Lint:
    """Something that looks wrong: where, and why."""

    table: str
    key: str
    text: str

    def __str__(self) -> str:
        return f"[{self.table}] {self.key}: {self.text}"


def lints(scene: Scene, without_inertia: float | None = None) -> list[Lint]:
    """All that looks wrong in a scene; `without_inertia` is how far massless rollers take the motion away."""
    return [
        *_of_numbers(scene.vehicle),
        *_of_parts(scene.tables["vehicle"], scene.vehicle),
        *_of_choices(scene, without_inertia),
    ]


def ring(mass: float, radius: float) -> float:
    """The largest inertia of a mass about an axis that none of it is farther from, kg m^2: of sizeless rollers."""
    sizeless = {name: 0.0 for name in PART_ARGUMENTS if name not in ("roller_mass", "roller_axis_radius")}
    points = 3
    _, _, inertia, _ = evaluate("inertias", 1, points, **sizeless, roller_mass=mass / points, roller_axis_radius=radius)
    return inertia


def _joint_height(vehicle: Vehicle) -> float:
    """The height of a roller's axis above the ground at the joint, m: the margin of the derivation's bound on r."""
    margin = next(
        bound["positive"]
        for bound in generated_data.load("bounds")["bounds"]
        if bound["field"] == "roller_axis_radius" and isinstance(bound["positive"], list)
    )
    codes = generated_data.code_names().items()
    return generated_data.evaluate(margin, {symbol: getattr(vehicle, code, None) for symbol, code in codes})


def _of_numbers(vehicle: Vehicle) -> Iterator[Lint]:
    rollers, share = vehicle.rollers_per_wheel, vehicle.mass / vehicle.wheels
    reach, thickness = vehicle.wheel_radius, vehicle.wheel_radius - vehicle.roller_axis_radius
    most = ring(share, reach)
    if vehicle.wheel_inertia > most:
        text = f"{vehicle.wheel_inertia:.3g} kg m^2 is more than a wheel with its share of the mass can have"
        yield Lint("vehicle", "wheel_inertia", f"{text}, {most:.3g}; only a rotor behind a gear gives more")
    most = ring(vehicle.mass, FAR * (vehicle.platform_radius + reach))
    if vehicle.yaw_inertia > most:
        text = (
            f"{vehicle.yaw_inertia:.3g} kg m^2 is more than with all of the mass {FAR:g} times as far out as the wheels"
        )
        yield Lint("vehicle", "yaw_inertia", f"{text}, {most:.3g}")
    # With all of its mass at its largest radius a roller weighs least; the wheel's inertia says what it weighs at most.
    least = vehicle.roller_inertia / ring(1.0, thickness)
    if least > vehicle.wheel_inertia / ring(rollers, vehicle.roller_axis_radius):
        text = f"needs rollers of {least:.3g} kg or more; {rollers} of them make wheel_inertia larger than it is"
        yield Lint("vehicle", "roller_inertia", text)
    if least * rollers > share:
        text = f"needs rollers of {least:.3g} kg or more; those of a wheel outweigh the wheel's share of the mass"
        yield Lint("vehicle", "roller_inertia", f"{text}, {share:.3g} kg")
    tip = _joint_height(vehicle)
    if tip < BLUNT * thickness:
        text = f"the joint is close to the tips: a roller's axis is {tip:.3g} m above the ground there"
        yield Lint("vehicle", "roller_axis_radius", f"{text}, {thickness:.3g} m in the roller's middle")


def _of_parts(table: dict[str, Any], vehicle: Vehicle) -> Iterator[Lint]:
    reach, thickness = vehicle.wheel_radius, vehicle.wheel_radius - vehicle.roller_axis_radius
    far = FAR * (vehicle.platform_radius + reach)
    outermost = {
        "platform_inertia": ("platform_mass", table.get("platform_disk_radius", far)),
        "hub_axial_inertia": ("hub_mass", table.get("hub_radius", reach)),
        "roller_axial_inertia": ("roller_mass", table.get("roller_radius", thickness)),
    }
    for name, (mass, radius) in outermost.items():
        if name in table and table[name] > (most := ring(table[mass], radius)):
            text = (
                f"{table[name]:.3g} kg m^2 is more than {table[mass]:g} kg within {radius:.3g} m of the axis can have"
            )
            yield Lint("vehicle", name, f"{text}, {most:.3g}")
    axial, transverse = cylinder(1.0, 1.0, 1e-9)  # nothing is flatter than a disk
    for body in ("hub", "roller", "rotor"):
        names = f"{body}_axial_inertia", f"{body}_transverse_inertia"
        if set(names) <= set(table) and table[names[0]] * transverse > table[names[1]] * axial * (1 + 1e-9):
            text = f"more than {axial / transverse:.3g} times the inertia across the axis, which not even a disk has"
            yield Lint("vehicle", names[0], text)
    if table.get("roller_mass", 0) > table.get("hub_mass", math.inf):
        yield Lint("vehicle", "roller_mass", "a roller is heavier than the wheel that carries it")


def _of_choices(scene: Scene, without_inertia: float | None) -> Iterator[Lint]:
    model, law = scene.options.get("roller_model", "free"), scene.options.get("switching", "impact")
    slips = "contact" in scene.tables
    if slips and "switching" in scene.tables:
        yield Lint("switching", "law", "has no part where wheels may slip: a switch changes no speed there")
    if model == "free" and law == "smooth" and not slips:
        yield Lint(
            "switching", "law", "the law smooth lets the energy of free rollers rise at switches; impact never does"
        )
    # The distance is exactly 0 where nothing moves; that tells nothing about the rollers.
    if model != "massless" and without_inertia and without_inertia < NEGLIGIBLE:
        text = f"the rollers' inertia changes this motion by {without_inertia:.1e}: massless would do"
        yield Lint("rollers", "model", text)
    for doubt in scene.doubts():
        yield Lint("controller", "sample_time", str(doubt))

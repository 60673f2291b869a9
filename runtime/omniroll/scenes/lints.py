"""All that is allowed in a scene and yet looks wrong: numbers of the vehicle, angles, what acts, choices."""

from collections.abc import Iterator

from omniroll.scenes.lint import Lint
from omniroll.scenes.lints_of_angles import of_angles
from omniroll.scenes.lints_of_ground import of_ground
from omniroll.scenes.lints_of_motion import of_motion
from omniroll.scenes.lints_of_motors import of_motors
from omniroll.scenes.lints_of_vehicle import of_numbers, of_parts, of_sizes
from omniroll.scenes.lints_of_wheels import of_wheels
from omniroll.scenes.loading import Scene

NEGLIGIBLE = 1e-4  # where massive rollers change the motion by less than this, massless ones would do


def lints(scene: Scene, without_inertia: float | None = None) -> list[Lint]:
    """All that looks wrong in a scene; `without_inertia` is how far massless rollers take the motion away."""
    return [
        *of_sizes(scene.vehicle),
        *of_numbers(scene.vehicle),
        *of_parts(scene.tables["vehicle"], scene.vehicle),
        *of_wheels(scene.tables["vehicle"], scene.vehicle),
        *of_angles(scene.vehicle, scene.tables),
        *of_motion(scene),
        *of_ground(scene),
        *of_motors(scene),
        *(Lint(*said) for said in scene.said),
        *_of_choices(scene, without_inertia),
    ]


def _of_choices(scene: Scene, without_inertia: float | None) -> Iterator[Lint]:
    model, law = scene.options.get("roller_model", "free"), scene.options.get("switching", "impact")
    if scene.slips and "switching" in scene.tables:
        yield Lint("switching", "law", "has no part where wheels may slip: a switch changes no speed there")
    if model == "free" and law == "smooth" and not scene.slips:
        yield Lint(
            "switching", "law", "the law smooth lets the energy of free rollers rise at switches; impact never does"
        )
    # The distance is exactly 0 where nothing moves; that tells nothing about the rollers.
    if model != "massless" and without_inertia and without_inertia < NEGLIGIBLE:
        text = f"the rollers' inertia changes this motion by {without_inertia:.1e}: massless would do"
        yield Lint("rollers", "model", text)
    for doubt in scene.doubts():
        yield Lint("controller", "sample_time", str(doubt))

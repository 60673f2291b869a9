"""`omniroll explain SCENE`: state, effects, costs, estimates, and what looks wrong."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.scenes import load_scene
from omniroll.scenes.estimates import estimates
from omniroll.scenes.explanation import explained, origins_of
from omniroll.scenes.lints import lints

pytestmark = pytest.mark.long

PAPER = omniroll.Vehicle.paper()
FIELDS = {name: value for name, value in PAPER.as_dict().items() if isinstance(value, (int, float))}
PARTS = {
    "wheels": 3, "rollers_per_wheel": 5, "platform_radius": 0.15, "wheel_radius": 0.07, "platform_mass": 1.0,
    "platform_inertia": 0.01, "hub_mass": 0.15, "hub_axial_inertia": 2e-4, "hub_transverse_inertia": 1e-4,
    "roller_mass": 0.05, "roller_axial_inertia": 2e-6, "roller_transverse_inertia": 2e-5,
}  # fmt: skip


def scene_of(folder: Path, vehicle: dict, more: str = "", nu: str = "[1, 0, 1]") -> omniroll.Scene:
    numbers = "\n".join(f"{name} = {value!r}" for name, value in vehicle.items())
    path = folder / "scene.toml"
    path.write_text(f"[vehicle]\n{numbers}\n[start]\nnu = {nu}\n[run]\nduration = 1\n{more}")
    return load_scene(path)


def keys_of(found) -> list[str]:
    return [lint.key for lint in found]


@pytest.mark.usefixtures("quick_timing")
@pytest.mark.parametrize("scene", sorted(Path("scenes").glob("*.toml")), ids=lambda scene: scene.stem)
def test_every_shipped_scene_is_explained(scene, shortened, capsys):
    assert cli.main(["explain", str(shortened(scene)), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["operations"]["total"] > 100 and 1 < said["time"]["nanoseconds"] < 1e7
    options = load_scene(scene).options
    on = [effect["name"] for effect in said["effects"] if effect["on"]]
    laws = [] if load_scene(scene).slips else [options.get("switching", "impact")]  # slip asks for no law
    assert on[: 1 + len(laws)] == [options.get("roller_model", "free"), *laws]
    assert not [effect for effect in said["effects"] if effect["on"] and effect["estimate"]]
    acting = [type(effect).__name__ for effect in options.get("effects", ())]
    rolls = not load_scene(scene).slips and options.get("roller_model") != "locked"
    assert [price["effect"] for price in said["prices"]] == acting + ["Contact"] * rolls
    for price in said["prices"]:
        assert price["operations"] is None or price["operations"] >= 0  # a controller adds none


@pytest.mark.usefixtures("quick_timing")
def test_operations_add_up(tmp_path):
    """The paper's table of counts, on the kernel's own numbers: constant + per wheel N, nothing per roller."""
    few, many = (load_scene("scenes/motion-3.toml"), scene_of(tmp_path, {"preset": "paper", "rollers_per_wheel": 60}))
    for scene in (few, many):
        said = explained(scene)
        for cost in said["operations"]["functions"]:
            assert cost["total"] == cost["constant"] + scene.vehicle.wheels * cost["per_wheel"] > 0
            assert cost["per_roller"] == 0
    counted = {entry["name"]: entry["count"] for entry in said["state"]}
    assert counted == {"nu": 3, "chi": 3, "pose": 3, "contact": 3, "axial": 3 * 59}


def test_an_estimate_is_the_distance_of_two_motions(tmp_path):
    """Of other rollers, and of the laws of the ground with the friction of [reactions], on a slope."""
    more = "[slope]\nangle = 0.2\n[reactions]\nfriction = 0.01\nheight = 0.05\n[rollers]\nmodel = 'massless'\n"
    duration, found = estimates(scene_of(tmp_path, {"preset": "paper"}, more))
    across, slope = {"normal_gravity": 9.80665 * np.cos(0.2)}, omniroll.Slope(0.2)
    run = partial(omniroll.simulate, PAPER, nu=(1, 0, 1), duration=duration)
    base, times = run(effects=[slope], roller_model="massless"), np.linspace(0, duration, 101)
    fade = 0.05 * np.abs(base.kernel.wheel_rates(base.nu, base.chi)[0]).max() * PAPER.wheel_radius
    grounds = {
        "contact_viscous": {"coefficient": 0.01 * PAPER.mass * 9.80665 / 3 / fade},
        "contact_regularised": across | {"law": "regularised", "friction": 0.01, "speed": fade},
        "contact_coulomb": across | {"law": "coulomb", "friction": 0.01},
    }
    estimated = {estimate.effect: estimate.distance for estimate in found}
    others = {model: run(effects=[slope], roller_model=model) for model in ("locked", "free")}
    for effect, numbers in grounds.items():
        others[effect] = run(effects=[slope, omniroll.Contact(**numbers)], roller_model="massless")
    for effect, other in others.items():
        apart = np.abs(base.sample(times).pose - other.sample(times).pose) / [0.15, 0.15, 1.0]
        assert 0.01 < apart.max() <= estimated[effect] * (1 + 1e-6)


def test_what_cannot_be_estimated_says_why(tmp_path):
    more = "[contact]\nlaw = 'coulomb'\nfriction = 0.5\n[rollers]\nmodel = 'massless'\n"
    found = {estimate.effect: estimate for estimate in estimates(scene_of(tmp_path, {"preset": "paper"}, more))[1]}
    assert "cannot be locked where wheels may slip" in found["locked"].why
    assert found["layout"].distance > 0 and not found["layout"].why  # loads at rest need no mass of the wheels
    assert found["smooth"].why == found["impact"].why == "wheels that may slip ask for no law"
    assert found["slope"].distance > 0 and not found["slope"].why
    assert found["contact_regularised"].distance > 0 and "contact_coulomb" not in found


@pytest.mark.usefixtures("quick_timing")
def test_a_scene_of_no_time_is_explained(tmp_path, capsys):
    path = tmp_path / "standing.toml"
    path.write_text(Path("scenes/motion-3.toml").read_text().replace("duration = 20.0", "duration = 0"))
    assert cli.main(["explain", str(path)]) == 0
    said = capsys.readouterr().out
    assert "not estimated (rollers in two rows, by turns)\n" in said
    assert "nothing to compare with: the motion takes no time" in said


def test_nothing_looks_wrong_with_good_vehicles(tmp_path):
    assert lints(scene_of(tmp_path, {"preset": "paper"})) == []
    assert lints(scene_of(tmp_path, PARTS)) == []


SHARE = PAPER.mass / 3
THICKNESS = PAPER.wheel_radius - PAPER.roller_axis_radius


@pytest.mark.parametrize(
    "changes, keys",
    [
        ({"wheel_inertia": 1.01 * SHARE * PAPER.wheel_radius**2}, ["wheel_inertia"]),
        ({"wheel_inertia": 0.99 * SHARE * PAPER.wheel_radius**2}, []),
        ({"yaw_inertia": 1.01 * PAPER.mass * (0.15 + PAPER.wheel_radius) ** 2}, ["yaw_inertia"]),
        ({"yaw_inertia": 0.99 * PAPER.mass * (0.15 + PAPER.wheel_radius) ** 2}, []),
        ({"yaw_inertia": 0.99 * 0.05 * PAPER.mass * 0.15**2}, ["yaw_inertia"]),
        ({"yaw_inertia": 1.01 * 0.05 * PAPER.mass * 0.15**2}, []),
        ({"roller_inertia": 1.01 * PAPER.wheel_inertia / 5 * (THICKNESS / 0.05) ** 2}, ["roller_inertia"]),
        ({"roller_inertia": 0.99 * PAPER.wheel_inertia / 5 * (THICKNESS / 0.05) ** 2}, []),
        ({"roller_inertia": 1.01 * SHARE / 5 * THICKNESS**2, "wheel_inertia": SHARE * PAPER.wheel_radius**2},
         ["roller_inertia"]),
        ({"roller_axis_radius": PAPER.wheel_radius * 0.999 * np.cos(np.pi / 5)}, ["roller_axis_radius"]),
    ],
)  # fmt: skip
def test_numbers_that_look_wrong(changes, keys, tmp_path):
    """Each lint at both sides of its bound, which is worked out here by hand."""
    numbers = FIELDS | {name: float(value) for name, value in changes.items()}
    assert keys_of(lints(scene_of(tmp_path, numbers))) == keys


@pytest.mark.parametrize("changes, key", [
    ({"platform_inertia": 1.01 * 1.0 * 0.22**2}, "platform_inertia"),
    (
        {"hub_axial_inertia": 1.01 * 0.15 * (0.07 * np.cos(np.pi / 4)) ** 2, "hub_transverse_inertia": 5e-4},
        "hub_axial_inertia",
    ),
    ({"hub_axial_inertia": 2.02e-4}, "hub_axial_inertia"),
    ({"roller_axial_inertia": 1.01 * 0.05 * (0.07 * (1 - np.cos(np.pi / 4))) ** 2}, "roller_axial_inertia"),
    ({"hub_mass": 0.04, "hub_axial_inertia": 5e-5, "hub_transverse_inertia": 5e-5}, "roller_mass"),
])  # fmt: skip
def test_parts_that_look_wrong(changes, key, tmp_path):
    parts = PARTS | {name: float(value) for name, value in changes.items()}
    assert key in keys_of(lints(scene_of(tmp_path, parts)))


def test_choices_that_look_wrong(tmp_path):
    pumping = "[switching]\nlaw = 'smooth'\n[rollers]\nmodel = 'free'\n"
    assert [lint.table for lint in lints(scene_of(tmp_path, {"preset": "paper"}, pumping))] == ["switching"]
    light = scene_of(tmp_path, FIELDS | {"roller_inertia": 1e-12})
    (found,) = [lint for lint in lints(light, estimates(light)[1][0].distance)]
    assert found.table == "rollers" and "massless would do" in found.text
    at_rest = scene_of(tmp_path, {"preset": "paper"}, nu="[0, 0, 0]")
    assert lints(at_rest, estimates(at_rest)[1][0].distance) == []


@pytest.mark.parametrize("inertia, words", [(None, "would add a tenth"), (1e-6, None)])
def test_a_rotor_that_nobody_gives_is_listed(tmp_path, inertia, words):
    drive = "[drive]\nvoltage = 1.0\ntorque_constant = 0.02\nresistance = 1.0\ngear_ratio = 3.0\n"
    drive += "" if inertia is None else f"rotor_inertia = {inertia}\n"
    found = origins_of(scene_of(tmp_path, {"preset": "paper"}, drive))
    rotors = [origin for origin in found if origin.name == "rotor_inertia"]
    assert len(rotors) == (inertia is None) and all(words in origin.reason for origin in rotors)

"""What will be simulated of a scene, and why: state, effects, costs, estimates, and what looks wrong."""

import math
from dataclasses import asdict
from typing import Any

from omniroll import generated_data
from omniroll.effects.motor import Motor
from omniroll.engine.compiled_engine import kernel_of
from omniroll.engine.runs import Task
from omniroll.engine.simulate import checked_task
from omniroll.kernels.by_state import has_pieces
from omniroll.kernels.kernel import BROUGHT
from omniroll.kernels.sets import general_sets
from omniroll.robots.catalogue import ROBOTS
from omniroll.scenes.acting import MAKERS
from omniroll.scenes.allowance import Allowance, working_clock
from omniroll.scenes.costs import nanoseconds, operations, prices
from omniroll.scenes.estimates import FELT, estimates
from omniroll.scenes.lints import lints
from omniroll.scenes.loading import Scene
from omniroll.scenes.schema import TABLES
from omniroll.scenes.wheels_explained import wheels_explained
from omniroll.vehicles.data_sheet import ASSUMED, GIVEN, Origin, motor_constants
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import INERTIAS, LENGTHS, MOTOR_SHEET, ROLLER_MODELS, STATE, Entry, by_name

JOINTS = "joints of rollers: the contact passes to the next one"
ARCS = "borders between the arcs of a roller: the wheel passes to the next one"
PIVOTS = "joints on which wheels stand that the rollers on both sides push back: one of them takes the wheel from there"
ALLOWED = 5.0  # s of work for estimates and prices together, so that all is said within 10 s
UNITS = {"energy": "J", "momentum": "kg m^2/s", "speed": "rad/s"}
UNITS |= {"deflection": "m, rad, rad", "deflection_rate": "m/s, rad/s, rad/s"}


def explained(scene: Scene) -> dict[str, Any]:
    """All of it in plain Python types. Runs the scene for a short time, and takes some ALLOWED s for that."""
    task = checked_task(scene.vehicle, **scene.options)
    allowance = Allowance(ALLOWED, working_clock())
    compared, off = estimates(scene, allowance)
    on = effects_on(scene, task)
    by_effect = {estimate.effect: estimate for estimate in off if estimate.effect not in on}
    costs = operations(task)
    massless = by_effect.get("massless")
    return {
        "scene": scene.name,
        "vehicle": scene.vehicle.as_dict(),
        "numbers": [asdict(origin) for origin in origins_of(scene)],
        **({"wheels": wheels} if (wheels := wheels_explained(scene)) else {}),
        "set": task.kernel.set_name,
        "backend": task.kernel.backend,
        "runs_on": runs_on(task),
        "state": state_variables(task),
        "effects": [
            {
                **{name: effect[name] for name in ("name", "table", "meaning")},
                "on": effect["name"] in on,
                "called_by": called_by(scene, effect) if effect["name"] in on else [],
                "estimate": asdict(by_effect[effect["name"]]) if effect["name"] in by_effect else None,
            }
            for effect in generated_data.load("effects")["effects"]
            if effect["name"] in on or can_be_on(effect)
        ],
        "events": events_of(task),
        "compared": compared,
        "felt": FELT,
        "operations": {"functions": [asdict(cost) for cost in costs], "total": sum(cost.total for cost in costs)},
        "time": nanoseconds(task),
        "prices": [asdict(price) for price in prices(scene, allowance)],
        "left_out": allowance.left_out,
        "allowed": ALLOWED,
        "lints": [asdict(lint) for lint in lints(scene, massless.distance if massless else None)],
    }


def runs_on(task: Task) -> str:
    """The engine that runs, and on which kernel, in words."""
    bound = kernel_of(task)
    if bound is None:
        return f"Python engine, {task.kernel.backend} kernel"
    if bound is task.kernel:
        return "compiled engine, kernel of these effects alone"
    return "compiled engine, prebuilt kernel with further effects at neutral values"


def origins_of(scene: Scene) -> list[Origin]:
    """Where each number of the vehicle comes from, and of its motors where a data sheet gives them."""
    vehicle, table, drive = scene.vehicle, scene.tables["vehicle"], scene.tables.get("drive", {})
    found = list(vehicle.origins)
    known = {origin.name for origin in found}
    missing = [entry for entry in LENGTHS + INERTIAS if entry.name not in known and (not found or entry.name in table)]
    found += [_origin_of_field(entry, vehicle, table) for entry in missing]
    if robot := ROBOTS.get(drive.get("preset", "")):
        found += [_in_drive(origin, drive) for origin in robot.motor_origins()]
    sheet = {entry.name: drive[entry.name] for entry in MOTOR_SHEET if entry.name in drive}
    if sheet:
        found += [Origin(entry.name, sheet[entry.name], entry.unit, GIVEN) for entry in MOTOR_SHEET]
        found += motor_constants(**sheet).values()
    motors = [effect for effect in scene.options.get("effects", ()) if isinstance(effect, Motor)]
    if motors and "rotor_inertia" not in drive and not any(origin.name == "rotor_inertia" for origin in found):
        found.append(_weightless_rotor(motors[0].gear_ratio, vehicle))
    return found


def _weightless_rotor(gear_ratio: float, vehicle: Vehicle) -> Origin:
    """The rotor of a motor whose inertia nobody gives."""
    tenth = 0.1 * vehicle.wheel_inertia / gear_ratio**2
    reason = f"a rotor that weighs nothing, or that wheel_inertia holds; one of {tenth:.2g} would add a tenth to it"
    return Origin("rotor_inertia", 0.0, "kg m^2", ASSUMED, reason)


def _in_drive(origin: Origin, drive: dict[str, Any]) -> Origin:
    """A number of a robot's motors, or what [drive] gives in its place."""
    given = drive.get(origin.name)
    return origin if given is None else Origin(origin.name, given, origin.unit, GIVEN)


def _origin_of_field(entry: Entry, vehicle: Vehicle, table: dict[str, Any]) -> Origin:
    """Of a number of a vehicle that is not made of parts."""
    kind, reason = GIVEN, ""
    if entry.name not in table:
        kind, reason = (ASSUMED, entry.default) if "preset" not in table else (GIVEN, "by the preset")
    return Origin(entry.name, getattr(vehicle, entry.name), entry.unit, kind, reason)


def events_of(task: Task) -> list[str]:
    """The events that steps end on, in words."""
    pivots = [PIVOTS] * task.kernel.pivots
    arcs = [ARCS] * has_pieces(task.vehicle)
    return [JOINTS, *arcs, *pivots, *(event for effect in task.effects.effects for event in effect.events())]


def effects_on(scene: Scene, task: Task) -> set[str]:
    """The effects of the registry that the scene calls for; the defaults where it says nothing."""
    asked = {"reactions"} if "reactions" in scene.tables else set()
    return {task.kernel.roller_model, task.switching, *task.kernel.effects} | asked


def can_be_on(effect: dict[str, Any]) -> bool:
    """Whether a scene can call for an effect of the registry: roller models, laws of switches, what a vehicle brings,
    outputs that have a table, and what acts, if some built engine has it. The others only come along with an effect
    that needs them, or only give functions."""
    name = effect["name"]
    if not effect["optional"] or name in BROUGHT or name in TABLES:
        return True
    return effect["table"] != "vehicle" and any(name in one for model in ROLLER_MODELS for one in general_sets(model))


def called_by(scene: Scene, effect: dict[str, Any]) -> list[str]:
    """The tables of the scene that call for an effect of the registry; none where it is there by default."""
    acting = zip((table for table in MAKERS if table in scene.tables), scene.options.get("effects", ()), strict=True)
    tables = [table for table, acts in acting if effect["name"] in acts.kernel_effects()]
    return tables or [table for table in (effect["table"],) if table in scene.tables]


def state_variables(task: Task) -> list[dict[str, Any]]:
    """What is carried along the motion: name, how many numbers, unit, what they are."""
    bound = task.kernel
    wheels, places = bound.wheels, bound.rollers_per_wheel - 1
    vector = task.effects.state_vector(bound)
    counts = {"nu": 3, "chi": wheels, "pose": 3}
    entries = by_name(STATE)
    state = [(name, count, entries[name].unit, entries[name].meaning) for name, count in counts.items()]
    for quantity in vector.quantities:
        about = generated_data.described(quantity.rate if quantity.account else quantity.name).meaning
        kind = f"integral of the {about}, for the ledger" if quantity.account else about
        state.append((quantity.name, math.prod(vector.shapes[quantity.name]), UNITS[quantity.size], kind))
    state.append(("contact", wheels, "", "the roller in contact of each wheel, changed by switches"))
    if bound.has_spins and "axial" not in vector.shapes:
        state.append(("axial", wheels * places, "rad/s", "axial speeds of the free rollers, kept between switches"))
    names = ("name", "count", "unit", "meaning")
    return [dict(zip(names, entry, strict=True)) for entry in state]

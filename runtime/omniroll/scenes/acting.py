"""The effects of a scene, as the objects that omniroll.simulate takes."""

from collections.abc import Callable
from typing import Any

from omniroll.effects import (
    Bearings,
    Contact,
    Controller,
    Effect,
    FunctionController,
    Motor,
    Slope,
    Torque,
    TorqueTable,
)
from omniroll.errors import InvalidValueError
from omniroll.scenes.checking import Findings
from omniroll.scenes.problems import shown
from omniroll.scenes.schema import MOTOR, TABLES
from omniroll.vehicles.vehicle import Vehicle

MOTOR_NAMES = tuple(key.name for key in MOTOR)
MOTOR_NEEDS = ("torque_constant", "resistance")


def effects_of(tables: dict[str, dict[str, Any]], findings: Findings) -> dict[str, Effect]:
    """The effect of each table that has one and is good; what is wrong goes into `findings`."""
    if "drive" in tables:
        _say_what_does_not_fit(tables["drive"], findings)
        _check_rotors(tables.get("vehicle", {}), tables["drive"], findings)
    effects = {}
    for table, make in MAKERS.items():
        if table in tables and not findings.keys_in(table):
            try:
                effects[table] = make(tables[table])
            except InvalidValueError as error:
                findings.add(table, error.field, error.bound, shown(error.value))
    return effects


def check_together(effects: dict[str, Effect], vehicle: Vehicle, findings: Findings) -> None:
    """What an effect needs of the vehicle and of the others."""
    for table, effect in effects.items():
        try:
            effect.check(vehicle, tuple(effects.values()))
        except InvalidValueError as error:
            findings.add(table, error.field, error.bound, shown(error.value))


def with_layout(vehicle: Vehicle, tables: dict[str, dict[str, Any]], findings: Findings) -> Vehicle:
    """The vehicle with its wheels and its centre of mass where [layout] says."""
    layout = tables.get("layout", {})
    if "wheel_angles" in layout and "wheel_angles" in tables["vehicle"]:
        findings.add(
            "layout", "wheel_angles", "cannot stand beside [vehicle] wheel_angles", shown(layout["wheel_angles"])
        )
    try:
        return vehicle.replace(**layout) if layout else vehicle
    except InvalidValueError as error:
        known = {key.name for key in TABLES["layout"].keys}
        findings.add("layout" if error.field in known else "vehicle", error.field, error.bound, shown(error.value))
        return vehicle


def _say_what_does_not_fit(drive: dict[str, Any], findings: Findings) -> None:
    already = findings.keys_in("drive")
    if "torque" in drive:
        for name in MOTOR_NAMES:
            if name in drive:
                findings.add("drive", name, "cannot stand beside torque", shown(drive[name]))
    elif "voltage" in drive:
        for name in MOTOR_NEEDS:
            if name not in drive and name not in already:
                findings.add("drive", name, "is missing; a motor's voltage needs it")
    elif not already & {"torque", "voltage"}:
        findings.add("drive", None, "needs torque or voltage")
    if "interpolation" in drive and "times" not in drive and "times" not in already:
        findings.add("drive", "interpolation", "needs times", shown(drive["interpolation"]))


def _check_rotors(vehicle: dict[str, Any], drive: dict[str, Any], findings: Findings) -> None:
    """A motor's rotor and its gear are given once: as a part of the vehicle, or with the drive."""
    if "voltage" not in drive:
        return
    if vehicle.get("rotor_axial_inertia") and drive.get("rotor_inertia"):
        expected = "must be 0: [vehicle] rotor_axial_inertia holds the rotor already, and it would count twice"
        findings.add("drive", "rotor_inertia", expected, shown(drive["rotor_inertia"]))
    if vehicle.get("rotor_axial_inertia") or "gear_ratio" in vehicle:
        ratio, driven = vehicle.get("gear_ratio", 1), drive.get("gear_ratio", 1)
        if driven != ratio:
            expected = f"must be {ratio:g}, as in [vehicle]: the rotor has one gear"
            findings.add("drive", "gear_ratio", expected, shown(driven))


def _drive(keys: dict[str, Any]) -> Effect:
    if "voltage" in keys:
        return Motor(**keys)
    return TorqueTable(**keys) if "times" in keys else Torque(**keys)


MAKERS: dict[str, Callable[[dict[str, Any]], Effect]] = {
    "drive": _drive,
    "controller": lambda keys: Controller(**keys),
    "function_controller": lambda keys: FunctionController(**keys),
    "bearings": lambda keys: Bearings(**keys),
    "slope": lambda keys: Slope(**keys),
    "contact": lambda keys: Contact(**keys),
}

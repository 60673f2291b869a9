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
    PathFollower,
    Slope,
    Springs,
    Torque,
    TorqueTable,
    Weight,
)
from omniroll.errors import InvalidValueError
from omniroll.robots.catalogue import ROBOTS
from omniroll.scenes.checking import Findings
from omniroll.scenes.problems import shown
from omniroll.scenes.schema import MOTOR, TABLES
from omniroll.vehicles.vehicle import Vehicle
from omniroll.vocabulary import MOTOR_SHEET

MOTOR_NAMES = tuple(key.name for key in MOTOR)
MOTOR_NEEDS = ("torque_constant", "resistance")
SHEET_NAMES = {entry.name for entry in MOTOR_SHEET}


def effects_of(tables: dict[str, dict[str, Any]], findings: Findings) -> dict[str, Effect]:
    """The effect of each table that has one and is good; what is wrong goes into `findings`."""
    if "drive" in tables:
        _say_what_does_not_fit(tables["drive"], findings)
        _check_gears(tables.get("vehicle", {}), tables["drive"], findings)
    effects: dict[str, Effect] = {}
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
        for name in ("preset", *MOTOR_NAMES):
            if name in drive:
                findings.add("drive", name, "cannot stand beside torque", shown(drive[name]))
    elif "voltage" in drive:
        sheet, preset = SHEET_NAMES & set(drive), {"preset"} & {*drive, *already}
        for name in sorted(SHEET_NAMES) if sheet else () if preset else MOTOR_NEEDS:
            if name not in drive and name not in already:
                findings.add("drive", name, "is missing; a motor's voltage needs it")
        for name in (*MOTOR_NEEDS, "preset") if sheet else ():
            if name in drive:
                findings.add("drive", name, f"cannot stand beside {min(sheet)}, from which it follows")
    elif not already & {"torque", "voltage", "log"}:
        findings.add("drive", None, "needs torque or voltage")
    if "interpolation" in drive and "times" not in drive and "times" not in already:
        findings.add("drive", "interpolation", "needs times", shown(drive["interpolation"]))


def _check_gears(vehicle: dict[str, Any], drive: dict[str, Any], findings: Findings) -> None:
    """A gear that both tables name; of a rotor among the parts the motor itself checks it."""
    ratio, driven = vehicle.get("gear_ratio", 1), with_preset(drive).get("gear_ratio", 1)
    if "voltage" in drive and "gear_ratio" in vehicle and not vehicle.get("rotor_axial_inertia") and driven != ratio:
        expected = f"must be {ratio:g}, as in [vehicle]: the rotor has one gear"
        findings.add("drive", "gear_ratio", expected, shown(driven))


def with_preset(drive: dict[str, Any]) -> dict[str, Any]:
    """[drive] with the numbers of the robot whose motors it names, in place of that name."""
    robot = ROBOTS.get(drive.get("preset", ""))
    numbers = {} if robot is None else {name: stated.value for name, stated in robot.motor_numbers.items()}
    return numbers | {name: value for name, value in drive.items() if name != "preset"}


def _drive(keys: dict[str, Any]) -> Effect:
    keys = with_preset(keys)
    if SHEET_NAMES & set(keys):
        return Motor.from_data_sheet(**keys)
    if "voltage" in keys:
        return Motor(**keys)
    return TorqueTable(**keys) if "times" in keys else Torque(**keys)


MAKERS: dict[str, Callable[[dict[str, Any]], Effect]] = {
    "drive": _drive,
    "controller": lambda keys: Controller(**keys),
    "function_controller": lambda keys: FunctionController(**keys),
    "path": lambda keys: PathFollower(**keys),
    "bearings": lambda keys: Bearings(**keys),
    "slope": lambda keys: Slope(**keys),
    "weight": lambda keys: Weight(**keys),
    "contact": lambda keys: Contact(**keys),
    "springs": lambda keys: Springs(**keys),
}

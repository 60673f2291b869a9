"""A scene with fitted numbers as the text of a TOML file."""

import copy
import json
from collections.abc import Mapping, Sequence
from typing import Any

from omniroll.effects.motor import Motor
from omniroll.identification.model import OF_INSTRUMENT, OF_VEHICLE, START, Model
from omniroll.scenes.schema import NUMBERS, SHARED, SIZES, TABLES
from omniroll.scenes.vehicles import PART_NAMES
from omniroll.vocabulary import MOTOR_SHEET

NUMBER_KEYS = tuple(key.name for key in (*SIZES, *SHARED, *NUMBERS))
SHEET = {entry.name for entry in MOTOR_SHEET}


def scene_text(
    tables: Mapping[str, Mapping[str, Any]], model: Model, names: Sequence[str], notes: Sequence[str]
) -> str:
    """The text of a scene.

    tables  of the scene as it was
    model   with the fitted numbers
    names   of the fitted numbers; what a scene has no key for must stand in the notes
    notes   lines that stand above it as comments
    """
    changed = copy.deepcopy(dict(tables))
    for name in names:
        _put(changed, name, model)
    lines = [f"# {note}" for note in notes]
    for table, content in changed.items():
        lines += ["", f"[{table}]", *(f"{key} = {json.dumps(value)}" for key, value in content.items())]
    return "\n".join(lines) + "\n"


def _put(tables: dict[str, dict[str, Any]], name: str, model: Model) -> None:
    """A number at its place in the tables."""
    if OF_INSTRUMENT.fullmatch(name):
        if name.endswith("_bias") and "measurements" in tables and name in _keys("measurements"):
            tables["measurements"][name] = model.value(name)
    elif match := START.fullmatch(name):
        tables["start"][match[1]] = [float(value) for value in model.options[match[1]]]
    elif name in OF_VEHICLE:
        if any(key in tables["vehicle"] for key in PART_NAMES):
            own = model.vehicle.as_dict()
            tables["vehicle"] = {key: own[key] for key in NUMBER_KEYS}
        tables["vehicle"][name] = model.value(name)
    else:
        table = next(t for t in tables if name in _keys(t) and t not in ("vehicle", "start", "run", "measurements"))
        if table == "drive" and SHEET & set(tables[table]):
            _spell_out(tables[table], model)
        tables[table][name] = model.value(name)


def _spell_out(drive: dict[str, Any], model: Model) -> None:
    """The constants of a motor in the place of its data sheet."""
    motor = next(effect for effect in model.effects if isinstance(effect, Motor))
    for key in SHEET & set(drive):
        del drive[key]
    drive |= {"torque_constant": motor.torque_constant, "resistance": motor.resistance, "back_emf": motor.back_emf}


def _keys(table: str) -> set[str]:
    return {key.name for key in TABLES[table].keys}

"""Runs of the paper's vehicle with twelve derivatives, whose instructions are counted (tests/costs/counting.py)."""

from dataclasses import replace
from typing import Any

from omniroll import Bearings, Contact, Motor, TorqueTable, Vehicle

TWELVE = (
    "nu[0]", "nu[1]", "nu[2]", "chi[0]", "chi[1]", "pose[2]", "mass", "yaw_inertia", "wheel_inertia", "roller_inertia",
    "wheel_radius", "platform_radius",
)  # fmt: skip
MOTOR = Motor(voltage=(1, 2, 3), torque_constant=0.02, resistance=1.5, gear_ratio=4, rotor_inertia=1e-6)
FRICTION = Bearings(wheel_viscous=1e-6, roller_viscous=1e-9)
VISCOUS = Contact((40.0, 30.0))
REGULARISED = Contact(law="regularised", friction=(0.3, 0.4), speed=0.05)
COULOMB = Contact(law="coulomb", friction=(0.3, 0.4))
AXLES, ROLLERS = Bearings(wheel_coulomb=0.002), Bearings(roller_coulomb=2e-5)
ALL = Bearings(wheel_coulomb=0.002, roller_coulomb=2e-5, roller_viscous=1e-9)
SLIPPING = {
    "massless, viscous, axles stick": {"roller_model": "massless", "effects": [VISCOUS, AXLES]},
    "regularised, axles stick": {"roller_model": "free", "effects": [REGULARISED, AXLES]},
    "viscous, rollers stick": {"roller_model": "free", "effects": [VISCOUS, ROLLERS]},
    "regularised, all stick": {"roller_model": "free", "effects": [REGULARISED, ALL]},
}
DRIVEN_ON_COULOMB = {
    "massless, coulomb, axles stick": {"roller_model": "massless", "effects": [COULOMB, AXLES, MOTOR]},
    "coulomb, axles stick": {"roller_model": "free", "effects": [COULOMB, AXLES, MOTOR], "duration": 3.0},
    "coulomb, rollers stick": {"roller_model": "free", "effects": [COULOMB, ROLLERS, MOTOR], "duration": 1.0},
}  # fmt: skip
TO_AND_FRO = TorqueTable(
    tuple(0.5 * k for k in range(21)), tuple(tuple((-1.0) ** k * x for x in (0.03, -0.02, 0.01)) for k in range(21))
)  # N m, of each wheel
HELD_LONGER = Bearings(roller_coulomb=0.005, roller_break_away=0.007)
ON_DISKS = Bearings(roller_coulomb=2e-5, roller_break_away=3e-5)
FREE_ON_COULOMB = {
    "coulomb, axles stick, no drive": {"roller_model": "free", "effects": [COULOMB, AXLES]},
    "coulomb, rollers held longer, no drive": {"roller_model": "free", "effects": [COULOMB, ON_DISKS]},
    "coulomb, rollers held longer, torque": {"roller_model": "free", "effects": [COULOMB, ON_DISKS, TO_AND_FRO]},
    # From most starts contacts change their modes together, and apart beside the run: not from this one.
    "coulomb, rollers stick, torque": {
        "roller_model": "free", "effects": [COULOMB, ROLLERS, TO_AND_FRO],
        "nu": (0.56, 0.21, 0.42), "chi": (-0.33, 0.1, 0.38), "duration": 5.0,
    },
}  # fmt: skip
IN_SERIES = {
    f"in series, {law}, {drive}": {"roller_model": "massless", "effects": [ground, HELD_LONGER, *given]}
    for law, ground in {"viscous": VISCOUS, "regularised": REGULARISED, "coulomb": COULOMB}.items()
    for drive, given in (("no drive", ()), ("torque", (TO_AND_FRO,)), ("motor", (MOTOR,)))
}  # massless rollers that stick
# They let go and stop, and contacts come to rest, let go and stand.
SLIDING, LIGHT = replace(COULOMB, wheel_rates=(3, -2, 1)), Bearings(roller_coulomb=0.02, roller_break_away=0.03)
SKID = {"roller_model": "massless", "effects": [SLIDING, LIGHT]}
PULL = replace(TO_AND_FRO, torque=tuple(tuple(12 * x for x in row) for row in TO_AND_FRO.torque))
IN_SERIES |= {
    "in series, coulomb, skid, no drive": SKID,
    "in series, coulomb, skid, torque": SKID | {"effects": [*SKID["effects"], PULL], "duration": 1.5},
}
TASKS: dict[str, dict[str, Any]] = {
    "massless": {"roller_model": "massless"},
    "locked": {"roller_model": "locked"},
    "free": {"roller_model": "free"},
    "friction": {"roller_model": "free", "effects": [FRICTION]},
    "motors": {"roller_model": "locked", "effects": [MOTOR]},
    "rollers that stick": {"roller_model": "free", "effects": [Bearings(roller_coulomb=2e-5)]},
    "rollers that stick, friction": {
        "roller_model": "free", "effects": [Bearings(roller_coulomb=2e-5, wheel_viscous=1e-6, roller_viscous=1e-9)]
    },
    "axles that stick": {"roller_model": "locked", "effects": [Bearings(wheel_coulomb=0.002)]},
    "massless, viscous": {"roller_model": "massless", "effects": [VISCOUS]},
    "massless, regularised": {"roller_model": "massless", "effects": [REGULARISED]},
    "viscous": {"roller_model": "free", "effects": [VISCOUS]},
    "regularised": {"roller_model": "free", "effects": [REGULARISED]},
    "massless, coulomb": {"roller_model": "massless", "effects": [COULOMB]},
    "coulomb": {"roller_model": "free", "effects": [COULOMB]},
} | SLIPPING | DRIVEN_ON_COULOMB | FREE_ON_COULOMB | IN_SERIES | {
    # 17 steps: what is done once for a run counts
    "massless, coulomb, axles stick, no drive": {"roller_model": "massless", "effects": [COULOMB, AXLES]},
}  # fmt: skip


def task(name: str) -> dict[str, Any]:
    start = {"nu": (1, 0.3, 0.8), "chi": (0.1, -0.2, 0.15), "duration": 10.0, "accuracy": 1e-9}
    return {"vehicle": Vehicle.paper(), **start, **TASKS[name], "sensitivities": TWELVE}

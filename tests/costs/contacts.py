"""What wheels cost that may slip, beside rolling. `python -m costs.contacts` from tests/ prints the tables.

Sticking: torques that rise and fall drive the vehicle to and fro on one roller of each wheel, so that nothing switches.
Slipping: the vehicle starts while its wheels stand, skids until it rolls, and passes six switches.
"""

import numpy as np

from omniroll import Bearings, Contact, Springs, TorqueTable, Vehicle

from .counting import Count, counted

KNOTS, PUSH = np.arange(21), np.array([0.03, -0.02, 0.01])  # N m
DRIVE = TorqueTable(tuple(KNOTS / 20), (-1.0) ** KNOTS[:, None] * PUSH)
ROUGH = {"law": "coulomb", "friction": 5.0}
STICKING = {"rolling": (), "static loads": (Contact(**ROUGH),)}
MODELS = ("massless", "free")
LAWS = {
    "viscous, 3 N s/m": {"coefficient": 3.0},
    "viscous, 30 N s/m": {"coefficient": 30.0},
    "viscous, 1e4 N s/m": {"coefficient": 1e4},
    "viscous, 1e6 N s/m": {"coefficient": 1e6},
    "regularised, 1e-2 m/s": {"law": "regularised", "friction": 0.3, "speed": 1e-2},
    "regularised, 1e-4 m/s": {"law": "regularised", "friction": 0.3, "speed": 1e-4},
    "regularised, 1e-6 m/s": {"law": "regularised", "friction": 0.3, "speed": 1e-6},
    "coulomb, friction 0.1": {"law": "coulomb", "friction": 0.1},
    "coulomb, friction 0.3": {"law": "coulomb", "friction": 0.3},
    "coulomb, friction 1": {"law": "coulomb", "friction": 1.0},
}
MASSLESS_LAWS = ("coulomb, friction 0.3", "coulomb, friction 1")
ALL_STICK, AS_BUILT = ", bearings that stick", ", engine as built"  # behind the loads; other engines are specialised
BEARINGS = Bearings(wheel_coulomb=0.02, roller_coulomb=2e-4)
LOADS, SPRUNG = "static loads", "springs of 0.1 mm"


def task(name: str) -> dict:
    """The arguments of a run, from its roller model, its law or nothing, and its ground."""
    model, law, ground = name.split("|")
    common = {"vehicle": Vehicle.paper(), "duration": 1.0, "accuracy": 1e-9, "roller_model": model}
    if law == "sticking":
        return common | {"nu": (0, 0, 0), "effects": (*STICKING[ground], DRIVE)}
    common |= {"engine": "compiled"} if ground.endswith(AS_BUILT) else {}
    effects = (Contact(**LAWS[law], wheel_rates=0),) if law else ()
    effects += (Springs(height=0.06, deflection=1e-4),) if ground.startswith(SPRUNG) else ()
    return common | {"nu": (2, 1, 0), "effects": (*effects, BEARINGS) if ground.endswith(ALL_STICK) else effects}


def measured() -> dict[str, dict[str, Count]]:
    """Of contacts that stick: {roller model: {ground: Count}}."""
    names = {model: {ground: f"{model}|sticking|{ground}" for ground in STICKING} for model in MODELS}
    found = counted("costs.contacts", [name for own in names.values() for name in own.values()])
    return {model: {ground: found[name] for ground, name in own.items()} for model, own in names.items()}


def slipping() -> dict[str, Count]:
    """Of wheels that slip: {"roller model|law|loads": Count}; of rolling without the law."""
    laws = {"free": tuple(LAWS), "massless": MASSLESS_LAWS}
    names = [f"{model}||" for model in MODELS]
    for model in MODELS:
        for law in laws[model]:
            names.append(f"{model}|{law}|{LOADS}")
            names += [f"{model}|{law}|{loads}{AS_BUILT}" for loads in (LOADS, SPRUNG) if law.startswith("coulomb")]
    return counted("costs.contacts", names)


def main() -> None:
    for model, counts in measured().items():
        for ground, count in counts.items():
            times = count.instructions / counts["rolling"].instructions
            print(f"{model:9} {ground:14} {times:5.2f} of rolling's instructions, {count}")
    counts = slipping()
    print(
        "| rollers, law, loads | evaluations | times rolling | instructions, times rolling |\n| --- | --- | --- | --- |"
    )
    for name, count in counts.items():
        rolling = counts[f"{name.split('|')[0]}||"]
        times = (count.evaluations / rolling.evaluations, count.instructions / rolling.instructions)
        print(f"| {name.replace('|', ', ')} | {count.evaluations} | {times[0]:.1f} | {times[1]:.1f} |")


if __name__ == "__main__":
    main()

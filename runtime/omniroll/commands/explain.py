"""omniroll explain SCENE: what will be simulated, and why."""

import argparse
import json
from pathlib import Path
from typing import Any

from shtab import FILE

from omniroll.scenes import load_scene
from omniroll.scenes.wheels_explained import text as wheels_in_words

SUMMARY = "show what a scene simulates: state, effects, costs, how large what it leaves out would be, what looks wrong"
EXAMPLES = (
    ("omniroll explain scenes/driven.toml", "state, effects, costs, what it leaves out"),
    ("omniroll explain scenes/driven.toml --json", "the same as data"),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a TOML file, see docs/scenes.md").complete = FILE
    parser.add_argument("--json", action="store_true", help="print JSON in place of text")


def run(arguments: argparse.Namespace) -> int:
    """0 where the scene was explained. Raises SceneError, SimulationStopped."""
    from omniroll.scenes.explanation import explained

    explanation = explained(load_scene(arguments.scene))
    print(json.dumps(explanation, indent=1, allow_nan=False) if arguments.json else text(explanation))
    return 0


def text(explanation: dict[str, Any]) -> str:
    """The explanation for people."""
    vehicle = explanation["vehicle"]
    lines = [
        f"{explanation['scene']}: {vehicle['wheels']} wheels of {vehicle['rollers_per_wheel']} rollers",
        "",
        "Vehicle",
        *map(_number, explanation["numbers"]),
        *wheels_in_words(explanation.get("wheels", {})),
        "",
        "State",
    ]
    lines += [f"  {e['name']:<14}{e['count']:>5}  {e['unit']:<10} {e['meaning']}" for e in explanation["state"]]
    lines += ["", "Effects that are on"]
    lines += [f"  {_named(e, _why(e))}  {e['meaning']}" for e in explanation["effects"] if e["on"]]
    lines += ["", "Events that steps end on", *(f"  {event}" for event in explanation["events"])]
    lines += [
        "",
        f"Effects that are off, and how far each would take the motion away within {explanation['compared']:g} s",
    ]
    lines += _effects_off(explanation)
    if not any(effect["estimate"] for effect in explanation["effects"]):
        lines.append("  nothing to compare with: the motion takes no time, or too long on this machine, or it stops")
    lines += _cost(explanation)
    if explanation["left_out"]:
        allowed = f"estimates and prices may take {explanation['allowed']:g} s together"
        lines += ["", f"Left out; {allowed}, and kernels that were made for them are kept"]
        lines += [f"  {text}" for text in explanation["left_out"]]
    lines += ["", "What looks wrong", *(f"  [{e['table']}] {e['key']}: {e['text']}" for e in explanation["lints"])]
    return "\n".join(lines if explanation["lints"] else [*lines, "  nothing"])


def _number(origin: dict[str, Any]) -> str:
    """A number of the vehicle, and what it comes from."""
    mark = origin["kind"] + (f": {origin['reason']}" if origin["reason"] else "")
    return f"  {origin['name']:<25}{origin['value']:>12.6g} {origin['unit']:<7} {mark}"


def _named(effect: dict[str, Any], place: str) -> str:
    return f"{effect['name']:<19} {place}".ljust(32)


def _why(effect: dict[str, Any]) -> str:
    """What calls for an effect that is on."""
    if effect["called_by"]:
        return " ".join(f"[{table}]" for table in effect["called_by"])
    return "by default" if effect["table"] else "[vehicle]"


def _effects_off(explanation: dict[str, Any]) -> list[str]:
    """A line for each; why some are not estimated is said once."""
    lines, said = [], set()
    for effect in explanation["effects"]:
        if effect["on"]:
            continue
        estimate = effect["estimate"]
        why = estimate["why"] if estimate else ""
        if why in said:
            estimate = estimate | {"why": "as above"}
        elif why:
            said.add(why)
        place = f"[{effect['table']}]"
        none = f"{'-':<9} not estimated ({effect['meaning']})"
        lines.append(f"  {_named(effect, place)}  {_estimated(estimate, explanation['felt']) if estimate else none}")
    return lines


def _estimated(estimate: dict[str, Any], felt: float) -> str:
    distance = "-" if estimate["distance"] is None else f"{estimate['distance']:.1e}"
    if estimate["distance"] is not None and 0 < estimate["distance"] < felt:
        distance = f"< {felt:.0e}"
    more = f"; 1 % at {estimate['percent']}" if estimate["percent"] else ""
    if estimate["why"]:
        more = f"{', ' if estimate['setting'] else ''}not estimated: {estimate['why']}"
    return f"{distance:<9} {estimate['setting']}{more}"


def _cost(explanation: dict[str, Any]) -> list[str]:
    measured = explanation["time"]
    return [
        "",
        f"Cost of an evaluation, kernel {explanation['set']}: operations (+ * / sqrt, sine or cosine)",
        f"  {'':<14}{'constant':>10}{'a wheel':>10}{'a roller':>10}{'total':>10}",
        *(
            f"  {c['function']:<14}{c['constant']:>10}{c['per_wheel']:>10}{c['per_roller']:>10}{c['total']:>10}"
            for c in explanation["operations"]["functions"]
        ),
        f"  {'total':<44}{explanation['operations']['total']:>10}",
        f"  {measured['nanoseconds']:.3g} ns per evaluation, measured here over {measured['evaluations']}: "
        f"steps and switches included, {explanation['runs_on']}",
        *_prices(explanation["prices"]),
    ]


def _prices(prices: list[dict[str, Any]]) -> list[str]:
    """What each effect adds to an evaluation."""
    lines = ["", "Price of each effect: the operations that it adds to an evaluation"] if prices else []
    for price in prices:
        shown = "not known: the scene does not run without it"
        if price["operations"] is not None:
            shown = f"{price['operations']}, {price['percent']:.0f} % of the scene's"
        if price["setting"]:
            shown += f", where wheels could slip ({price['setting']})"
        lines.append(f"  {price['effect']:<14} {shown}")
    return lines

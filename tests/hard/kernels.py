"""Every kernel function of every set against ball arithmetic."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hard.case import Cases, Measurement, Scale
from hard.kernel_errors import (
    BOUND,
    OF_THE_FUNCTION,
    REFERENCE,
    Bench,
    Errors,
    compiled_kernels,
    measurements,
    python_kernels,
    worst,
)
from hard.sampling import Sample, sample

CASES = Cases("Number types and compilers")
WORST = Path(__file__).with_name("worst_states.json")


def samples(scale: Scale) -> list[Sample]:
    """10^5 states in full: usual ones, tips, other numbers of wheels and rollers."""
    usual, few, many = scale.of((150, 30, 2), (60_000, 6_000, 100))
    found = [sample(1, usual, 3, 5), sample(2, usual // 3, 3, 5, closest_tip=1e-12)]
    for seed, (wheels, rollers) in enumerate([(1, 3), (2, 4), (4, 6), (6, 3)], start=3):
        found.append(sample(seed, few, wheels, rollers, closest_tip=1e-12 if seed % 2 else 1e-3))
    return [*found, sample(7, many, 24, 5), sample(8, many, 3, 100)]


def merged(errors: list[Errors]) -> list[Errors]:
    """Errors of the same function on several samples as one, with its worst state."""
    found: dict[tuple, list[Errors]] = {}
    for e in errors:
        found.setdefault((e.set_name, e.function), []).append(e)
    flat = lambda group, part: np.concatenate([getattr(e, part).ravel() for e in group])  # noqa: E731
    return [
        Errors(*key, flat(group, "vectors"), flat(group, "components"), worst_state(group))
        for key, group in found.items()
    ]


def worst_state(group: list[Errors]) -> Sample:
    units = [np.nan_to_num(e.vectors, nan=-1.0) for e in group]
    place = int(np.argmax([u.max() for u in units]))
    return group[place].states.at(np.array([units[place].argmax()]))


@CASES.case(
    "kernels-against-balls",
    "Every function of every kernel, 10^5 states, log-uniform and on the boundaries",
    promise=OF_THE_FUNCTION,
)
def against_balls(scale: Scale) -> list[Measurement]:
    """All functions of all sets on all samples, compiled and in Python. In full the worst states are kept."""
    kernels = {"compiled": compiled_kernels(), "python": python_kernels}
    found: dict[str, list[Errors]] = {on: [] for on in kernels}
    for part in samples(scale):
        for model in REFERENCE:
            bench = Bench(part, model)
            for on, outputs in kernels.items():
                found[on] += bench.errors(outputs)
    whole = {on: merged(errors) for on, errors in found.items()}
    if scale is Scale.FULL:
        keep(whole["compiled"])
    return [m for on, errors in whole.items() for m in measurements(errors, on)]


def keep(errors: list[Errors]) -> None:
    """Writes the worst state of each function; says which is the worst of all."""
    entries = [
        {"set": e.set_name, "function": e.function, "units": worst(e.vectors), **as_lists(e.states)}
        for e in sorted(errors, key=lambda e: (e.set_name, e.function))
    ]
    WORST.write_text("[\n" + ",\n".join(map(json.dumps, entries)) + "\n]\n", encoding="utf-8")
    most = max(entries, key=lambda entry: entry["units"])
    print(
        f"worst: {most['units']:.3g} ulp cond, {most['set']} {most['function']}; states in {WORST.name}",
        file=sys.stderr,
    )


def as_lists(state: Sample) -> dict:
    lists = lambda part: {name: array.tolist() for name, array in part.items()}  # noqa: E731
    size = {"wheels": state.wheels, "rollers": state.rollers}
    return size | {"vehicle": lists(state.vehicle), "state": lists(state.state)}


def kept_states() -> Iterator[tuple[str, str, Sample]]:
    """The worst state of each function when all were measured last: set, function, the one state."""
    for entry in json.loads(WORST.read_text(encoding="utf-8")):
        arrays = lambda part: {name: np.array(values) for name, values in part.items()}  # noqa: E731
        state = Sample(entry["wheels"], entry["rollers"], arrays(entry["vehicle"]), arrays(entry["state"]))
        yield entry["set"], entry["function"], state


@CASES.case(
    "worst-states",
    "The worst state of each function, kept",
    promise=f"at most {BOUND} ulp times the condition",
)
def worst_states(scale: Scale) -> Iterator[Measurement]:
    """Each function on the state that was its worst when all were measured last."""
    for set_name, function, state in kept_states():
        bench = Bench(state, set_name.removesuffix("_sharp"), [function])
        for on, outputs in (("compiled", compiled_kernels()), ("python", python_kernels)):
            errors = list(bench.errors(outputs))
            yield from (m for m in measurements(errors, on, components=False) if m.bound == BOUND)

"""Every kernel function of every set against ball arithmetic."""

import numpy as np

from hard import naive_kernels
from hard.case import Case, Measurement, Scale
from hard.kernel_errors import (
    BOUND,
    BULK,
    BULK_BOUND,
    REFERENCE,
    Bench,
    Errors,
    compiled_kernels,
    measurements,
    python_kernels,
    worst,
)
from hard.sampling import Sample, sample

SECTION = "Number types and compilers"


def samples(scale: Scale) -> list[Sample]:
    """10^5 states in full: usual ones, tips, other numbers of wheels and rollers."""
    usual, few, many = scale.of((150, 30, 2), (60_000, 6_000, 100))
    found = [sample(1, usual, 3, 5), sample(2, usual // 3, 3, 5, closest_tip=1e-12)]
    for seed, (wheels, rollers) in enumerate([(1, 3), (2, 4), (4, 6), (6, 3)], start=3):
        found.append(sample(seed, few, wheels, rollers, closest_tip=1e-12 if seed % 2 else 1e-3))
    return [*found, sample(7, many, 24, 5), sample(8, many, 3, 100)]


def merged(errors: list[Errors]) -> list[Errors]:
    """Errors of the same function on several samples as one."""
    found: dict[tuple, list[Errors]] = {}
    for e in errors:
        found.setdefault((e.set_name, e.function), []).append(e)
    flat = lambda group, part: np.concatenate([getattr(e, part).ravel() for e in group])  # noqa: E731
    return [Errors(*key, flat(group, "vectors"), flat(group, "components")) for key, group in found.items()]


def against_balls(scale: Scale) -> list[Measurement]:
    """All functions of all sets on all samples, compiled and in Python."""
    kernels = {"compiled": compiled_kernels(), "python": python_kernels}
    found: dict[str, list[Errors]] = {on: [] for on in kernels}
    for part in samples(scale):
        for model in REFERENCE:
            bench = Bench(part, model)
            for on, outputs in kernels.items():
                found[on] += bench.errors(outputs)
    return [m for on, errors in found.items() for m in measurements(merged(errors), on)]


def accelerations_as_written(scale: Scale) -> list[Measurement]:
    """The reduced form beside the formulas evaluated as they are printed."""
    found = []
    part = sample(1, scale.of(300, 10_000), 3, 5)
    for model in ("locked", "free"):
        bench = Bench(part, model, ["reduced"])
        printed = {e.set_name: worst(e.vectors) for e in bench.errors(naive_kernels.accelerations)}
        for e in bench.errors(compiled_kernels()):
            found += measurements([e], "compiled", naive=printed[e.set_name])
    return found


CASES = [
    Case(
        name="kernels-against-balls",
        section=SECTION,
        title="Every function of every kernel, 10^5 states, log-uniform and on the boundaries",
        naive="no bound is known; the formulas as printed are in the next line",
        promise=f"at most {BOUND} ulp times the condition of the function; {BULK_BOUND} for {BULK} % of the states",
        run=against_balls,
    ),
    Case(
        name="accelerations-as-written",
        section=SECTION,
        title="Accelerations of the same vehicles",
        naive="rho = l cos(chi) - r, 1/rho^2 in M*, a linear solver",
        promise="the same bound",
        run=accelerations_as_written,
    ),
]

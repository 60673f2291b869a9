"""Kernels under test, and their errors as measurements."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from hard import rounding
from hard.builds import Build
from hard.case import Measurement
from hard.sampling import Sample
from omniroll.kernels.kernel import SHARP

PACKAGE = Build("cc", ("-O3", "-ffp-contract=off"))  # as runtime/build_kernels.py compiles
BOUND, BULK_BOUND, BULK = rounding.NO_DIGIT, 8, 99  # ulp cond; of so many per cent of the states
EPS = {"double": 2.0**-52, "float": 2.0**-23, "long double": float(np.finfo(np.longdouble).eps)}
PROMISE = f"at most {BOUND} ulp times the condition, {BULK_BOUND} for {BULK} % of the states"
OF_THE_FUNCTION = PROMISE.replace("condition,", "condition of the function;")
REFERENCE = {"massless": "massless", "locked": "locked_sharp", "free": "free_sharp"}

Found = Callable[[Sample, str], dict[str, np.ndarray]]  # outputs by function of a set on a sample


@dataclass(frozen=True)
class Errors:
    """Errors in ulp cond of one function of a set on K states: of vectors (K,) and of components (M, K)."""

    set_name: str
    function: str
    vectors: np.ndarray
    components: np.ndarray
    states: Sample


def python_kernels(sample: Sample, set_name: str) -> dict[str, np.ndarray]:
    return {name: rounding.values(sample, set_name, name) for name in rounding.functions(set_name, sample)}


def compiled_kernels(build: Build = PACKAGE, rounding_mode: str = "FE_TONEAREST") -> Found:
    return lambda sample, set_name: build.run(sample, set_name, rounding_mode)


class Bench:
    """A sample with the values and conditions of a roller model's functions, judged once for many kernels."""

    def __init__(self, sample: Sample, model: str, names: list[str] | None = None):
        self.model, self.parts = model, []
        sharp = sample.sharpness() > SHARP if model != "massless" else np.zeros(len(sample), bool)
        for set_name, rows in ((model, ~sharp), (f"{model}_sharp", sharp)):
            part = sample.at(np.flatnonzero(rows))
            if len(part):
                found = [n for n in rounding.functions(REFERENCE[model], part) if names is None or n in names]
                self.parts.append((set_name, part, rounding.judged_by(part, REFERENCE[model], found)))

    def errors(self, kernels: Found, eps: float = EPS["double"]) -> Iterator[Errors]:
        """Of the kernels that each vehicle calls for: the sharp twin's where its rollers are sharp."""
        for set_name, part, judges in self.parts:
            found = kernels(part, set_name)
            for name, judge in judges.items():
                if name in found:
                    yield Errors(set_name, name, *judge.units(found[name], eps), part)


def measurements(
    errors: list[Errors], on: str, number_type: str = "double", naive: float | None = None, components: bool = True
) -> Iterator[Measurement]:
    """The worst vector, and the vectors and components in bulk, of each function."""
    for e in errors:
        if np.isnan(e.vectors).all():
            continue  # no state left to judge
        values = {
            "error of a vector / ulp cond": (worst(e.vectors), BOUND),
            f"the same, {BULK} % of the states": (percentile(e.vectors), BULK_BOUND),
        }
        if components:
            values[f"of single components, {BULK} % of all"] = (percentile(e.components), BULK_BOUND)
        for place, (what, (value, bound)) in enumerate(values.items()):
            setting = f"{e.set_name} {e.function}"
            yield Measurement(what, on, number_type, setting, value, bound, None if place else naive)


def worst(units: np.ndarray) -> float:
    """The largest, where the function is not singular; what is not finite counts."""
    return float(units[~np.isnan(units)].max())


def percentile(units: np.ndarray) -> float:
    kept = np.sort(units[~np.isnan(units)], axis=None)
    return float(kept[min(len(kept) - 1, len(kept) * BULK // 100)])

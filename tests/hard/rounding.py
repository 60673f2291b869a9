"""Errors of kernel functions in units of ulp times the condition.

The function is what a user computes: from the vehicle's numbers, through prepare(), and from the state. Its value comes
from the generated Python kernel in ball arithmetic, its condition sum_k |df/dx_k| |x_k| / |f| over all those
numbers from complex steps through the same kernel. An ulp is eps |f|, and a condition below 1 counts as 1.

The error is judged twice: all outputs of a function as one vector, with the largest component of the error over the
largest of eps sum_k |df/dx_k| |x_k|; and component by component. A component may vanish by a symmetry of the state,
together with its derivatives, while what cancels in it does not: no kernel keeps it accurate then, and the first
measure is the one that holds for all states.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from flint import acb, arb, ctx

from hard.sampling import Sample
from omniroll.kernels import sets
from omniroll.kernels.kernel import form, signatures

BITS = 160
NO_DIGIT = 64  # ulp cond: the bound that is promised
FITS = ("nu_from_wheels", "nu_from_contacts", "wheel_torques")  # least squares
SUSPECT = 8  # ulp cond
MOST_STATES = 20_000  # that a Python kernel is called with at once
STEP = 1e-30  # of a complex step, relative: its square vanishes beside 1, also times a condition of 1e12


def set_key(base: str, effects: tuple[str, ...] = ()) -> str:
    """One string for a roller model, "_sharp" after it for its functions for sharp tips, and further effects."""
    return "+".join([base, *effects])


def split_key(set_name: str) -> tuple[str, tuple[str, ...]]:
    base, *effects = set_name.split("+")
    return base.removesuffix("_sharp"), tuple(effects)


def is_sharp(set_name: str) -> bool:
    """Whether the functions for sharp tips are meant."""
    return set_name.split("+")[0].endswith("_sharp")


def module(set_name: str):
    return sets.python_module(*split_key(set_name))


def generated(set_name: str, name: str):
    """The generated Python function that computes what `name` says."""
    code = module(set_name)
    return getattr(code, form(name, is_sharp(set_name), vars(code)))


def functions(set_name: str, sample: Sample) -> dict:
    """The functions of a set that make sense for the number of wheels, by name; without those along a direction, which
    tests/effects/test_derivatives.py asks."""
    least = {"nu_from_wheels": 3, "wheel_torques": 3, "nu_from_contacts": 2}
    found = signatures(*split_key(set_name), sample.wheels, sample.rollers, is_sharp(set_name))
    return {
        name: signature
        for name, signature in found.items()
        if signature.outputs and sample.wheels >= least.get(name, 1) and not name.endswith("_along")
    }


def vehicle_numbers(sample: Sample, set_name: str) -> dict[str, np.ndarray]:
    """The numbers of the vehicles that a set takes: massless rollers, for instance, have no roller_inertia."""
    wanted = signatures(*split_key(set_name), sample.wheels, sample.rollers)["prepare"].inputs
    return {argument.name: sample.vehicle[argument.name] for argument in wanted}


def flat(values) -> list:
    return [v for part in values for v in flat(part)] if isinstance(values, (list, tuple)) else [values]


def nested(array: np.ndarray, number) -> list:
    return [nested(part, number) for part in array] if np.ndim(array) else number(float(array))


@dataclass(frozen=True)
class Reference:
    """Outputs of a function by component: high + low +- radius, (M, K) each; NaN where the function is singular."""

    high: np.ndarray
    low: np.ndarray
    radius: np.ndarray

    def error(self, found: np.ndarray) -> np.ndarray:
        """|found - value|; a found value that is not finite is infinitely wrong."""
        found = found.astype(np.longdouble)
        with np.errstate(invalid="ignore"):
            error = np.abs((found - self.high) - self.low).astype(float)
        return np.where(np.isfinite(found) | np.isnan(self.high), error, np.inf)


def references(sample: Sample, set_name: str, names: list[str]) -> dict[str, Reference]:
    """By ball arithmetic, state by state."""
    code, wanted = module(set_name), functions(set_name, sample)
    found = {name: [] for name in names}
    with ctx.workprec(BITS):
        for row in range(len(sample)):
            model = code.prepare(
                sample.wheels,
                sample.rollers,
                **{name: nested(array[row], arb) for name, array in vehicle_numbers(sample, set_name).items()},
            )
            for name in names:
                inputs = [nested(sample.state[a.name][row], arb) for a in wanted[name].inputs]
                found[name].append([split(ball) for ball in flat(generated(set_name, name)(model, *inputs))])
    return {name: Reference(*np.array(parts).transpose(2, 1, 0)) for name, parts in found.items()}


def split(ball) -> tuple[float, float, float]:
    """A ball as the nearest double, the double nearest to the rest, and its radius."""
    ball = arb(ball)
    high = float(ball.mid())
    return high, float((ball - arb(high)).mid()) if np.isfinite(high) else high, float(ball.rad())


def judged_by(sample: Sample, set_name: str, names: list[str]) -> dict[str, "Judge"]:
    """What the functions of a set must give on a sample."""
    found = references(sample, set_name, names)
    return {name: Judge(sample, set_name, name, found[name], slopes(sample, set_name, name)) for name in names}


@dataclass(frozen=True)
class Judge:
    """The values of a function and the error that each component (M, K) is allowed, over eps.

    Where wheels all but fail to fix a function, doubles lose its slopes too; they are found anew in balls where an
    error seems large.
    """

    sample: Sample
    set_name: str
    name: str
    reference: Reference
    slope: np.ndarray

    def units(self, found: np.ndarray, eps: float) -> tuple[np.ndarray, np.ndarray]:
        """Errors in ulp cond: of the vectors (K,), and of all components (M, K).

        NaN where the function is singular: where even the ball is too wide, or its condition is above 1/(64 eps), so
        that 64 ulp times the condition is all that is found.
        """
        error = self.reference.error(found)
        lost = ~(self.reference.radius <= 2.0**-75 * self._allowed()).all(axis=0)
        suspect = over(error.max(axis=0), eps * self._allowed().max(axis=0)) > SUSPECT
        for row in np.flatnonzero(suspect & ~lost & ~self._refined):
            self.slope[:, row] = slopes_in_balls(self.sample.at(np.array([row])), self.set_name, self.name)
            self._refined[row] = True
        allowed = self._allowed()
        lost |= NO_DIGIT * eps * allowed.max(axis=0) > np.abs(self.reference.high).max(axis=0)
        components = over(error, eps * allowed)
        components[:, lost] = np.nan
        vectors = over(error.max(axis=0), eps * allowed.max(axis=0))
        return np.where(lost, np.nan, vectors), components

    @cached_property
    def _refined(self) -> np.ndarray:
        return np.zeros(len(self.sample), bool)

    def _allowed(self) -> np.ndarray:
        return np.maximum(self.slope, np.abs(self.reference.high))


def over(error: np.ndarray, allowed: np.ndarray) -> np.ndarray:
    """error / allowed, and nothing where there is no error."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(error == 0, 0.0, error / allowed)


def values(sample: Sample, set_name: str, name: str, dtype=np.float64) -> np.ndarray:
    """Outputs (M, K) of the generated Python kernel on arrays of states."""
    return call(set_name, name, sample, *inputs_of(sample, set_name, name, dtype))


def inputs_of(sample: Sample, set_name: str, name: str, dtype) -> tuple[dict, list[np.ndarray]]:
    last = lambda array: np.moveaxis(array, 0, -1).astype(dtype)  # noqa: E731
    vehicle = {field: last(array) for field, array in vehicle_numbers(sample, set_name).items()}
    return vehicle, [last(sample.state[a.name]) for a in functions(set_name, sample)[name].inputs]


def call(set_name: str, name: str, sample: Sample, vehicle: dict, inputs: list) -> np.ndarray:
    code = module(set_name)
    with np.errstate(all="ignore"):
        model = code.prepare(sample.wheels, sample.rollers, **vehicle)
        found = flat(generated(set_name, name)(model, *inputs))
    states = next(iter(vehicle.values())).shape[-1]
    return np.array([np.broadcast_to(v, states) for v in found])


def slopes(sample: Sample, set_name: str, name: str) -> np.ndarray:
    """sum_k |df/dx_k| |x_k| (M, K) over the vehicle's numbers and the inputs.

    A wheel's direction counts as one radian at least: the platform's axes, from which it is measured, are anybody's
    choice, and so is its being zero. What is fitted counts as its largest component.
    """
    vehicle, inputs = inputs_of(sample, set_name, name, complex)
    arrays, states = [*vehicle.values(), *inputs], len(sample)
    steps = []  # (place of the array, place of the component in it, its step)
    for k, array in enumerate(arrays):
        components = array.reshape(-1, states)
        least = 1.0 if array is vehicle["wheel_angles"] else 0.0
        if name in FITS and k >= len(vehicle):
            least = np.abs(components).max(axis=0)
        steps += [(k, row, 1j * STEP * np.maximum(np.abs(exact), least)) for row, exact in enumerate(components)]
    total, at_once = 0.0, max(1, MOST_STATES // states)
    for first in range(0, len(steps), at_once):
        chosen = steps[first : first + at_once]
        moved = [np.repeat(array[..., None, :], len(chosen), axis=-2) for array in arrays]
        for copy, (k, row, step) in enumerate(chosen):
            moved[k].reshape(-1, len(chosen), states)[row, copy] += step
        moved = [array.reshape(*array.shape[:-2], -1) for array in moved]
        numbers = dict(zip(vehicle, moved, strict=False))
        rates = call(set_name, name, sample, numbers, moved[len(vehicle) :]).imag.reshape(-1, len(chosen), states)
        with np.errstate(over="ignore"):
            for copy in range(len(chosen)):
                total = total + np.abs(rates[:, copy]) / STEP
    return total


def slopes_in_balls(sample: Sample, set_name: str, name: str) -> np.ndarray:
    """`slopes` (M,) of a single state, by the same complex steps in many digits."""
    code, total = module(set_name), 0.0
    vehicle = {field: array[0] for field, array in vehicle_numbers(sample, set_name).items()}
    given = [sample.state[a.name][0] for a in functions(set_name, sample)[name].inputs]
    with ctx.workprec(4 * BITS):
        step = arb(2) ** (-2 * BITS)
        for array in [*vehicle.values(), *given]:
            least = 1.0 if array is vehicle["wheel_angles"] else 0.0
            if name in FITS and any(array is one for one in given):
                least = float(np.abs(array).max())
            for place in np.ndindex(array.shape):
                moved = acb(0, step * max(abs(float(array[place])), least))
                numbers = lambda values: _moved(values, place if values is array else None, moved)  # noqa: B023, E731
                model = code.prepare(
                    sample.wheels, sample.rollers, **{field: numbers(values) for field, values in vehicle.items()}
                )
                found = flat(generated(set_name, name)(model, *map(numbers, given)))
                total = total + np.array([abs(float((acb(value).imag / step).mid())) for value in found])
    return total


def _moved(values: np.ndarray, place: tuple[int, ...] | None, by: acb) -> list | acb:
    """Numbers in balls, the one at `place` moved."""
    exact = np.array([acb(float(value)) for value in np.ravel(values)], object).reshape(np.shape(values))
    if place is not None:
        exact[place] += by
    return exact.tolist()

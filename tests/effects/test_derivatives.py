"""The generated derivatives against the derivative of the generated rates, by power series of balls in 60 digits; in
doubles against these; and what they cost.
"""

import numpy as np
import pytest
from effects.cases import MODELS, OPTIONAL, balls, prepared_kernel, random_case, without_layout
from oracle.balls import coefficient, exact, line, working_precision

from omniroll.kernels import sets

CLOSE = 1e-40
EPS = np.finfo(float).eps
ALL = tuple(effect for effect in OPTIONAL if effect != "axle_sticking")
SETS = [(), *((e,) for e in OPTIONAL if e != "motor"), ("drive", "motor")]
BY = {  # argument that is moved: the output with its derivative
    "nu": "nu_dot_by_nu", "chi": "nu_dot_by_chi", "torque": "nu_dot_by_torque", "heading": "nu_dot_by_heading",
}  # fmt: skip
MOMENTA = ("nu_dot_by_momentum_cos", "nu_dot_by_momentum_sin")


def state_of(model, effects, seed=3):
    """A vehicle, and the values of the functions' inputs by name, as balls."""
    rng = np.random.default_rng([seed, len(effects)])
    vehicle, (nu, chi, _), numbers = random_case(rng)
    if "layout" not in effects:
        vehicle = without_layout(vehicle)
    numbers = numbers | {"roller_drag": rng.normal(size=3), "momenta": rng.normal(size=(3, 2)) * 0.1, "theta": 0.4}
    numbers["bearing_drag"] = rng.normal(size=3)
    return vehicle, numbers | {"nu": nu, "chi": chi}


def inputs_of(model, effects, function):
    (entry,) = (f for f in sets.functions(model, effects) if f["name"] == function)
    return [a["name"] for a in entry["arguments"] if a["role"] == "in"]


def outputs_of(model, effects, function, values):
    (entry,) = (f for f in sets.functions(model, effects) if f["name"] == function)
    return dict(zip((a["name"] for a in entry["arguments"] if a["role"] == "out"), values, strict=True))


def moved(values, place):
    """The values as balls, with the one at `place` as the series value + t."""
    if not place:
        return line(exact(float(values)), exact(1))
    parts = balls(values)
    k, *rest = place
    parts[k] = moved(values[k], rest)
    return parts


@working_precision
def column(vehicle, known, model, effects, function, argument, place):
    """The derivative of a function's outputs by one component of an argument."""
    module, prepared = prepared_kernel(vehicle, model, effects, known)
    names = inputs_of(model, effects, function)
    values = [moved(known[name], place) if name == argument else balls(known[name]) for name in names]
    found = getattr(module, function)(prepared, *values)
    return [coefficient(value, 1) for value in found]


@working_precision
def derivatives(vehicle, known, model, effects, function="forward_dynamics_derivatives"):
    effects = (*effects, "derivatives")
    module, prepared = prepared_kernel(vehicle, model, effects, known)
    names = inputs_of(model, effects, function)
    return outputs_of(model, effects, function, getattr(module, function)(prepared, *(balls(known[n]) for n in names)))


def agree(got, want):
    for a, b in zip(got, want, strict=True):
        assert abs(float(a - b)) <= CLOSE * (1 + abs(float(b)))


@pytest.mark.long
@pytest.mark.parametrize("model, effects", [
    *((MODELS[k % 3], effects) for k, effects in enumerate(SETS)), *((model, ALL) for model in MODELS),
])  # fmt: skip
def test_they_are_the_derivatives_of_the_accelerations(model, effects):
    vehicle, known = state_of(model, effects)
    found = derivatives(vehicle, known, model, effects)
    asked = [n for n in inputs_of(model, effects, "forward_dynamics") if n in BY]
    assert {BY[name] for name in asked} <= found.keys()

    def true(argument, *place):
        return column(vehicle, known, model, effects, "forward_dynamics", argument, place)

    for name in asked:
        if name == "heading":
            agree(found[BY[name]], true(name))
            continue
        for k in range(3):
            agree(found[BY[name]][k], true(name, k))
    if model == "free":
        for which, output in enumerate(MOMENTA):
            for wheel in range(3):
                agree(found[output][wheel], true("momenta", wheel, which))


@pytest.mark.parametrize("model", MODELS)
def test_those_of_the_other_rates(model):
    vehicle, known = state_of(model, ("layout",))
    found = derivatives(vehicle, known, model, ("layout",), "rate_derivatives")
    for k in range(3):
        agree(found["chi_dot_by_nu"][k],
              column(vehicle, known, model, ("layout",), "wheel_speeds", "nu", (k,)))  # fmt: skip
        agree(found["pose_dot_by_nu"][k],
              column(vehicle, known, model, ("layout",), "pose_rates", "nu", (k,)))  # fmt: skip
    agree(found["pose_dot_by_heading"], column(vehicle, known, model, ("layout",), "pose_rates", "theta", ()))


@working_precision
def test_those_of_the_momenta_under_friction():
    effects = ("roller_viscous",)
    vehicle, known = state_of("free", effects)
    known |= {"roller_energy": np.zeros(3)}
    found = derivatives(vehicle, known, "free", effects, "momenta_derivatives")
    module, prepared = prepared_kernel(vehicle, "free", effects, known)

    @working_precision
    def true(argument, *place):
        names = inputs_of("free", effects, "momenta_rates")
        values = [moved(known[n], place) if n == argument else balls(known[n]) for n in names]
        return [[coefficient(v, 1) for v in wheel] for wheel in module.momenta_rates(prepared, *values)[0]]

    for wheel in range(3):
        agree(true("nu", 2)[wheel], found["momenta_dot_by_nu_3"][wheel])
        agree(true("chi", wheel)[wheel], found["momenta_dot_by_chi"][wheel])
        for which in range(2):
            by_own = true("momenta", wheel, which)
            assert float(by_own[wheel][1 - which]) == 0
            agree([by_own[wheel][which]], [found["momenta_dot_by_momenta"][wheel][which]])


@pytest.mark.parametrize("form", ["", "_sharp"])
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("effects", [(), ALL], ids=["bare", "all"])
def test_they_cost_at_most_six_times_the_accelerations(model, effects, form):
    """The answers of rows near sharp tips are carried past the wheels after them: a little more with each wheel."""
    if form and model == "massless":
        pytest.skip("massless rollers have no form for sharp tips")

    def operations(names, function, wheels):
        (entry,) = (f for f in sets.functions(model, names) if f["name"] == function + form)
        times = {"once": 1, "wheel": wheels, "slot": 0, "roller": 0, "earlier": wheels * (wheels - 1) // 2}
        return sum(times[place] * sum(counted.values()) for place, counted in entry["operations"].items())

    for wheels in (3, 4, 6, 12):
        price = operations((*effects, "derivatives"), "forward_dynamics_derivatives", wheels)
        assert price <= 6 * operations(effects, "forward_dynamics", wheels)


@pytest.mark.parametrize("effects", [(), ALL], ids=["bare", "all"])
def test_a_set_that_was_not_asked_for_them_has_none(effects):
    assert not [f["name"] for f in sets.functions("free", effects) if "derivatives" in f["name"]]

"""The generated derivatives, by state, inputs and numbers of the vehicle and of effects, against the derivatives of
what was differentiated, by power series of balls in 60 digits; and what they cost.
Their digits, in C and in Python, are those of the hard case `derivatives`.
"""

from dataclasses import replace

import numpy as np
import pytest
from effects.cases import MODELS, OPTIONAL, balls, prepared_kernel, random_case, without_layout
from oracle.balls import coefficient, exact, line, working_precision

import omniroll
from omniroll import InvalidValueError
from omniroll.codegen.programs import ContractError
from omniroll.kernels import sets
from omniroll.kernels.kernel import PythonKernel, form

CLOSE = 1e-40
ALL = tuple(effect for effect in OPTIONAL if effect != "axle_sticking")
SETS = [(), *((e,) for e in OPTIONAL if e != "motor"), ("drive", "motor")]
BY = {  # argument that is moved: the output with its derivative
    "nu": "nu_dot_by_nu", "chi": "nu_dot_by_chi", "torque": "nu_dot_by_torque", "heading": "nu_dot_by_heading",
}  # fmt: skip
MOMENTA = ("nu_dot_by_momentum_cos", "nu_dot_by_momentum_sin")


# ---- by state and inputs ---------------------------------------------------------------------------------------------


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


# ---- by numbers ------------------------------------------------------------------------------------------------------

# Of a vehicle, but for the mass: `prepare` takes pi from its first argument, and a series knows none.
OF_VEHICLE = ("yaw_inertia", "wheel_inertia", "roller_inertia", "yaw_scale", "platform_radius", "wheel_radius",
              "roller_axis_radius", "wheel_angles")  # fmt: skip
PLACES = ("wheel_places", "center_of_mass")
ROLLING_DOWN = ("massless", ("layout", "slope"), ("yaw_inertia", "wheel_inertia", "yaw_scale", "platform_radius",
                "wheel_radius", "wheel_angles", *PLACES, "gravity", "slope_angle"))  # fmt: skip
PUSHED = (
    "massless", ("layout", "drive", "motor", "axle_viscous", "axle_coulomb", "roller_viscous", "slope"),
    (*OF_VEHICLE[:2], *OF_VEHICLE[3:], "axle_damping", "axle_torque", "axle_fade_speed", "roller_damping", *PLACES,
     "gravity", "slope_angle"),
)  # fmt: skip
OF_LAYOUT = ("locked", ("layout", "motor", "axle_coulomb", "slope"), (*OF_VEHICLE, *PLACES))
OF_FREE = ("free", ("layout", "motor"), (*OF_VEHICLE, *PLACES))
NUMBERS = [  # of a set, by which it is differentiated
    ("locked", ("roller_coulomb", "slope"), ("wheel_radius", "wheel_angles", "roller_fade_speed", "slope_angle")),
    ("free", ("drive", "motor", "roller_viscous"), ("roller_inertia", "yaw_scale", "roller_damping", "resistance")),
    OF_LAYOUT, OF_FREE, ROLLING_DOWN, PUSHED,
]  # fmt: skip
FUNCTIONS = ("forward_dynamics", "wheel_speeds", "pose_rates", "momenta_rates", "motor_torques", "impact")


def asked(effects, numbers):
    """The effects with the requests behind them, as a kernel orders them."""
    return (*effects, "derivatives", *sorted(f"derivatives_by_{name}" for name in numbers))


def known_state(model, effects):
    vehicle, known = state_of(model, effects)
    rng = np.random.default_rng(4)
    further = {"voltage": rng.normal(size=3), "modes": np.array([0.0, 1.0, -1.0]), "roller_energy": np.ones(3)}
    speeds = {"entering": rng.normal(size=3), "leaving": rng.normal(size=3)}
    angles = {"wheel_angles": np.array(vehicle.wheel_angles, float), "center_of_mass": np.array(vehicle.offset, float)}
    places = {} if vehicle.places is None else {"wheel_places": np.array(vehicle.places, float)}
    return vehicle, known | further | speeds | angles | places


def prepared_with(vehicle, model, effects, known, number, place):
    """The kernel's constants as power series along one component of a number."""
    module = sets.python_module(model, effects)
    names = inputs_of(model, effects, "prepare")
    given = [balls(known[name]) if name in known else vehicle.number(name) for name in names]
    which = names.index(number)
    given[which] = moved(known[number], place) if number in known else line(vehicle.number(number), exact(1))
    return module.prepare(vehicle.wheels, vehicle.rollers_per_wheel, *given)


def flat(values):
    return [number for part in values for number in flat(part)] if isinstance(values, list | tuple) else [values]


def expected(vehicle, known, model, effects, function, number):
    """{component: every output of the function, its derivative by that component, flat, by name}."""
    module, inputs = sets.python_module(model, effects), inputs_of(model, effects, function)
    value = known[number] if number in known else 0.0
    found = {}
    for place in np.ndindex(np.shape(value)):
        prepared = prepared_with(vehicle, model, effects, known, number, place)
        values = getattr(module, function)(prepared, *(balls(known[n]) for n in inputs))
        values = values if isinstance(values, tuple) else (values,)
        (entry,) = (f for f in sets.functions(model, effects) if f["name"] == function)
        names = [a["name"] for a in entry["arguments"] if a["role"] == "out"]
        slopes = [[coefficient(one, 1) for one in flat([v])] for v in values]
        found[place] = dict(zip(names, slopes, strict=True))
    return found


def compared_parts(got, wanted, place):
    """How many: an output of each wheel by a number of each wheel has its own part alone, and no other is moved."""
    own = slice(None)
    if len(got) < len(wanted):
        own = slice(place[0] * len(got), (place[0] + 1) * len(got))
        others = [*wanted[: own.start], *wanted[own.stop :]]
        agree(others, [0] * len(others))
    agree(got, wanted[own])
    return len(got)


@working_precision
def compared(model, effects, numbers, sharp):
    """How many components were compared."""
    vehicle, known = known_state(model, effects)
    effects = asked(effects, numbers)
    module, prepared = prepared_kernel(vehicle, model, effects, known)
    count = 0
    for function in FUNCTIONS:
        name = form(f"{function}_by_numbers", sharp, vars(module))
        if not hasattr(module, name):
            continue
        values = getattr(module, name)(prepared, *(balls(known[n]) for n in inputs_of(model, effects, name)))
        values = values if isinstance(values, tuple) else (values,)
        found = outputs_of(model, effects, name, values)
        for number in numbers:
            for place, slopes in expected(vehicle, known, model, effects, function, number).items():
                for output, wanted in slopes.items():
                    got = found[f"{output}_by_{number}"]
                    for k in place:
                        got = got[k]
                    count += compared_parts(flat([got]), wanted, place)
    return count


@pytest.mark.long
@pytest.mark.parametrize("model, effects, numbers", NUMBERS)
def test_by_numbers_they_are_the_derivatives_of_every_rate(model, effects, numbers):
    assert compared(model, effects, numbers, sharp=False) > 50


@pytest.mark.long
@pytest.mark.parametrize("model, effects, numbers", [OF_LAYOUT, OF_FREE])
def test_so_are_those_of_the_forms_for_sharp_tips(model, effects, numbers):
    assert compared(model, effects, numbers, sharp=True) > 50


def test_a_set_that_was_not_asked_for_a_number_has_none():
    plain = sets.functions("free", ("drive", "derivatives"))
    assert not [f["name"] for f in plain if "by_numbers" in f["name"]]
    assert not [name for name in inputs_of("free", ("drive", "derivatives"), "prepare") if "_by_" in name]


def test_a_kernel_is_asked_by_the_number_s_name():
    vehicle = omniroll.Vehicle.paper()
    kernel = PythonKernel(vehicle, "massless", ("derivatives_by_mass",))
    by_mass = kernel.call("forward_dynamics_by_numbers", (1.0, 0.2, 0.3), (0.1, 0.0, 0.2))
    step = 1e-6 * vehicle.mass
    sides = [replace(vehicle, mass=vehicle.mass + side * step) for side in (1, -1)]
    up, down = (PythonKernel(v, "massless").forward_dynamics((1.0, 0.2, 0.3), (0.1, 0.0, 0.2)) for v in sides)
    assert np.allclose(by_mass, (up - down) / (2 * step), rtol=1e-7)
    with pytest.raises(InvalidValueError, match="derivatives_by_colour"):
        PythonKernel(vehicle, "massless", ("derivatives_by_colour",))
    with pytest.raises(ContractError, match="no derivative by colour"):
        sets.programs().kernel("massless", ("derivatives_by_colour",))


# ---- what they cost --------------------------------------------------------------------------------------------------


def operations(model, effects, function, wheels):
    """All operations of one call."""
    (entry,) = (f for f in sets.functions(model, effects) if f["name"] == function)
    times = {"once": 1, "wheel": wheels, "earlier": wheels * (wheels - 1) // 2}
    return sum(times.get(place, 0) * sum(counted.values()) for place, counted in entry["operations"].items())


def components(model, effects, numbers, wheels):
    known = known_state(model, effects)[1]
    each = [name for name in numbers if np.shape(known.get(name, 0.0))[:1] == (3,)]
    count = sum(int(np.prod(np.shape(known.get(name, 0.0)))) for name in numbers)
    return count + (wheels - 3) * sum(int(np.prod(np.shape(known[name])[1:])) for name in each)


def forms(model):
    """Massless rollers have no form for sharp tips."""
    return ("",) if model == "massless" else ("", "_sharp")


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("effects", [(), ALL], ids=["bare", "all"])
def test_they_cost_at_most_six_times_the_accelerations(model, effects):
    """The answers of rows near sharp tips are carried past the wheels after them: a little more with each wheel."""
    for ending in forms(model):
        for wheels in (3, 4, 6, 12):
            price = operations(model, (*effects, "derivatives"), f"forward_dynamics_derivatives{ending}", wheels)
            assert price <= 6 * operations(model, effects, f"forward_dynamics{ending}", wheels)


@pytest.mark.long
@pytest.mark.parametrize("model, effects, numbers", [NUMBERS[1], OF_FREE, ROLLING_DOWN, PUSHED])
def test_each_number_costs_at_most_half_the_accelerations_beyond_that(model, effects, numbers):
    wanted = asked(effects, numbers)
    for ending in forms(model):
        for wheels in (3, 4):
            names = ("forward_dynamics", "forward_dynamics_derivatives", "forward_dynamics_by_numbers")
            plain, price, further = (operations(model, wanted, f"{name}{ending}", wheels) for name in names)
            assert price + further <= (6 + components(model, effects, numbers, wheels) / 2) * plain

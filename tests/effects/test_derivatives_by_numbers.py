"""Generated derivatives by numbers of the vehicle and of effects against the derivatives of what was differentiated, by
power series of balls in 60 digits; in doubles against balls; and what they cost.
"""

from dataclasses import replace

import numpy as np
import pytest
from effects.cases import balls, prepared_kernel
from effects.test_derivatives import agree, inputs_of, moved, outputs_of, state_of
from hard import rounding
from hard.effect_kernels import compiled_on_demand, with_effects
from hard.kernel_errors import BOUND, EPS, python_kernels, worst
from hard.sampling import sample
from oracle.balls import coefficient, exact, line, working_precision

import omniroll
from omniroll import InvalidValueError
from omniroll.codegen.programs import ContractError
from omniroll.kernels import sets
from omniroll.kernels.kernel import SHARP, PythonKernel, form

NUMBERS = {  # a set: what it is differentiated by
    ("massless", ("layout", "axle_coulomb")): ("wheel_inertia", "wheel_places", "axle_fade_speed", "axle_torque"),
    ("locked", ("roller_coulomb", "slope")): ("wheel_radius", "wheel_angles", "roller_fade_speed", "slope_angle"),
    ("free", ("drive", "motor", "roller_viscous")): ("roller_inertia", "yaw_scale", "roller_damping", "resistance"),
}
SETS = [(*key, numbers) for key, numbers in NUMBERS.items()]
# Of a vehicle, but for the mass: `prepare` takes pi from its first argument, and a series knows none.
OF_VEHICLE = ("yaw_inertia", "wheel_inertia", "roller_inertia", "yaw_scale", "platform_radius", "wheel_radius",
              "roller_axis_radius", "wheel_angles")  # fmt: skip
EVERY = [
    ("massless", (), tuple(n for n in OF_VEHICLE if not n.startswith("roller"))),
    ("locked", ("axle_viscous", "roller_viscous"), OF_VEHICLE),
    ("free", ("roller_viscous",), OF_VEHICLE),
    ("locked", ("layout", "motor", "axle_coulomb", "slope"), (*OF_VEHICLE, "wheel_places", "center_of_mass")),
    ("free", ("layout", "motor"), (*OF_VEHICLE, "wheel_places", "center_of_mass")),
    ("free", ("layout", "axle_viscous"), (*OF_VEHICLE, "wheel_places", "center_of_mass", "axle_damping")),
]
FALLING = ("massless", ("layout", "slope"), ("yaw_inertia", "wheel_inertia", "yaw_scale", "platform_radius",
           "wheel_radius", "wheel_angles", "wheel_places", "center_of_mass", "gravity", "slope_angle"))  # fmt: skip
OF_MASSLESS = tuple(n for n in OF_VEHICLE if not n.startswith("roller"))
PUSHED = [
    ("massless", ("drive", "axle_viscous"), (*OF_MASSLESS, "axle_damping")),
    ("massless", ("layout", "drive", "motor", "axle_viscous", "axle_coulomb", "roller_viscous", "slope"),
     (*OF_VEHICLE[:2], *OF_VEHICLE[3:], "axle_damping", "axle_torque", "axle_fade_speed", "roller_damping",
      "wheel_places", "center_of_mass", "gravity", "slope_angle")),
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
@pytest.mark.parametrize("model, effects, numbers", [*SETS, *EVERY[3:], FALLING, PUSHED[1]])
def test_they_are_the_derivatives_of_every_rate(model, effects, numbers):
    assert compared(model, effects, numbers, sharp=False) > 50


@pytest.mark.long
@pytest.mark.parametrize("model, effects, numbers", EVERY[3:5])
def test_so_are_those_of_the_forms_for_sharp_tips(model, effects, numbers):
    assert compared(model, effects, numbers, sharp=True) > 50


def assert_digits_kept(states, name, functions):
    for function in functions:
        judge = rounding.judged_by(states, name, [function])[function]
        assert worst(judge.units(rounding.values(states, name, function), EPS["double"])[0]) <= BOUND


@pytest.mark.long
@pytest.mark.parametrize("model", ["locked", "free"])
def test_so_do_those_of_places_and_damping_and_of_impacts(model):
    """The pull at a contact and the wheels that do not switch: both are lost in differences of large numbers."""
    effects = ("layout", "roller_viscous")
    name = rounding.set_key(f"{model}_sharp", asked(effects, ("roller_damping", "wheel_places", "wheel_radius")))
    states = sample(73, 100, 3, 5, closest_tip=1e-9)
    states = with_effects(states.at(np.flatnonzero(states.sharpness() > SHARP)), name, 173)
    assert_digits_kept(states, name, ("forward_dynamics_by_numbers", "impact_by_numbers"))


@pytest.mark.long
@pytest.mark.parametrize("effects, number", [
    ((), "mass"), ((), "wheel_radius"), (("layout",), "yaw_inertia"), (FALLING[1], "wheel_inertia"),
    (FALLING[1], "wheel_places"), (FALLING[1], "slope_angle"),
    *((PUSHED[1][1], number) for number in ("axle_damping", "roller_damping", "center_of_mass", "gravity")),
])  # fmt: skip
def test_the_derivatives_keep_their_digits_beside_light_wheels(effects, number):
    name = rounding.set_key("massless", asked(effects, (number,)))
    assert_digits_kept(with_effects(sample(73, 100, 3, 5), name, 173), name, ("forward_dynamics_by_numbers",))


def moved_by_masses(effects):
    """{a mass: what nu' moves by where it grows by its own size}, with massless rollers."""
    masses = ("mass", "yaw_inertia", "wheel_inertia")
    vehicle, known = known_state("massless", effects)
    wanted, name = asked(effects, masses), "forward_dynamics_by_numbers"
    module, prepared = prepared_kernel(vehicle, "massless", wanted, known)
    values = getattr(module, name)(prepared, *(balls(known[n]) for n in inputs_of("massless", wanted, name)))
    found = outputs_of("massless", wanted, name, values)
    return {mass: [vehicle.number(mass) * part for part in flat(found[f"nu_dot_by_{mass}"])] for mass in masses}


@pytest.mark.parametrize("effects", [(), FALLING[1]])
@working_precision
def test_masses_together_move_nothing_where_no_wheel_is_pushed(effects):
    """A vehicle whose masses all grow alike moves as before, and falls as before."""
    moved = moved_by_masses(effects)
    assert all(abs(part) > 1e-9 for part in moved["mass"])
    agree([sum(own) for own in zip(*moved.values(), strict=True)], [0] * 3)


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


@pytest.mark.long
@pytest.mark.parametrize("form", ["", "_sharp"])
@pytest.mark.parametrize("model, effects, numbers", [SETS[2], EVERY[1], EVERY[4], FALLING, PUSHED[1]])
def test_each_number_costs_at_most_half_the_accelerations_beyond_six_times_them(model, effects, numbers, form):
    if form and model == "massless":
        pytest.skip("massless rollers have no form for sharp tips")
    wanted = asked(effects, numbers)
    for wheels in (3, 4):
        count = components(model, effects, numbers, wheels)
        plain = operations(model, wanted, f"forward_dynamics{form}", wheels)
        price = operations(model, wanted, f"forward_dynamics_derivatives{form}", wheels)
        further = operations(model, wanted, f"forward_dynamics_by_numbers{form}", wheels)
        assert price + further <= (6 + count / 2) * plain


def numbers_of(model, effects):
    """{number that `prepare` takes: its shape}, but for how many wheels and rollers there are."""
    (entry,) = (f for f in sets.functions(model, effects) if f["name"] == "prepare")
    return {a["name"]: a["shape"] for a in entry["arguments"] if a["role"] == "in"}


@pytest.mark.long
@pytest.mark.parametrize("base", ["locked", "free"])
def test_both_kernels_call_the_form_for_sharp_tips(base):
    numbers = ("mass", "roller_inertia", "wheel_angles", "wheel_radius")  # for so many the rows ask and are answered
    effects = ("derivatives", *(f"derivatives_by_{number}" for number in numbers))
    set_name = rounding.set_key(f"{base}_sharp", effects)
    part = sample(3, 20, 3, 5, closest_tip=1e-9)
    part = with_effects(part.at(np.flatnonzero(part.sharpness() > SHARP)), set_name, 5)
    name = "forward_dynamics_by_numbers"
    found, expected = (outputs(part, set_name)[name] for outputs in (compiled_on_demand, python_kernels))
    assert found.shape == expected.shape and len(part)
    assert (np.abs(found - expected) <= 64 * EPS["double"] * np.abs(expected).max(axis=0)).all()


@pytest.mark.long
@pytest.mark.parametrize("model, effects, numbers", [EVERY[4], PUSHED[1]])
def test_both_kernels_have_every_number(model, effects, numbers):
    name = rounding.set_key(model, asked(effects, ("mass", *numbers)))
    part = sample(3, 20, 3, 5)
    part = with_effects(part.at(np.flatnonzero(part.sharpness() <= SHARP)), name, 5)
    function = "forward_dynamics_by_numbers"
    found, expected = (outputs(part, name)[function] for outputs in (compiled_on_demand, python_kernels))
    assert found.any() and len(part)
    assert (np.abs(found - expected) <= 64 * EPS["double"] * np.abs(expected).max(axis=0)).all()

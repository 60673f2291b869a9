"""Kernels with effects against ball arithmetic: each effect alone, and all together."""

from collections.abc import Callable

import numpy as np
from oracle.directions import directions_allowed

from hard import rounding
from hard.case import Cases, Measurement, Scale
from hard.kernel_errors import EPS, OF_THE_FUNCTION, Errors, measurements, python_kernels
from hard.sampling import Draw, Sample, per_state, sample
from omniroll import Vehicle, generated_data
from omniroll.kernels.kernel import SHARP, VEHICLE_SCALARS, CompiledKernel, optional_effects, signatures


def effect_sets(scale: Scale) -> list[str]:
    """All effects at once for every roller model, and in full each alone; as rounding.set_key writes them.

    Axles that stick alone with sharp tips too: they have a form of their own for these. Wheels that slip are left out:
    their functions take other states. So are derivatives, which have a case of their own.
    """
    every, bases = every_effect(), bases_of(scale)
    alone = [rounding.set_key(base, (effect,)) for base in bases[:3] for effect in every]
    together = [rounding.set_key(base, every) for base in bases]
    together += [rounding.set_key(base, effects) for base in bases[:3] for effects in other_wheels()]
    return together + scale.of([], [*alone, rounding.set_key("free_sharp", ("axle_sticking",))])


def every_effect() -> tuple[str, ...]:
    # roller_sticking stands in the place of roller_coulomb; other wheels are by themselves
    left_out = ("contact", "derivatives", "roller_sticking", "joints", "moving_rows", "arcs", "weight", *OTHER_WHEELS)
    return tuple(effect for effect in optional_effects() if not effect.startswith(left_out))


def other_wheels() -> list[tuple[str, ...]]:
    """Two rows of rollers, mecanum wheels, wheels of several kinds, and profiles of mecanum rollers, each with all
    effects that go beside."""
    entries = {entry["name"]: entry for entry in generated_data.load("effects")["effects"]}
    chosen = []
    for kind in OTHER_WHEELS:
        own = {kind} if kind != "profile" else {"mecanum", kind, "arcs", "weight"}
        needed = {needs for name in own for needs in entries[name]["needs"]}
        excluded = {other for name in own for other in entries[name]["excludes"]}
        chosen.append(({*every_effect(), "layout", "joints"} - excluded) | own | needed)
    return [tuple(effect for effect in optional_effects() if effect in own) for own in chosen]


def bases_of(scale: Scale) -> tuple[str, ...]:
    return scale.of(("locked", "free"), ("massless", "locked", "free", "locked_sharp", "free_sharp"))


CASES = Cases("Number types and compilers")
OTHER_WHEELS = ("rows", "mecanum", "kinds", "profile")
NUMBERS = {  # by which the derivatives are judged, of a bare vehicle and of one with all effects
    (): ("mass", "roller_inertia", "wheel_angles", "wheel_radius"),
    ("all",): ("roller_damping", "roller_fade_speed", "slope_angle", "wheel_places"),
}


def sets_with_derivatives(scale: Scale) -> list[str]:
    """Derivatives alone, and of all effects; in full by state and inputs, and by numbers beside these."""
    found = []
    for base in bases_of(scale):
        for all_of_them, numbers in NUMBERS.items():
            effects = (*(every_effect() if all_of_them else ()), "derivatives")
            own = [name for name in numbers if (base, name) != ("massless", "roller_inertia")]
            requests = tuple(f"derivatives_by_{name}" for name in own)
            found += [rounding.set_key(base, (*effects, *asked)) for asked in scale.of([()], [(), requests])]
    return found


def short_name(set_name: str) -> str:
    base, effects = rounding.split_key(set_name)
    base += "_sharp" if rounding.is_sharp(set_name) else ""
    many = [effect for effect in effects if not effect.startswith("derivatives")]
    if len(many) > 1:
        return f"{base}{''.join(f', {kind}' for kind in OTHER_WHEELS if kind in effects)} and all effects"
    return base if len(effects) > 1 and not many else set_name


def constants(draw: Draw, vehicle: dict[str, np.ndarray], speed: np.ndarray, wheels: int) -> dict[str, np.ndarray]:
    """What `prepare` takes for effects, by name, of the sizes that forces and friction have beside inertia."""
    each = lambda values: per_state(values, (wheels,)) * draw.log(1e-3, 1e3, wheels)  # noqa: E731
    radius, inertia = vehicle["platform_radius"], vehicle["wheel_inertia"]
    gyration = np.sqrt(vehicle["yaw_inertia"] / vehicle["mass"])
    return {
        "wheel_places": per_state(radius, (wheels, 2)) * draw.signed(0.1, 2, wheels, 2),
        "center_of_mass": per_state(gyration, (2,)) * draw.signed(1e-6, 0.5, 2),
        "axle_damping": each(inertia * speed),
        "axle_torque": each(inertia * speed**2),
        "axle_fade_speed": speed * draw.log(1e-3, 1),
        "roller_damping": each(vehicle["roller_inertia"] * speed),
        "roller_torque": each(vehicle["roller_inertia"] * speed**2),
        "roller_fade_speed": speed * draw.log(1e-3, 1),
        "gravity": radius * speed**2 * draw.log(1e-2, 1e2),
        "slope_angle": draw.rng.uniform(0, 1.5, draw.count),
        "slope_direction": draw.rng.uniform(-np.pi, np.pi, draw.count),
        "torque_constant": draw.log(1e-3, 1e3),
        "resistance": draw.log(1e-3, 1e3),
        "motor_gear_ratio": draw.signed(1e-1, 1e2),
        "back_emf": draw.log(1e-3, 1e3),
        "current_limit": draw.log(1e-3, 1e3),
    } | of_other_wheels(draw, vehicle, wheels)


def of_other_wheels(draw: Draw, vehicle: dict[str, np.ndarray], wheels: int) -> dict[str, np.ndarray]:
    """Of two rows; of rollers at an angle, up to which the wheel keeps inertia; of several kinds, with wheels up to
    twice as large as the vehicle's; of arcs about points on either side of the roller's axis and of its middle. Every
    third wheel stands."""
    carried = 5 * vehicle["roller_inertia"]
    larger = draw.rng.uniform(1, 2, (draw.count, wheels))
    weightless = draw.rng.integers(0, 2, (draw.count, wheels)).astype(float)
    steepest = np.minimum(np.arcsin(np.sqrt(np.minimum(0.9 * vehicle["wheel_inertia"] / carried, 1))), 1.5)
    thick = per_state(vehicle["wheel_radius"] - vehicle["roller_axis_radius"], (wheels,))
    radii = thick * draw.rng.uniform(0, 1.3, (draw.count, wheels))
    return {
        "arc_radii": radii,
        "arc_asides": thick - radii,
        "arc_alongs": thick * draw.rng.uniform(-0.5, 0.5, (draw.count, wheels)),
        "wheel_loads": per_state(vehicle["mass"], (wheels,)) * draw.rng.uniform(0, 10, (draw.count, wheels)),
        "roller_angle": per_state(steepest, (wheels,)) * draw.rng.uniform(-1, 1, (draw.count, wheels)),
        "row_offset": vehicle["wheel_radius"] * draw.signed(1e-3, 1),
        "wheel_radii": per_state(vehicle["wheel_radius"], (wheels,)) * larger,
        "roller_axis_radii": per_state(vehicle["roller_axis_radius"], (wheels,)) * larger,
        "wheel_inertias": per_state(vehicle["wheel_inertia"], (wheels,)) * larger**5,
        "roller_inertias": per_state(vehicle["roller_inertia"], (wheels,)) * (1 - weightless),
        "weightless": weightless,
        "roller_counts": draw.rng.integers(3, 6, (draw.count, wheels)).astype(float),
        "driven": draw.rng.integers(0, 2, (draw.count, wheels)).astype(float),
        "sides": draw.rng.choice([-1.0, 1.0], (draw.count, wheels)),
        "turns": np.minimum(draw.rng.integers(0, 3, (draw.count, wheels)), 1).astype(float),
    }


def axles_that_stick(part: Sample, set_name: str, draw: Draw) -> dict[str, np.ndarray]:
    """Directions (M, 9) that one to three axles which stick allow, as a run chooses them; and those that are absent."""
    unit_nu = lambda k: Sample(part.wheels, part.rollers, part.vehicle, {"nu": np.tile(np.eye(3)[k], (len(part), 1))})  # noqa: E731
    columns = [rounding.values(unit_nu(k), set_name, "wheel_speeds") for k in range(3)]
    rows = np.array(columns).transpose(2, 1, 0)
    matrices = rounding.values(part, set_name, "mass_matrix").T.reshape(-1, 3, 3)
    stuck = [draw.rng.permutation(part.wheels)[: draw.rng.integers(1, 4)] for _ in range(len(part))]
    cases = zip(rows, stuck, matrices, strict=True)
    directions = np.array([directions_allowed(own[axles], matrix) for own, axles, matrix in cases])
    return {"directions": directions.reshape(-1, 9), "absent": (~directions.any(axis=1)).astype(float)}


def inputs(draw: Draw, part: Sample, speed: np.ndarray) -> dict[str, np.ndarray]:
    """What functions of effects take beside those of the roller models, by name."""
    vehicle, wheels = part.vehicle, part.wheels
    B, radius = vehicle["roller_inertia"], vehicle["platform_radius"]
    force = vehicle["mass"] * radius**2 * speed**2
    signed = lambda values, *shape: per_state(values, shape) * draw.signed(1e-2, 1e2, *shape)  # noqa: E731
    return {
        "heading": part.state["theta"],
        "torque": signed(force, wheels),
        "bearing_torque": signed(force, wheels),
        "contact_bearing": signed(B * speed**2, wheels),
        "free_bearing": signed(B * speed**2, wheels, part.rollers - 1),
        "bearing_drag": signed(B * speed**2, wheels),
        "bearing_momenta_dot": signed(B * speed**2, wheels, 2),
        "voltage": draw.signed(1e-2, 1e2, wheels),
        "modes": draw.rng.integers(-1, 2, (draw.count, wheels)).astype(float),
        "damping": per_state(vehicle["wheel_inertia"] * speed, (wheels,)) * draw.log(1e-3, 1e3, wheels),
        "roller_drag": signed(B * speed**2, wheels),
        "pose": np.concatenate([signed(radius, 2), part.state["theta"][:, None]], axis=1),
        "nu_before": signed(speed, 3),
        "spin_before": signed(speed, wheels),
        "momenta_before": signed(B * speed, wheels, 2),
        "momenta_after": signed(B * speed, wheels, 2),
        "roller_energy": per_state(B * speed**2, (wheels,)) * draw.log(1e-3, 1e3, wheels),
        "elapsed": draw.log(1e-3, 1e3) / speed,
        "coulomb_momenta_dot": signed(B * speed**2, wheels, 2),
        "normal_gravity": radius * speed**2 * draw.log(1e-2, 1e2),
        "height": radius * draw.log(1e-2, 1),
        "wheel_mass": vehicle["mass"] * draw.log(1e-3, 0.3),
        "platform_products": signed(vehicle["yaw_inertia"], 2),
        "spin_inertia": signed(B, wheels),
        "rate_excess": signed(speed, wheels),
        "turn_excess": signed(speed, wheels),
        "sides": draw.rng.choice([-1.0, 1.0], (draw.count, wheels)),
        "turns": np.ones((draw.count, wheels)),
    }


def with_effects(part: Sample, set_name: str, seed: int) -> Sample:
    """A sample with the constants of effects that the set needs, and no others, at speeds near those of its states."""
    draw = Draw(seed, len(part))
    speed = np.maximum(np.abs(part.state["nu"]).max(axis=1), 1e-9)
    given = part.vehicle | constants(draw, part.vehicle, speed, part.wheels)
    wanted = signatures(*rounding.split_key(set_name), part.wheels, part.rollers)["prepare"].inputs
    vehicle = part.vehicle | {argument.name: given[argument.name] for argument in wanted}
    given = Sample(part.wheels, part.rollers, vehicle, part.state | inputs(draw, part, speed))
    if "axle_sticking" in set_name:
        given.state.update(axles_that_stick(given, set_name, draw))
    return given


def compiled_on_demand(part: Sample, set_name: str) -> dict[str, np.ndarray]:
    """Outputs (M, K) of every function of the set's C kernel, made and compiled as for a scene."""
    wanted = rounding.functions(set_name, part)
    found = {name: [] for name in wanted}
    for row in range(len(part)):
        kernel = compiled_kernel(part, row, set_name)
        for name, signature in wanted.items():
            outputs = kernel.call(name, *(part.state[a.name][row] for a in signature.inputs))
            outputs = outputs if len(signature.outputs) > 1 else (outputs,)
            found[name].append(np.concatenate([output.ravel() for output in outputs]))
    return {name: np.transpose(rows) for name, rows in found.items()}


def compiled_kernel(part: Sample, row: int, set_name: str) -> CompiledKernel:
    """The kernel of one state's vehicle."""
    base, effects = rounding.split_key(set_name)
    numbers = {name: array[row].tolist() for name, array in part.vehicle.items()}
    fields = (*VEHICLE_SCALARS, "wheel_angles")
    own = {name: numbers.pop(name) for name in fields}
    vehicle = Vehicle(wheels=part.wheels, rollers_per_wheel=part.rollers, **own)
    constants = tuple(numbers.items())
    kernel = CompiledKernel(vehicle, base, "double", effects, constants)
    assert kernel.sharp == rounding.is_sharp(set_name)
    return kernel


@CASES.case(
    "kernels-with-effects",
    "Every function of kernels with effects: each effect alone, and all together",
    promise=OF_THE_FUNCTION,
)
def of_effects(scale: Scale) -> list[Measurement]:
    # Least squares of mecanum wheels go by normal equations, which square the condition.
    return against_balls(scale, effect_sets(scale), lambda name: not name.endswith("_at"))


@CASES.case(
    "derivatives",
    "The derivatives of accelerations and rates, alone and with all effects",
    promise=OF_THE_FUNCTION,
)
def of_derivatives(scale: Scale) -> list[Measurement]:
    return against_balls(
        scale, sets_with_derivatives(scale), lambda name: name.endswith(("_derivatives", "_by_numbers"))
    )


def against_balls(scale: Scale, sets: list[str], wanted: Callable[[str], bool] = bool) -> list[Measurement]:
    """The functions of the sets whose names are wanted."""
    kernels = {"compiled": compiled_on_demand, "python": python_kernels}
    errors: dict[str, list[Errors]] = {on: [] for on in kernels}
    for place, set_name in enumerate(sets):
        part = sample(60 + place, scale.of(40, 1000), 3, 5, closest_tip=1e-9)
        fits = (part.sharpness() > SHARP) == set_name.startswith(("locked_sharp", "free_sharp"))
        part = part.at(np.flatnonzero(fits | set_name.startswith("massless")))
        part = with_effects(part, set_name, 160 + place)
        names = [name for name in rounding.functions(set_name, part) if wanted(name)]
        judges = rounding.judged_by(part, set_name, names)
        for on, outputs in kernels.items():
            found = outputs(part, set_name)
            errors[on] += [
                Errors(short_name(set_name), name, *judge.units(found[name], EPS["double"]), part)
                for name, judge in judges.items()
            ]
    return [m for on, several in errors.items() for m in measurements(several, on, components=False)]

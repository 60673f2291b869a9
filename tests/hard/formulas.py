"""Formulas where they lose their digits: tips, light and heavy rollers, wheels almost in line, one wheel and many."""

from collections.abc import Callable, Iterator

import numpy as np

from hard import naive_kernels, rounding
from hard.case import Case, Measurement, Scale
from hard.kernel_errors import PROMISE, Bench, compiled_kernels, measurements, python_kernels, worst
from hard.sampling import Draw, Sample, sample

SOLVED = ["forward_dynamics", "accelerations", "impact"]
Fields = dict[str, np.ndarray]  # of the vehicles drawn so far


def measured(
    scale: Scale, parts: list[Sample], names: list[str], models: tuple[str, ...], naive: Callable | None
) -> Iterator[Measurement]:
    """Errors of some functions on all samples, compiled and in Python, beside naive ones where there are such."""
    for part in parts:
        for model in models:
            bench = Bench(part, model, names)
            written = bench.errors(naive) if naive and scale is Scale.FULL else ()
            theirs = {(e.set_name, e.function): worst(e.vectors) for e in written}
            for on, kernels in (("compiled", compiled_kernels()), ("python", python_kernels)):
                for e in bench.errors(kernels):
                    yield from measurements([e], on, naive=theirs.get((e.set_name, e.function)), components=False)


def case(
    name: str, title: str, parts: Callable[[Scale], list[Sample]], names=SOLVED, models=("locked", "free"),
    naive: Callable | None = naive_kernels.accelerations,
) -> Case:  # fmt: skip
    words = naive_kernels.AS_WRITTEN if naive else "normal equations"
    return Case(name, "Formulas", title, words, PROMISE,
                lambda scale: measured(scale, parts(scale), names, models, naive))  # fmt: skip


def light_rollers(vehicle: Fields, draw: Draw) -> np.ndarray:
    return vehicle["roller_inertia"] * draw.log(1e-250, 1e-3)


def light_with_the_tip(vehicle: Fields, draw: Draw) -> np.ndarray:
    """B with rho^2, so that B/rho^2 stays."""
    tip = vehicle["wheel_radius"] * np.cos(np.pi / 5) - vehicle["roller_axis_radius"]
    return np.minimum(vehicle["roller_inertia"], vehicle["mass"] * tip**2 * draw.log(1e-6, 1e6))


def vanishing_rollers(scale: Scale) -> list[Sample]:
    count = scale.of(100, 1_500)
    return [sample(24, count, 3, 5, roller_inertia=light_rollers),
            sample(25, count, 3, 5, closest_tip=1e-12, roller_inertia=light_with_the_tip)]  # fmt: skip


def close_to_the_bound(vehicle: Fields, draw: Draw) -> np.ndarray:
    """I_S is almost all in the rollers' axial spins: N n B/2 = I_S (1 - 1e-12 ... 0.5)."""
    return 2 * vehicle["yaw_inertia"] / 15 * (1 - draw.log(1e-12, 0.5))


def heavy_wheels(vehicle: Fields, draw: Draw) -> np.ndarray:
    return vehicle["mass"] * vehicle["wheel_radius"] ** 2 * draw.log(0.1, 30)


def two_directions(vehicle: Fields, draw: Draw) -> np.ndarray:
    """Wheels on one line through S, so that they resist two of the three motions only."""
    turned = draw.rng.uniform(-np.pi, np.pi, (draw.count, 1))
    return turned + np.pi * draw.rng.integers(0, 2, (draw.count, 3))


def close_together(vehicle: Fields, draw: Draw) -> np.ndarray:
    """All wheels within an angle of 1e-8 ... 1 from each other."""
    middle = draw.rng.uniform(-np.pi, np.pi, (draw.count, 1))
    return middle + draw.log(1e-8, 1, 1) * draw.rng.uniform(-1, 1, vehicle["wheel_angles"].shape)


def anywhere(vehicle: Fields, draw: Draw) -> np.ndarray:
    """Wheels anywhere, so that no sum over them cancels."""
    return draw.rng.uniform(-np.pi, np.pi, vehicle["wheel_angles"].shape)


def one_wheel_and_many(scale: Scale) -> list[Sample]:
    count = scale.of(10, 2_000)
    return [
        sample(30 + k, 1 + count // (wheels * rollers // 10 + 1), wheels, rollers, wheel_angles=anywhere)
        for k, (wheels, rollers) in enumerate([(1, 3), (2, 4), (3, 100), (24, 3)])
    ]


CASES = [
    case(
        "sharp-tips", "Contact near the joint of rollers whose tips are cut at 0.4 ... 1e-12 of l",
        lambda scale: [sample(21, scale.of(200, 2_000), 3, 5, closest_tip=1e-12)],
    ),
    case(  # a unit of length of 2^470 m
        "edge-of-overflow", "Wheels of 1e-142 m: 1/rho^2 at the edge of overflow and beyond",
        lambda scale: [sample(23, scale.of(200, 1_500), 3, 5, closest_tip=1e-12).in_units(2.0**-470, 2.0**200)],
        ["forward_dynamics", "wheel_rates"],
    ),
    case("rollers-vanish", "B -> 0, alone and together with rho", vanishing_rollers),
    case(
        "rollers-at-their-bound", "B up to its bound, I_S = N n B/2 (1 + 1e-12)",
        lambda scale: [sample(26, scale.of(150, 2_000), 3, 5, roller_inertia=close_to_the_bound)],
    ),
    case(  # M* with a condition number up to 1e7
        "badly-conditioned", "M* badly conditioned: heavy wheels in line on a light platform",
        lambda scale: [sample(27, scale.of(150, 2_000), 3, 5, wheel_inertia=heavy_wheels, wheel_angles=two_directions)],
    ),
    case(
        "wheels-almost-in-line",
        "Wheels nearly collinear, within 1 ... 1e-8 rad: speeds and torques by least squares",
        lambda scale: [sample(28, scale.of(150, 2_000), 4, 5, wheel_angles=close_together)],
        list(rounding.FITS), ("massless",), None,
    ),
    case("any-size", "N = 1, 2, 3, 24, n = 3, 4, 100, wheels at any angles", one_wheel_and_many),
]  # fmt: skip

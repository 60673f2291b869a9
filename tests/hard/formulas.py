"""Formulas where they lose their digits: tips, light and heavy rollers, wheels almost in line, one wheel and many."""

from collections.abc import Callable

import numpy as np

from hard import naive_kernels, rounding
from hard.case import Case, Measurement, Scale
from hard.kernel_errors import BOUND, BULK, BULK_BOUND, Bench, compiled_kernels, measurements, python_kernels, worst
from hard.sampling import Draw, Sample, sample

SECTION = "Formulas"
MASSIVE = ("locked", "free")
SOLVED = ["forward_dynamics", "accelerations", "impact"]

PROMISE = f"at most {BOUND} ulp times the condition, {BULK_BOUND} for {BULK} % of the states"
AS_WRITTEN = naive_kernels.AS_WRITTEN


def measured(parts: list[Sample], names: list[str], models=MASSIVE, naive=naive_kernels.accelerations):
    """Errors of some functions on all samples, compiled and in Python, beside naive ones where there are such."""
    found = []
    for part in parts:
        for model in models:
            bench = Bench(part, model, names)
            theirs = {(e.set_name, e.function): worst(e.vectors) for e in bench.errors(naive)}
            for on, kernels in (("compiled", compiled_kernels()), ("python", python_kernels)):
                for e in bench.errors(kernels):
                    found += measurements([e], on, naive=theirs.get((e.set_name, e.function)), components=False)
    return found


def case(name: str, title: str, naive: str, run: Callable[[Scale], list[Measurement]]) -> Case:
    return Case(name=name, section=SECTION, title=title, naive=naive, promise=PROMISE, run=run)


def sharp_tips(scale: Scale) -> list[Measurement]:
    part = sample(21, scale.of(200, 2_000), 3, 5, closest_tip=1e-12)
    return measured([part], SOLVED)


def elimination(sample: Sample, set_name: str) -> dict[str, np.ndarray]:
    """The kernels without folding, whatever the tip."""
    plain = set_name.removesuffix("_sharp")
    return {name: rounding.values(sample, plain, name) for name in ("forward_dynamics", "impact")}


def contact_spin_eliminated(scale: Scale) -> list[Measurement]:
    """1/rho and 1/rho^2 as wheels come near the joint, on sharp vehicles only."""
    part = sample(22, scale.of(400, 2_000), 3, 5, closest_tip=1e-12)
    return measured(
        [part.at(np.flatnonzero(part.sharpness() > 1e4))], ["forward_dynamics", "impact"], naive=elimination
    )


def edge_of_overflow(scale: Scale) -> list[Measurement]:
    """A unit of length of 2^470 m: wheels of about 1e-142, 1/rho^2 above 1e280 and, at the tips, out of range."""
    part = sample(23, scale.of(200, 1_500), 3, 5, closest_tip=1e-12)
    return measured([part.in_units(2.0**-470, 2.0**200)], ["forward_dynamics", "wheel_rates"])


def light_rollers(vehicle: dict[str, np.ndarray], draw: Draw) -> np.ndarray:
    return vehicle["roller_inertia"] * draw.log(1e-250, 1e-3)


def rollers_vanish(scale: Scale) -> list[Measurement]:
    """B down to 1e-250 of its usual size; and B with rho^2, so that B/rho^2 stays."""
    count = scale.of(100, 1_500)
    alone = sample(24, count, 3, 5, roller_inertia=light_rollers)
    together = sample(25, count, 3, 5, closest_tip=1e-12, roller_inertia=with_the_tip)
    return measured([alone, together], SOLVED)


def with_the_tip(vehicle: dict[str, np.ndarray], draw: Draw) -> np.ndarray:
    tip = vehicle["wheel_radius"] * np.cos(np.pi / 5) - vehicle["roller_axis_radius"]
    return np.minimum(vehicle["roller_inertia"], vehicle["mass"] * tip**2 * draw.log(1e-6, 1e6))


def close_to_the_bound(vehicle: dict[str, np.ndarray], draw: Draw) -> np.ndarray:
    return 2 * vehicle["yaw_inertia"] / 15 * (1 - draw.log(1e-12, 0.5))


def rollers_at_their_bound(scale: Scale) -> list[Measurement]:
    """I_S is almost all in the rollers' axial spins: N n B/2 = I_S (1 - 1e-12 ... 0.5)."""
    return measured([sample(26, scale.of(150, 2_000), 3, 5, roller_inertia=close_to_the_bound)], SOLVED)


def heavy_wheels(vehicle: dict[str, np.ndarray], draw: Draw) -> np.ndarray:
    return vehicle["mass"] * vehicle["wheel_radius"] ** 2 * draw.log(0.1, 30)


def two_directions(vehicle: dict[str, np.ndarray], draw: Draw) -> np.ndarray:
    """Wheels on one line through S, so that they resist two of the three motions only."""
    turned = draw.rng.uniform(-np.pi, np.pi, (draw.count, 1))
    return turned + np.pi * draw.rng.integers(0, 2, (draw.count, 3))


def badly_conditioned(scale: Scale) -> list[Measurement]:
    """M* with a condition number up to 1e7: heavy wheels in line on a light platform."""
    vehicle = {"wheel_inertia": heavy_wheels, "wheel_angles": two_directions}
    return measured([sample(27, scale.of(150, 2_000), 3, 5, **vehicle)], SOLVED)


def close_together(vehicle: dict[str, np.ndarray], draw: Draw) -> np.ndarray:
    """All wheels within an angle of 1e-8 ... 1 from each other."""
    middle = draw.rng.uniform(-np.pi, np.pi, (draw.count, 1))
    return middle + draw.log(1e-8, 1, 1) * draw.rng.uniform(-1, 1, vehicle["wheel_angles"].shape)


def normal_equations(sample: Sample, set_name: str) -> dict[str, np.ndarray]:
    """Fits by G = sum g g^T and a linear solver."""
    v = {k: a if a.ndim == 2 else a[:, None] for k, a in sample.vehicle.items()}
    rows = np.stack(
        [np.sin(v["wheel_angles"]), -np.cos(v["wheel_angles"]), -1 / v["yaw_scale"] + 0 * v["wheel_angles"]]
    )
    rows = rows * v["platform_radius"] / v["wheel_radius"]
    gram = np.einsum("akn,bkn->kab", rows, rows)
    sums = np.einsum("akn,kn->ka", rows, sample.state["chi_dot"])
    return {
        "nu_from_wheels": solved(gram, sums).T,
        "wheel_torques": np.einsum("akn,ka->nk", rows, solved(gram, sample.state["force"])),
    }


def solved(matrices: np.ndarray, sums: np.ndarray) -> np.ndarray:
    found = np.full(sums.shape, np.nan)
    for row, (matrix, right) in enumerate(zip(matrices, sums, strict=True)):
        try:
            found[row] = np.linalg.solve(matrix, right)
        except np.linalg.LinAlgError:
            pass  # it stays NaN: singular to rounding
    return found


def wheels_almost_in_line(scale: Scale) -> list[Measurement]:
    part = sample(28, scale.of(150, 2_000), 4, 5, wheel_angles=close_together)
    return measured([part], list(rounding.FITS), models=("massless",), naive=normal_equations)


def any_size(scale: Scale) -> list[Measurement]:
    """Wheels anywhere, so that no sum over them cancels."""
    count = scale.of(10, 2_000)
    sizes = [(1, 3), (2, 4), (3, 100), (24, 3)]
    parts = [
        sample(30 + k, 1 + count // (wheels * rollers // 10 + 1), wheels, rollers, wheel_angles=anywhere)
        for k, (wheels, rollers) in enumerate(sizes)
    ]
    return measured(parts, SOLVED)


def anywhere(vehicle: dict[str, np.ndarray], draw: Draw) -> np.ndarray:
    return draw.rng.uniform(-np.pi, np.pi, vehicle["wheel_angles"].shape)


CASES = [
    case(
        "sharp-tips",
        "Contact near the joint of rollers whose tips are cut at 0.4 ... 1e-12 of l",
        AS_WRITTEN,
        sharp_tips,
    ),
    case(
        "contact-spin-eliminated",
        "The same, sharp vehicles only: the contact spin is eliminated by folding rows, without 1/rho^2",
        "rho without cancellation, but elimination in M*",
        contact_spin_eliminated,
    ),
    case(
        "edge-of-overflow",
        "Wheels of 1e-142 m: 1/rho^2 at the edge of overflow and beyond",
        AS_WRITTEN,
        edge_of_overflow,
    ),
    case("rollers-vanish", "B -> 0, alone and together with rho", AS_WRITTEN, rollers_vanish),
    case("rollers-at-their-bound", "B up to its bound, I_S = N n B/2 (1 + 1e-12)", AS_WRITTEN, rollers_at_their_bound),
    case(
        "badly-conditioned",
        "M* badly conditioned: heavy wheels in line on a light platform",
        AS_WRITTEN,
        badly_conditioned,
    ),
    case(
        "wheels-almost-in-line",
        "Wheels nearly collinear, within 1 ... 1e-8 rad: speeds and torques by least squares",
        "normal equations",
        wheels_almost_in_line,
    ),
    case("any-size", "N = 1, 2, 3, 24, n = 3, 4, 100, wheels at any angles", AS_WRITTEN, any_size),
]

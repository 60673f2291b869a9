"""omniroll.accelerations against the oracle: relative 1e-12, or 100 eps cond where that is larger."""

import itertools
import math

import numpy as np
import pytest
from oracle import condition, lagrange
from oracle.bridge import project_vehicle
from oracle.lagrange import MODELS
from oracle.states import paper_vehicle, random_state, random_vehicle

ROLLERS = (3, 4, 5, 8, 17, 60)


def oracle_outputs(vehicle, model):
    """The function x = (nu, chi, spins, alpha, l, r) -> (nu_dot, spins_dot) as one list of balls."""
    count, n = vehicle.wheels, vehicle.rollers_per_wheel

    def outputs(x):
        flat = x[3 + count : -count - 2]
        spins = [flat[i * (n - 1) : (i + 1) * (n - 1)] for i in range(count)] if flat else None
        *angles, wheel_radius, roller_axis_radius = x[-count - 2 :]
        moved = vehicle.with_(
            wheel_angles=tuple(angles), wheel_radius=wheel_radius, roller_axis_radius=roller_axis_radius
        )
        found = lagrange.accelerations(moved, x[:3], x[3 : 3 + count], spins, model=model)
        return found.nu_dot + [s for wheel in found.spins_dot for s in wheel] * (model == "free")

    return outputs


def check(vehicle, nu, chi, spins, model, of_vehicle=0):
    """Every component of the accelerations; the condition is computed only where 1e-12 does not hold.

    Inputs are nu, chi and spins, and `of_vehicle` more of the vehicle: N for the wheels' angles on a regular
    polygon, where whole sums over the wheels cancel and what is left is the angles' rounding; N + 2 for the
    two radii also, where rollers are nearly pointed and rho is what their rounding leaves.
    """
    import omniroll

    free = model == "free"
    nu_dot, spins_dot = omniroll.accelerations(
        project_vehicle(vehicle), nu, chi, spins if free else None, roller_model=model
    )
    assert np.shape(nu_dot) == (3,)
    assert np.shape(spins_dot) == np.shape(spins) if free else spins_dot is None
    found = np.concatenate([nu_dot, np.ravel(spins_dot)]) if free else np.asarray(nu_dot)
    outputs = oracle_outputs(vehicle, model)
    state = [*nu, *chi, *(np.ravel(spins) if free else ())]
    x = [*state, *vehicle.wheel_angles, vehicle.wheel_radius, vehicle.roller_axis_radius]
    wanted = outputs([lagrange.exact(v) for v in x])
    errors = np.array([abs(float(w - lagrange.exact(f))) for f, w in zip(found, wanted, strict=True)])
    values = np.array([float(w) for w in wanted])
    late = np.flatnonzero(~(errors <= 1e-12 * np.abs(values)))
    if len(late):
        slope = np.zeros(len(values))
        ends = [0, 3 + len(chi), len(state), len(state) + of_vehicle]
        for inputs in map(range, ends, ends[1:]):  # few inputs first: they often suffice
            slope += condition.slopes(outputs, x, inputs)
            late = [m for m in late if not errors[m] <= condition.allowed(values[m], slope[m])]
            if not late:
                return
        m = late[0]
        units = errors[m] / (condition.EPS * slope[m]) if slope[m] else math.inf
        pytest.fail(f"component {m}: {found[m]!r} for {values[m]!r}, {units:.3g} eps cond away")


@pytest.mark.parametrize("wheels, rollers, model", [
    (2 + k % 5, rollers, model) for k, (rollers, model) in enumerate(itertools.product(ROLLERS, MODELS))
])  # fmt: skip
def test_random_states(wheels, rollers, model):
    rng = np.random.default_rng([wheels, rollers, MODELS.index(model)])
    for _ in range(4):
        vehicle = random_vehicle(rng, wheels, rollers)
        check(vehicle, *random_state(rng, vehicle), model)


@pytest.mark.parametrize("model", MODELS)
def test_the_papers_vehicle(model):
    """Its wheels stand on a regular polygon: many sums over the wheels cancel."""
    rng = np.random.default_rng([2, MODELS.index(model)])
    exact_vehicle = paper_vehicle()
    fields = {k: v for k, v in exact_vehicle.fields().items() if k not in ("wheels", "wheel_angles")}
    vehicle = type(exact_vehicle)(**fields, wheel_angles=tuple(float(a) for a in exact_vehicle.wheel_angles))
    for _ in range(10):
        check(vehicle, *random_state(rng, vehicle), model, of_vehicle=vehicle.wheels)


@pytest.mark.parametrize("model", ["locked", "free"])
@pytest.mark.parametrize("margin", [1e-2, 1e-3, 1e-4, 1e-6, 1e-9, 1e-12])
def test_rollers_nearly_pointed(margin, model):
    """At the joint the contact point comes as near to the roller's axis as `margin` wheel radii."""
    rng = np.random.default_rng([3, MODELS.index(model)])
    for wheels, rollers in ((2, 3), (3, 5), (4, 12)):
        largest = math.cos(math.pi / rollers)
        vehicle = random_vehicle(rng, wheels, rollers)
        vehicle = vehicle.with_(roller_axis_radius=vehicle.wheel_radius * (largest - margin))
        nu, chi, spins = random_state(rng, vehicle)
        for distance in (1e-2, 1e-6, 0.0):
            chi[0] = math.pi / rollers * (1 - distance)
            check(vehicle, nu, chi, spins, model, of_vehicle=wheels + 2)


@pytest.mark.parametrize("model", MODELS)
def test_special_states(model):
    """One speed at a time, wheels at the middle or at the joints of their rollers, rollers at rest."""
    rng = np.random.default_rng([4, MODELS.index(model)])
    vehicle = random_vehicle(rng, 4, 5)
    spins = rng.normal(size=(4, 4))
    joint = math.pi / 5
    for nu in (*np.eye(3), np.array([1.0, 0.0, 1.0]), np.array([1e-8, 1.0, 1e8])):
        for chi in (np.zeros(4), np.array([joint, -joint, 0.0, joint])):
            for rest in (spins, np.zeros_like(spins)):
                check(vehicle, nu, chi, rest, model)

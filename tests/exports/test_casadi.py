"""The exported function in CasADi, as a solver takes it: values, Jacobians, and generated code that calls it."""

import subprocess
from functools import cache

import numpy as np
import pytest
from pages import blocks, page

import omniroll
from omniroll.errors import InvalidValueError
from omniroll.exchange.casadi_function import casadi_files, to_casadi

casadi = pytest.importorskip("casadi", reason="casadi is not installed: make test-exports installs it")

PAPER = omniroll.Vehicle.paper()
MOTOR = omniroll.Motor(voltage=0, torque_constant=0.02, resistance=1.5, gear_ratio=4)
FRICTION = omniroll.Bearings(wheel_viscous=1e-3, wheel_coulomb=2e-3, wheel_speed=0.5, roller_viscous=1e-5)
CASES = {
    "massless": (PAPER, {"roller_model": "massless", "effects": [MOTOR]}),
    "locked": (omniroll.Vehicle.paper(4), {"roller_model": "locked"}),
    "slope": (PAPER, {"roller_model": "locked", "effects": [omniroll.Slope(angle=0.2, direction=0.3), MOTOR]}),
    "free": (PAPER, {"roller_model": "free", "effects": [MOTOR]}),
    "friction": (PAPER, {"roller_model": "free", "effects": [FRICTION]}),
}
CLOSE = 1e-13


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """The library of a case, made once."""
    return cache(lambda case: to_casadi(CASES[case][0], tmp_path_factory.mktemp(case), **CASES[case][1]))


def state(vehicle, free):
    rng = np.random.default_rng(3)
    chi = rng.uniform(-0.5, 0.5, vehicle.wheels) * np.pi / vehicle.rollers_per_wheel
    spins = {"spins": rng.normal(size=(vehicle.wheels, vehicle.rollers_per_wheel - 1))} if free else {}
    return {"nu": rng.normal(size=3), "chi": chi, "pose": rng.normal(size=3)} | spins


def close(found, wanted):
    assert np.abs(np.asarray(found) - wanted).max() <= CLOSE * max(1, np.abs(wanted).max())


@pytest.mark.parametrize("case", CASES)
def test_it_is_the_linear_model_and_the_accelerations(case, library):
    """Rates, A and B as the Python kernel's derivatives have them, in the same order of states."""
    vehicle, options = CASES[case]
    rates = casadi.external("rates", str(library(case)))
    at = state(vehicle, options.get("roller_model") == "free")
    model = omniroll.linearise(vehicle, **at, **options)
    x, u = casadi.MX.sym("x", len(model.state)), casadi.MX.sym("u", vehicle.wheels)
    x_dot = rates(x, u)
    every = casadi.Function("every", [x, u], [x_dot, casadi.jacobian(x_dot, x), casadi.jacobian(x_dot, u)])
    found = every(model.state, model.input)
    close(found[0].full()[:, 0], model.rates)
    close(found[1].full(), model.A)
    close(found[2].full(), model.B)
    at = model.state, model.input
    along = rates.forward(1)(*at, rates(*at), *at)
    close(along.full()[:, 0], model.A @ model.state + model.B @ model.input)


def hessian_of(rates, size, wheels):
    """The Hessian of a weighted sum of rates by x and u, as a solver takes that of a Lagrangian."""
    at, weights = casadi.MX.sym("at", size + wheels), casadi.MX.sym("weights", size)
    sum_of_rates = casadi.dot(weights, rates(at[:size], at[size:]))
    return casadi.Function("hessian", [at, weights], [casadi.hessian(sum_of_rates, at)[0]])


@pytest.mark.parametrize("case", CASES)
def test_hessians(case, library):
    """Of a Lagrangian: the second derivatives of linearise, which tests/test_linearisation.py holds to differences."""
    vehicle, options = CASES[case]
    rates = casadi.external("rates", str(library(case)))
    at = state(vehicle, options.get("roller_model") == "free")
    model = omniroll.linearise(vehicle, **at, **options, hessians=True)
    size, weights = len(model.state), np.random.default_rng(5).normal(size=len(model.state))
    hessian, point = hessian_of(rates, size, vehicle.wheels), np.concatenate([model.state, model.input])
    found = hessian(point, weights).full()
    close(found, np.einsum("k, kij -> ij", weights, model.hessians))


def test_the_predictive_controller_of_the_page(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (*_, program), (printed,) = (blocks(language, page("docs/exports.md")) for language in ("py", "text"))
    exec(program, {})
    assert capsys.readouterr().out == printed


def test_generated_code_that_calls_it_compiles_and_runs(tmp_path, library, monkeypatch):
    """A step of Runge and Kutta with its Jacobian, written as C by CasADi: acados compiles and links such files."""
    vehicle, options = CASES["massless"]
    rates, folder = casadi.external("rates", str(library("massless"))), library("massless").parent
    x, u, h = casadi.MX.sym("x", 9), casadi.MX.sym("u", 3), 0.01
    k1 = rates(x, u)
    k2 = rates(x + h / 2 * k1, u)
    k3 = rates(x + h / 2 * k2, u)
    end = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(x + h * k3, u))
    step = casadi.Function("step", [x, u], [end, casadi.jacobian(end, x), casadi.jacobian(end, u)])
    monkeypatch.chdir(tmp_path)
    step.generate("step.c")
    made = tmp_path / "step.so"
    sources = [tmp_path / "step.c", folder / "rates.c", folder / "omniroll.c"]
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", *sources, "-I", folder, "-lm", "-o", made], check=True)
    compiled = casadi.external("step", str(made))
    given = [0.3, 0.2, 1.0, 0.1, -0.2, 0.05, 0, 0, 0.4], [1.0, -2.0, 0.5]
    for one, other in zip(compiled(*given), step(*given), strict=True):
        close(one.full(), other.full())
    run = omniroll.simulate(
        vehicle, nu=given[0][:3], chi=given[0][3:6], pose=given[0][6:], duration=h, roller_model="massless",
        effects=[omniroll.Motor(voltage=given[1], torque_constant=0.02, resistance=1.5, gear_ratio=4)],
    )  # fmt: skip
    wanted = np.concatenate([run.nu[-1], run.chi[-1], run.pose[-1]])
    assert compiled(*given)[0].full()[:, 0] == pytest.approx(wanted, abs=1e-9)


def test_what_is_refused(tmp_path):
    with pytest.raises(InvalidValueError, match="identifier"):
        to_casadi(PAPER, tmp_path / "no", name="3rates")
    coulomb = omniroll.Bearings(roller_coulomb=1e-4, roller_speed=1.0)
    with pytest.raises(InvalidValueError, match="state"):
        casadi_files(PAPER, effects=[coulomb])
    with pytest.raises(InvalidValueError, match="wheels that roll"):
        casadi_files(PAPER, effects=[omniroll.Contact(100.0)])
    assert not (tmp_path / "no").exists()

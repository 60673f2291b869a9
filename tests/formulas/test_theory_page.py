"""docs/theory.md: its formulas of M* and f, of no slip, of the brackets and of the impulse have the values of the
generated kernels and equations; its example prints what it says.

A formula is checked where the line before it says <!-- checked: name -->.
"""

import json
import re

import numpy as np
import pytest
from latex_value import Evaluator
from oracle.bridge import project_vehicle
from oracle.states import ordinary_vehicle, random_state
from pages import ROOT, blocks, page

from codegen.mathtext import Reader, text_of
from omniroll.kernels.kernel import kernel

PAGE = page("docs/theory.md") + page("docs/theory-motions.md")
EQUATIONS = json.loads((ROOT / "generated/data/equations.json").read_text(encoding="utf-8"))["equations"]
CLOSE = 1e-11


def checked_formulas() -> dict[str, dict[str, str]]:
    """{name of the block: {left side: right side}}, the left sides as plain text."""
    found = {}
    for name, block in re.findall(r"<!-- checked: ([^>]*) -->\n```math\n(.*?)\n```", PAGE, re.DOTALL):
        lines = re.sub(r"\\(begin|end)\{aligned\}|&", "", block).replace(r"\lbrace", r"\{").replace(r"\rbrace", r"\}")
        sides = (line.split("=", 1) for line in lines.split("\\\\"))
        found[name] = {text_of(Reader.read(left.strip())).replace(" ", ""): right.strip() for left, right in sides}
    return found


FORMULAS = checked_formulas()


class State:
    """What the evaluator asks of a vehicle: numbers, and one wheel's angle and direction."""

    def __init__(self, vehicle, nu, chi):
        names = {"M": "mass", "I_S": "yaw_inertia", "J": "wheel_inertia", "B": "roller_inertia", "Lambda": "yaw_scale",
                 "R": "platform_radius", "l": "wheel_radius", "r": "roller_axis_radius"}  # fmt: skip
        self.numbers = {symbol: getattr(vehicle, name) for symbol, name in names.items()}
        self.wheels, self.rollers = vehicle.wheels, vehicle.rollers_per_wheel
        self.nu, self.chi, self.alphas = np.asarray(nu), chi, vehicle.wheel_angles
        self.theta = self.kappa_1 = 0.0
        self.rates = np.full(self.wheels, np.nan)  # the page says what the wheels' rates are

    def place(self, wheel: int) -> int:
        return wheel


class PageEvaluator(Evaluator):
    """The page's formulas: a symbol of a wheel is what the page defines it as, or a given number of each wheel."""

    def __init__(self, state: State, blocks: list[str], given: dict[str, np.ndarray]):
        super().__init__(state, extra={"theta'": state.nu[2] / state.numbers["Lambda"]})
        self.definitions = {left: right for block in blocks for left, right in FORMULAS[block].items()}
        self.given = given

    def known(self, text: str):
        if "i" in self.index and text in self.given:
            return self.given[text][self.index["i"]]
        if text in self.definitions and text.endswith("_i"):
            return self(self.definitions[text])
        return super().known(text)

    def of(self, left: str) -> float:
        return float(self(self.definitions[left]))

    def of_wheels(self, left: str) -> np.ndarray:
        values = []
        for wheel in range(self.vehicle.wheels):
            self.index = {"i": wheel}
            values.append(self.of(left))
        self.index = {}
        return np.array(values)


@pytest.fixture(params=range(6))
def case(request):
    """(omniroll.Vehicle, nu, chi, spins, State) at random, the wheels in any directions."""
    rng = np.random.default_rng([27, request.param])
    vehicle = ordinary_vehicle(rng, *[(1, 3), (2, 3), (3, 5), (3, 4), (4, 7), (5, 12)][request.param])
    nu, chi, spins = random_state(rng, vehicle, filled=0.9)
    found = project_vehicle(vehicle)
    nu, chi, spins = (np.array(values, float) for values in (nu, chi, spins))
    return found, nu, chi, spins, State(found, nu, chi)


def evaluator(case, roller_model: str) -> tuple[PageEvaluator, object, tuple]:
    """The page's formulas for a roller model; the Python kernel; what it takes beside nu and chi."""
    vehicle, nu, chi, spins, state = case
    bound, given, inputs = kernel(vehicle, roller_model, "python"), {}, ()
    if roller_model == "free":
        momenta = bound.call("momenta", bound.call("axial_speeds", nu, chi, spins))
        given, inputs = {"H_i^c": momenta[:, 0], "H_i^s": momenta[:, 1]}, (momenta,)
    blocks = ["rolling", "matrix, locked", "numbers of a wheel", f"momentum along the ground, {roller_model}", "forces",
              f"force 3, {roller_model}"] + ["matrix, free"] * (roller_model == "free")  # fmt: skip
    return PageEvaluator(state, blocks, given), bound, inputs


def assert_close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=CLOSE, atol=CLOSE * np.abs(expected).max())


def test_rates_of_wheels_and_rollers(case):
    page, bound, _ = evaluator(case, "locked")
    chi_dot, contact_spin = bound.wheel_rates(case[1], case[2])
    assert_close(page.of_wheels("chi'_i"), chi_dot)
    assert_close(page.of_wheels("phi'_i"), contact_spin)


@pytest.mark.parametrize("roller_model", ["locked", "free"])
def test_mass_matrix(case, roller_model):
    page, bound, _ = evaluator(case, roller_model)
    upper = {(a, b): page.of(f"m_{a + 1}{b + 1}^*") for a in range(3) for b in range(a, 3)}
    found = [[upper[min(a, b), max(a, b)] for b in range(3)] for a in range(3)]
    assert_close(found, bound.mass_matrix(case[2]))


@pytest.mark.parametrize("roller_model", ["locked", "free"])
def test_forces(case, roller_model):
    page, bound, inputs = evaluator(case, roller_model)
    assert_close([page.of(f"f_{k}") for k in (1, 2, 3)], bound.forces(case[1], case[2], *inputs))


def value(expression, numbers: dict) -> float:
    """An expression of equations.json. numbers: those of the vehicle, and under "wheels" those of each wheel."""
    if isinstance(expression, str):
        return numbers[expression]
    if not isinstance(expression, list):
        return float(expression)
    name, *arguments = expression
    if name == "sum_i":
        return sum(value(arguments[0], numbers | own) for own in numbers["wheels"])
    values = [value(argument, numbers) for argument in arguments]
    return {"+": np.sum, "*": np.prod, "^": lambda v: v[0] ** v[1], "sin": lambda v: np.sin(v[0]),
            "cos": lambda v: np.cos(v[0])}[name](values)  # fmt: skip


def derived(case, name: str, **more) -> float:
    """An equation of the vehicle."""
    state = case[4]
    numbers = state.numbers | {"theta": 0.3} | {f"nu_{k + 1}": float(v) for k, v in enumerate(state.nu)}
    numbers["wheels"] = [
        {"chi": chi, "alpha": float(alpha), "rho": numbers["l"] * np.cos(chi) - numbers["r"]}
        | {symbol: values[wheel] for symbol, values in more.items()}
        for wheel, (chi, alpha) in enumerate(zip(map(float, state.chi), state.alphas, strict=True))
    ]
    return value(next(equation["expr"] for equation in EQUATIONS if equation["id"] == name), numbers)


def test_brackets(case):
    page = PageEvaluator(case[4], ["rolling", "numbers of a wheel"], {})
    found = [float(page(right)) for right in FORMULAS["brackets"].values()]
    assert_close(found, [derived(case, name) for name in ("PP12", "PP13", "PP23")])


def test_impulse(case):
    rng = np.random.default_rng(5)
    entering, leaving = rng.normal(size=(2, case[4].wheels))
    page = PageEvaluator(case[4], ["rolling", "impulse"], {"u_i^+": entering, "u_i^-": leaving})
    found = [page.of(f"I_{k}") for k in (1, 2, 3)]
    assert_close(found, [derived(case, f"impact:{k}", entering=entering, leaving=leaving) for k in (1, 2, 3)])


def test_the_example_prints_what_the_page_says(capsys):
    example, printed = (blocks(language, PAGE)[0] for language in ("python", "text"))
    exec(example, {})
    assert capsys.readouterr().out == printed

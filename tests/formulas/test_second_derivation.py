"""Verdicts against a second derivation, in numbers: the print's LaTeX is evaluated as it is shown, and compared with
mechanics that shares nothing with maxima/. A test of the verdicts, not where they come from.
"""

import json
from collections.abc import Callable

import numpy as np
import pytest
from latex_value import Evaluator
from maxima_session import ROOT
from numeric_vehicle import NumericVehicle

from codegen.mathtext import Matrix, Reader

RECORDS = {r["id"]: r for r in json.loads((ROOT / "generated/formulas/formulas.json").read_text())["formulas"]}
ANYWHERE = np.array([0.3, 1.9, 2.4, 4.0])
CENTRED = np.array([0.3, 0.3 + np.pi, 2.4, 2.4 + np.pi])
ASSUMPTIONS = {  # kappa_1, wheels; the first that suffices is the verdict's
    (): (0.4, ANYWHERE),
    ("kappa_1",): (0.0, ANYWHERE),
    ("sum",): (0.4, CENTRED),
    ("kappa_1", "sum"): (0.0, CENTRED),
}
WHEEL, ROLLER = 1, 2
Check = Callable[[NumericVehicle, str], tuple[object, object]]  # printed, derived


def side(number: int, derived: Callable, *, summed: bool = False, momenta: bool = False) -> Check:
    """The side of the printed equation with that number, for wheel 1 or roller (1, 2) where it has an index."""

    def check(v, latex):
        evaluator = Evaluator(v, v.p if momenta else None, {"i": WHEEL, "k": WHEEL, "s": (WHEEL, ROLLER)})
        latex = latex.replace(r"\frac{\partial\mathcal{M}^*}{\partial\chi_i}", r"\mathcal{M}_i^*")
        node = evaluator.sides(latex)[number]
        if summed:
            return sum(as_number(Evaluator(v, None, {"i": i}).value(node)) for i in range(v.wheels)), derived(v)
        return evaluator.value(node), derived(v)

    return check


def as_number(value: object) -> float:
    return float(np.asarray(value).item())


def entry(a: int, b: int) -> Check:
    return side(-1, lambda v: v.Ms0[a, b])


def momentum(place: Callable) -> Check:
    return side(-1, lambda v: v.star[place(v)])


def combination(a: int) -> Check:
    return side(-1, lambda v: v.P(v.p)[a], momenta=True)


def bracket(a: int, b: int) -> Check:
    """The starred middle and the right side, both against {P_a, P_b}*; tables S are evaluated from their own LaTeX."""

    def check(v, latex):
        tables = {}
        for group, entries in (("1", "123"), ("2", "123"), ("3", "123")):
            for k in entries:
                printed = RECORDS[f"7:S{group}:{k}"]["printed"]
                tables[f"S_{k}^{group}"] = Evaluator(v).value(Evaluator(v).sides(printed)[1])
        evaluator = Evaluator(v, None, {}, tables)
        values = [evaluator.value(node) for node in evaluator.sides(latex)[1:3]]
        return values, [v.bracket(a, b, v.star)] * 2

    return check


def row(a: int, b: int, platform: Callable) -> Check:
    """The row p_ab, from {P_a, P_b}* = platform - B R^2 p_ab nu."""

    def check(v, latex):
        found = Evaluator(v).tuple(Evaluator(v).sides(latex)[-1])
        unit = lambda k: np.eye(len(v.nu))[k]  # noqa: E731
        scale = v.numbers["B"] * v.numbers["R"] ** 2
        starred = lambda nu: v.bracket(a, b, (v.Mq(v.q) @ v.V(v.q) @ nu).real)  # noqa: E731
        wanted = [-(starred(unit(k)) - platform(v, unit(k))) / scale for k in range(3)]
        return found[:3], wanted

    return check


def table(a: int, b: int, k: int) -> Check:
    def check(v, latex):
        c = v.numbers
        starred = v.bracket(a, b, (v.Mq(v.q) @ v.V(v.q) @ np.eye(len(v.nu))[k]).real)
        scale = (
            c["B"] * c["R"] ** 2 * (c["R"] if k < 2 else 1 / c["Lambda"]) * (1 if (a, b) == (0, 1) else 1 / c["Lambda"])
        )
        evaluator = Evaluator(v)
        return evaluator.value(evaluator.sides(latex)[1]), -starred / scale

    return check


def matrix_V(v, latex):
    node = next(i for i in Reader.read(latex).items if isinstance(i, Matrix))
    cells = Evaluator(v, None, {"i": WHEEL, "k": WHEEL}).matrix(
        Matrix("matrix", tuple(tuple(cell for cell in row[:3]) for row in node.rows[:5]))
    )
    places = [0, 1, 2, v.place(WHEEL), v.place(WHEEL, 0)]
    return cells, v.V0[places, :3]


def third_group(v, latex):
    """The part of {P_a, nu_mu P_mu}* without the platform's momentum, at nu = (0, 0, nu_3, 0)."""
    nu = np.where(np.arange(len(v.nu)) == 2, v.nu, 0)
    p = (v.Mq(v.q) @ v.V(v.q) @ nu).real
    p[:2] = 0
    wanted = [nu[2] * v.bracket(a, 2, p) for a in range(2)]
    weight = [np.sin(x) ** 2 / Evaluator(v).rho(i) ** 2 for i, x in enumerate(v.chi)]
    factor = -v.numbers["B"] * v.numbers["R"] ** 2 if "BR^2" in latex else 1
    scale = factor * nu[2] ** 2 / v.numbers["Lambda"] ** 2
    return [scale * (f(v.alphas) @ weight) for f in (np.cos, np.sin)], wanted


def equations(group: int, todo: int) -> Check:
    """(3.4), every row: sign of the group of brackets with L*, factor of the term that the paper leaves to do."""

    def check(v, latex):
        c, nu = v.numbers, v.nu
        force = np.zeros(len(nu))
        turning = [-np.sin(v.alphas), np.cos(v.alphas), np.full(v.wheels, 1 / c["Lambda"])]
        for a in range(3):
            force[a] = (
                group * c["R"] / (2 * c["l"]) * sum(t * (nu @ Mi @ nu) for t, Mi in zip(turning[a], v.Mi, strict=True))
            )
            force[a] += sum(nu[b] * v.bracket(a, b, v.star) for b in range(3))
        force += todo * sum(v.rates[v.place(i)] * (Mi @ nu) for i, Mi in enumerate(v.Mi))
        return force, v.force

    return check


AS_PRINTED, CORRECTED = equations(1, 0), equations(-1, -1)
POWER = lambda v: sum(v.nu[a] * v.PL(a) for a in range(3))  # noqa: E731
CHECKS: dict[str, Check] = {
    "2.2": side(1, lambda v: v.rates[v.place(WHEEL)]),
    "V": matrix_V,
    "3.3:P1": combination(0), "3.3:P2": combination(1), "3.3:P3": combination(2),
    "7.3:P1": combination(0), "7.3:P2": combination(1), "7.3:P3": combination(2),
    "3.3:Ps": side(-1, lambda v: v.P(v.p)[v.speed_place(WHEEL, ROLLER)], momenta=True),
    "7.3:Ps": side(-1, lambda v: v.P(v.p)[v.speed_place(WHEEL, ROLLER)], momenta=True),
    "PL:1": side(-1, lambda v: v.PL(0), summed=True), "PL:2": side(-1, lambda v: v.PL(1), summed=True),
    "PL:3": side(-1, lambda v: v.PL(2), summed=True),
    "3.4": AS_PRINTED,
    "property:1:PL": side(-1, POWER, summed=True),
    "property:3:third-group": third_group,
    "7.1:m11": entry(0, 0), "7.1:m22": entry(1, 1), "7.1:m33": entry(2, 2),
    "7.1:m12": entry(0, 1), "7.1:m13": entry(0, 2), "7.1:m23": entry(1, 2),
    "7.2:p_x": momentum(lambda v: 0), "7.2:p_y": momentum(lambda v: 1), "7.2:p_theta": momentum(lambda v: 2),
    "7.2:p_chi": momentum(lambda v: v.place(WHEEL)), "7.2:p_phi_k": momentum(lambda v: v.place(WHEEL, 0)),
    "7.2:p_phi_s": momentum(lambda v: v.place(WHEEL, ROLLER)),
    "7:PP12": bracket(0, 1), "7:PP13": bracket(0, 2), "7:PP23": bracket(1, 2),
    "7:S1": bracket(0, 1), "7:S2": bracket(0, 2), "7:S3": bracket(1, 2),
    "7:p12": row(0, 1, lambda v, nu: 0),
    "7:p13": row(0, 2, lambda v, nu: v.numbers["M"] * v.numbers["R"] ** 2 / v.numbers["Lambda"] * nu[1]),
    "7:p23": row(1, 2, lambda v, nu: -v.numbers["M"] * v.numbers["R"] ** 2 / v.numbers["Lambda"] * nu[0]),
    **{f"7:S{g}:{k + 1}": table(a, b, k) for g, (a, b) in enumerate(((0, 1), (0, 2), (1, 2)), 1) for k in range(3)},
}  # fmt: skip


def agrees(check: Check, latex: str, kappa_1: float, alphas: np.ndarray, seed: int) -> bool:
    vehicle = NumericVehicle(np.random.default_rng(seed), alphas, 5, kappa_1)
    if r"\sigma_s" in latex:
        vehicle.numbers["sigma_s"] = np.sin(vehicle.chi[WHEEL] + vehicle.kappa[ROLLER])
    printed, derived = check(vehicle, latex)
    printed, derived = np.asarray(printed, float), np.asarray(derived, float)
    return np.abs(printed - derived).max() <= 1e-10 * max(1.0, np.abs(derived).max())


def found_assumptions(check: Check, latex: str) -> tuple[str, ...] | None:
    """The first set of assumptions under which print and derivation have the same numbers, or None."""
    for names, (kappa_1, alphas) in ASSUMPTIONS.items():
        if all(agrees(check, latex, kappa_1, alphas, seed) for seed in (1, 2)):
            return names
    return None


def recorded(record: dict) -> tuple[str, ...] | None:
    if record["verdict"] == "misprint":
        return None
    return tuple(dict.fromkeys(a["text"].split(" ")[0] for a in record["assumptions"]))


@pytest.mark.parametrize("name", CHECKS)
def test_verdict(name):
    record = RECORDS[name]
    assert found_assumptions(CHECKS[name], record["printed"]) == recorded(record)


@pytest.mark.parametrize("name", [n for n in CHECKS if RECORDS[n]["verdict"] == "misprint"])
def test_correction(name):
    check = CORRECTED if name == "3.4" else CHECKS[name]
    assert found_assumptions(check, RECORDS[name]["corrected"]["latex"]) is not None


def test_spin_of_the_contact_roller():
    """(2.1) by the geometry of a contact roller at chi + kappa_1: it needs kappa_1 = 0."""
    latex = RECORDS["2.1"]["printed"].split(r", \quad")[0]
    for kappa_1, holds in ((0.0, True), (0.2, False)):
        v = NumericVehicle(np.random.default_rng(3), ANYWHERE, 5, kappa_1, tilted=True)
        evaluator = Evaluator(v, None, {"k": WHEEL})
        printed = evaluator.value(evaluator.sides(latex)[1])
        assert np.isclose(printed, v.rates[v.place(WHEEL, 0)], rtol=1e-12) == holds


SHOWN = [name for name in CHECKS if RECORDS[name]["verdict"].startswith("agrees") and name != "V"]


@pytest.mark.parametrize("name", [n for n in SHOWN if n[:3] not in ("3.4", "7:p")])
def test_derived_latex_has_the_derived_numbers(name):
    """What the page shows as derived, evaluated like the print."""
    v = NumericVehicle(np.random.default_rng(4), ANYWHERE, 5, 0.3)
    _, derived = CHECKS[name](v, RECORDS[name]["printed"])
    momenta = v.p if name[:3] in ("3.3", "7.3") else None
    evaluator = Evaluator(v, momenta, {"i": WHEEL, "k": WHEEL, "s": (WHEEL, ROLLER)})
    shown = evaluator.value(evaluator.sides(RECORDS[name]["derived"])[1])
    assert np.isclose(as_number(shown), derived, rtol=1e-10)

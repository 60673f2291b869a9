"""LaTeX of the derived equations: it can be read, and has the numbers of the second derivation."""

import json

import numpy as np
import pytest
from latex_value import Evaluator
from maxima_session import ROOT
from numeric_vehicle import NumericVehicle

from codegen.equation import main
from codegen.expressions import Canonical, Order
from codegen.latex import Latex, symbol_names
from codegen.mathtext import Reader

DATA = ROOT / "generated/data"
EQUATIONS, SYMBOLS = (json.loads((DATA / f"{name}.json").read_text()) for name in ("equations", "symbols"))
LATEX = Latex(symbol_names(SYMBOLS["symbols"], EQUATIONS))
READ = Canonical(Order(SYMBOLS["symbols"])).read
RECORDS = {entry["id"]: entry for part in ("equations", "equations_more") for entry in EQUATIONS[part]}
OVER_ROLLERS = (r"\sum_{i=1}^{N} \sum_{j=2}^{n}", r"\sum_{s}")  # as the reader of the paper's formulas has it
PAIRS = ((1, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 3))
TRUE = {
    **{f"7.1:{a}{b}": lambda v, a=a, b=b: v.Ms0[a - 1, b - 1] for a, b in PAIRS},
    **{f"7.2:{k}": lambda v, k=k: v.star[k - 1] for k in (1, 2, 3)},
    **{f"3.3:{k}": lambda v, k=k: v.P(v.p)[k - 1] for k in (1, 2, 3)},
    **{f"PP{a}{b}": lambda v, a=a, b=b: v.bracket(a - 1, b - 1, v.star) for a, b in ((1, 2), (1, 3), (2, 3))},
    **{f"PL:{k}": lambda v, k=k: v.PL(k - 1) for k in (1, 2, 3)},
    **{f"3.4:{k}": lambda v, k=k: v.force[k - 1] for k in (1, 2, 3)},
}  # fmt: skip


@pytest.mark.parametrize("name", RECORDS)
def test_it_is_mathematics(name):
    entry, e = RECORDS[name], READ(RECORDS[name]["expr"])
    Reader.read(f"{entry['left']} = {LATEX.expression(e)}")
    assert all(line.count("{") == line.count("}") for line in LATEX.lines(e))


@pytest.mark.parametrize("name", TRUE)
def test_it_has_the_numbers_of_the_second_derivation(name):
    v = NumericVehicle(np.random.default_rng(7), np.array([0.3, 1.9, 2.4, 4.0]), 5)
    text = LATEX.expression(READ(RECORDS[name]["expr"])).replace(*OVER_ROLLERS)
    value = Evaluator(v, v.p if name.startswith("3.3") else None, {})(text)
    np.testing.assert_allclose(float(np.asarray(value).item()), TRUE[name](v), rtol=1e-10, atol=1e-12)


def test_one_equation_on_request(capsys):
    assert main(["7.1:23", "V"]) == 0
    told = capsys.readouterr().out
    assert told.startswith(r"m^*_{23} = \sum_{i=1}^{N} \left(") and r"V = \begin{pmatrix}" in told
    assert main(["7.1:99"]) == 2 and "no equation 7.1:99" in capsys.readouterr().err
    assert main([]) == 0 and len(capsys.readouterr().out.splitlines()) == len(RECORDS) + len(EQUATIONS["matrices"])

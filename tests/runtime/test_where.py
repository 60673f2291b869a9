"""`omniroll where`: each symbol, function and effect has a way whose lines say what it claims."""

import json
import re
from pathlib import Path

import pytest

from omniroll import InvalidValueError, cli, generated_data
from omniroll.kernels.origins import STATIONS, way

ROOT = Path(__file__).parents[2]
SYMBOLS = generated_data.load("symbols")["symbols"]
FUNCTIONS = sorted({f["name"] for f in generated_data.load("programs")["functions"]})
FORMULAS = json.loads((ROOT / "generated/formulas/formulas.json").read_text(encoding="utf-8"))["formulas"]
EFFECTS = [e["name"] for e in generated_data.load("effects")["effects"]]


def places(name):
    return [(station, place) for station, all_of in way(name).stations.items() for place in all_of]


def check(name):
    """The places are lines of files that there are; returns the stations that there are."""
    found = places(name)
    for _, place in found:
        file = ROOT / place.file
        assert file.is_file(), place
        assert 0 <= place.line <= len(file.read_text(encoding="utf-8").splitlines()), place
    return {station for station, _ in found}


@pytest.mark.parametrize("name", ["m13", "7.1:m13"])
def test_m13_in_five_hops(name):
    found = way(name)
    assert list(found.stations) == list(STATIONS) and len(STATIONS) == 5 and all(found.stations.values())
    texts = {station: " ".join(f"{p.file} {p.text}" for p in found.stations[station]) for station in STATIONS}
    assert "(7.1:m13)" in texts["paper"]
    assert (
        "maxima/paper/kinetic_energy.mac Mstar:" in texts["derivation"]
        and "proved: free wheel, matrix" in texts["derivation"]
    )
    assert "steps row_matrix, from maxima/forms/system.mac" in texts["data"]
    assert re.search(r"generated/c/free\.c m13 \+=", texts["code"]) and "generated/python/free.py m13" in texts["code"]
    assert "runtime/csrc/step/collocation.c core_rates(" in texts["engine"]


@pytest.mark.parametrize("symbol", SYMBOLS)
def test_every_symbol_of_the_table(symbol):
    stations = check(symbol)
    assert stations & {"paper", "derivation"}, "nobody says where it comes from"
    code = re.sub(r"[\[({].*", "", SYMBOLS[symbol]["code"])
    if code and not symbol.startswith("p_"):  # formal momenta are of the derivation alone
        assert stations & {"code", "data"} or symbol in ("kappa", "arm", "omega", "nu_s"), "nobody says what it became"
    shown = way(f"${SYMBOLS[symbol]['latex']}$").stations
    assert shown["paper"] or shown["derivation"]


NAMES = {  # and the stations that each must have
    **{record["id"]: {"paper"} for record in FORMULAS},
    **{record["equation"]: {"paper", "derivation"} for record in FORMULAS if record["equation"]},
    **dict.fromkeys(FUNCTIONS, {"derivation", "code"}),
    **dict.fromkeys(EFFECTS, {"derivation", "data"}),
}


@pytest.mark.parametrize("name", NAMES)
def test_every_formula_equation_function_and_effect(name):
    assert NAMES[name] <= check(name)


# Read in the paper: the first formula that a symbol stands in, and the file that derives or introduces the symbol.
FIRST = {
    "rho": ("2.1", "paper/constraints.mac"), "chi_dot": ("2.2", "paper/constraints.mac"),
    "nu_2": ("2:pose", "paper/constraints.mac"), "theta": ("2:q", "paper/constraints.mac"),
    "kappa": ("3.2", "paper/geometry.mac"), "I_S": ("3.2", "paper/parts.mac"),
    "m33": ("7.1:m33", "paper/kinetic_energy.mac"), "x": ("2:q", "paper/constraints.mac"),
    "p_phi": ("7.2:p_phi_k", "paper/momenta.mac"), "f3": ("3.1", "paper/equations.mac"),
    "chi_kl": ("section3:chi_kl", "paper/parts.mac"), "sigma": ("7:sigma", "programs/notation.mac"),
    "arm": (None, "paper/geometry.mac"), "omega": ("3.2", "paper/kinetic_energy.mac"),
}  # fmt: skip


@pytest.mark.parametrize("symbol", FIRST)
def test_a_way_begins_with_the_paper_and_the_line_that_introduces_the_symbol(symbol):
    formula, file = FIRST[symbol]
    stations = way(symbol).stations
    assert [place.text.partition(")")[0] for place in stations["paper"][:1]] == ([f"({formula}"] if formula else [])
    assert stations["derivation"][0].file == f"maxima/{file}"


SPELLED = {
    "m13": ("m*_13", "m^*_{13}", "$m^*_{13}$", "m_13^*"), "rho": (r"\rho_i", "rho_i", r"$\rho_k$", "rho_{k}"),
    "nu": (r"\nu", r"\boldsymbol\nu"), "nu_dot_1": (r"\dot\nu_1", "nu_1'", r"\dot{\nu}_1"), "couple": ("G_i", "G_{i}"),
    "Mstar": (r"\mathcal M^*", r"\mathcal{M}^*"), "Mq": (r"\mathcal{M}",), "f1": ("f_1", r"\mathbf f_1"),
    "phi_dot": ("phi'_k", r"\dot\phi_i"), "Lambda": (r"\Lambda", "yaw_scale"), "chi": (r"\chi_i", "chi_k"),
}  # fmt: skip


@pytest.mark.parametrize(("symbol", "spelling"), [(own, text) for own, texts in SPELLED.items() for text in texts])
def test_a_symbol_in_the_spellings_of_paper_latex_and_code(symbol, spelling):
    assert way(spelling).stations == way(symbol).stations


def test_a_way_fits_a_screen(capsys):
    for name in ("m13", "3.4", "rho", "forward_dynamics"):
        assert cli.main(["where", name]) == 0
        assert len(capsys.readouterr().out.splitlines()) <= 32


def test_an_unknown_name_is_refused_with_what_is_near(capsys):
    with pytest.raises(InvalidValueError, match="forward_dynamics"):
        way("forward_dynamic")
    assert cli.main(["where", "forward_dynamic"]) == 2
    assert "nearest" in capsys.readouterr().err


def test_the_command_shows_the_way(capsys):
    assert cli.main(["where", "rho"]) == 0
    text = capsys.readouterr().out
    assert [f"{k}. {station}" in text for k, station in enumerate(STATIONS, 1)] == [True] * 5
    assert "maxima/paper/constraints.mac" in text and "rho_of_chi: ride*cos(chi)" in text
    assert cli.main(["where", "rho", "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)["stations"]) == set(STATIONS)


PRINTED = [
    r"\nu_\alpha", r"\dot{\mathbf{q}}", r"p_{\phi_{k1}}", "T", r"\chi^+", r"\chi_i^-", r"\mathbf{p}_{\alpha\beta}",
    r"\mathbf{e}_\xi", "OXY", "SZ", r"\mathbf{E}_{N(n-1)}", r"\mathcal{M}_i^*", r"m_{ij}^*", r"\sigma_s", r"\tau_k",
]  # fmt: skip

CODED = [code for entry in SYMBOLS.values() for code in entry["code"].split(", ") if code]


@pytest.mark.parametrize("spelled", [*PRINTED, *CODED])
def test_what_the_paper_writes_and_elements_of_arrays_have_a_way(spelled):
    assert way(spelled).stations

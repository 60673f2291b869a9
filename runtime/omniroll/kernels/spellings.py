"""What people type for a symbol, a formula or an equation: as the paper prints it, as LaTeX, as a name in the code.

m13, m*_13, m^*_{13}, 7.1:m13          an entry of the mass matrix
rho, rho_i, \\rho_i, $\\rho_k$            a symbol of each wheel, whichever index counts it
nu_1', nu_dot_1, \\dot\\nu_1             a rate
3.4, (3.4)                             an equation
"""

import re
from collections.abc import Iterable, Iterator

FONT = re.compile(r"\\(?:mathcal|mathbf|boldsymbol|mathrm)(?![A-Za-z])")
SPACES = re.compile(r"\\(?:left|right|quad)(?![A-Za-z])|\\[,;! ]|[\s{}\\^_]")
PRIME = re.compile(r"(\w+)'")
INDEX = re.compile(r"_(?:[ijkl]|\d|\{[ijklN\d, ]+\})(?=\Z|\^)")  # of a wheel, or of a roller on a wheel
ALSO = {  # what the paper writes of a symbol beside the spelling of the table
    r"\nu_\alpha": "nu", r"\nu_\mu": "nu", r"\dot{\mathbf{q}}": "q", r"\dot q_i": "q", "q_i": "q", "p_i": "p",
    r"p_{\phi_{k1}}": "p_phi", r"p_{\phi_k}": "p_phi", "T": "L", r"\chi^+": "joint", r"\chi^-": "joint",
    r"\chi_i^+": "joint", r"\chi_i^-": "joint", r"\mathbf{p}_{\alpha\beta}": "p_12_nu", r"\mathbf{e}_\xi": "xi",
    r"\mathbf{e}_\eta": "eta", "X": "x", "Y": "y", "OXY": "S", "O": "S", "Z": "theta", "SZ": "theta",
    r"\mathbf{E}_{N(n-1)}": "V",
}  # fmt: skip
ELEMENT = re.compile(r"(?:\[[\w, ]+\])+\Z")  # of an array in the code
EQUATION = re.compile(r"\(?(\d\.\d)\)?\Z")


def equation_number(text: str) -> str | None:
    """3.4 of 3.4 and (3.4)."""
    found = EQUATION.match(text.strip())
    return found[1] if found else None


def normal(text: str) -> str:
    """A spelling without what LaTeX and plain text write in different ways; fonts stay, a star stands last."""
    found = SPACES.sub("", PRIME.sub(r"dot\1", text))
    return found.replace("*", "") + "*" * found.count("*")


def candidates(text: str) -> Iterator[str]:
    """Normal spellings of a text, the most exact first: as it is, without fonts, without an index that counts."""
    text = text.strip("$` ")
    for shorter in (text, FONT.sub("", text)):
        yield normal(shorter)
    yield normal(INDEX.sub("", FONT.sub("", text)))


def table(spelled: Iterable[tuple[str, str]]) -> dict[str, str]:
    """{normal spelling: name} of (spelling, name); of two names that which is spelled more exactly, then the first."""
    pairs = [(tuple(candidates(spelling)), name) for spelling, name in spelled]
    known: dict[str, str] = {}
    for exactness in range(3):
        for found, name in pairs:
            known.setdefault(found[exactness], name)
    return known


def looked_up(text: str, known: dict[str, str], without_index: bool = True) -> str | None:
    """The name that a text spells."""
    found = list(candidates(text))[: 3 if without_index else 2]
    return next((known[spelling] for spelling in found if spelling in known), None)

"""The transcription's statements in maxima/comparison/printed_*.mac, and what one change makes of them."""

import re
from dataclasses import dataclass
from pathlib import Path

COMPARISON = Path(__file__).resolve().parents[2] / "maxima/comparison"
FILES = ("printed_section2", "printed_section3", "printed_section4", "printed_appendix")
INDICES = {
    "nu_1": "nu_2", "nu_2": "nu_3", "nu_3": "nu_1", "p_x": "p_y", "p_y": "p_x", "p_chi": "p_phi", "p_phi": "p_chi",
    "p_12_nu": "p_13_nu", "p_13_nu": "p_23_nu", "p_23_nu": "p_12_nu", "kappa": "kappa_1", "kappa_1": "kappa",
    "nu_s": "nu_1", "p_phi_s": "p_phi", "theta_dot": "chi_dot", "chi_dot": "phi_dot", "phi_dot": "chi_dot",
}  # fmt: skip
KINDS = ("sign", "factor", "index")


@dataclass(frozen=True)
class Mutant:
    """One changed statement of the formula `name`. kind: sign, factor, index."""

    name: str
    kind: str
    statement: str


def covered(text: str) -> str:
    """The text with comments and strings blanked out, of the same length."""
    return re.sub(r'/\*.*?\*/|"(?:\\.|[^"\\])*"', lambda found: " " * len(found[0]), text, flags=re.DOTALL)


def statements() -> list[str]:
    """Every statement of the transcription, without its final $ and the comments before it."""
    found = []
    for file in FILES:
        text = (COMPARISON / f"{file}.mac").read_text()
        bare, start = re.sub(r"/\*.*?\*/", lambda m: " " * len(m[0]), text, flags=re.DOTALL), 0
        for end in (m.start() for m in re.finditer(r"\$", covered(text))):
            found.append(bare[start:end].strip())
            start = end + 1
    return found


def printed_statements() -> dict[str, str]:
    """{id: the statement printed(...)}."""
    calls = (s for s in statements() if s.startswith("printed("))
    return {re.match(r'printed\("([^"]*)"', s)[1]: s for s in calls}


def table_entries() -> dict[str, str]:
    """{id: the statement S_k_a: ...} of the second set of tables."""
    entries = (re.match(r"S_(\d)_(\d):", s) for s in statements())
    return {f"7:S{m[2]}:{m[1]}": m.string for m in entries if m}


def expression_places(statement: str) -> int:
    """Where the components begin: after the fifth string of printed(...)."""
    return list(re.finditer(r'"(?:\\.|[^"\\])*"', statement))[4].end()


def mutants(name: str, statement: str, most: int = 4) -> list[Mutant]:
    """Up to `most` changes of each kind, spread over the expressions of printed(...) or of a table's entry."""
    start = expression_places(statement) if statement.startswith("printed(") else statement.index(":")
    changes: dict[str, list[str]] = {kind: [] for kind in KINDS}
    for found in re.finditer(r"(?<![\w%'])[A-Za-z]\w*\b(?![(\[])|[-+]", covered(statement)):
        if found.start() < start or found[0].endswith(("_names", "_")):
            continue
        for kind, new in changed_words(found[0]):
            changes[kind].append(statement[: found.start()] + new + statement[found.end() :])
    return [Mutant(name, kind, text) for kind, texts in changes.items() for text in spread(texts, most)]


def changed_words(word: str) -> list[tuple[str, str]]:
    """(kind, what stands for the word in the mutant)."""
    if word in "+-":
        return [("sign", "-" if word == "+" else "+")]
    changed = [("factor", f"(2*{word})")]
    if entry := re.fullmatch(r"S_(\d)_(\d)", word):
        changed.append(("index", f"S_{int(entry[1]) % 3 + 1}_{entry[2]}"))
    elif word in INDICES:
        changed.append(("index", INDICES[word]))
    return changed


def spread(items: list, most: int) -> list:
    """At most `most` of the items, evenly spread."""
    return items if len(items) <= most else [items[k * len(items) // most] for k in range(most)]

"""The comparison with the paper: records whose mathematics is written out, and the page that shows them."""

import re
from collections import Counter
from dataclasses import dataclass
from html import escape, unescape

from .derivation import Derivation
from .expressions import ZERO, Expression, Sum, negated, split_coefficient
from .infix import is_negative
from .latex import Latex
from .mathtext import GREEK, mathml, plain, prose

SECTIONS = {
    "2": "Section 2: statement of the problem",
    "3": "Section 3: equations of motion",
    "4": "Section 4: from roller to roller",
    "5": "Section 5: motions",
    "6": "Abstract and conclusion",
    "appendix": "Appendix",
}
MEANINGS = {
    "agrees": "what is printed is what is derived",
    "agrees-if": "it agrees under the assumption named",
    "misprint": "it is wrong; the corrected formula is proved equal to the derived one",
    "ambiguous": "the print can be read in more than one way, and the readings have different verdicts",
    "undefined": "the print uses a symbol that it never defines; with the meaning named it is right",
    "holds": "true in every case that the words cover",
    "holds-if": "true in some of these cases, which are named",
    "fails": "true in none of them, or not in the paper's own setting",
    "not judged": "it cannot be judged; the reason is named",
}
SUMS = {"platform": "", "wheel": r"\sum_i", "roller": r"\sum_s"}
PROSE = ("summary", "note", "title", "derived", "printed")


class NumberedLatex(Latex):
    """Symbols of single wheels and rollers besides: alpha_1, nu_2_3."""

    def symbol(self, name: str) -> str:
        if name in self.names:
            return self.names[name]
        stem, *indices = (rf"\{part}" if part in GREEK else part for part in name.split("_"))
        if len(stem) > 1 and not stem.startswith("\\"):
            return super().symbol(name)
        return f"{stem}_{{{','.join(indices)}}}"


@dataclass
class Comparison:
    """The derivation's part `formulas`, completed: LaTeX of every expression, plain text of all LaTeX."""

    derivation: Derivation

    def __post_init__(self) -> None:
        symbols = {name: entry["latex"] for name, entry in self.derivation.data["symbols"].items()}
        known = symbols | {"pi": r"\pi"} | self.derivation.data.get("formula_symbols", {})
        self.latex = NumberedLatex(known)

    def records(self) -> list[dict]:
        return [self.record(data) for data in self.derivation.part("formulas")]

    def record(self, data: dict) -> dict:
        shared = {key: data[key] for key in ("id", "kind", "verdict", "equation", "section", "title", "printed")}
        fill = {"formula": self.formula, "claim": self.claim, "unjudged": self.unjudged}[data["kind"]]
        return with_text(shared | fill(data) | {"note": data["note"], "run": data.get("run", "")})

    def formula(self, data: dict) -> dict:
        corrected, wrong = data["corrected"], data["counterexample"]
        made = {
            "derived": corrected["latex"] if corrected else data["derived_latex"] or self.shown(data),
            "difference": self.listed(data["difference"], ":"),
            "corrected": corrected,
            "assumptions": data["assumptions"],
            "meanings": [self.meaning(meaning) for meaning in data["meanings"]],
            "readings": data["readings"],
            "counterexample": self.counterexample(wrong) if wrong else None,
            "brute_force": data["brute_force"],
            "expressions": {"derived": data["derived"], "difference": data["difference"]},
        }
        return made | {"summary": summary(data["verdict"], made)}

    def meaning(self, data: dict) -> dict:
        return data | {"latex": f"{self.expression(data['symbol'])} = {self.expression(data['expr'])}"}

    def counterexample(self, data: dict) -> dict:
        return {
            "component": data["component"],
            "printed": self.expression(data["printed"]),
            "derived": self.expression(data["derived"]),
            "values": [f"{self.expression(name)} = {self.expression(value)}" for name, value in data["values"]],
        }

    def claim(self, data: dict) -> dict:
        cases = [self.case(case) for case in data["cases"]]
        true, false = (
            "; ".join(c["condition"] for c in cases if c["holds"] is holds and c["condition"])
            for holds in (True, False)
        )
        said = [f"{word} for: {which}" for word, which in (("True", true), ("False", false)) if which]
        left = next((c["residual"] for c in cases if not c["holds"] and c["residual"] not in ("", "0")), "")
        told = {"fails": f"fails: {false}", "holds-if": f"holds for: {true}"}
        return {
            "derived": ". ".join(said) or "True",
            "difference": left,
            "cases": cases,
            "summary": told.get(data["verdict"], "holds"),
        }

    def case(self, data: dict) -> dict:
        residual = data["residual"]
        return data | {"residual": "" if residual is None else self.expression(residual)}

    def unjudged(self, data: dict) -> dict:
        return {"derived": "", "difference": "", "summary": data["note"]}

    # Sums over wheels and rollers

    def shown(self, data: dict) -> str:
        if not data["shape"]:
            return self.listed(data["derived"], " =")
        cells = [self.parts(c["parts"]) for c in data["derived"]]
        rows, columns = map(int, data["shape"])
        lines = [" & ".join(cells[k * columns : (k + 1) * columns]) for k in range(rows)]
        return r"\begin{pmatrix} " + r" \\ ".join(lines) + r" \end{pmatrix}"

    def listed(self, components: list[dict], sign: str) -> str:
        return r", \quad ".join(f"{c['left']}{sign} {self.parts(c['parts'])}" for c in components)

    def parts(self, parts: dict) -> str:
        """The platform's part, the sum over the wheels i, the sum over the free rollers s."""
        text = ""
        for name, sign in SUMS.items():
            e = self.derivation.canonical.read(parts[name])
            if e != ZERO:
                text += self.summand(e, sign, first=not text)
        return text or "0"

    def summand(self, e: Expression, sign: str, *, first: bool) -> str:
        if not sign:
            return self.latex.expression(opened(e))
        minus, e = is_negative(e), negated(e) if is_negative(e) else e
        inner = self.latex.expression(e)
        if isinstance(e, Sum):
            inner = rf"\left( {inner} \right)"
        before = ("-" if minus else "") if first else (" - " if minus else " + ")
        return f"{before}{sign} {inner}"

    def expression(self, data: object) -> str:
        return self.latex.expression(self.derivation.canonical.read(data))


def opened(e: Expression) -> Expression:
    """A sum under a minus sign as the sum of its negated terms."""
    value, factors = split_coefficient(e)
    if value == -1 and len(factors) == 1 and isinstance(factors[0], Sum):
        return Sum(tuple(map(negated, factors[0].terms)))
    return e


def summary(verdict: str, data: dict) -> str:
    """One line; formulas stand between dollar signs."""
    under = [f"${assumed['latex']}$" for assumed in data["assumptions"]]
    meanings = [meaning["latex"] for meaning in data["meanings"]]
    match verdict:
        case "misprint":
            return f"printed: ${data['corrected']['wrong']}$; should be: ${data['corrected']['right']}$"
        case "agrees-if":
            return f"agrees if {' and '.join(under)}"
        case "undefined":
            return f"agrees with {' and '.join([f'${meant}$' for meant in meanings] + under)}"
        case "ambiguous":
            return "; ".join(f"{r['verdict']} if {r['text']}" for r in data["readings"])
    return verdict


def with_text(record: dict) -> dict:
    """The record with `text`, the same for a terminal: no LaTeX."""
    formula = record["kind"] == "formula"
    text = {key: prose(record[key], plain) for key in PROSE}
    if formula:
        text |= {key: plain(record[key]) for key in ("printed", "derived")}
    text["difference"] = plain(record["difference"])
    if wrong := record.get("counterexample"):
        values = ", ".join(map(plain, wrong["values"]))
        what, was, is_ = (plain(wrong[key]) for key in ("component", "printed", "derived"))
        text["counterexample"] = f"{what}: printed {was}, derived {is_}; {values}"
    return record | {"text": text}


# The page


def page_values(records: list[dict]) -> dict:
    """What the page's templates need."""
    counts = Counter(record["verdict"] for record in records)
    by_section = {
        title: [r for r in records if heading(r["section"]) == section and r["kind"] != "unjudged"]
        for section, title in SECTIONS.items()
    }
    return {
        "records": records,
        "counts": {verdict: counts[verdict] for verdict in MEANINGS if counts[verdict]},
        "meanings": MEANINGS,
        "sections": by_section,
    }


def heading(section: str) -> str:
    """The section of the page under which a record stands."""
    if section.startswith("figure"):
        return "5"
    return "6" if section == "abstract" else section


def in_markdown(latex: str) -> str:
    """A formula for Markdown as repository hosts read it: what stands between backquotes is left alone."""
    return f"$`{latex}`$"


def markdown(text: str) -> str:
    return prose(text, in_markdown)


def html(text: str) -> str:
    """Prose with formulas as HTML."""
    return prose(escape(text, quote=False), lambda found: mathml(unescape(found)))


def anchor(name: str) -> str:
    """A name as part of an address."""
    return "f-" + re.sub(r"[^A-Za-z0-9]+", "-", name.replace("*", "-star")).strip("-")


FILTERS = {
    "markdown": markdown,
    "in_markdown": in_markdown,
    "html": html,
    "mathml": mathml,
    "anchor": anchor,
}

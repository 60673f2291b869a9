"""python -m codegen.equation ID ...: LaTeX of single equations of generated/latex/equations.tex, by their identifiers.

An identifier stands there above its equation. Without one all are listed.
"""

import json
import sys

from .__main__ import ROOT, say
from .expressions import Canonical, Order
from .latex import Latex, matrix_of, symbol_names


def main(arguments: list[str] | None = None) -> int:
    """Exit code: 0 where every equation is there, 2 otherwise."""
    names = sys.argv[1:] if arguments is None else arguments
    folder = ROOT / "generated/data"
    data, symbols = (json.loads((folder / f"{part}.json").read_text()) for part in ("equations", "symbols"))
    known = {entry["id"]: entry for part in ("equations", "equations_more", "matrices") for entry in data[part]}
    if not names:
        say("\n".join(f"{name:18} {entry['title']}" for name, entry in known.items()))
        return 0
    latex, read = Latex(symbol_names(symbols["symbols"], data)), Canonical(Order(symbols["symbols"])).read
    for name in names:
        if name not in known:
            print(f"codegen: no equation {name}; without an identifier all are listed", file=sys.stderr)
            return 2
        entry = known[name]
        right = matrix_of(latex, entry["rows"], read) if "rows" in entry else latex.expression(read(entry["expr"]))
        say(f"{entry['left']} = {right}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

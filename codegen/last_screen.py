"""What `make` has done, on one screen: what was derived, proved and built, where it is, and how long each step took.

python -m codegen.last_screen regenerate=92 build=71 motions=4
"""

import json
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def clock(seconds: int) -> str:
    return f"{seconds // 60} min {seconds % 60} s" if seconds >= 60 else f"{seconds} s"


def screen(took: dict[str, int]) -> str:
    """The lines, for steps that took these seconds."""
    from omniroll.commands.formulas import counted, load

    generated, built = ROOT / "generated", "runtime/omniroll/kernels/built"
    proofs = json.loads((generated / "data/proofs.json").read_text(encoding="utf-8"))["proofs"]
    functions = json.loads((generated / "data/programs.json").read_text(encoding="utf-8"))["functions"]
    kernels = sum(path.is_dir() for path in (ROOT / built).iterdir())
    pictures = len(list((ROOT / "out/motions").glob("*.png")))
    lines = [
        ("derived", f"{len(functions)} functions, and their equations", "generated/c, generated/latex/equations.tex"),
        ("proved", f"{len(proofs)} claims, every one", "generated/data/proofs.json"),
        ("compared", f"the paper: {counted(load())}", "generated/formulas/formulas.md"),
        ("built", f"{kernels} kernels, with their engines in C", built),
        ("pictures", f"{pictures}, of the paper's three motions", "out/motions/index.html"),
    ]
    text = "\n".join(f"{what:9} {how_many}\n          {where}" for what, how_many, where in lines)
    steps = ", ".join(f"{step} {clock(seconds)}" for step, seconds in took.items())
    after = "next      .venv/bin/omniroll run scenes/motion-3.toml; make test; README.md"
    return f"\n==> all done in {clock(sum(took.values()))}: {steps}\n{text}\n{after}"


if __name__ == "__main__":
    print(screen({step: int(seconds) for step, _, seconds in (given.partition("=") for given in sys.argv[1:])}))

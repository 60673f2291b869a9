"""python -m codegen.interactive: Maxima by hand, with the paper's part of the derivation loaded.

load_rest() loads the forms, the effects and the programs. Proofs that fail are listed in `failures`. With --where the
program and what it needs from the environment are printed as one line for a shell, for those who start it themselves.
"""

import os
import shlex
import sys

from .__main__ import SCRIPT, say
from .maxima import Maxima, environment

NEEDED = ("MAXIMA_PREFIX", "ECLDIR")


def main(arguments: list[str] | None = None) -> None:
    maxima = Maxima.find(say)
    needs = environment(maxima.program)
    if "--where" in (sys.argv[1:] if arguments is None else arguments):
        given = [f"{name}={shlex.quote(needs[name])}" for name in NEEDED if name in needs]
        say(" ".join([*given, shlex.quote(str(maxima.program))]))
        return
    os.chdir(SCRIPT.parent)
    program = str(maxima.program)
    os.execvpe(program, [program, "--very-quiet", "--run-string", 'load("./paper.mac")$ '], needs)


if __name__ == "__main__":
    main()

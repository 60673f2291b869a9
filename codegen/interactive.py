"""python -m codegen.interactive: Maxima by hand, with the derivation loaded.

Proofs that fail are listed in `failures`.
"""

import os

from .__main__ import SCRIPT, say
from .maxima import Maxima, environment


def main() -> None:
    maxima = Maxima.find(say)
    load = 'display2d: false$ collect_failures: true$ load("./derive.mac")$ printf(true, "failures: ~a~%", failures)$ '
    os.chdir(SCRIPT.parent)
    program = str(maxima.program)
    os.execvpe(program, [program, "--very-quiet", "--run-string", load], environment(maxima.program))


if __name__ == "__main__":
    main()

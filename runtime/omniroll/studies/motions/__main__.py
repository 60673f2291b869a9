"""`python -m omniroll.studies.motions` is the command `omniroll motions`."""

import sys

from omniroll.cli import main

sys.exit(main(["motions", *sys.argv[1:]]))

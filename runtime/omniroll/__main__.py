"""`python -m omniroll` is the command `omniroll`."""

import sys

from omniroll.cli import main

sys.exit(main())

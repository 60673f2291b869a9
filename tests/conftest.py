"""Kernels that tests make on demand are kept beside what they were built with, not in the user's own cache."""

import os
import sys
from pathlib import Path

os.environ.setdefault("OMNIROLL_CACHE", str(Path(sys.prefix, "omniroll-kernels")))

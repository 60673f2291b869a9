"""The toy derivation, rendered once for all tests here."""

import json
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent.parent)]

from toy import derivation  # noqa: E402


@pytest.fixture(scope="session")
def toy_file(tmp_path_factory):
    file = tmp_path_factory.mktemp("toy") / "derivation.json"
    file.write_text(json.dumps(derivation()))
    return file

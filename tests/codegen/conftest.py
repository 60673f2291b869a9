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


@pytest.fixture(scope="session")
def toy_folder(toy_file, tmp_path_factory):
    """A folder with everything that is generated from the toy; toy_generated is its importable name."""
    from codegen.__main__ import main

    parent = tmp_path_factory.mktemp("generated")
    folder = parent / "toy_generated"
    assert main(["--derivation", str(toy_file), "--output", str(folder)]) == 0
    sys.path.insert(0, str(parent))
    return folder

"""What is installed is pinned, each file by its hash."""

import re
from importlib import metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FILES = (
    "requirements.txt",
    "codegen/maxima-requirements.txt",
    "tests/benchmarks/requirements.txt",
    "docs/site/requirements.txt",
    "tests/viewing/requirements.txt",
    "tests/exports/requirements.txt",
)


def pinned(name: str) -> dict[str, tuple[str, list[str]]]:
    """Version and hashes of each package; a line that is neither a package nor a hash fails."""
    text = re.sub(r"^#.*\n", "", (ROOT / name).read_text(encoding="utf-8"), flags=re.MULTILINE)
    packages = {}
    for line in filter(None, (line.strip(" \\") for line in text.splitlines())):
        if package := re.fullmatch(r"([\w.-]+)==(\S+)", line):
            packages[package[1]] = (package[2], [])
        else:
            (digest,) = re.fullmatch(r"--hash=sha256:([0-9a-f]{64})", line).groups()
            packages[[*packages][-1]][1].append(digest)
    return packages


@pytest.mark.parametrize("name", FILES)
def test_every_package_has_hashes(name):
    packages = pinned(name)
    assert packages and all(hashes for _, hashes in packages.values())


def test_what_the_environment_holds_is_pinned():
    """Every package that is installed, the dependencies of dependencies too, and in the version that is pinned."""
    plain = {re.sub(r"[-_.]+", "-", name).lower(): version for name, (version, _) in pinned(FILES[0]).items()}
    for package in plain:
        needs = [need for need in metadata.requires(package) or () if "extra ==" not in need]
        for need in needs:
            if "python_version" in need or "platform" in need or "implementation" in need:
                continue  # for other Pythons and machines
            assert re.sub(r"[-_.]+", "-", re.match(r"[\w.-]+", need)[0]).lower() in plain, f"{package} needs {need}"
        assert metadata.version(package) == plain[package]

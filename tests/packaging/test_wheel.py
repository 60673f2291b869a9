"""The wheel works by itself: built from the sources, installed where neither Maxima nor mpmath is."""

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll.kernels import sets

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("codegen", "generated", "runtime", "LICENSE", "MANIFEST.in", "README.md", "pyproject.toml", "setup.py")
MODEL = "locked"  # that is built, with the fewest general sets: what each of the others adds `make build` compiles
STATE = {"nu": [0.3, -0.7, 1.1], "chi": [0.1, -0.5, 0.4]}
PROGRAM = """
import importlib.util, json, sys
import omniroll
from omniroll.kernels import sets
from omniroll.kernels.neutral_kernel import kernel_by
assert importlib.util.find_spec("mpmath") is None
vehicle = omniroll.Vehicle.paper()
state = json.loads(sys.argv[1])
nu_dot, _ = omniroll.accelerations(vehicle, **state, roller_model="locked")
slope = (("gravity", 9.8), ("slope_angle", 0.1), ("slope_direction", 0.0))
made = omniroll.kernel(vehicle, "locked", effects=("slope",), constants=slope)
general = kernel_by("prebuilt", vehicle, "locked", ("slope",), slope)
end = None
if made.backend == "compiled":  # else a wheel that has no free rollers takes the Python kernels
    run = omniroll.simulate(vehicle, nu=(1, 0, 1), duration=1.0, roller_model="locked", effects=[omniroll.Slope(0.1)])
    assert run.stats["kernel"] == sets.set_name("locked", sets.general_sets("locked")[0])
    end = run.nu[-1].tolist()
rates = [kernel.forward_dynamics(state["nu"], state["chi"], 0.4).tolist() for kernel in (made, general)]
print(json.dumps([omniroll.__file__, nu_dot.tolist(), end, made.backend, *rates]))
"""
SLOPE = (("gravity", 9.8), ("slope_angle", 0.1), ("slope_direction", 0.0))
pytestmark = pytest.mark.long


def run(*command: str | Path, **options) -> str:
    """Standard output of `command`; a failure shows all that it printed."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{command}:\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """The wheel, built from a copy of the sources, so that no file of an earlier build is in it."""
    folder = tmp_path_factory.mktemp("wheel")
    skip = shutil.ignore_patterns("__pycache__", "*.so", "*.egg-info")
    for name in SOURCES:
        source, copy = ROOT / name, folder / "sources" / name
        copy.parent.mkdir(exist_ok=True)
        shutil.copytree(source, copy, ignore=skip) if source.is_dir() else shutil.copy(source, copy)
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    # Quick; the numbers must be the same to the bit.
    quick = os.environ | {"OMNIROLL_CFLAGS": "-O0 -march=native", "OMNIROLL_SETS": MODEL}
    how = ("--no-deps", "--no-build-isolation", "--wheel-dir")
    run(*pip, "wheel", *how, folder, folder / "sources", env=quick)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def python(wheel, tmp_path_factory) -> Path:
    """The interpreter of a fresh environment that holds the wheel and its pinned dependencies."""
    folder = tmp_path_factory.mktemp("environment")
    run(sys.executable, "-m", "venv", folder)
    pip = (folder / "bin/python", "-m", "pip", "--disable-pip-version-check", "--quiet")
    # Hashes among constraints would ask for one of the wheel, too.
    pinned = re.findall(r"^[\w-]+==\S+", (ROOT / "requirements.txt").read_text(), re.MULTILINE)
    (folder / "constraints.txt").write_text("\n".join(pinned))
    run(*pip, "install", "--constraint", folder / "constraints.txt", wheel)
    return folder / "bin/python"


def test_the_wheel_holds_the_whole_package(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    written = [path for path in (ROOT / "runtime/omniroll").rglob("*.py") if "built" not in path.parts]
    ours = {str(path.relative_to(ROOT / "runtime")) for path in written}
    ours |= {
        f"omniroll/codegen/{path.relative_to(ROOT / 'codegen')}"
        for path in (ROOT / "codegen").rglob("*")
        if path.suffix in (".py", ".j2")
    }
    made = {
        f"omniroll/generated/{path.relative_to(ROOT / 'generated')}"
        for path in (ROOT / "generated").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    page = {f"omniroll/viewer/assets/{name}" for name in ("viewer.js", "viewer.css", "page.html", "LICENCES.txt")}
    assert sorted((ours | made | page) - names) == []
    built = f"omniroll/kernels/built/{MODEL}"
    assert {f"{built}/{name}" for name in ("omniroll.h", "omniroll.c", "declarations.h")} <= names
    libraries = [name.rpartition("-")[2] for name in names if name.startswith(f"{built}/") and name.endswith(".so")]
    assert sorted(libraries) == ["3.so", "4.so", "any.so", f"{built}/double.so"]
    general = {name.split("/")[3] for name in names if name.startswith(f"{built}_") and name.endswith(".so")}
    assert general == {sets.set_name(MODEL, effects) for effects in sets.general_sets(MODEL)}
    assert not [name for name in names if name.startswith(("codegen", "maxima", "tests"))]


@pytest.mark.parametrize("backend", ["compiled", "python"])
def test_the_wheel_runs_without_mpmath(python, tmp_path, backend):
    """A kernel made on demand is compiled where there is a compiler, and runs in Python where there is none."""
    compiler = os.environ["PATH"] if backend == "compiled" else str(python.parent)
    environment = {"PATH": compiler, "HOME": str(tmp_path), "CC": "cc"}
    out = run(python, "-I", "-c", PROGRAM, json.dumps(STATE), cwd=tmp_path, env=environment)
    file, nu_dot, end, found, *rates = json.loads(out)
    assert found == backend
    assert str(ROOT) not in file
    vehicle = omniroll.Vehicle.paper()
    near = {"rtol": 0 if backend == "compiled" else 1e-13}
    np.testing.assert_allclose(nu_dot, omniroll.accelerations(vehicle, **STATE, roller_model="locked")[0], **near)
    own = omniroll.kernel(vehicle, "locked", effects=("slope",), constants=SLOPE)
    for on_slope in rates:
        np.testing.assert_allclose(on_slope, own.forward_dynamics(STATE["nu"], STATE["chi"], 0.4), rtol=1e-13)
    if backend == "compiled":
        slope = [omniroll.Slope(0.1)]
        here = omniroll.simulate(vehicle, nu=(1, 0, 1), duration=1.0, roller_model="locked", effects=slope)
        assert np.array_equal(end, here.nu[-1])


def test_a_source_distribution_has_what_builds_it_and_no_more(wheel, tmp_path):
    asked = "import sys; from setuptools import build_meta; print(build_meta.build_sdist(sys.argv[1]))"
    made = run(sys.executable, "-c", asked, tmp_path, cwd=wheel.parent / "sources").split()[-1]
    with tarfile.open(tmp_path / made) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    for folder, kinds in {
        "runtime": (".py", ".c", ".h", ".j2"),
        "codegen": (".py", ".j2"),
        "generated": (".json", ".c"),
    }.items():
        ours = {path.relative_to(ROOT).as_posix() for path in (ROOT / folder).rglob("*") if path.suffix in kinds}
        assert {name for name in ours if "/kernels/built/" not in name} <= names
    assert not [name for name in names if name.startswith("tests") or "/built/" in name or name.endswith(".so")]

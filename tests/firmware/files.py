"""Pairs of C files for tests: written into a folder, compiled as a hostile reviewer would, and run."""

import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

from omniroll.cli import main
from omniroll.kernels import sets

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parents[1] / "examples"
WARNINGS = ("-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wdouble-promotion", "-Werror")
STRICT = ("-std=c99", *WARNINGS, "-O2", "-ffp-contract=off")
NUMBER_TYPES = {"double": (), "float": ("-DOMNIROLL_FLOAT",), "long double": ("-DOMNIROLL_LONG_DOUBLE",)}
PAIRS = {  # that ship, and pairs with effects: one for each way in which a step integrates
    "massless": ("massless", ()),
    "locked": ("locked", ()),
    "free": ("free", ()),
    "free_sharp": ("free", ()),
    "drive": ("free", ("drive",)),
    "motor": ("free", ("drive", "motor")),
    "viscous": ("free", ("drive", "roller_viscous", "axle_viscous", "slope")),
    "everything": ("free", ("layout", "drive", "motor", "axle_coulomb", "roller_coulomb", "slope", "reactions")),
    "locked_loaded": ("locked", ("drive", "axle_viscous", "slope", "reactions")),
}


DRIVEN = """
[vehicle]
wheels = 3
rollers_per_wheel = 5
mass = 2.25
yaw_inertia = 0.0625
wheel_inertia = 0.0009765625
roller_inertia = 0.00001
yaw_scale = 0.5
platform_radius = 0.15625
wheel_radius = 0.0703125
roller_axis_radius = 0.05
wheel_angles = [0.0, 2.0, 4.0]
[start]
nu = [0.0, 0.0, 0.0]
[run]
duration = 1.0
[rollers]
model = "free"
[drive]
voltage = [0.0, 0.0, 0.0]
torque_constant = 0.02
resistance = 1.5
"""


@cache
def texts(name: str, prefix: str = "omniroll"):
    """The pair of a set of PAIRS."""
    texts = sets.programs().kernel(*PAIRS[name]).in_one_form(sharp=name.endswith("_sharp"))
    return texts.pair(stem=prefix, prefix=prefix)


def write(name: str, folder: Path, prefix: str = "omniroll") -> Path:
    """Writes a pair; the path of its source file."""
    pair = texts(name, prefix)
    (folder / f"{prefix}.h").write_text(pair.header, encoding="ascii")
    source = folder / f"{prefix}.c"
    source.write_text(pair.source, encoding="ascii")
    return source


def write_driven(folder: Path) -> Path:
    """Writes what examples/controller.c takes, of a vehicle whose numbers are short in base two; its source file."""
    scene = folder / "driven.toml"
    scene.write_text(DRIVEN, encoding="ascii")
    assert main(["kernel", str(scene), "--output", str(folder), "--constants"]) == 0
    return folder / "omniroll.c"


def tool(name: str) -> str:
    """The path of a program; skips the test where it is not installed."""
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"{name} is not installed")
    return found


def run(*command: str | Path, **options) -> str:
    """What the command prints; a failure shows all that it said."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, timeout=120, **options)
    assert done.returncode == 0, f"{' '.join(map(str, command))}\n{done.stdout[-3000:]}\n{done.stderr[-6000:]}"
    return done.stdout


def example(header: str) -> str:
    """The example in a header's first comment, as it stands there."""
    lines = re.findall(r"^ \*     (?! )?(.*)$|^ \*$", header[header.index(" * Example:") : header.index(" */")], re.M)
    return "\n".join(lines).strip("\n") + "\n"

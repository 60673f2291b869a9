"""What docs/c-interface.md and README.md say of C is so: their commands and programs run as they stand there."""

import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pages import ROOT, blocks, page
from scipy.linalg import solve_discrete_are
from scipy.signal import cont2discrete

import omniroll.cli
from firmware.files import NUMBER_TYPES, STRICT, run, tool

PAGE, README, LINEARISING = map(page, ("docs/c-interface.md", "README.md", "docs/linearising.md"))


def shell(text, folder):
    """Runs a block of the shell where the scenes are."""
    for name in ("scenes", "examples"):
        shutil.copytree(ROOT / name, folder / name, dirs_exist_ok=True)
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    run("sh", "-ec", text, cwd=folder, env=os.environ | {"PATH": path})


@pytest.mark.long
def test_the_commands_and_the_program_of_the_page(tmp_path):
    tool("cc")
    for block in blocks("sh", PAGE):
        shell(block, tmp_path)
    (program,) = blocks("c", PAGE)
    main = tmp_path / "firmware" / "main.c"
    main.write_text(program)
    for flags in NUMBER_TYPES.values():
        made = tmp_path / "program"
        run(tool("gcc"), *STRICT, *flags, main, tmp_path / "firmware/omniroll.c", "-lm", "-o", made)
        assert subprocess.run([made]).returncode == 0


@pytest.mark.long
def test_the_program_of_the_page_drives_motors_without_a_limit_of_their_current(tmp_path):
    scene = (ROOT / "scenes/driven.toml").read_text(encoding="utf-8")
    (tmp_path / "driven.toml").write_text(re.sub(r"(?m)^current_limit.*$", "", scene))
    command = ["kernel", str(tmp_path / "driven.toml"), "--output", str(tmp_path), "--constants"]
    assert omniroll.cli.main(command) == 0
    (program,) = blocks("c", PAGE)
    shown = 'printf("%.9f %.9f %.9f", state.nu[0], state.nu[1], state.nu[2]);\n    return status;'
    (tmp_path / "main.c").write_text("#include <stdio.h>\n" + program.replace("return status;", shown))
    run(tool("gcc"), *STRICT, tmp_path / "main.c", tmp_path / "omniroll.c", "-lm", "-o", tmp_path / "program")
    (motor,) = omniroll.load_scene(tmp_path / "driven.toml").options["effects"]
    driven = omniroll.simulate(
        omniroll.load_scene(tmp_path / "driven.toml").vehicle, nu=(0, 0, 0), duration=1,
        effects=[replace(motor, voltage=(4, -2, -2), times=None)],
    )  # fmt: skip
    assert numbers(run(tmp_path / "program")) == pytest.approx(driven.nu[-1].tolist(), abs=1e-6)
    assert abs(driven.nu[-1]).max() > 1


@pytest.mark.long
def test_the_commands_of_the_readme(tmp_path):
    tool("cc")
    (block,) = (block for block in blocks("sh", README) if "omniroll kernel" in block)
    shell(block, tmp_path)
    assert (tmp_path / "out/firmware/omniroll.o").exists() and (tmp_path / "out/free/omniroll.h").exists()


@pytest.mark.long
def test_the_regulator_and_the_filter_of_the_page_on_derivatives(tmp_path):
    """The gain against SciPy's from omniroll.linearise; the filter against its readings and its own bounds."""
    (scene,) = blocks("toml", LINEARISING)
    (tmp_path / "robot.toml").write_text(scene)
    (command,) = blocks("sh", LINEARISING)
    shell(command, tmp_path)
    printed = {kind: printed_on_board(tmp_path / "firmware", NUMBER_TYPES[kind]) for kind in ("double", "float")}
    assert printed["double"] == blocks("console", LINEARISING)
    regulator, known = map(numbers, printed["double"])
    assert [*regulator, *known] == pytest.approx(numbers("".join(printed["float"])), abs=1e-4)
    model = omniroll.linearise(omniroll.load_scene(tmp_path / "robot.toml"), nu=(1, 0, 0.5), chi=0)
    A, B, *_ = cont2discrete((model.A[:3, :3], model.B[:3], np.eye(3), np.zeros((3, 3))), 0.02)
    P = solve_discrete_are(A, B, np.eye(3), 0.01 * np.eye(3))
    gain = np.linalg.solve(0.01 * np.eye(3) + B.T @ P @ B, B.T @ P @ A)
    assert regulator[:9] == pytest.approx(gain.ravel(), abs=2e-5)
    assert regulator[-3:] == pytest.approx([1, 0, 0.5], abs=1e-3)
    surprise, nu, of_wheels, place, of_camera, of_odometry = known
    assert abs(surprise - 1) < 4 * (2 / 4300) ** 0.5  # of some 4300 squares
    assert nu < of_wheels / 5 and place < of_camera / 3 and place < of_odometry / 3


def printed_on_board(firmware, flags):
    """What the two programs print with a number type."""
    run(tool("gcc"), *STRICT, *flags, "-c", firmware / "omniroll.c", "-o", firmware / "omniroll.o")
    found = []
    for name in ("regulator", "kalman_filter"):
        sources = (ROOT / f"examples/{name}.c", firmware / "omniroll.o", "-lm")
        run(tool("gcc"), *STRICT, *flags, "-I", firmware, *sources, "-o", firmware / name)
        found.append(run(firmware / name))
    return found


def numbers(text):
    """The numbers with a point that a program prints."""
    return [float(found) for found in re.findall(r"-?\d+\.\d+", text)]

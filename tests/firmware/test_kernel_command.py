"""omniroll kernel: exactly the files that a firmware needs, and numbers that read back."""

import re
import shlex
import subprocess
from pathlib import Path

import numpy as np
import pytest

import omniroll
from firmware.files import NUMBER_TYPES, STRICT, run, tool
from omniroll.cli import main
from omniroll.commands.kernel import scene_kernel
from omniroll.errors import InvalidValueError
from omniroll.kernels import sets
from omniroll.kernels.kernel import ROLLER_MODELS, kernel

ROOT = Path(__file__).resolve().parents[2]
# Mecanum wheels have no files for a controller yet.
SCENES = [path for path in sorted((ROOT / "scenes").glob("*.toml")) if "mecanum" not in path.stem]
FREE = """
[vehicle]
preset = "paper"
[start]
nu = [1.0, 0.0, 1.0]
[run]
duration = 1.0
[rollers]
model = "free"
"""


def fields_of(pointer):
    """(name, field) of each field of the struct that a cffi pointer leads to."""
    return sets.library("free", (), "double").ffi.typeof(pointer).item.fields


def kernel_command(*arguments):
    return main(["kernel", *map(str, arguments)])


@pytest.mark.parametrize("model", ROLLER_MODELS)
def test_a_roller_model_gives_functions_of_the_pair_that_ships(model, tmp_path, capsys):
    assert kernel_command(model, "--output", tmp_path / "new") == 0
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["omniroll.c", "omniroll.h"]
    for name in ("omniroll.h", "omniroll.c"):
        new, ships = ((folder / name).read_text() for folder in (tmp_path / "new", sets.BUILT / model))
        new, ships = (re.sub(r"^#define omniroll_.*\n", "", text, flags=re.MULTILINE) for text in (new, ships))
        assert set(new.split("\n\n")) <= set(ships.split("\n\n")) and "_sharp(" not in new
    out = capsys.readouterr().out
    assert f"{(tmp_path / 'new/omniroll.c').stat().st_size} bytes" in out


@pytest.mark.long
@pytest.mark.parametrize("scene", SCENES[::3], ids=lambda path: path.stem)
def test_a_scene_compiles_with_the_line_that_is_printed(scene, tmp_path, capsys):
    if tool("cc"):
        assert kernel_command(scene, "--output", tmp_path, "--constants") == 0
    lines = capsys.readouterr().out.splitlines()
    files = {"omniroll.h", "omniroll.c", "omniroll_constants.h"}
    assert {path.name for path in tmp_path.iterdir()} == files
    assert {Path(line.split()[0]).name for line in lines[:-1]} == files
    subprocess.run(shlex.split(lines[-1]), check=True)
    program = tmp_path / "main.c"
    program.write_text(
        '#include "omniroll_constants.h"\nint main(void)\n{\n    return omniroll_constant_model.wheels < 1;\n}\n'
    )
    types = NUMBER_TYPES if scene.stem == "driven" else {"float": NUMBER_TYPES["float"]}  # double is done
    for flags in types.values():
        run(tool("gcc"), *STRICT, "-O0", *flags, program, tmp_path / "omniroll.c", "-lm", "-o", tmp_path / "program")
        run(tmp_path / "program")


def test_a_scene_gets_its_effects_and_no_others(tmp_path):
    assert kernel_command(ROOT / "scenes/driven.toml", "--output", tmp_path) == 0
    header = (tmp_path / "omniroll.h").read_text()
    assert "omniroll_real *torque" in header and "omniroll_real *damping" in header
    assert "slope" not in header and "axle_damping" not in header
    made = scene_kernel(ROOT / "scenes/driven.toml")
    assert made.set_name == "free_motor"


def printed(folder, prefix, fields, *flags):
    """What the numbers of the constant model are in C."""
    lines = "".join(f'    printf("%.17g\\n", (double){prefix}_constant_model.{name});\n' for name in fields)
    head = f'#include "{prefix}_constants.h"\n#include <stdio.h>\nint main(void)\n{{\n'
    (folder / "main.c").write_text(f"{head}{lines}    return 0;\n}}\n")
    run(tool("gcc"), *STRICT, *flags, folder / "main.c", folder / f"{prefix}.c", "-lm", "-o", folder / "program")
    return [float(line) for line in run(folder / "program").split()]


@pytest.mark.long
def test_constants_are_what_prepare_gives(tmp_path):
    """The same bits in double. In float each number is that of double, rounded once."""
    scene = tmp_path / "free.toml"
    scene.write_text(FREE)
    assert kernel_command(scene, "--output", tmp_path, "--constants", "--prefix", "base") == 0
    twin = kernel(scene_kernel(scene).vehicle, "free")
    fields = [name for name, _ in fields_of(twin.model)][2:-2]
    wheel, roller = (fields_of(getattr(twin.model, name)) for name in ("wheel", "roller"))
    names = [f"wheel[{i}].{name}" for i in range(3) for name, _ in wheel]
    names += [f"roller[{j}].{name}" for j in range(4) for name, _ in roller] + fields
    wanted = [getattr(twin.model.wheel[i], name) for i in range(3) for name, _ in wheel]
    wanted += [getattr(twin.model.roller[j], name) for j in range(4) for name, _ in roller]
    wanted += [getattr(twin.model, name) for name in fields]
    assert printed(tmp_path, "base", names) == wanted
    assert printed(tmp_path, "base", names, "-DBASE_FLOAT") == np.array(wanted, np.float32).tolist()


@pytest.mark.long
def test_constants_have_the_slopes_that_derivatives_read(tmp_path):
    scene = ROOT / "scenes/driven.toml"
    assert kernel_command(scene, "--output", tmp_path, "--constants", "--derivatives", "mass") == 0
    assert printed(tmp_path, "omniroll", ["m0_11_by_mass"]) == pytest.approx(
        [scene_kernel(scene).vehicle.platform_radius ** 2]
    )


def test_float_without_a_macro(tmp_path):
    assert kernel_command("free", "--output", tmp_path, "--float", "--prefix", "base") == 0
    program = tmp_path / "main.c"
    program.write_text('#include "base.h"\nint main(void)\n{\n    return sizeof(base_real) != sizeof(float);\n}\n')
    run(tool("gcc"), *STRICT, program, tmp_path / "base.c", "-lm", "-o", tmp_path / "program")
    run(tmp_path / "program")


@pytest.mark.parametrize("scene, has_step", [("driven", True), ("two-rows", False), ("robomaster-mecanum", False)])
def test_files_without_a_step_say_so(scene, has_step, tmp_path, capsys):
    assert main(["kernel", f"{ROOT}/scenes/{scene}.toml", "--output", str(tmp_path)]) == 0
    assert ("there is no omniroll_step" in capsys.readouterr().err) is not has_step
    assert ("int omniroll_step(" in (tmp_path / "omniroll.h").read_text()) is has_step


def test_a_file_is_no_folder(tmp_path, capsys):
    (tmp_path / "file").touch()
    assert main(["kernel", "free", "--output", str(tmp_path / "file")]) == 1
    assert "file is a file; name a folder" in capsys.readouterr().err


def test_files_of_others_stay(tmp_path, capsys):
    (tmp_path / "omniroll.c").write_text("int mine;\n")
    assert kernel_command("free", "--output", tmp_path) == 1
    assert "did not write it" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["omniroll.c"]
    assert (tmp_path / "omniroll.c").read_text() == "int mine;\n"
    (tmp_path / "omniroll.c").unlink()
    assert kernel_command("free", "--output", tmp_path) == kernel_command("locked", "--output", tmp_path) == 0
    assert "locked rollers" in (tmp_path / "omniroll.h").read_text()


@pytest.mark.parametrize("arguments, said", [
    (("free", "--constants"), "needs a scene"),
    (("free", "--prefix", "3wheels"), "C identifier"),
    (("free", "--prefix", "Base"), "lower case"),
    (("free", "--prefix", "_base"), "underscore"),
    (("no-such-scene.toml",), "no-such-scene.toml': is no file; name a scene, or a roller model: massless"),
])  # fmt: skip
def test_calls_that_make_no_sense(arguments, said, tmp_path, capsys):
    assert kernel_command(*arguments, "--output", tmp_path / "new") == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_a_vehicle_that_the_c_kernel_refuses_is_named():
    light = omniroll.Vehicle.paper().replace(mass=1e-60)  # less than the least number in float
    assert kernel(light, "free", "compiled", "double")
    with pytest.raises(InvalidValueError, match="status 2"):
        kernel(light, "free", "compiled", "float")

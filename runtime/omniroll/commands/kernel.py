"""omniroll kernel SCENE --output DIR: the C files that a scene's firmware needs."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from shtab import DIRECTORY, FILE

from omniroll.errors import InvalidValueError
from omniroll.kernels.by_state import has_pieces
from omniroll.kernels.kernel import ROLLER_MODELS, Kernel
from omniroll.validation import choice

SUMMARY = "write the C files that a controller for a scene needs: a header and a source file, and no others"
EXAMPLES = (
    ("omniroll kernel free --output out/free", "free rollers, no further effects"),
    (
        "omniroll kernel scenes/driven.toml --output out/firmware --constants",
        "what this scene calls for, and its vehicle",
    ),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scene", metavar="SCENE", help=f"a TOML file, or a roller model: {', '.join(ROLLER_MODELS)}"
    ).complete = FILE
    parser.add_argument(
        "--output", type=Path, required=True, metavar="DIR", help="folder for the files; made if need be"
    ).complete = DIRECTORY
    parser.add_argument(
        "--constants", action="store_true", help="write a header with the scene's vehicle as constants, too"
    )
    parser.add_argument("--prefix", default="omniroll", help="of the files and of all names in them (omniroll)")
    parser.add_argument("--float", action="store_true", dest="is_float", help="numbers are float without a macro")
    parser.add_argument(
        "--derivatives",
        nargs="*",
        metavar="NUMBER",
        help="with the derivatives of the rates by state and inputs, and by these numbers (mass, wheel_radius, ...)",
    )
    parser.add_argument(
        "--sharp", action="store_true", help="of a roller model: the functions for sharp tips; a scene knows its own"
    )


def run(arguments: argparse.Namespace) -> int:
    """0 where the files were written. Raises SceneError, InvalidValueError, OmnirollError, OSError."""
    from omniroll.kernels import firmware

    prefix = firmware.checked_prefix(arguments.prefix)
    if arguments.scene not in ROLLER_MODELS and not Path(arguments.scene).exists():
        bound = f"is no file; name a scene, or a roller model: {', '.join(ROLLER_MODELS)}"
        raise InvalidValueError("SCENE", arguments.scene, bound)
    kernel = None if arguments.scene in ROLLER_MODELS else scene_kernel(Path(arguments.scene))
    if kernel is None and arguments.constants:
        raise InvalidValueError("SCENE", arguments.scene, "is a roller model; --constants needs a scene with a vehicle")
    if arguments.constants and has_pieces(kernel.vehicle):
        bound = "has rollers of several arcs, and constants are those of one: call prepare for each, with its arc"
        raise InvalidValueError("SCENE", arguments.scene, bound)
    base, effects = (arguments.scene, ()) if kernel is None else (kernel.base, kernel.effects)
    if arguments.derivatives is not None:
        effects = with_derivatives(base, effects, arguments.derivatives)
    sharp = arguments.sharp if kernel is None else kernel.sharp
    files = firmware.pair_files(base, effects, prefix, arguments.is_float, sharp)
    if arguments.constants:
        asked = scene_kernel(Path(arguments.scene), tuple(name for name in effects if name not in kernel.effects))
        files |= firmware.constants_file(asked, ascii_name(arguments.scene), prefix)
    written = firmware.write(arguments.output, files)
    width = max(len(str(path)) for path in written)
    for path in written:
        text = path.read_text(encoding="ascii")
        print(f"{str(path):<{width}}  {len(text.splitlines()):>5} lines  {len(text):>7} bytes")
    source = arguments.output / f"{prefix}.c"
    print(f"cc -std=c99 -O2 -ffp-contract=off -c {source} -o {source.with_suffix('.o')}")
    if f"{prefix}_step(" not in files[f"{prefix}.h"]:
        said = f"there is no {prefix}_step for what this scene calls for; integrate the rates of the other functions"
        print(f"omniroll: {said}", file=sys.stderr)
    return 0


def with_derivatives(base: str, effects: tuple[str, ...], numbers: Sequence[str]) -> tuple[str, ...]:
    """The effects with the requests for derivatives. Raises InvalidValueError for what is no number of the set."""
    from omniroll.codegen.derivatives import REQUEST
    from omniroll.kernels.kernel import DERIVATIVES, signatures

    known = [argument.name for argument in signatures(base, effects, 3, 3)["prepare"].inputs]
    for name in numbers:
        choice("derivatives", name, known)
    return (*effects, DERIVATIVES, *sorted({REQUEST + name for name in numbers}))


def scene_kernel(path: Path, also: tuple[str, ...] = ()) -> Kernel:
    """The kernel of a scene's vehicle, with the scene's effects and no others but `also`."""
    from omniroll.effects.effect_set import EffectSet
    from omniroll.scenes import load_scene

    scene = load_scene(path)
    effects = EffectSet.checked(scene.options.get("effects", ()), scene.vehicle)
    return effects.kernel(scene.vehicle, scene.options.get("roller_model", "free"), "python", also)


def ascii_name(scene: str) -> str:
    """The scene's file name as it may stand in a C comment."""
    return Path(scene).name.encode("ascii", "replace").decode().replace("*/", "?")

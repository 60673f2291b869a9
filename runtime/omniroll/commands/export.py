"""omniroll export fmu SCENE, omniroll export casadi SCENE: the vehicle of a scene for tools of others."""

import argparse
from pathlib import Path

from shtab import FILE

from omniroll.scenes import load_scene

SUMMARY = "write the vehicle of a scene as an FMU (FMI 2 or 3, co-simulation) or as a CasADi function with derivatives"
EXAMPLES = (
    ("omniroll export fmu scenes/driven.toml", "FMI 2.0: out/export/driven.fmu, with its sources"),
    ("omniroll export fmu scenes/driven.toml --fmi 3 --output robot.fmu", "FMI 3.0"),
    ("omniroll export casadi scenes/driven.toml", "out/export/driven/rates.so, for casadi.external('rates', ...)"),
)
TAKEN = ("nu", "chi", "spins", "pose", "roller_model", "switching", "effects", "start_time")  # of a scene


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("format", choices=("fmu", "casadi"), help="what to write")
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a TOML file, see docs/scenes.md").complete = FILE
    parser.add_argument(
        "--output", type=Path, metavar="PATH",
        help="file of the FMU, or folder of the function; default: out/export/ and the scene's name",
    ).complete = FILE  # fmt: skip
    parser.add_argument("--fmi", type=int, choices=(2, 3), default=2, help="version of FMI (2)")
    parser.add_argument("--name", default="rates", help="of the function in CasADi (rates)")


def run(arguments: argparse.Namespace) -> int:
    """0 where it was written. Raises SceneError, InvalidValueError, OmnirollError, OSError."""
    from omniroll.exchange.casadi_function import to_casadi  # templates take a while to import
    from omniroll.exchange.fmu import to_fmu

    scene = load_scene(arguments.scene)
    options = {name: value for name, value in scene.options.items() if name in TAKEN}
    place = arguments.output or Path("out/export", scene.name + ".fmu" * (arguments.format == "fmu"))
    if arguments.format == "fmu":
        print(to_fmu(scene.vehicle, place, version=arguments.fmi, name=scene.name,
                     stop=scene.options["duration"], **options))  # fmt: skip
        return 0
    library = to_casadi(scene.vehicle, place, name=arguments.name, scene=scene.name, **options)
    print(library)
    print(f"casadi.external({arguments.name!r}, {str(library)!r})")
    return 0

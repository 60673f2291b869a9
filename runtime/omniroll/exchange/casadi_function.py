"""The rates of a vehicle and their Jacobians as C that CasADi takes as an external function."""

import re
import tempfile
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from numpy.typing import ArrayLike

from omniroll import validation
from omniroll.errors import InvalidValueError, OmnirollError
from omniroll.exchange.plant import PREFIX, Plant, filled
from omniroll.kernels import building, firmware
from omniroll.vehicles.vehicle import Vehicle

KNOWN = {  # arguments of the functions that are in x, or rates
    "nu": "x", "chi": "x + CHI", "heading": "x[POSE + 2]", "theta": "x[POSE + 2]", "momenta": "x + MOMENTA",
    "nu_dot": "rates",
}  # fmt: skip
SIZES = {"N": "WHEELS"}
FUNCTIONS = ("forward_dynamics_derivatives", "rate_derivatives", "momenta_derivatives")


@dataclass(frozen=True)
class Call:
    """A call of a generated function: its arguments in C, and those of its twin with slopes in a direction."""

    function: str
    arguments: list[str]
    along: list[str]

    @classmethod
    def of(cls, plant: Plant, function: str) -> "Call":
        taken, given = (
            [KNOWN.get(a["name"], a["name"]) for a in plant.arguments(function) if a["role"] == role]
            for role in ("in", "out")
        )
        ways = [[re.sub(r"^\w+", r"\g<0>_along", text) for text in texts] for texts in (taken, given)]
        return cls(function, [*taken, *given], [*taken, *ways[0], *given, *ways[1]])


def casadi_files(
    vehicle: Vehicle, name: str = "rates", scene: str = "a vehicle", **options: ArrayLike
) -> dict[str, str]:
    """The texts of the C files, by file name; arguments as of to_casadi."""
    if not name.isascii() or not name.isidentifier() or name.startswith("_"):
        raise InvalidValueError("name", name, "must be a C identifier that does not begin with an underscore")
    plant = Plant.of(vehicle, **options, derivatives=True)
    kernel = plant.kernel
    if "roller_coulomb" in kernel.effects and "spins" in plant.start:
        bound = "makes each free roller a state; the function knows viscous friction"
        raise InvalidValueError("roller_coulomb", kernel.set_name, bound)
    friction = "momenta_derivatives" in kernel.signatures
    functions = [function for function in FUNCTIONS if function in kernel.signatures]
    outputs = {}
    for function in functions:
        for argument in plant.arguments(function):
            if argument["role"] == "out" and argument["name"] != "nu_dot":
                outputs[argument["name"]] = "*".join(str(SIZES.get(size, size)) for size in argument["shape"])
    calls = [Call.of(plant, function) for function in functions]
    free = "spins" in plant.start
    wheels = kernel.wheels
    states = ["nu[0 ... 2]", f"chi[0 ... {wheels - 1}]", "pose[0 ... 2]"]
    states += [f"momenta[0 ... {wheels - 1}][0 ... 1]"] if free else []
    motor = "motor" in kernel.effects
    text = filled(
        "casadi.c", name=name, scene=scene.replace("*/", "?").encode("ascii", "replace").decode(),
        set_name=kernel.set_name, states=", ".join(states), signal=plant.signal, wheels=wheels,
        size=6 + wheels + 2 * wheels * free, outputs=list(outputs.items()), calls=calls, free=free, friction=friction,
        heading="nu_dot_by_heading" in outputs, has_motor=motor,
        has_limit=motor and float(kernel.constant("current_limit")) > 0,
    )  # fmt: skip
    return {f"{name}.c": text} | plant.pair() | firmware.constants_file(kernel, scene, PREFIX)


def to_casadi(
    vehicle: Vehicle,
    folder: str | PathLike[str],
    *,
    name: str = "rates",
    scene: str = "a vehicle",
    **options: ArrayLike,
) -> Path:
    """Write the rates of a vehicle, near a state between two events, as an external function of CasADi.

    vehicle  Vehicle
    folder   for NAME.c, the generated source that it calls, and the library NAME.so of both
    name     of the function: name(x, u) -> x_dot, jac_name and jac_jac_name
    scene    what the files say that they are made from
    options  roller_model, effects, ... as of to_fmu

    x is nu, chi, pose and with free rollers the momenta, u the torques or voltages: in the order and units of
    omniroll.linearise, whose A and B are the Jacobians; casadi.hessian has generated second derivatives, too. (3.4),
    (2.2) and (2.3).

    Returns the path of the library, for casadi.external(name, path). Raises InvalidValueError as to_fmu does,
    OmnirollError without a C compiler and where other files are in the way; OSError.
    """
    folder, name, scene = (
        validation.file_path("folder", folder), validation.text("name", name), validation.text("scene", scene)
    )  # fmt: skip
    files = casadi_files(vehicle, name, scene, **options)
    sources = [path for path in firmware.write(folder, files) if path.suffix == ".c"]
    library = folder / f"{name}.so"
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        made = Path(scratch, library.name)
        try:
            building.compile_library(sources, made, [folder], ("-fvisibility=hidden", "-Wl,-Bsymbolic"))
        except building.CompilationError as error:
            raise OmnirollError(f"the function is compiled code: {error}") from error
        made.replace(library)
    return library

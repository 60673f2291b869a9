"""A vehicle as a functional mock-up unit, FMI 2.0 or 3.0 for co-simulation: generated C behind FMI's functions.

The numbers of the vehicle and of its effects are parameters, with the start; torques or voltages are inputs, constant
over a communication step; what moves is read from outputs. The step is that of the generated source, of the fourth
order, in internal steps whose length follows from their error; a joint ends one, and so does a motor that comes to its
limit.
"""

import platform
import tempfile
import uuid
import zipfile
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from omniroll import durable, validation
from omniroll.errors import InvalidValueError, OmnirollError
from omniroll.exchange.plant import Plant, filled
from omniroll.exchange.units import powers
from omniroll.kernels import building
from omniroll.vehicles.vehicle import Vehicle

INTERNAL = {  # bounds of internal steps: value, unit and meaning
    "internal_step": (1e-2, "s", "longest internal step"),
    "tolerance": (1e-9, "1/s", "error that a second of motion may add to nu, pose and chi, over 1 or their size"),
}
BINARIES = {2: "linux64", 3: "x86_64-linux"}
FLAGS = ("-fvisibility=hidden", "-Wl,-Bsymbolic")
WHEN = (1980, 1, 1, 0, 0, 0)  # of every file: the same scene gives the same bytes
LAWS = {"smooth": "OMNIROLL_SMOOTH", "impact": "OMNIROLL_IMPACT"}
STARTS = {  # parameters that are the state at the start: unit and meaning
    "nu": ("1/s", "at the start: quasi-velocity"),
    "pose": ("m", "at the start: x, y, heading"),
    "chi": ("rad", "at the start: wheel angle from the middle of the roller in contact"),
    "spins": ("rad/s", "at the start: spin of a free roller relative to its disk"),
}
INPUTS = {"torque": ("N m", "torque at a wheel's axle"), "voltage": ("V", "voltage of a wheel's motor")}
OUTPUTS = {  # unit, meaning, and the call that puts it into `found`
    "nu": ("1/s", "quasi-velocity", "memcpy(found, v->state.nu, sizeof v->state.nu);"),
    "pose": ("m", "x, y, heading", "memcpy(found, v->state.pose, sizeof v->state.pose);"),
    "twist": (
        "m/s",
        "speeds forward and to the left, yaw rate",
        "omniroll_twist_from_nu(&v->model, v->state.nu, found);",
    ),
    "chi": ("rad", "wheel angle from the middle of the roller in contact", "memcpy(found, v->chi, sizeof v->chi);"),
    "wheel_rates": ("rad/s", "rate of a wheel", "omniroll_wheel_speeds(&v->model, v->state.nu, found);"),
    "drive_torque": ("N m", "torque of a drive at a wheel's axle", ""),
    "energy": ("J", "kinetic energy", ""),
}
DRIVE_TORQUE = """omniroll_wheel_speeds(&v->model, v->state.nu, found);
        for (int i = 0; i < WHEELS; i++)
            found[i] = v->torque[i] - {};"""
ENERGY = {
    False: "omniroll_energy(&v->model, v->state.nu, v->chi, found);",
    True: """double spins[WHEELS*(ROLLERS - 1)];
        omniroll_spins_from_axial(&v->model, v->state.nu, v->chi, v->axial, spins);
        omniroll_energy(&v->model, v->state.nu, v->chi, spins, found);""",
}
THIRD = {("pose", 2): "rad", ("twist", 2): "rad/s"}  # units of components that differ from the first


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU. start: its text, or nothing for what is calculated."""

    reference: int
    name: str
    unit: str
    meaning: str
    causality: str
    variability: str
    initial: str = ""
    start: str = ""
    whole: bool = False


@dataclass(frozen=True)
class Mockup:
    """The texts of an FMU.

    plant    what moves
    scene    what it is called
    stop     s, until when an experiment goes by default
    version  of FMI, 2 or 3
    """

    plant: Plant
    scene: str
    stop: float
    version: int

    @property
    def identifier(self) -> str:
        """The name of the model, as C takes it."""
        name = "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in self.scene)
        return name if name[:1].isalpha() else f"vehicle_{name}"

    @property
    def token(self) -> str:
        """Of the scene and its numbers: the same where these are."""
        numbers = ",".join(f"{v.name}={v.start}" for v in self.variables)
        own = uuid.uuid5(uuid.NAMESPACE_URL, f"omniroll {self.plant.kernel.set_name} {self.plant.law} {numbers}")
        return f"{{{own}}}"

    @cached_property
    def constants(self) -> list[tuple[str, np.ndarray, dict]]:
        """Arguments of `prepare`: name, value, entry."""
        entries = {entry["name"]: entry for entry in self.plant.arguments("prepare")}
        kernel = self.plant.kernel
        pairs = zip(kernel.constant_names, kernel.constants, strict=True)
        return [(name, np.asarray(value), entries[name]) for name, value in pairs]

    @cached_property
    def given(self) -> list[Variable]:
        """Parameters and inputs, in the order of their value references, which begin at 1."""
        found: list[Variable] = []

        def add(name: str, values: np.ndarray, unit: str, meaning: str, causality: str) -> None:
            variability = "fixed" if causality == "parameter" else "continuous"
            for place in np.ndindex(values.shape):
                own = THIRD.get((name.removesuffix("_start"), *place), unit)
                initial = "exact" if causality == "parameter" else ""
                found.append(Variable(
                    len(found) + 1, indexed(name, place), "" if own == "1" else own, meaning, causality, variability,
                    initial, repr(float(values[place])),
                ))  # fmt: skip

        for name, value, entry in self.constants:
            add(name, value, entry["unit"], entry["meaning"], "parameter")
        for name, (value, unit, meaning) in INTERNAL.items():
            add(name, np.array(value), unit, meaning, "parameter")
        for name, (unit, meaning) in STARTS.items():
            if name in self.plant.start:
                add(f"{name}_start", self.plant.start[name], unit, meaning, "parameter")
        signal = self.plant.signal
        add(signal, self.plant.start[signal], *INPUTS[signal], "input")
        return found

    @cached_property
    def outputs(self) -> list[tuple[str, int, int, str]]:
        """Name, place of the first number, how many, and the statement that finds them."""
        found, first = [], 0
        lost = "v->damping[i]*found[i]" if self.has_motor else "0*found[i]"
        special = {"drive_torque": DRIVE_TORQUE.format(lost), "energy": ENERGY["spins" in self.plant.start]}
        for name, (_, _, statement) in OUTPUTS.items():
            count = {"nu": 3, "pose": 3, "twist": 3, "energy": 1}.get(name, self.plant.kernel.wheels)
            found.append((name, first, count, special.get(name, statement)))
            first += count
        return found

    @cached_property
    def numbers(self) -> list[Variable]:
        found = []
        for name, _, count, _ in self.outputs:
            unit, meaning, _ = OUTPUTS[name]
            for k in range(count):
                own = name if name == "energy" else indexed(name, (k,))
                reference = len(self.given) + 1 + len(found)
                found.append(Variable(
                    reference, own, THIRD.get((name, k), unit), meaning, "output", "continuous", "calculated"
                ))  # fmt: skip
        return found

    @cached_property
    def variables(self) -> list[Variable]:
        """All of them, in the order of their value references."""
        time = Variable(0, "time", "s", "time", "independent", "continuous")
        first = 1 + len(self.given) + len(self.numbers)
        contacts = [
            Variable(first + i, indexed("contact", (i,)), "", "number of the roller in contact", "output", "discrete",
                     "calculated", whole=True)
            for i in range(self.plant.kernel.wheels)
        ]  # fmt: skip
        return [time, *self.given, *self.numbers, *contacts]

    @property
    def has_motor(self) -> bool:
        return "motor" in self.plant.kernel.effects

    def files(self) -> dict[str, str]:
        """The texts by their path in the FMU, without the binary."""
        units = dict.fromkeys(v.unit for v in self.variables if v.unit)
        description = filled(
            f"model_description_{self.version}.xml", identifier=self.identifier, token=self.token,
            version=metadata.version("omniroll"), stop=self.stop, variables=self.variables,
            units=[(unit, powers(unit)) for unit in units],
            description=f"A vehicle on omni-wheels: {self.scene}. Rollers: {self.plant.kernel.roller_model}",
        )  # fmt: skip
        texts = {"modelDescription.xml": description, "sources/fmi.c": self.source()}
        texts |= {f"sources/{name}": text for name, text in self.plant.pair().items()}
        if self.version == 3:
            texts["sources/buildDescription.xml"] = filled("build_description.xml", identifier=self.identifier)
        return texts

    def source(self) -> str:
        kernel = self.plant.kernel
        places = {v.name.removesuffix("_start").partition("_start[")[0].partition("[")[0]: v.reference - 1
                  for v in reversed(self.given)}  # fmt: skip
        signal = self.plant.signal
        first_input = next(v.reference for v in self.given if v.causality == "input")
        return filled(
            f"fmi{self.version}.c", scene=self.scene.replace("*/", "?").encode("ascii", "replace").decode(),
            set_name=kernel.set_name, identifier=self.identifier, token=self.token,
            wheels=kernel.wheels, rollers=kernel.rollers_per_wheel, law=LAWS[self.plant.law],
            parameters=first_input - 1, given=[(v.name, v.start) for v in self.given], numbers=self.numbers,
            outputs=self.outputs, most=max(3, kernel.wheels), places=places | {"signal": places[signal]},
            constants=[(name, places[name], bool(value.ndim)) for name, value, _ in self.constants],
            has_motor=self.has_motor, free="spins" in self.plant.start,
            has_roller=has_roller(kernel.base),
        )  # fmt: skip


def indexed(name: str, place: tuple[int, ...]) -> str:
    """As linear models name their numbers."""
    return name + "".join(f"[{k}]" for k in place)


def has_roller(base: str) -> bool:
    """Whether the generated model has constants of a free roller."""
    return base == "free"


def to_fmu(
    vehicle: Vehicle,
    path: str | PathLike[str],
    *,
    version: int = 2,
    name: str | None = None,
    stop: float = 10.0,
    **options: ArrayLike,
) -> Path:
    """Write a vehicle as an FMU for co-simulation, with its sources and a binary for this machine.

    vehicle  Vehicle
    path     of the file, *.fmu
    version  2 for FMI 2.0, 3 for FMI 3.0
    name     of the model; by default that of the file
    stop     s, how long an experiment takes by default
    options  nu, chi, spins, pose, roller_model, switching, effects, start_time, as of simulate; a controller among the
             effects is left out, since its output is an input of the FMU

    Returns the path. Raises InvalidValueError for effects that the generated step lacks: wheels that may slip, bearings
    that stick; OmnirollError without a C compiler; OSError.
    """
    path = validation.file_path("path", path)
    if validation.integer("version", version, 2) not in BINARIES:
        raise InvalidValueError("version", version, "must be 2 or 3")
    named = path.stem if name is None else validation.text("name", name)
    mockup = Mockup(Plant.of(vehicle, **options), named, validation.not_negative("stop", stop), version)
    files: dict[str, bytes] = {inside: text.encode() for inside, text in mockup.files().items()}
    files |= _binary(mockup, files)
    path.parent.mkdir(parents=True, exist_ok=True)
    with durable.whole_file(path, "wb") as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for inside, content in files.items():
            archive.writestr(zipfile.ZipInfo(inside, WHEN), content, zipfile.ZIP_DEFLATED)
    return path


def _binary(mockup: Mockup, files: dict[str, bytes]) -> dict[str, bytes]:
    """The library for this machine, by its path in the FMU; none on a machine that FMI has no name for here."""
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        return {}
    with tempfile.TemporaryDirectory() as folder:
        sources = []
        for inside, content in files.items():
            if inside.endswith((".c", ".h")):
                source = Path(folder, Path(inside).name)
                source.write_bytes(content)
                sources += [source] if source.suffix == ".c" else []
        library = Path(folder, f"{mockup.identifier}.so")
        try:
            building.compile_library(sources, library, [Path(folder)], FLAGS)
        except building.CompilationError as error:
            raise OmnirollError(f"an FMU holds compiled code: {error}") from error
        return {f"binaries/{BINARIES[mockup.version]}/{library.name}": library.read_bytes()}

"""What the questions share: timing, compiling, the machine, the reduced form for any algebra, and results."""

import ctypes
import importlib.metadata
import importlib.util
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import numpy as np

import omniroll
from omniroll.kernels import sets
from omniroll.kernels.kernel import VEHICLE_SCALARS

ROOT = Path(__file__).resolve().parents[2]
COMPILER = "gcc"
FLAGS = ["-O3", "-std=gnu99", "-fno-math-errno"]  # for the peers' C and for ours alike

HARNESS = """
#include <time.h>
void rhs(const double *in, double *out);
__attribute__((externally_visible)) double seconds(const double *in, double *out, int in_size, int states, long calls)
{
    struct timespec a, b;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &a);
    for (long k = 0; k < calls; k++)
        rhs(in + (k % states)*in_size, out);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &b);
    return (b.tv_sec - a.tv_sec) + 1e-9*(b.tv_nsec - a.tv_nsec);
}
"""


@dataclass
class Target:
    """A ratio or a time that the project set itself, and what was measured."""

    claim: str
    measured: str
    reached: bool


@dataclass
class Answer:
    """One question's result, as it goes onto the page."""

    title: str
    text: str
    headings: list[str]
    rows: list[list[str]]
    targets: list[Target] = field(default_factory=list)
    closing: str = ""
    figures: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Times:
    """Minimum and median over repeats, in s."""

    least: float
    median: float

    def in_unit(self, scale: float, digits: str = ".3g") -> str:
        return f"{self.least * scale:{digits}} ({self.median * scale:{digits}})"


def repeated(action: Callable[[], float | None], repeats: int) -> Times:
    """Times of `action`: what it returns in s, or the time of this thread where it returns None."""
    found = []
    for _ in range(repeats):
        start = time.thread_time()
        own = action()
        found.append(time.thread_time() - start if own is None else own)
    return Times(min(found), statistics.median(found))


def compiled(folder: Path, name: str, sources: list[Path], *flags: str) -> ctypes.CDLL:
    """A shared library of C files."""
    library = folder / f"{name}.so"
    command = [COMPILER, *FLAGS, "-shared", "-fPIC", *flags, *map(str, sources), "-o", str(library), "-lm"]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(library))


class RightHandSide:
    """`void rhs(const double *in, double *out)` of C files, with the loop that times it in the same library."""

    def __init__(self, folder: Path, name: str, sources: list[Path], out_size: int, *flags: str):
        harness = folder / "harness.c"
        harness.write_text(HARNESS)
        self.library = compiled(folder, name, [*sources, harness], *flags)
        self.library.seconds.restype = ctypes.c_double
        self.out = np.empty(out_size)

    def __call__(self, state: np.ndarray) -> np.ndarray:
        state = np.ascontiguousarray(state)
        self.library.rhs(_pointer(state), _pointer(self.out))
        return self.out.copy()

    def per_call(self, states: np.ndarray, repeats: int = 60, least: float = 2e-3) -> Times:
        """Times of a call; a repeat takes at least `least` s."""
        states = np.ascontiguousarray(states)

        def seconds(calls: int) -> float:
            count, size = states.shape
            return self.library.seconds(_pointer(states), _pointer(self.out), size, count, ctypes.c_long(calls))

        calls = 16
        while seconds(calls) < least:
            calls *= 2
        return repeated(lambda: seconds(calls) / calls, repeats)


def _pointer(array: np.ndarray):
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def pair(set_name: str) -> Path:
    """The folder with the pair of files of a set, omniroll.h and omniroll.c."""
    return sets.c_folder(set_name, ())


def reduced_form(set_name: str, sin: Callable, cos: Callable):
    """A copy of the generated Python kernels whose sine and cosine are another algebra's."""
    name = f"omniroll.generated.python._{set_name}_of_{id(sin)}"
    spec = importlib.util.spec_from_file_location(name, sets.folder(set_name, ()) / f"{set_name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.sin, module.cos = sin, cos
    return module


def numeric_model(vehicle: omniroll.Vehicle, set_name: str):
    """The constants of the Python kernels, as floats."""
    module = importlib.import_module(f"omniroll.generated.python.{set_name}")
    return module.prepare(
        vehicle.wheels,
        vehicle.rollers_per_wheel,
        wheel_angles=list(vehicle.wheel_angles),
        **{name: getattr(vehicle, name) for name in VEHICLE_SCALARS},
    )


def model_as_data(model, symbol):
    """The model with symbols for its numbers (those that forward_dynamics reads), and these symbols in their order."""
    changed, symbols = SimpleNamespace(**vars(model)), []
    for name, value in model_numbers(model):
        if isinstance(value, list):
            setattr(changed, name, [symbol(f"{name}_{i}") for i in range(len(value))])
            symbols += getattr(changed, name)
        else:
            setattr(changed, name, symbol(name))
            symbols.append(getattr(changed, name))
    return changed, symbols


def model_numbers(model):
    """(name, number or list of numbers) of the constants that do not belong to a free roller's place."""
    skipped = ("wheels", "rollers_per_wheel", "cos_kappa", "sin_kappa")
    return [(name, value) for name, value in vars(model).items() if name not in skipped]


def random_states(vehicle: omniroll.Vehicle, count: int, seed: int = 1) -> tuple[np.ndarray, ...]:
    """nu (count, 3), chi (count, N), spins (count, N, n-1)."""
    random = np.random.default_rng(seed)
    wheels, rollers = vehicle.wheels, vehicle.rollers_per_wheel
    nu = random.uniform(-1, 1, (count, 3))
    chi = random.uniform(-0.95, 0.95, (count, wheels)) * np.pi / rollers
    return nu, chi, random.uniform(-2, 2, (count, wheels, rollers - 1))


def relative_error(found: np.ndarray, exact: np.ndarray) -> float:
    """Largest error over the largest component, of many states (rows)."""
    return float((np.abs(found - exact).max(axis=-1) / np.abs(exact).max(axis=-1)).max())


def machine() -> list[tuple[str, str]]:
    """The machine and the versions, without names of hosts or folders."""
    cpu, flags, cores = "unknown", "", 0
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        key, _, value = line.partition(":")
        cores += key.strip() == "processor"
        if key.strip() == "model name":
            cpu = value.strip()
        if key.strip() == "flags":
            flags = value
    vectors = [name for name in ("avx2", "fma", "avx512f") if name in flags.split()]
    version = subprocess.run([COMPILER, "--version"], capture_output=True, text=True).stdout.splitlines()[0]
    peers = []
    for name in ("casadi", "sympy", "heyoka", "mujoco", "numpy", "scipy"):
        try:
            peers.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            peers.append(f"{name} (not installed)")
    return [
        ("CPU", f"{cpu}, {cores} cores, {platform.machine()} with {', '.join(vectors) or 'no vector extension'}"),
        ("System", f"{platform.system()}, Python {sys.version.split()[0]}"),
        ("Compiler", f"{version}, `{' '.join(FLAGS)}` for the peers' C and for the kernels of question 1"),
        ("Peers", ", ".join(peers)),
    ]

"""The stand-in for machines without Python's C headers: the same C as plain libraries, the same numbers."""

import runpy
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from omniroll import Vehicle
from omniroll.kernels import kernel as kernels
from omniroll.kernels import shared_kernels

ROOT = Path(__file__).resolve().parents[2]
MODEL_SETS = ("massless", "locked", "free")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder with the three libraries, compiled as setup.py says."""
    if shutil.which("cc") is None:
        pytest.skip("cc is not installed")
    folder = tmp_path_factory.mktemp("libraries")
    for extension in runpy.run_path(str(ROOT / "runtime/build_kernels.py"))["shared_libraries"]():
        macros = [f"-D{name}={value}" for name, value in extension.define_macros]
        include = [f"-I{place}" for place in extension.include_dirs]
        library = folder / f"{extension.name.removeprefix('omniroll.')}.so"
        # Without optimisation: quick, and the numbers must be the same to the bit.
        flags = ["-shared", "-fPIC", *extension.extra_compile_args, "-O0", "-march=native", *macros, *include]
        subprocess.run(["cc", *flags, *extension.sources, "-o", library, "-lm"], cwd=ROOT, check=True)
    return folder


@pytest.mark.parametrize("number_type", kernels.NUMBER_TYPES)
def test_it_has_the_functions_and_numbers_of_the_modules(number_type, folder, monkeypatch):
    module = kernels.compiled_module(number_type)
    monkeypatch.setattr(shared_kernels, "__file__", str(folder / "kernels" / "shared_kernels.py"))
    assert shared_kernels.has_shared_kernels(number_type)
    shared = shared_kernels.shared_kernels.__wrapped__(number_type)
    real = kernels.NUMBER_TYPES[number_type]
    nu = np.random.default_rng(1).normal(size=3).astype(real)
    for name in MODEL_SETS:
        results = [model_and_wheel_speeds(loaded, name, nu, real) for loaded in (module, shared)]
        assert np.isfinite(results[0]).all() and np.array_equal(*results)


def model_and_wheel_speeds(loaded, name: str, nu: np.ndarray, real: type) -> np.ndarray:
    """The numbers that `prepare` and `wheel_speeds` of a set write for the paper's vehicle."""
    vehicle = Vehicle.paper()
    sizes = (vehicle.wheels, vehicle.rollers_per_wheel)
    model_size, prepare, wheel_speeds = (
        getattr(loaded.lib, f"omniroll_{name}_{function}") for function in ("model_size", "prepare", "wheel_speeds")
    )

    def pointer(array):
        return loaded.ffi.from_buffer("real_t[]", array)

    model = np.zeros(model_size(*sizes), real)
    angles = np.array(vehicle.wheel_angles, real)
    scalars = [float(getattr(vehicle, field)) for field in kernels.VEHICLE_SCALARS]
    prepare(*sizes, *scalars, pointer(angles), pointer(model))
    chi_dot = np.zeros(vehicle.wheels, real)
    wheel_speeds(*sizes, pointer(model), pointer(nu), pointer(chi_dot))
    return np.concatenate([model, chi_dot])


def test_without_a_library_there_is_none(tmp_path, monkeypatch):
    monkeypatch.setattr(shared_kernels, "__file__", str(tmp_path / "shared_kernels.py"))
    assert not shared_kernels.has_shared_kernels("double")

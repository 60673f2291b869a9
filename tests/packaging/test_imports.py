"""Imports: no circles, rooms that import only rooms before them, and nothing large or optional before it is used."""

import ast
import pickle
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import omniroll

PACKAGE = Path(omniroll.__file__).parent

# The order of the rooms, and of the modules that stand beside them: each imports only what stands before it. This is
# the one place where the order is written down.
ORDER = (
    "errors", "extras", "validation", "progress", "durable", "json_texts", "interruption", "alone", "generated",
    "generated_data", "kinds", "vocabulary", "vehicles", "codegen", "kernels", "effects", "robots", "results",
    "conventions", "exchange", "viewer", "engine", "sweeps", "scenes", "identification", "studies", "gym", "omniroll",
    "commands", "cli", "__main__",
)  # fmt: skip
OPTIONAL = {  # what the extras of pyproject.toml bring
    "control", "dask", "distributed", "flint", "gymnasium", "heyoka", "matplotlib", "mujoco", "pandas", "pyarrow",
    "rosbags", "tqdm", "xarray",
}  # fmt: skip
ROOMS_OF_SCIPY = tuple(f"scipy.{room}" for room in ("integrate", "interpolate", "linalg", "optimize", "special"))
LARGE = ("numpy", "scipy", *ROOMS_OF_SCIPY, "cffi", "jinja2", "json", "shtab", *sorted(OPTIONAL))


def name_of(path: Path) -> str:
    parts = ("omniroll", *path.relative_to(PACKAGE).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


BUILT = PACKAGE / "kernels/built"  # generated kernels that the build has put beside their libraries
MODULES = {name_of(path): path for path in sorted(PACKAGE.rglob("*.py")) if not path.is_relative_to(BUILT)}


def imported_by(path: Path) -> set[str]:
    """The modules of the package that a file imports anywhere, also inside functions and for type checkers only."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            whole = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {name if is_module(name) else node.module for name in whole}
    return {name for name in found if name.split(".")[0] == "omniroll"}


def is_module(name: str) -> bool:
    return name in MODULES or name in ("omniroll.generated", "omniroll.generated.python", "omniroll.codegen")


def room_of(module: str) -> str:
    return module.split(".")[1] if "." in module else "omniroll"


@pytest.fixture(scope="module")
def imports() -> dict[str, set[str]]:
    return {name: imported_by(path) for name, path in MODULES.items()}


def test_every_room_has_its_place():
    assert {room_of(name) for name in MODULES} | {"generated", "codegen"} == set(ORDER)


def test_modules_import_in_no_circle(imports):
    try:
        tuple(TopologicalSorter(imports).static_order())
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_rooms_import_only_rooms_before_them(imports):
    wrong = [
        f"{name} imports {other}"
        for name, others in imports.items()
        for other in sorted(others)
        if ORDER.index(room_of(other)) > ORDER.index(room_of(name))
    ]
    assert wrong == []


def test_optional_packages_are_imported_where_they_are_used():
    """At the top of a module they would be needed by everybody who imports it. omniroll.gym is imported by those only
    who have gymnasium."""
    wrong = []
    for name, path in MODULES.items():
        if room_of(name) == "gym":
            continue
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module]
                wrong += [f"{name} imports {module}" for module in modules if module.split(".")[0] in OPTIONAL]
    assert wrong == []


def loaded_after(code: str) -> set[str]:
    """The modules of LARGE, and those of the package, that a fresh interpreter has after `code`."""
    program = f"{code}\nimport sys\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return {name for name in done.stdout.split() if name in LARGE or name.split(".")[0] == "omniroll"}


def test_importing_the_package_imports_nothing_else():
    assert loaded_after("import omniroll") == {"omniroll"}


def test_a_vehicle_needs_no_compiled_code_and_no_scipy():
    large = loaded_after("import omniroll; omniroll.Vehicle.paper()") & set(LARGE)
    assert large == {"numpy", "json"}  # json reads the derivation's bounds


def test_a_run_of_the_compiled_engine_imports_no_room_of_scipy():
    """They take longer than all that this package imports."""
    large = loaded_after("import omniroll; omniroll.simulate(omniroll.Vehicle.paper(), nu=(1, 0, 1), duration=1)")
    assert "omniroll.engine.compiled_engine" in large and not large & set(ROOMS_OF_SCIPY)


def test_the_names_of_the_package():
    """What is imported when it is used is there for dir(), for star imports and for pickle, and errors are plain."""
    assert set(omniroll.__all__) <= set(dir(omniroll))
    for name in omniroll.__all__:
        thing = getattr(omniroll, name)
        assert thing.__name__ == name and sys.modules[thing.__module__].__dict__[name] is thing
        assert pickle.loads(pickle.dumps(thing)) is thing
    with pytest.raises(AttributeError):
        omniroll.nothing_of_this_name  # noqa: B018

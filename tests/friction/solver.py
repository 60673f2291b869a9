"""The C solver of runtime/csrc/friction, compiled alone, and the law of friction by formulas that are not its."""

import hashlib
import subprocess
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
from cffi import FFI

FRICTION = Path(__file__).resolve().parents[2] / "runtime/csrc/friction"
WARNINGS = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-Wno-sign-conversion")
ALONE = "-DFRICTION_LINKAGE="  # a library of its own
FIXED, INTERVAL, ELLIPSE = range(3)
RESTS, SLIPS, YIELDS = range(3)
BEHIND = np.full(64, 0xA5, np.uint8)  # behind the memory

DECLARATIONS = """
typedef struct { int kind, first, rows; double size[2], strip; } friction_element_t;
typedef struct {
    int rows, elements, apart, equalities;
    friction_element_t *element;
    double *matrix, *given, *equality, *wanted, *mobility, *yaw, *apart_given, *bound, *yaw_rows;
    double yaw_yaw;
} friction_problem_t;
typedef struct {
    double *force, *acceleration; int *state; double *pull; double residual; int iterations, unique;
} friction_solution_t;
size_t friction_memory(int rows, int elements, int apart, int equalities);
int friction_decide(const friction_problem_t *problem, void *memory, friction_solution_t *found);
double friction_least_use(const friction_problem_t *problem, void *memory, friction_solution_t *found);
double friction_use_rate(const friction_problem_t *problem, void *memory, const double *change);
"""


@dataclass(frozen=True)
class Element:
    """An element of friction: its kind and the half-axes of its set; `strip` bounds the first row alone."""

    kind: int
    size: tuple[float, ...] = ()
    strip: float = np.inf

    @property
    def rows(self) -> int:
        return 1 if self.kind == INTERVAL else 2


@dataclass
class Problem:
    """Forces y with y^T matrix y/2 + given^T y least; rows apart have intervals and meet the others through the yaw."""

    elements: list[Element]
    matrix: np.ndarray
    given: np.ndarray
    equality: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    wanted: np.ndarray = field(default_factory=lambda: np.zeros(0))
    mobility: np.ndarray = field(default_factory=lambda: np.zeros(0))
    yaw: np.ndarray = field(default_factory=lambda: np.zeros(0))
    apart_given: np.ndarray = field(default_factory=lambda: np.zeros(0))
    bound: np.ndarray = field(default_factory=lambda: np.zeros(0))
    yaw_rows: np.ndarray = field(default_factory=lambda: np.zeros(0))
    yaw_yaw: float = 0.0

    def whole(self) -> tuple[np.ndarray, np.ndarray, list[Element]]:
        """The same with all rows in one matrix."""
        across = np.outer(self.yaw_rows, self.yaw) if len(self.yaw) else np.zeros((len(self.given), 0))
        apart = np.diag(self.mobility) + self.yaw_yaw * np.outer(self.yaw, self.yaw)
        matrix = np.block([[self.matrix, across], [across.T, apart]])
        intervals = [Element(INTERVAL, (bound,)) for bound in self.bound]
        return matrix, np.concatenate([self.given, self.apart_given]), self.elements + intervals


@dataclass(frozen=True)
class Solution:
    """What the solver has found."""

    force: np.ndarray
    acceleration: np.ndarray
    state: np.ndarray
    pull: np.ndarray
    residual: float
    iterations: int
    unique: bool
    status: float
    rate: float  # of the least use


@cache
def library(place: Path, *flags: str) -> tuple[FFI, object]:
    """The solver as a library in `place`, each file compiled by itself."""
    ffi = FFI()
    ffi.cdef(DECLARATIONS)
    name = hashlib.sha256("".join(flags).encode()).hexdigest()[:8]
    objects = []
    for source in sorted(FRICTION.glob("*.c")):
        objects.append(place / f"{source.stem}-{name}.o")
        options = [*WARNINGS, "-O2", "-fPIC", ALONE, *flags]
        command = ["cc", *options, "-c", str(source), "-o", str(objects[-1])]
        subprocess.run(command, check=True)
    built = place / f"friction-{name}.so"
    subprocess.run(["cc", "-shared", *flags, *map(str, objects), "-lm", "-o", str(built)], check=True)
    return ffi, ffi.dlopen(str(built))


def c_elements(problem: Problem) -> np.ndarray:
    """The elements as C has them."""
    layout = np.dtype([("kind", "i4"), ("first", "i4"), ("rows", "i4"), ("size", "f8", 2), ("strip", "f8")], align=True)
    elements, first = np.zeros(len(problem.elements), dtype=layout), 0
    for place, element in enumerate(problem.elements):
        size = (*element.size, 0.0, 0.0)[:2]
        elements[place] = element.kind, first, element.rows, size, element.strip
        first += element.rows
    return elements


def solve(
    built: tuple[FFI, object], problem: Problem, function: str = "friction_decide", change: np.ndarray | None = None
) -> Solution:
    """What a function of the solver finds; its memory is full of NaN before, and nothing behind it is written.
    `change`: of h - E y, for the rate of the least use."""
    ffi, lib = built
    rows, apart, count = len(problem.given), len(problem.yaw), len(problem.elements)
    elements = ffi.new("friction_element_t[]", count + 1)
    ffi.memmove(elements, c_elements(problem), count * ffi.sizeof("friction_element_t"))
    kept = {}

    def numbers(values: np.ndarray) -> object:
        kept[len(kept)] = np.ascontiguousarray(np.append(np.ravel(values), 0.0))
        return ffi.cast("double *", kept[len(kept) - 1].ctypes.data)

    names = ("matrix", "given", "equality", "wanted", "mobility", "yaw", "apart_given", "bound", "yaw_rows")
    given = ffi.new(
        "friction_problem_t *",
        {
            **{"rows": rows, "elements": count, "apart": apart, "equalities": len(problem.wanted), "element": elements},
            **{name: numbers(getattr(problem, name)) for name in names},
            "yaw_yaw": problem.yaw_yaw,
        },
    )
    force, acceleration = np.full((2, rows + apart + 1), np.nan)
    pull = np.full(2 * count + apart + 1, np.nan)
    state = np.full(count + apart + 1, -1, dtype=np.intc)
    found = ffi.new("friction_solution_t *")
    for name, array in (("force", force), ("acceleration", acceleration), ("pull", pull)):
        setattr(found, name, ffi.cast("double *", array.ctypes.data))
    found.state = ffi.cast("int *", state.ctypes.data)
    size = lib.friction_memory(rows, count, apart, len(problem.wanted))
    memory = np.concatenate([np.full(size // 8 + 1, np.nan).view(np.uint8)[:size], BEHIND])
    status = getattr(lib, function)(given, ffi.cast("void *", memory.ctypes.data), found)
    arrays = force[:-1], acceleration[:-1], state[:-1], pull[:-1]
    assert (memory[size:] == BEHIND).all()
    rate = (
        np.nan
        if change is None
        else lib.friction_use_rate(given, ffi.cast("void *", memory.ctypes.data), numbers(change))
    )
    return Solution(*arrays, found.residual, found.iterations, bool(found.unique), status, rate)


def nearest_in_cone(acceleration: np.ndarray, *normals: np.ndarray) -> float:
    """The distance of -acceleration from the cone of all normals that a set has at a place."""
    found = [np.linalg.norm(acceleration)]
    for normal in normals:
        along = max(-(acceleration @ normal) / (normal @ normal), 0)
        found.append(np.linalg.norm(acceleration + along * normal))
    if len(normals) == 2 and abs(np.linalg.det(np.array(normals, dtype=float))) > 0:
        parts = np.linalg.solve(np.array(normals, dtype=float).T, -acceleration.astype(float))
        found += [0.0] if (parts >= 0).all() else []
    return float(min(found))


def law(problem: Problem, force: np.ndarray, edge: float = 1e-12) -> float:
    """By how much forces break the law: outside of their sets, or with accelerations that are not against them; over
    the size of the accelerations' terms. In extended precision, with all rows in one matrix."""
    matrix, given, elements = problem.whole()
    wide = np.longdouble
    acceleration = matrix.astype(wide) @ force.astype(wide) + given
    terms = np.abs(matrix) @ np.abs(force) + np.abs(given)
    worst, first = 0.0, 0
    for element in elements:
        rows = slice(first, first + element.rows)
        first += element.rows
        size = np.ones(element.rows) if element.kind == FIXED else np.array(element.size)
        if element.kind == ELLIPSE and not element.strip > 0:
            size = np.array([0, size[1]])
        place = np.divide(force[rows], size, out=np.zeros(element.rows), where=size > 0)
        rate, scale = acceleration[rows] * size, float(max(terms[rows] * size))
        normals = []
        if element.kind != FIXED:
            gauge, strip = np.linalg.norm(place), element.strip / size[0] if size[0] > 0 else np.inf
            worst = max(worst, gauge - 1, abs(place[0]) / strip - 1, np.abs(force[rows][size == 0]).max(initial=0))
            normals += [place] if gauge > 1 - edge else []
            normals += [np.sign(place) * [1, 0]] if abs(place[0]) > strip * (1 - edge) else []
        if scale > 0:
            worst = max(worst, nearest_in_cone(rate, *normals) / scale)
    return float(worst)

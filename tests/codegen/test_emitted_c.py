"""The emitted C compiles as a hostile reviewer would compile it, and agrees with the emitted Python."""

import ctypes
import importlib
import shutil
import subprocess

import pytest

FLAGS = [
    "-std=c99",
    "-pedantic",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wshadow",
    "-O2",
]
TYPES = {"double": ([], ctypes.c_double, 2.0**-52), "float": (["-DOMNIROLL_FLOAT"], ctypes.c_float, 2.0**-23),
         "long double": (["-DOMNIROLL_LONG_DOUBLE"], ctypes.c_longdouble, 2.0**-52)}  # fmt: skip
N, n = 3, 4
NU, CHI, THETA = [0.25, -0.5, 1.5], [0.125, -0.25, 0.5], 0.75
SPINS = [[0.5 * i - 0.25 * j for j in range(n - 1)] for i in range(N)]
MOMENTA = [[0.5, 0.25], [-0.75, 1.0], [0.125, -2.0]]


@pytest.fixture(scope="module", params=[(c, t) for c in ("gcc", "clang") for t in TYPES], ids="-".join)
def library(request, toy_folder, tmp_path_factory):
    """(the loaded toy, its real type, its epsilon), for a compiler and a number type."""
    compiler, number_type = request.param
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    macro, real, epsilon = TYPES[number_type]
    file = tmp_path_factory.mktemp("toy") / "toy.so"
    sources = sorted(map(str, toy_folder.glob("c/omniroll_*.c")))
    subprocess.run([compiler, *FLAGS, *macro, "-shared", "-fPIC", "-o", file, *sources, "-lm"], check=True)
    loaded = ctypes.CDLL(str(file))
    loaded.omniroll_toy_model_size.restype = loaded.omniroll_toy_step_work_size.restype = ctypes.c_size_t
    return loaded, real, epsilon


@pytest.fixture(scope="module")
def python(toy_folder):
    return importlib.import_module("toy_generated.python.toy")


def flat(values):
    return [x for v in values for x in flat(v)] if isinstance(values, list | tuple) else [float(values)]


def reals(real, values):
    values = flat(values)
    return (real * len(values))(*values)


def model_of(library, real):
    model = reals(real, [0.0] * library.omniroll_toy_model_size(N, n))
    library.omniroll_toy_prepare(N, n, real(2.5), real(8.0), reals(real, [0.5, 2.5, 4.5]), model)
    return model


def python_model(python):
    return python.prepare(N, n, 2.5, 8.0, [0.5, 2.5, 4.5])


def agree(found, expected, epsilon):
    assert flat(list(found)) == pytest.approx(flat(expected), rel=200 * epsilon, abs=20 * epsilon)


def test_model(library, python):
    loaded, real, epsilon = library
    assert loaded.omniroll_toy_model_size(N, n) == 2 + 2 * N + (n - 1)
    m = python_model(python)
    expected = [m.gain, m.l, *[x for i in range(N) for x in (m.cos_alpha[i], m.sin_alpha[i])], *m.cos_kappa]
    agree(model_of(loaded, real), expected, epsilon)


def test_functions(library, python):
    loaded, real, epsilon = library
    model, m = model_of(loaded, real), python_model(python)
    out = reals(real, [0.0] * 3)
    loaded.omniroll_toy_reduced(N, n, model, reals(real, NU), reals(real, CHI), reals(real, MOMENTA), out)
    agree(out, python.reduced(m, NU, CHI, MOMENTA), epsilon)
    rates, spins = reals(real, [0.0] * N), reals(real, [0.0] * N)
    loaded.omniroll_toy_wheel_rates(N, n, model, reals(real, NU), reals(real, CHI), rates, spins)
    agree([*rates, *spins], python.wheel_rates(m, NU, CHI), epsilon)
    loaded.omniroll_toy_pose_rates(N, n, model, reals(real, NU), real(THETA), out)
    agree(out, python.pose_rates(m, NU, THETA), epsilon)


def test_arrays_are_dense(library, python):
    loaded, real, epsilon = library
    model = model_of(loaded, real)
    matrix, spins, momenta = (reals(real, [0.0] * size) for size in (9, N * (n - 1), 2 * N))
    energy = reals(real, [0.0])
    loaded.omniroll_toy_everything(
        N, n, model, reals(real, NU), reals(real, CHI), reals(real, SPINS), matrix, spins, momenta, energy
    )
    expected = python.everything(python_model(python), NU, CHI, SPINS)
    agree([*matrix, *spins, *momenta, *energy], expected, epsilon)


def test_set_without_a_model(library, toy_folder):
    loaded, real, epsilon = library
    parts = importlib.import_module("toy_generated.python.parts")
    total, mean = reals(real, [0.0]), reals(real, [0.0])
    loaded.omniroll_parts_share_of(N, n, real(1.5), reals(real, CHI), total, mean)
    agree([*total, *mean], parts.share_of(N, n, 1.5, CHI), epsilon)


def python_step(python, model, h, nu, chi, pose):
    """One classical Runge-Kutta step, written out."""

    def rates(state):
        nu, chi, pose = state[:3], state[3 : 3 + N], state[3 + N :]
        return [*python.reduced(model, nu, chi, MOMENTA), *python.wheel_speeds(model, nu),
                *python.pose_rates(model, nu, pose[2])]  # fmt: skip

    y = [*nu, *chi, *pose]
    ahead = lambda k, c: [a + c * b for a, b in zip(y, k, strict=True)]  # noqa: E731
    k1 = rates(y)
    k2 = rates(ahead(k1, h / 2))
    k3 = rates(ahead(k2, h / 2))
    k4 = rates(ahead(k3, h))
    return [a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(y, k1, k2, k3, k4, strict=True)]


def test_step(library, python):
    loaded, real, epsilon = library
    work = reals(real, [0.0] * loaded.omniroll_toy_step_work_size(N))
    nu, chi, pose = reals(real, NU), reals(real, CHI), reals(real, [0.0, 1.0, THETA])
    loaded.omniroll_toy_step(N, n, model_of(loaded, real), real(0.125), nu, chi, reals(real, MOMENTA), pose, work)
    agree(
        [*nu, *chi, *pose],
        python_step(python, python_model(python), 0.125, NU, CHI, [0.0, 1.0, THETA]),
        epsilon,
    )


def test_header_serves_cpp(toy_folder, tmp_path):
    compiler = next(filter(None, map(shutil.which, ["g++", "clang++"])), None)
    if compiler is None:
        pytest.skip("no C++ compiler")
    program = tmp_path / "all.cpp"
    headers = sorted(h.name for h in toy_folder.glob("c/omniroll_*.h"))
    program.write_text("".join(f'#include "{h}"\n' for h in headers) + "int main() { return 0; }\n")
    subprocess.run([compiler, "-Wall", "-Wextra", "-Werror", "-fsyntax-only", f"-I{toy_folder}/c", program], check=True)


def test_source_says_where_it_comes_from(toy_folder):
    for file in toy_folder.rglob("*.*"):
        if file.is_file() and "__pycache__" not in file.parts:
            start = file.read_text()[:600]
            assert "Generated by codegen from codegen/templates/" in start, file
            assert "do not edit" in start.replace("\n", " "), file


def test_comments_carry_counts_units_and_equations(toy_folder):
    header = (toy_folder / "c/omniroll_toy.h").read_text()
    assert "Equations: (3.4), section 4." in header
    assert "out nu_dot[3] [1]: the toy's nu_dot" in header
    assert "Operations: once" in header and "Intermediates:" in header
    longest = max(len(line) for file in toy_folder.glob("c/omniroll_*") for line in file.read_text().splitlines())
    assert longest <= 120

"""Sine and cosine in the generated C: a polynomial for half a wheel angle, the library for longer angles."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import mpmath
import numpy as np
import pytest

from omniroll.kernels import sets

HERE = Path(__file__).resolve().parent
ENGINE = HERE.parents[1] / "runtime" / "csrc"
TYPES = {"double": ([], np.float64), "float": (["-DOMNIROLL_FLOAT"], np.float32)}
LONGEST = np.sqrt(0.28)  # of the angles that have the polynomial


def sines(folder, macros, real, angles):
    """(sin, cos) of the angles by the generated C, built with these macros."""
    if shutil.which("gcc") is None:
        pytest.skip("gcc is not installed")
    library = folder / "sines.so"
    for name, text in sets.programs().kernel("free", ()).files().items():
        (folder / name).write_text(text)
    flags = [
        "-std=c99",
        "-O2",
        "-Wno-psabi",
        "-ffp-contract=off",
        "-shared",
        "-fPIC",
        f"-I{folder}",
        f"-I{ENGINE}",
        *macros,
    ]
    subprocess.run(["gcc", *flags, str(HERE / "sines.c"), "-o", str(library), "-lm"], check=True)
    angles = np.ascontiguousarray(angles, real)
    found = np.empty((2, len(angles)), real)
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in (angles, found[0], found[1])]
    ctypes.CDLL(str(library)).sines(len(angles), *pointers)
    return found


def ulps(found, angles, real):
    """Distance of (sin, cos) from the exact values, in units in the last place of these."""
    with mpmath.workdps(40):
        exact = [[f(mpmath.mpf(float(x))) for x in angles] for f in (mpmath.sin, mpmath.cos)]
        return np.array(
            [
                [float(abs(float(a) - b) / float(np.spacing(real(abs(b))))) if b else float(a != 0)
                 for a, b in zip(row, wanted, strict=True)]
                for row, wanted in zip(found, exact, strict=True)
            ]
        )  # fmt: skip


def short_angles(real):
    """Angles of both signs on a roller, tiny ones, and the neighbours of the longest one."""
    edge = real(LONGEST)
    edges = [np.nextafter(edge, real(0)), edge, np.nextafter(edge, real(1))]
    some = np.random.default_rng(3).uniform(0, np.pi / 6, 3000)
    positive = np.array([0, 1e-30, 1e-9, 1e-4, np.pi / 6, *edges, *some], real)
    return np.concatenate([positive, -positive])


@pytest.mark.parametrize("number_type", TYPES)
def test_sines_are_right_to_an_ulp_and_odd_and_even_to_the_bit(number_type, tmp_path):
    """Short angles have the polynomial, long ones the library's."""
    macros, real = TYPES[number_type]
    short, long = short_angles(real), np.array([0.6, 1.0, -2.0, 3.5, 100.0, -1e5], real)
    angles = np.concatenate([short, long])
    found = sines(tmp_path, macros, real, angles)
    assert ulps(found, angles, real).max() <= 1
    sine, cosine = found[:, : len(short)].reshape(2, 2, -1)
    assert np.array_equal(sine[1], -sine[0]) and np.array_equal(cosine[1], cosine[0])


def test_without_the_question_the_polynomial_still_serves_a_little_beyond(tmp_path):
    """In the compiled engine: up to pi/4, chi = pi/2, errors stay small."""
    angles = np.linspace(0.5, np.pi / 4, 200)
    found = sines(tmp_path, ["-DSHORT_ANGLES"], np.float64, angles)
    assert np.abs(found - [np.sin(angles), np.cos(angles)]).max() < 2e-12

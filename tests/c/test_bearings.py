"""The compiled engine's complementarity problem alone, under the sanitizers: the law, and what Python finds."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from effects.test_complementarity import CASES, case, load

from omniroll.effects.complementarity import Facets, least_torques, nearest_force, span

SEEDS = CASES[::2]
ROOT = Path(__file__).resolve().parents[2]
SANITIZERS = ("-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def problem(seed):
    """A case, and forces that its bearings can hold: inside, on a facet, on a vertex, and none."""
    rows, bounds, mass_matrix, force = case(seed)
    held = span(rows).T @ span(rows) @ force
    held *= (0.9, 1.0, 0.999999)[seed % 3] / max(load(held, rows, bounds), 1e-3)
    if seed % 7 == 0:
        held = rows.T @ (bounds * np.sign(rows @ force))
    return rows, bounds, mass_matrix, force, 0.0 * held if seed % 11 == 0 else held


def answers(folder, problems):
    """For each problem nu' and its torques, the largest part of a facet's reach, the least torques twice."""
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("no gcc")
    made = folder / "bearings"
    source = Path(__file__).with_name("bearings.c")
    command = [compiler, "-std=c11", "-Wall", "-Wextra", "-Werror", "-Wno-psabi", *SANITIZERS]
    built = subprocess.run(
        [*command, f"-I{ROOT / 'runtime/csrc'}", source, "-lm", "-o", made], capture_output=True, text=True
    )
    if "cannot find" in built.stderr and "san" in built.stderr:
        pytest.skip("no sanitizer libraries")
    assert built.returncode == 0, built.stderr
    lines = []
    for rows, *numbers in problems:
        flat = np.concatenate([rows.ravel(), *(np.ravel(part) for part in numbers)])
        lines.append(" ".join([str(len(rows)), *map(repr, flat.tolist())]))
    ran = subprocess.run([made], input="\n".join(lines), capture_output=True, text=True, timeout=120)
    assert ran.returncode == 0, ran.stderr
    return [np.array(line.split(), float) for line in ran.stdout.splitlines()]


@pytest.mark.long
def test_the_problem_is_solved_as_in_python(tmp_path):
    problems = [problem(seed) for seed in SEEDS]
    for given, answer in zip(problems, answers(tmp_path, problems), strict=True):
        check(*given, answer)


def check(rows, bounds, mass_matrix, force, held, answer):
    count = len(rows)
    nu_dot, torques, (part,), least, of_more = np.split(answer, [3, 3 + count, 4 + count, 4 + 2 * count])
    size = np.abs(force).max()
    wanted, _ = nearest_force(mass_matrix, force, rows, bounds)
    np.testing.assert_allclose(nu_dot, wanted, rtol=0, atol=1e-10 * (1e-3 + np.abs(wanted).max()))
    np.testing.assert_allclose(mass_matrix @ nu_dot - force, rows.T @ torques, atol=1e-12 * size)
    assert (np.abs(torques) <= bounds).all()
    rates = rows @ nu_dot
    assert np.abs(bounds * np.abs(rates) + torques * rates).max() <= 1e-12 * size * max(1, np.abs(nu_dot).max())
    facets = Facets.of(rows, bounds)
    assert part == pytest.approx(max((facets.normals @ held / facets.reach).max(), 0), rel=1e-12, abs=1e-15)
    np.testing.assert_allclose(rows.T @ least, held, atol=1e-12 * np.abs(rows).max() * bounds.max())
    assert (np.abs(least) <= bounds).all()
    of_python = least_torques(held, rows, bounds)
    np.testing.assert_allclose(least, of_python, atol=1e-9 * bounds.max())
    np.testing.assert_allclose(of_more, least, atol=1e-9 * bounds.max())  # also where no torques give that force

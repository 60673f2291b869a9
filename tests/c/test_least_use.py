"""The compiled engine's least use alone, under the sanitizers: what Python finds, which is tested against SciPy."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from c.test_bearings import ROOT, SANITIZERS

from omniroll.effects.least_use import Uses, least_norm, least_use

WIDER = 1.1


def problem(seed):
    """Rows of forces, what they are to give, and uses; in a third of the cases rows of rank two, in some of them parts
    of very different sizes."""
    rng = np.random.default_rng([52, seed])
    count, parts = int(rng.integers(1, 13)), int(rng.integers(6, 16))
    columns = rng.normal(size=(3, count))
    if seed % 3 == 0:
        columns[2] = columns[0] - columns[1]
    force = columns @ rng.normal(size=count)
    per_force = rng.normal(size=(parts, 2, count)) * (rng.random((parts, 1, count)) < 0.5)
    per_force[:, 1] *= (rng.random(parts) < 0.5)[:, None]
    per_force[np.arange(count) % parts, 0, np.arange(count)] += 1
    per_force *= 10 ** rng.uniform(-4, 0, (parts, 1, 1)) if seed % 4 == 0 else 1.0
    given = 0.3 * rng.normal(size=(parts, 2))
    return columns, force, Uses(per_force, given)


@pytest.mark.long
def test_the_least_use_and_the_least_norm_are_those_of_python(tmp_path):
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("no gcc")
    made, source = tmp_path / "least_use", Path(__file__).with_name("least_use.c")
    command = [compiler, "-std=c11", "-Wall", "-Wextra", "-Werror", "-Wno-psabi", "-Wno-unused-function", *SANITIZERS]
    built = subprocess.run(
        [*command, f"-I{ROOT / 'runtime/csrc'}", source, "-lm", "-o", made], capture_output=True, text=True
    )
    if "cannot find" in built.stderr and "san" in built.stderr:
        pytest.skip("no sanitizer libraries")
    assert built.returncode == 0, built.stderr
    problems, lines = [problem(seed) for seed in range(60)], []
    for columns, force, uses in problems:
        numbers = (columns.T, force, uses.per_force, uses.given, WIDER)
        flat = np.concatenate([np.ravel(part) for part in numbers])
        lines.append(" ".join([str(columns.shape[1]), str(len(uses.given)), *map(repr, flat.tolist())]))
    ran = subprocess.run([made], input="\n".join(lines), capture_output=True, text=True, timeout=120)
    assert ran.returncode == 0, ran.stderr
    for (columns, force, uses), line in zip(problems, ran.stdout.splitlines(), strict=True):
        (found,), forces, of_least_norm = np.split(np.array(line.split(), float), [1, 1 + columns.shape[1]])
        use, _ = least_use(columns, force, uses)
        assert found == pytest.approx(use, rel=1e-12)
        assert columns @ forces == pytest.approx(force, abs=1e-12 * (1 + np.abs(force).max()))
        assert uses.of(forces).max() == pytest.approx(use, rel=1e-12)
        wider = Uses(*(own / (WIDER * use) for own in (uses.per_force, uses.given, uses.lacking)))
        wanted = least_norm(columns, force, wider)
        assert wider.of(of_least_norm).max() <= 1 + 1e-12
        assert of_least_norm == pytest.approx(wanted, abs=1e-7 * (1 + np.abs(wanted).max()))

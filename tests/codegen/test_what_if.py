"""What follows from a changed assumption: what fails is listed, the rest still runs, equations stand old beside new."""

import contextlib
import io
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from codegen import what_if
from codegen.maxima import Maxima, MaximaError

ROOT = Path(__file__).resolve().parents[2]
ONE_CHAPTER = """load("./claims.mac")$
chapter("first.mac", "")$
prove("right", "1 = 1", 0)$
prove("wrong", "x = 2 x", x)$
prove("right again", "2 = 2", 0)$
s: openw(output_file)$
printf(s, "[~a, ~a]", length(proofs), length(failures))$
close(s)$
"""


@pytest.fixture
def script(tmp_path):
    shutil.copy(ROOT / "maxima/machinery/claims.mac", tmp_path)
    (tmp_path / "derive.mac").write_text(ONE_CHAPTER)
    return tmp_path / "derive.mac"


def test_a_proof_that_fails_stops_the_derivation(script, tmp_path):
    with pytest.raises(MaximaError, match="wrong"):
        Maxima.find().derive(script, tmp_path / "out", lambda line: None)


def test_asked_what_if_it_is_counted_and_the_next_proof_runs(script, tmp_path):
    Maxima.find().derive(script, tmp_path / "out", lambda line: None, flags=("collect_failures",))
    assert (tmp_path / "out").read_text() == "[2, 1]"


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    """What follows from a change of one line of the derivation: what is told, and the LaTeX."""

    def ask(file: str, old: str, new: str, *options: str) -> tuple[str, Path]:
        folder = tmp_path_factory.mktemp("what-if")
        changed = shutil.copytree(ROOT / "maxima", folder / "maxima") / file
        text = changed.read_text()
        assert text.count(old) == 1
        changed.write_text(text.replace(old, new))
        tex, told = folder / "equations.tex", io.StringIO()
        with contextlib.redirect_stdout(told):
            assert what_if.main(["--script", str(folder / "maxima/derive.mac"), "--output", str(tex), *options]) == 0
        return told.getvalue(), tex

    return ask


def changed(told: str) -> set[str]:
    """The equations that are told to be others than they were."""
    return set(re.findall(r"^  (\S+), .*\n    old ", told, re.MULTILINE))


@pytest.mark.long
def test_one_changed_term_of_the_kinetic_energy(asked):
    told, tex = asked(
        "paper/kinetic_energy.mac", "spin^2 + 2*dot(carrier, axis)*spin", "spin^2 + dot(carrier, axis)*spin",
        "--only-paper",
    )  # fmt: skip
    assert "free roller, first integral (paper/free_rollers.mac)" in told and "leaves" in told
    assert {"7.1:13", "7.1:23", "PP12", "3.4:wheel:1"} <= changed(told) and "7.1:11" not in changed(told)
    assert tex.read_text().count("old: ") == tex.read_text().count("new: ") == len(changed(told))
    compiled(tex)


def test_asked_of_the_paper_alone_the_equations_are_as_committed(asked):
    told, _ = asked("paper/geometry.mac", "axle: level_axle$", "axle: 1*level_axle$", "--only-paper")
    assert "0 fail" in told and "0 of 46 equations change" in told


@pytest.mark.long
def test_axles_that_are_not_horizontal(asked):
    level, leaning = "axle: level_axle$", "axle: cos(camber)*level_axle + sin(camber)*vertical$"
    told, tex = asked("paper/geometry.mac", level, leaning, "--only-paper")
    assert "(2.2) (paper/constraints.mac)" in told
    assert {"2.1", "2.2", "7.1:11", "7.1:33", "PP12", "3.4:wheel:1"} <= changed(told)
    compiled(tex)


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="no pdflatex here")
def test_the_equations_fit_the_page(tmp_path):
    compiled(Path(shutil.copy(ROOT / "generated/latex/equations.tex", tmp_path)))


def compiled(source: Path) -> None:
    """Nothing is too wide for the page; nothing is asked where there is no LaTeX."""
    if shutil.which("pdflatex") is None:
        return
    command = ["pdflatex", "-interaction=nonstopmode", f"-output-directory={source.parent}", source]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    assert done.returncode == 0 and re.findall("Overfull.*", done.stdout) == []

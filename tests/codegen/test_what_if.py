"""What follows from a changed assumption: what fails is listed, the rest still runs, equations stand old beside new."""

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


@pytest.mark.slow
def test_one_changed_term_of_the_kinetic_energy(tmp_path, capsys):
    changed = shutil.copytree(ROOT / "maxima", tmp_path / "maxima")
    energy = changed / "paper/kinetic_energy.mac"
    text = energy.read_text()
    assert text.count("2*theta_dot*sin(angle)*spin") == 1
    energy.write_text(text.replace("spin^2 + 2*theta_dot*sin(angle)*spin", "spin^2 + theta_dot*sin(angle)*spin"))
    tex = tmp_path / "equations.tex"
    assert what_if.main(["--script", str(changed / "derive.mac"), "--output", str(tex)]) == 0
    told = capsys.readouterr().out
    assert "free roller, first integral (paper/free_rollers.mac)" in told and "leaves" in told
    assert "7.1:13, mass matrix, part of a wheel" in told and "7.1:11," not in told
    assert "massless, forward_dynamics" not in told, "what does not depend on the change still holds"
    assert tex.read_text().count("old: ") == tex.read_text().count("new: ") > 10


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="no pdflatex here")
def test_the_equations_fit_the_page(tmp_path):
    source = ROOT / "generated/latex/equations.tex"
    command = ["pdflatex", "-interaction=nonstopmode", f"-output-directory={tmp_path}", source]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    assert done.returncode == 0 and "Overfull" not in done.stdout

"""What follows from a changed assumption: what fails is listed, the rest still runs, equations stand old beside new."""

import contextlib
import io
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pages import ROOT, blocks, page

import omniroll
from codegen import what_if
from omniroll.studies import what_if as what_if_study


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
    return set(re.findall(r"^  (\S+), .*\n    (?:old|loses|gains) ", told, re.MULTILINE))


@pytest.mark.long
def test_one_changed_term_of_the_kinetic_energy(asked):
    told, tex = asked(
        "paper/kinetic_energy.mac", "spin^2 + 2*dot(carrier, axis)*spin", "spin^2 + dot(carrier, axis)*spin",
        "--only-paper",
    )  # fmt: skip
    assert "free roller, first integral (paper/free_rollers.mac)" in told and "leaves" in told
    assert {"7.1:13", "7.1:23", "PP12", "3.4:1"} <= changed(told) and "7.1:11" not in changed(told)
    assert "Lagrange" not in told, HELD
    assert tex.read_text().count("old: ") == tex.read_text().count("new: ") == len(changed(told))
    compiled(tex)


TURNING = "I_S*theta_dot^2)/2$"  # the end of the platform's energy
HELD = "what follows is what Lagrange and d'Alembert give, without brackets"


@pytest.mark.long
def test_an_eccentric_mass_changes_the_matrix_and_the_motion(asked, tmp_path, monkeypatch, capsys):
    """m*_23 gains M R e/Lambda; the motion is that of a vehicle whose centre of mass is beside S."""
    eccentric = "I_S*theta_dot^2)/2 + M*e*theta_dot*(y_dot*cos(theta) - x_dot*sin(theta))$"
    scene = tmp_path / "scene.toml"
    scene.write_text('vehicle.preset = "paper"\nstart.nu = [1.0, 0.2, 1.0]\nrun.duration = 1.0\n')
    told, tex = asked(
        "paper/kinetic_energy.mac", TURNING, eccentric, "--only-paper", "--run", str(scene), "--number", "e=0.02"
    )
    assert re.search(r"^  7\.1:23, .*\n    old sum_i\(.*\n    new M\*R\*e/Lambda \+ sum_i\(", told, re.MULTILINE)
    assert {"7.2:1", "7.2:2", "7.2:3", "PP13"} <= changed(told) and "3.4:wheel" not in told
    assert re.search(r"^  3\.4:1, .*\n    gains M\*R\*nu_3\^2\*e/\(Lambda\^2\)$", told, re.MULTILINE)
    assert "new in the equations: e\n" in told and "Lagrange" not in told, HELD
    assert (tex.parent / "motion.png").stat().st_size > 1e4
    vehicle = omniroll.Vehicle.paper()
    for name, beside, numbers in (("old", 0.0, {}), ("new", 0.02, {"e": 0.02})):
        kernel = what_if_study.loaded(tex.parent / f"kernel_{name}.py")
        for model in ("locked", "free"):
            changed_vehicle = what_if_study.ChangedVehicle(kernel, vehicle, model, "impact", numbers)
            motion = changed_vehicle.motion(1.0, nu=(1, 0.2, 1))
            run = omniroll.simulate(
                replace(vehicle, center_of_mass=(beside, 0.0)), nu=(1, 0.2, 1), duration=1.0, roller_model=model
            )
            assert len(motion.switches) == len(run.switches) > 1
            np.testing.assert_allclose(motion.nu[-1], run.nu[-1], rtol=0, atol=1e-9)
            np.testing.assert_allclose(motion.pose[-1], run.pose[-1], rtol=0, atol=1e-9)
            np.testing.assert_allclose(motion.energy[-1], run.energy[-1], rtol=1e-9)
    with pytest.raises(omniroll.InvalidValueError, match="also need e"):
        what_if_study.ChangedVehicle(kernel, vehicle)
    (example,) = blocks("python after-the-command-above", page("docs/changing-the-derivation.md"))
    shutil.copytree(tex.parent, tmp_path / "out/what-if", ignore=shutil.ignore_patterns("maxima"))
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "the page", "exec"), {"__name__": "__main__"})
    run = omniroll.simulate(replace(vehicle, center_of_mass=(0.02, 0.0)), nu=(1, 0, 1), duration=10)
    x, y, _ = run.pose[-1]
    assert f"after 10 s  x {x:.4f} m  y {y:.4f} m  heading" in capsys.readouterr().out


def test_a_syntax_error_is_told_with_its_line(tmp_path, capfd):
    folder = shutil.copytree(ROOT / "maxima", tmp_path / "maxima")
    file = folder / "paper/kinetic_energy.mac"
    text = file.read_text()
    line = 1 + text[: text.index("T_platform: (M*")].count("\n")
    file.write_text(text.replace("T_platform: (M*(x_dot^2 + y_dot^2)", "T_platform: (M*(x_dot^2 + y_dot^2"))
    assert what_if.main(["--script", str(folder / "derive.mac"), "--only-paper"]) == 2
    told = capfd.readouterr().err
    assert re.search(rf"paper/kinetic_energy\.mac:({line}:\d+:)?\s*incorrect syntax: Missing \)", told)


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


@pytest.mark.parametrize(
    "arguments, told",
    [
        (("--run", "scenes/motion-1.toml", "--number", "g=9,81"), "NAME=VALUE"),
        (("--run", "scenes/motion-1.toml", "--number", "g=9.81,e=0.1"), "NAME=VALUE"),
        (("--number", "e=0.02"), "give --run SCENE"),
        (("--run", "no-such-scene.toml"), "no-such-scene.toml: no such file"),
    ],
)
def test_what_is_given_wrongly_is_refused_before_the_derivation(arguments, told, capsys):
    with pytest.raises(SystemExit):
        what_if.main(list(arguments))
    assert told in capsys.readouterr().err

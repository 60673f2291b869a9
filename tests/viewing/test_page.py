"""The page as a file: its size, what it needs, what it refuses; the commands that write it."""

import hashlib
import html
import re
import subprocess
import sys

import numpy as np
import pytest

import omniroll
from omniroll.cli import main
from omniroll.commands import BAD_CALL, FAILED
from omniroll.scenes.result_folder import load_results
from viewing.runs import KIT, ROOT, locked, soccer_kit
from viewing.unpacking import unpacked

LARGEST = 1_500_000  # bytes of the page for 20 s of the soccer kit
ASSETS = ROOT / "runtime/omniroll/viewer/assets"


def test_twenty_seconds_of_the_soccer_kit_are_small():
    run = soccer_kit(20.0)
    page = omniroll.view(run, reactions=omniroll.reactions(run, height=0.04))
    assert len(page.html.encode()) <= LARGEST


def test_the_page_names_no_other_file():
    page = omniroll.view(locked()).html
    named = re.findall(r"""(?:src|href)\s*=\s*["']?([^"'\s>]+)|url\(([^)]*)\)|@import""", page)
    assert named == [("data:,", "")]


def test_titles_and_labels_are_text_on_the_page():
    title = "</title><script>alert(1)</script> {{data}}"
    page = omniroll.view(locked(), title=title, labels=["<b>one</b></script>"]).html
    assert f"<title>{html.escape(title)}</title>" in page
    assert "<b>one" not in page and unpacked(page)[0]["runs"][0]["label"] == "<b>one</b></script>"


@pytest.mark.parametrize("arguments, options, field", [
    ((), {}, "runs"),
    ((1,), {}, "runs"),
    ((locked,) * 5, {}, "runs"),
    ((locked,), {"labels": ["a", "b"]}, "labels"),
    ((locked,), {"reactions": [None, None]}, "reactions"),
    ((locked,), {"reactions": [1]}, "reactions"),
])  # fmt: skip
def test_what_makes_no_sense_is_refused(arguments, options, field):
    runs = [run() if callable(run) else run for run in arguments]
    with pytest.raises(omniroll.InvalidValueError) as caught:
        omniroll.view(*runs, **options)
    assert caught.value.field == field


# The commands


SCENE = KIT.read_text(encoding="utf-8").replace("duration = 10.0", "duration = 1.0") + "\n[reactions]\nheight = 0.04\n"


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """A folder with a run that has reactions."""
    monkeypatch.setenv("BROWSER", "true")  # a program that opens nothing
    (tmp_path / "kit.toml").write_text(SCENE, encoding="utf-8")
    assert main(["run", str(tmp_path / "kit.toml"), "--output", str(tmp_path / "kit"), "--view"]) == 0
    return tmp_path / "kit"


def test_run_and_view_write_the_same_data(kept, capsys):
    of_run, arrays = unpacked((kept / "view.html").read_text(encoding="utf-8"))
    assert main(["view", str(kept), "--title", "kit"]) == 0
    assert capsys.readouterr().out.strip().endswith("runs.html")
    load_results(kept)  # the page of the run has a checksum, and stands
    of_view, again = unpacked((kept / "runs.html").read_text(encoding="utf-8"))
    assert of_run == of_view and arrays.keys() == again.keys() and "0/forces" in arrays
    assert all(np.array_equal(arrays[name], again[name]) for name in arrays)


def test_runs_beside_each_other_are_named_after_their_folders(kept, tmp_path):
    locked().save(tmp_path / "other.npz")
    assert main(["view", str(kept), str(tmp_path / "other.npz"), "--output", str(tmp_path / "both.html")]) == 0
    runs = unpacked((tmp_path / "both.html").read_text(encoding="utf-8"))[0]["runs"]
    assert [run["label"] for run in runs] == ["kit", "other"]


def test_what_holds_no_run_is_refused(kept, tmp_path, capsys):
    assert main(["view", str(tmp_path / "nothing")]) == BAD_CALL
    assert "is not there; name a folder that `omniroll run` wrote" in capsys.readouterr().err
    assert main(["view", str(tmp_path / "kit.toml")]) == BAD_CALL
    assert "omniroll run SCENE --view" in capsys.readouterr().err
    assert main(["view", str(tmp_path)]) == BAD_CALL
    assert "not a folder that `omniroll run` wrote" in capsys.readouterr().err
    table = (kept / "reactions.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (kept / "reactions.csv").write_text("".join(table[:-1]), encoding="utf-8")
    assert main(["view", str(kept)]) == FAILED
    assert "reactions.csv is not the file that" in capsys.readouterr().err


# What the package holds


def test_the_page_was_built_from_its_sources():
    """`make viewer` writes the checksum of what it reads; `make check-viewer` builds again and compares all."""
    folder = ROOT / "viewer"
    sources = [folder / "package-lock.json", folder / "build.mjs", *sorted((folder / "src").iterdir())]
    checksum = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()
    first = (ASSETS / "viewer.js").read_text(encoding="utf-8").partition("\n")[0]
    assert first == f"// built from viewer/, sha256 {checksum}"


NOTEBOOK = """
import sys
from types import ModuleType, SimpleNamespace


class Formatter(dict):
    def for_type_by_name(self, module, name, function):
        self[module, name] = function

html = Formatter()
shell = SimpleNamespace(display_formatter=SimpleNamespace(formatters={"text/html": html}))
sys.modules["IPython"] = ModuleType("IPython")
sys.modules["IPython"].get_ipython = lambda: shell
import omniroll
assert "numpy" not in sys.modules
run = omniroll.simulate(omniroll.Vehicle.paper(), nu=(1, 0, 1), duration=1)
(show,) = html.values()
assert (type(run).__module__, type(run).__name__) in html
print(show(run)[:7], len(show(run)) > 1e5)
from omniroll.viewer import notebook
notebook.MOST_ROWS = len(run) - 1
print(show(run))
"""


def test_a_notebook_shows_a_trajectory():
    done = subprocess.run([sys.executable, "-c", NOTEBOOK], capture_output=True, text=True)
    assert done.stdout == "<iframe True\nNone\n", done.stderr

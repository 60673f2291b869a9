"""The page itself: one HTML file that needs nothing else."""

import html
import re
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from omniroll import validation
from omniroll.durable import whole_file
from omniroll.errors import InvalidValueError
from omniroll.results.reactions import Reactions
from omniroll.results.trajectory import Trajectory
from omniroll.viewer.packing import compressed, packed
from omniroll.viewer.shown import Shown

ASSETS = files("omniroll.viewer") / "assets"
MOST_RUNS = 4  # more colours cannot be told apart
NOTEBOOK_HEIGHT = 640  # px


@dataclass(frozen=True, eq=False, repr=False)
class View:
    """A page that shows runs moving. A notebook shows it in its cell.

    html   the whole page; it needs no network and no other file
    title  what stands above it
    """

    html: str
    title: str

    def save(self, path: str | PathLike) -> Path:
        """Write the page to a file; its path.

        path  str or path, such as "run.html"

        Raises OSError where the file cannot be written, and what had this name before is left then;
        InvalidValueError for what is no path.
        """
        path = validation.file_path("path", path)
        with whole_file(path) as file:
            file.write(self.html)
        return path

    def open(self, path: str | PathLike) -> Path:
        """Write the page to a file and open it in the browser; its path.

        path  str or path, such as "run.html"

        Raises OSError where the file cannot be written.
        """
        path = self.save(path)
        webbrowser.open(path.resolve().as_uri())
        return path

    def __repr__(self) -> str:
        return f"<View: {self.title}, {len(self.html) / 1e6:.2f} MB; save(path) writes it, a notebook shows it>"

    def _repr_html_(self) -> str:
        title, page = html.escape(self.title), html.escape(self.html)
        style = f"width:100%;height:{NOTEBOOK_HEIGHT}px;border:0;border-radius:8px"
        return f'<iframe title="{title}" style="{style}" allowfullscreen srcdoc="{page}"></iframe>'


def view(
    *runs: Trajectory,
    labels: Sequence[str] | None = None,
    reactions: Reactions | Sequence[Reactions | None] | None = None,
    title: str | None = None,
) -> View:
    """A page on which runs move in 3-D, beside their speeds, energy and ledger.

    runs       one Trajectory or more, at most four, with their polynomials; all start at time 0 of the page
    labels     the runs' names on the page; otherwise by roller model and law
    reactions  omniroll.reactions of the run, whose forces are drawn; with several runs one for each, or None
    title      of the page

    Returns a View: `save("run.html")` writes it, `open("run.html")` shows it in the browser too, and a notebook shows
    it as the value of a cell. Raises InvalidValueError for what is not a trajectory or was saved without polynomials,
    for more runs than four, and for labels or reactions that do not belong to the runs.
    """
    for run in runs:
        if not isinstance(run, Trajectory):
            raise InvalidValueError("runs", run, "must be Trajectories")
    names = _one_for_each("labels", _labels(runs) if labels is None else labels, runs)
    for name in names:
        validation.text("labels", name)
    reactions = [None] * len(runs) if reactions is None else reactions
    given = [reactions] if isinstance(reactions, Reactions) else _one_for_each("reactions", reactions, runs)
    if title is not None:
        validation.text("title", title)
    forces = [None if of_run is None else forces_of(run, of_run) for run, of_run in zip(runs, given, strict=True)]
    shown = [Shown(*parts) for parts in zip(runs, names, forces, strict=True)]
    return view_of(shown, title or ", ".join(names))


def _one_for_each(field: str, value: Any, runs: Sequence[Trajectory]) -> list:
    bound = f"must be {len(runs)}, one for each run"
    found = validation.sequence(field, value, bound)
    if len(found) != len(runs):
        raise InvalidValueError(field, value, bound)
    return found


def view_of(shown: Sequence[Shown], title: str) -> View:
    """The page of some runs. Raises InvalidValueError for none, for more than four, and without polynomials."""
    if not 1 <= len(shown) <= MOST_RUNS:
        raise InvalidValueError("runs", len(shown), f"must be 1 to {MOST_RUNS} runs on one page")
    arrays = {f"{number}/{name}": array for number, one in enumerate(shown) for name, array in one.arrays().items()}
    data = packed({"title": title, "runs": [one.description() for one in shown]}, arrays)
    parts = {
        "title": html.escape(title),
        "style": _asset("viewer.css"),
        "start": _asset("start.js"),
        "code": _code(),
        "data": data,
        "licences": html.escape(_asset("LICENCES.txt")).replace("--", "- -"),
    }
    return View(re.sub(r"\{\{(\w+)\}\}", lambda place: parts[place[1]], _asset("page.html")), title)


@cache
def _code() -> str:
    return compressed(_asset("viewer.js").encode())


def _asset(name: str) -> str:
    return (ASSETS / name).read_text(encoding="utf-8")


def _labels(runs: Sequence[Trajectory]) -> list[str]:
    """Names by roller model and law; by number too where these are the same."""
    names = []
    for run in runs:
        law = "" if run.roller_model == "massless" else f", {run.switching}"
        names.append(f"{run.roller_model} rollers{law}")
    return names if len(set(names)) == len(names) else [f"{k} {name}" for k, name in enumerate(names, 1)]


def forces_of(run: Trajectory, reactions: Reactions) -> np.ndarray:
    """(T, N, 3) in N, as Shown has them. Raises InvalidValueError for reactions of another run."""
    if not isinstance(reactions, Reactions) or not np.array_equal(reactions.t, run.t):
        raise InvalidValueError("reactions", reactions, "must be those of the run")
    return np.concatenate([reactions.contact_force, reactions.load[..., None]], axis=-1)

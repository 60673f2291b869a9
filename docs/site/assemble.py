"""Puts the sources of the site together: python assemble.py FOLDER [PICTURES [NOTEBOOKS]].

The pages are those of docs/, which are read on their own, too, and what codegen has written of formulas and symbols.
The reference of functions, commands and C headers is made from what the package says of itself. Links between pages
stay links, links to other files become downloads, and a link that leads nowhere is an error.
"""

import argparse
import io
import os
import pkgutil
import re
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout, suppress
from pathlib import Path

import omniroll
from omniroll import cli, commands
from omniroll.kernels import sets

ROOT = Path(__file__).resolve().parents[2]
SITE = Path(__file__).resolve().parent / "pages"  # pages that only the site has
ELSEWHERE = {  # other pages of the repository, and where they stand on the site
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
    "SECURITY.md": "security.md",
    "generated/formulas/formulas.md": "formulas.md",
    "generated/symbols.md": "symbols.md",
}
LINK = re.compile(r"(?P<image>!?)\[(?P<text>[^\[\]]*)\]\((?P<target>[^)\s]+)\)")
CODE = re.compile(r"^```.*?^```|`[^`\n]+`", re.MULTILINE | re.DOTALL)
HEADERS = (("free", ()), ("free", ("motor",)))  # sets whose C headers are shown
FURTHER = "FURTHER"  # stands in the contents for the pages that they do not name
GROUPS = {  # of the reference; what belongs to none stands behind them
    "Vehicles": ("Vehicle", "cylinder", "robot", "Robot", "import_vehicle", "Imported", "to_mjcf", "to_urdf"),
    "Runs": ("simulate", "simulate_many", "Many", "Session", "Batch", "accelerations", "tau"),
    "What acts on a vehicle": (
        "Torque", "TorqueTable", "Motor", "Controller", "FunctionController", "register_controller", "PathFollower",
        "Bearings", "Slope", "Contact", "register_effect",
    ),
    "Results": (
        "Trajectory", "Samples", "Ledger", "Instruments", "reactions", "Reactions", "Doubt", "impulses", "Impulses",
        "view", "View", "Results", "load_results", "unfinished",
    ),
    "Scenes": ("Scene", "load_scene", "run"),
    "Logs and fits": ("fit", "Fit", "Log", "Number"),
    "Linear models and derivatives": ("linearise", "LinearModel", "gradient", "Sensitivity"),
    "Kernels": ("kernel", "Kernel"),
}  # fmt: skip


def main(folder: Path, drawn: Path | None = None, notebooks: Path | None = None) -> None:
    """Write the sources into a new folder, with the pictures of `drawn` in the place of those in docs/, and with
    `notebooks` to download from the tutorials that they have the names of."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(SITE, folder)
    files: set[str] = set()
    for source, page in pages().items():
        text = (ROOT / source).read_text(encoding="utf-8")
        place = folder / page
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(with_targets(with_mathematics(with_links(text, source, page, files))), encoding="utf-8")
    for file in files:
        (folder / "files" / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / file, folder / "files" / file)
    for place in filter(None, (ROOT / "docs", drawn)):
        for picture in place.glob("*.png"):
            shutil.copy(picture, folder / picture.name)
    if notebooks is not None:
        add_notebooks(folder, notebooks)
    for name, text in made().items():
        place = folder / f"{name}.md"
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding="utf-8")
    contents = (folder / "index.md").read_text(encoding="utf-8")
    (folder / "index.md").write_text(with_further(contents, [*pages().values()]), encoding="utf-8")


def add_notebooks(folder: Path, notebooks: Path) -> None:
    """Copy notebooks into the sources, each with a link from its page."""
    (folder / "files/notebooks").mkdir(parents=True, exist_ok=True)
    for notebook in sorted(notebooks.glob("*.ipynb")):
        shutil.copy(notebook, folder / "files/notebooks" / notebook.name)
        with (folder / "tutorials" / f"{notebook.stem}.md").open("a", encoding="utf-8") as page:
            page.write(f"\n[This page as a notebook of Jupyter](path:/files/notebooks/{notebook.name})\n")


def with_further(contents: str, every: list[str]) -> str:
    """The front page, with the pages that no table of contents names behind those of the how-tos."""
    names = [page.removesuffix(".md") for page in every]
    return contents.replace(FURTHER, "\n".join(name for name in names if f"\n{name}\n" not in contents))


def pages() -> dict[str, str]:
    """Where each page of the repository stands on the site."""
    docs = sorted(path for path in (ROOT / "docs").rglob("*.md") if SITE.parent not in path.parents)
    own = [path.relative_to(ROOT).as_posix() for path in docs]
    return {source: source.removeprefix("docs/") for source in own} | {
        source: page for source, page in ELSEWHERE.items() if page != "index.md"
    }


# Pages that are taken as they are, but for their links and mathematics


def with_links(text: str, source: str, page: str, files: set[str]) -> str:
    """The text with links that hold on the site; `files` gets those that are no pages. Raises FileNotFoundError for a
    link that leads nowhere."""
    known = pages() | ELSEWHERE

    def changed(found: re.Match) -> str:
        target, _, anchor = found["target"].partition("#")
        if not target or ":" in target:
            return found[0]
        path = os.path.normpath(Path(source).parent / target)
        if path in known:
            there = os.path.relpath(known[path], Path(page).parent)
            return f"[{found['text']}]({there}{'#' * bool(anchor)}{anchor})"
        file = ROOT / path
        if not file.exists():
            raise FileNotFoundError(f"{source}: {found['target']} leads nowhere")
        if found["image"]:
            return found[0]
        if file.is_dir():
            return found["text"]
        files.add(path)
        return f"[{found['text']}](path:/files/{path})"

    return outside_code(LINK, changed, text)


def outside_code(pattern: re.Pattern, change: Callable[[re.Match], str], text: str) -> str:
    """`text` with the pattern's matches changed, except for those that begin in code."""
    code = [span.span() for span in CODE.finditer(text)]

    def kept(found: re.Match) -> str:
        return found[0] if any(a <= found.start() < b for a, b in code) else change(found)

    return pattern.sub(kept, text)


def with_mathematics(text: str) -> str:
    """Mathematics between dollars and backticks between dollars alone, as MyST has it."""
    return re.sub(r"\$`(.+?)`\$", lambda found: "$" + found[1].strip().replace("\n", " ") + "$", text, flags=re.DOTALL)


def with_targets(text: str) -> str:
    """Anchors in HTML as targets of MyST, which its links find."""
    return re.sub(r'^<a id="([\w-]+)"></a>$', r"(\1)=", text, flags=re.MULTILINE)


# Pages that are made


def made() -> dict[str, str]:
    """The pages that are made, by name."""
    return {
        "reference/python": "\n".join(python_reference()),
        "reference/gymnasium": "\n".join(environments()),
        "reference/command-line": "\n".join(command_line()),
        "reference/c": "\n".join(c_headers()),
    }


def python_reference() -> Iterator[str]:
    """Every public name, once."""
    classes = {name for name in omniroll.__all__ if isinstance(getattr(omniroll, name), type)}
    errors = sorted(name for name in classes if issubclass(getattr(omniroll, name), BaseException))
    named = {*errors, *(name for names in GROUPS.values() for name in names)}
    groups = GROUPS | {"Further names": sorted({*omniroll.__all__} - named), "Errors and warnings": errors}
    yield "# Python"
    yield "\nEvery public name of `omniroll`. N is the number of wheels, n of rollers per wheel. Units are SI.\n"
    for title, names in ((title, names) for title, names in groups.items() if names):
        yield f"## {title}\n"
        for name in names:
            kind = "exception" if name in errors else "class" if name in classes else "function"
            members = "\n   :members:" if kind == "class" else ""
            yield f"```{{eval-rst}}\n.. auto{kind}:: omniroll.{name}{members}\n```\n"


def environments() -> Iterator[str]:
    """The public names of omniroll.gym."""
    yield "# Gymnasium\n"
    yield "What `import omniroll.gym` brings. [How to train an agent](../gymnasium.md) is the guide.\n"
    for name in ("TwistTask", "TwistEnv", "TwistVectorEnv"):
        yield f"```{{eval-rst}}\n.. autoclass:: omniroll.gym.{name}\n   :members:\n```\n"


def command_line() -> Iterator[str]:
    """The help of every command."""
    yield "# Command line\n"
    yield f"```text\n{help_of()}```\n"
    for command in sorted(found.name for found in pkgutil.iter_modules(commands.__path__)):
        yield f"## omniroll {command}\n"
        yield f"```text\n{help_of(command)}```\n"


def help_of(*command: str) -> str:
    """What --help prints, of the whole or of a command."""
    os.environ["COLUMNS"] = "110"
    with redirect_stdout(io.StringIO()) as printed, suppress(SystemExit):
        cli.main([*command, "--help"])
    return printed.getvalue()


def c_headers() -> Iterator[str]:
    """Headers of a controller's files."""
    yield "# C headers\n"
    yield "What `omniroll kernel` writes for a controller. [From scene to firmware](../c-interface.md) is the guide.\n"
    for base, effects in HEADERS:
        yield f"## {base} rollers{', ' if effects else ''}{', '.join(effects)}\n"
        yield f"```c\n{sets.programs().kernel(base, effects).pair().header}```\n"


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("pictures", type=Path, nargs="?", help="pictures that take the places of those in docs/")
    arguments.add_argument("notebooks", type=Path, nargs="?", help="notebooks of the tutorials, to download")
    given = arguments.parse_args()
    sys.exit(main(given.folder, given.pictures, given.notebooks))

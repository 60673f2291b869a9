"""Draws the pictures of the pages: python pictures.py FOLDER [NAME ...], where a name is that of a script in docs/.

Each picture has a script of its name, whose function `draw` writes it into a folder. `make docs` draws all of them for
the site. Those in docs/ are the same, for those who read the pages without the site: `make pictures` draws them anew.
Pictures of measured times are drawn where the times are measured: by `make bench` and `make accuracy`.
"""

import argparse
import importlib.util
import os
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1]
NAMES = (  # those that take longest stand first
    "ground_contact", "view", "robots", "urdf_mjcf", "motion_3", "fitting", "fitting_mujoco",
    "path_following", "conventions", "sweep", "mecanum",
)  # fmt: skip
MEASURED = (
    "accuracy-motion-3",
    "benchmark-batch",
    "benchmark-motion-3",
    "benchmark-right-hand-side",
)


def draw(name: str, folder: Path) -> tuple[str, float]:
    """The name of what has been done, and the seconds that it took."""
    spec = importlib.util.spec_from_file_location(f"picture_{name}", DOCS / f"{name}.py")
    script = importlib.util.module_from_spec(spec)
    began = time.perf_counter()
    spec.loader.exec_module(script)
    if name == "view" and script.CHROMIUM is None:
        return "view: the one in docs/, since there is no Chromium here", 0.0
    script.draw(folder)
    return name, time.perf_counter() - began


def main(folder: Path, names: list[str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(os.cpu_count()) as workers:
        for done in as_completed([workers.submit(draw, name, folder.resolve()) for name in names]):
            name, seconds = done.result()
            print(f"  {name} {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("names", nargs="*")
    given = arguments.parse_args()
    main(given.folder, given.names or list(NAMES))

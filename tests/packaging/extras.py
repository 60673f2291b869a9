"""What each extra is for, as programs; and `make test-extras`, which installs each one alone.

    python extras.py WHEEL FOLDER [EXTRA ...]

makes an environment for each extra in the folder, installs the wheel with it, and runs its program there: it does what
it should. In an environment without any extra it ends with the line that says what to install.
"""

import argparse
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RUN = "run = omniroll.simulate(omniroll.Vehicle.paper(), nu=(1, 0, 1), duration=0.1)\n"
TOML = '[vehicle]\npreset = "paper"\n[start]\nnu = [1.0, 0.0, 1.0]\n[run]\nduration = 0.1\n'
SCENE = f"open('s.toml', 'w').write({TOML!r})\n"
COMMAND = SCENE + "from omniroll import cli\nraise SystemExit(cli.main({}))\n"
FITTED = """
from omniroll.identification.pictures import draw_residuals
log = omniroll.Log({"t": [0.0, 1.0], "gyro": [0.0, 0.0]})
draw_residuals([log], [{"gyro": log.t}], [{"gyro": 1.0}], __import__("pathlib").Path("fit.png"))
"""
PROGRAMS = {  # of each extra: what needs a package, and which; the programs begin with `import omniroll`
    "plots": {
        "run --plot": ("matplotlib", COMMAND.format("['run', 's.toml', '--plot']")),
        "pictures of fits": ("matplotlib", FITTED),
    },
    "accuracy": {
        "references": ("flint", "from omniroll.studies.accuracy import reference\nreference.flint_module()\n")
    },
    "control": {"to_control": ("control", "omniroll.linearise(omniroll.Vehicle.paper(), nu=(1, 0, 0)).to_control()\n")},
    "gymnasium": {
        "omniroll.gym": (
            "gymnasium",
            "import omniroll.gym, gymnasium\nenv = gymnasium.make('omniroll/Twist-v0')\nenv.reset(seed=1)\n"
            "env.step(env.action_space.sample())\n",
        )
    },
    "mujoco": {
        "import_vehicle": (
            "mujoco",
            "open('v.xml', 'w').write(omniroll.to_mjcf(omniroll.Vehicle.paper()))\nomniroll.import_vehicle('v.xml')\n",
        ),
        "compare": ("mujoco", COMMAND.format("['compare', 's.toml', '--with', 'mujoco']")),
    },
    "bags": {
        "Log.read": (
            "rosbags",
            "open('log.mcap', 'wb').close()\ntry:\n    omniroll.Log.read('log.mcap')\n"
            "except omniroll.errors.LogError as error:\n    assert 'rosbags reads' in str(error)\n",
        )
    },
    "tables": {
        "to_pandas": ("pandas", RUN + "run.to_pandas()\n"),
        "to_xarray": ("xarray", RUN + "run.to_xarray()\n"),
        "to_parquet": ("pyarrow", RUN + "run.to_parquet('run.parquet')\n"),
    },
    "training": {},  # the program is a page's
    "progress": {},  # without it lines of text say how far a run is
    "cluster": {},  # the executor is the user's own
    "generate": {},  # of the repository, not of the package
}
ALONE = {  # what these extras bring is there
    "progress": RUN + "import tqdm\n",
    "cluster": (
        "from distributed import Client, LocalCluster\n"
        "with LocalCluster(n_workers=1, processes=False, dashboard_address=None) as c, Client(c) as client:\n"
        "    many = omniroll.simulate_many([omniroll.Vehicle.paper()], nu=(1, 0, 1), duration=0.1,\n"
        "                                  executor=client.get_executor())\n"
        "assert not many.reasons\n"
    ),
    "generate": "import mpmath\n",
    "training": f"import runpy\nrunpy.run_path({str(ROOT / 'docs/training.py')!r}, run_name='__main__')\n",  # a minute
}


def line_of(extra: str, package: str) -> re.Pattern:
    """What is said where the package is missing."""
    return re.compile(rf"(.* )?needs {package}, which is missing: pip install 'omniroll\[{extra}\]'")


def environment(folder: Path, wheel: Path, extra: str | None) -> Path:
    """Python of a new environment with the wheel, and an extra of it."""
    subprocess.run([sys.executable, "-m", "venv", "--clear", folder], check=True)
    python = folder / "bin/python"
    pinned = re.findall(r"^[\w.-]+==\S+", (ROOT / "requirements.txt").read_text(), re.MULTILINE)
    (folder / "constraints.txt").write_text("\n".join(pinned))
    what = f"{wheel}[{extra}]" if extra else str(wheel)
    pip = [python, "-m", "pip", "--disable-pip-version-check", "--quiet", "install"]
    subprocess.run([*pip, "--constraint", folder / "constraints.txt", what], check=True)
    return python


def run(python: Path, program: str) -> subprocess.CompletedProcess:
    """The program in the folder of its environment, which sees no other one."""
    options = {"capture_output": True, "text": True, "cwd": python.parents[1]}
    return subprocess.run([python, "-I", "-c", f"import omniroll\n{program}"], **options)


def main(wheel: Path, folder: Path, names: list[str]) -> int:
    """How many programs did not do what they should."""
    wrong = 0
    plain = environment(folder / "plain", wheel, None)
    for extra in names:
        python = environment(folder / extra, wheel, extra)
        print(extra, flush=True)
        for name, (package, program) in PROGRAMS[extra].items():
            done, without = run(python, program), run(plain, program)
            said = line_of(extra, package).search(without.stderr)
            print("  ", name, "works" if done.returncode == 0 else f"FAILS\n{done.stderr}", flush=True)
            print("  ", "without it:", said[0] if said else f"NOT SAID\n{without.stderr}", flush=True)
            wrong += (done.returncode != 0) + (said is None)
        if extra in ALONE:
            done = run(python, ALONE[extra])
            print("  ", "alone", "works" if done.returncode == 0 else f"FAILS\n{done.stderr}", flush=True)
            wrong += done.returncode != 0
    return wrong


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("wheel", type=Path)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("extras", nargs="*")
    given = arguments.parse_args()
    sys.exit(main(given.wheel.resolve(), given.folder.resolve(), given.extras or list(PROGRAMS)) != 0)

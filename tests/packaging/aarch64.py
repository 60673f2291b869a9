"""What runs on aarch64 gives the same bits as here: C programs of the tests, and a wheel with a Python of that machine.

    python aarch64.py WHEEL FOLDER

The machine is QEMU's user mode; the compiler is Debian's gcc-aarch64-linux-gnu. The Python is Debian's, unpacked into
the folder beside the packages of PyPI for that machine: this machine needs the two tools and no more.
"""

import argparse
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import omniroll.cli

ROOT = Path(__file__).resolve().parents[2]
COMPILER, EMULATOR, LIBRARIES = "aarch64-linux-gnu-gcc", "qemu-aarch64", "/usr/aarch64-linux-gnu"
PROGRAMS = {  # of tests/c, and what `omniroll kernel` makes for them
    "accelerations.c": ("free",),
    "bounded.c": (str(ROOT / "scenes/robot-soccer-kit.toml"), "--constants"),
}
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off")
PYTHON = "python3.11"
PACKAGES = (
    f"{PYTHON}-minimal", f"lib{PYTHON}-minimal", f"lib{PYTHON}-stdlib", "libc6", "libexpat1", "zlib1g", "libffi8",
    "libssl3", "libgcc-s1", "libstdc++6", "libbz2-1.0", "liblzma5", "libuuid1",
)  # fmt: skip
PLATFORMS = ("manylinux_2_28_aarch64", "manylinux_2_27_aarch64", "manylinux_2_17_aarch64", "manylinux2014_aarch64")


def output(*command: object, **options) -> str:
    parts = [str(part) for part in command]
    return subprocess.run(parts, check=True, stdout=subprocess.PIPE, text=True, **options).stdout


def programs(folder: Path) -> dict[str, bool]:
    """Of each C program whether both machines print the same."""
    same = {}
    for name, asked in PROGRAMS.items():
        place = folder / Path(name).stem
        omniroll.cli.main(["kernel", *asked, "--output", str(place)])
        files, shown = (ROOT / "tests/c" / name, place / "omniroll.c"), []
        for compiler, emulator in (("cc", ()), (COMPILER, (EMULATOR, "-L", LIBRARIES))):
            output(compiler, *FLAGS, *files, "-I", place, "-o", place / compiler, "-lm")
            shown.append(output(*emulator, place / compiler))
        same[name] = shown[0] == shown[1] != ""
    return same


def machine(folder: Path) -> Path:
    """A root folder of aarch64 with a Python, from packages of Debian; this system's own lists stay as they are."""
    root, debs, lists = folder / "root", folder / "debs", folder / "lists"
    for place in (root, debs, lists / "partial", folder / "cache/archives/partial"):
        place.mkdir(parents=True, exist_ok=True)
    settings = {
        "APT::Architecture": "arm64", "APT::Architectures": "arm64", "Dir::State::lists": lists,
        "Dir::State::status": "/dev/null", "Dir::Cache": folder / "cache", "APT::Sandbox::User": "root",
    }  # fmt: skip
    apt = ("apt-get", "-qq", *(part for name, value in settings.items() for part in ("-o", f"{name}={value}")))
    output(*apt, "update")
    output(*apt, "download", *PACKAGES, cwd=debs)
    for deb in debs.glob("*.deb"):
        output("dpkg", "-x", deb, root)
    return root


def site(folder: Path, wheel: Path) -> Path:
    """A folder with the wheel and what it needs on that machine."""
    place = folder / "site"
    wanted = [f"--platform={name}" for name in PLATFORMS]
    pinned = re.findall(r"^[\w.-]+==\S+", (ROOT / "requirements.txt").read_text(), re.MULTILINE)
    (folder / "constraints.txt").write_text("\n".join(pinned))
    with zipfile.ZipFile(wheel) as packed:
        (metadata,) = (name for name in packed.namelist() if name.endswith(".dist-info/METADATA"))
        lines = packed.read(metadata).decode().splitlines()
        packed.extractall(place)
    needed = [line.split(": ")[1] for line in lines if line.startswith("Requires-Dist: ") and ";" not in line]
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", "install", "--only-binary=:all:")
    where = ("--constraint", folder / "constraints.txt", "--target", place)
    output(*pip, *wanted, "--python-version=3.11", *where, *needed)
    return place


def main(wheel: Path, folder: Path) -> int:
    """0 where all is the same, to the bit."""
    folder.mkdir(parents=True, exist_ok=True)
    same = programs(folder)
    runs, root = Path(__file__).with_name("runs_to_compare.py"), machine(folder)
    there = os.environ | {"CC": COMPILER, "OMNIROLL_CACHE": str(folder / "kernels")}
    there["PYTHONPATH"] = str(site(folder, wheel))
    shown = output(EMULATOR, "-L", root, root / "usr/bin" / PYTHON, runs, env=there)
    print(shown, end="")
    same["the wheel's runs"] = shown == output(sys.executable, "-I", runs) != ""
    for name, equal in same.items():
        print(f"{name}: {'the same bits as here' if equal else 'NOT THE SAME'}")
    return 0 if all(same.values()) else 1


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("wheel", type=Path)
    arguments.add_argument("folder", type=Path)
    given = arguments.parse_args()
    sys.exit(main(given.wheel.resolve(), given.folder.resolve()))

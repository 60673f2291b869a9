"""The package's own libraries, compiled with sanitizers, under wrong calls, wrong scenes, any vehicle and any state.

Run as a program, with the sanitizers' library preloaded:

    python -m hard.sanitized BUILT WHAT COUNT

BUILT is a folder of kernels, in place of the package's own. It ends with 0 where nothing was found.
"""

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hard.builds import ROOT
from hard.case import Cases, Measurement, Scale

CASES = Cases("Input")
FLAGS = "-O0 -g1 -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all -fno-omit-frame-pointer"
COMPILERS = {  # further flags, and the library to preload; without optimisation clang takes minutes for an engine
    "gcc": ("", "libasan.so"),
    "clang": ("-O1 -shared-libasan", "libclang_rt.asan-x86_64.so"),
}
QUIET = {
    "ASAN_OPTIONS": "detect_leaks=0:allocator_may_return_null=1",  # Python itself ends with memory that it holds
    "UBSAN_OPTIONS": "print_stacktrace=1",
    "PYTHONMALLOC": "malloc",  # every array of the caller has ends that are watched
}
COUNTS = {"calls": 5000, "scenes": 5000, "vehicles": 300, "states": 500}
FAULT = "int past(int *numbers, int count) { return numbers[count]; }"  # of `count` numbers
SEES = """
import cffi, sys
ffi = cffi.FFI()
ffi.cdef("int past(int *, int);")
ffi.dlopen(sys.argv[1]).past(ffi.new("int[4]"), 4)
"""


def preloaded(compiler: str) -> Path | None:
    """The sanitizers' library of a compiler; None where it has none."""
    if shutil.which(compiler) is None:
        return None
    name = COMPILERS[compiler][1]
    found = subprocess.run([compiler, f"-print-file-name={name}"], capture_output=True, text=True).stdout.strip()
    runtime = subprocess.run([compiler, "-print-runtime-dir"], capture_output=True, text=True).stdout.strip()
    return next((path for path in (Path(found), Path(runtime, name)) if path.is_absolute() and path.exists()), None)


def flags(compiler: str) -> str:
    return f"{FLAGS} {COMPILERS[compiler][0]}".strip()


def watched(compiler: str, *command: object, **changes: str) -> subprocess.CompletedProcess:
    """A Python program with the sanitizers' library preloaded, and with that of C++: a sanitizer that does not find it
    at the start ends the program at the first exception of another package's extension."""
    of_cpp = subprocess.run([compiler, "-print-file-name=libstdc++.so.6"], capture_output=True, text=True, check=True)
    preload = f"{preloaded(compiler)} {of_cpp.stdout.strip()}"
    environment = os.environ | QUIET | {"LD_PRELOAD": preload} | changes
    return subprocess.run(
        [sys.executable, *map(str, command)], capture_output=True, text=True, env=environment, cwd=ROOT / "tests"
    )


def unseen(compiler: str, folder: Path) -> Measurement:
    """That the sanitizers see a read beyond an array of the caller's, which is none of the package's."""
    (folder / "fault.c").write_text(FAULT, encoding="ascii")
    made = folder / f"fault-{compiler}.so"
    command = [compiler, *shlex.split(flags(compiler)), "-shared", "-fPIC", folder / "fault.c", "-o", made]
    subprocess.run(command, check=True)
    done = watched(compiler, "-c", SEES, made)
    seen = done.returncode != 0 and "AddressSanitizer: heap-buffer-overflow" in done.stderr
    return Measurement("reads beyond an array, made on purpose, that nobody sees", compiler, "", "", not seen, 0)


@contextmanager
def built(compiler: str, folder: Path) -> Iterator[Path]:
    """All libraries of the package, compiled with sanitizers."""
    environment = {"CC": compiler, "OMNIROLL_CFLAGS": flags(compiler), "OMNIROLL_LEVELS": "x86-64"}
    place = folder / compiler
    command = [sys.executable, "setup.py", "--quiet", "build_ext", "--build-lib", place, "--build-temp", place]
    subprocess.run(list(map(str, command)), cwd=ROOT, env=os.environ | environment, check=True, stdout=sys.stderr)
    yield place / "omniroll/kernels/built"
    shutil.rmtree(place)


@CASES.case(
    "sanitized-engine",
    "Wrong calls, wrong scenes, any vehicle and any start, with engines and kernels under sanitizers",
    promise="no read or write beyond an array, no undefined arithmetic; each as without sanitizers",
)
def clean(scale: Scale) -> Iterator[Measurement]:
    """Runs that a sanitizer ended, or in which a promise was broken."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for compiler in filter(preloaded, scale.of(["gcc"], [*COMPILERS])):
            yield unseen(compiler, folder)
            if scale is Scale.TEST:
                continue
            with built(compiler, folder) as place:
                for what, count in COUNTS.items():
                    done = watched(
                        compiler, "-m", "hard.sanitized", place, what, count, OMNIROLL_CACHE=scratch, CC="false"
                    )
                    print(done.stdout[-2000:], done.stderr[:6000] if done.returncode else "", file=sys.stderr)
                    text = f"a sanitizer's complaint, or a broken promise, in {count} {what}"
                    yield Measurement(text, "package's libraries", "double", compiler, done.returncode != 0, 0)


def main(place: str, what: str, count: str) -> int:
    from hard import attempts, inputs, wrong_inputs
    from omniroll.kernels import sets

    sets.BUILT = Path(place)
    with tempfile.TemporaryDirectory() as scratch:
        os.chdir(scratch)
        of_inputs = {"vehicles": inputs.try_vehicle, "states": inputs.try_state}
        attempt = of_inputs[what] if what in of_inputs else wrong_inputs.ATTEMPTS[what](Path(scratch))
        failed = attempts.broken(attempts.tried(attempt, int(count), inputs.PATIENCE))
        os.chdir("/")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))

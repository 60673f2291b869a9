"""Finds or installs Maxima, and runs the derivation with it.

In this order: $MAXIMA, `maxima` on PATH where its libraries are installed too, and the pinned pair of
maxima-requirements.txt, installed once into an environment of its own in the user's cache folder.
"""

import hashlib
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import venv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from . import cache

REQUIREMENTS = Path(__file__).with_name("maxima-requirements.txt")
BEGIN, END = "omniroll: begin", "omniroll: end"
LIBRARY = "stringproc"  # Maxima's own, which writes what is derived
TIMEOUT = 3600.0  # seconds; two minutes on a quiet core, and many on a machine that is busy
HEAP = str(400 << 20)  # bytes: with less, the pinned Maxima collects garbage for a fifth of its time
FAILED_CLAIM = "identity is not zero:"
SYNTAX = re.compile(r".+\.mac:(\d+:\d+:)?\s*incorrect syntax")  # Maxima goes on with the next file after one
NEXT_FILE = re.compile(r"maxima: .*\bnow (\S+)$")  # which some builds of Maxima do not name where its syntax is wrong
LINES_OF_A_SYNTAX_ERROR = 3  # file, line, column and what is wrong; the text there; a mark below it
LINES_OF_A_FAILURE = 12
Report = Callable[[str], None]


class MaximaError(RuntimeError):
    """Maxima could not be had, or the derivation stopped. The message ends with what Maxima said last."""


@dataclass(frozen=True)
class Maxima:
    program: Path
    version: str

    @classmethod
    def find(cls, report: Report = print) -> "Maxima":
        """The Maxima to use; installs one where there is none."""
        named = os.environ.get("MAXIMA")
        program = shutil.which(named or "maxima")
        if named and program is None:
            raise MaximaError(f"$MAXIMA is {named}, which is no program")
        if program is None:
            return cls.at(installed(report))
        found = cls.at(Path(program))
        if found.is_whole():
            return found
        lack = f"{program} lacks its library {LIBRARY} (in Debian the package maxima-share)"
        if named:
            raise MaximaError(f"$MAXIMA: {lack}")
        report(f"maxima: {lack}; the pinned Maxima is used")
        return cls.at(installed(report))

    @classmethod
    def at(cls, path: Path) -> "Maxima":
        """The program at this path. Raises MaximaError where it is no Maxima."""
        answer = answer_of(path, "--version")
        version = re.search(r"Maxima (\S+)", answer.stdout)
        if answer.returncode != 0 or version is None:
            raise MaximaError(f"{path} does not run:\n{answer.stdout}{answer.stderr}".rstrip())
        return cls(path, version[1])

    def is_whole(self) -> bool:
        """Whether its libraries are there, which some distributions have in a package of their own."""
        batch = f'(load("{LIBRARY}"), print("{END}"))$'
        said = answer_of(self.program, "--very-quiet", "--init=omniroll-no-init", f"--batch-string={batch}").stdout
        return END in map(str.strip, said.splitlines())

    def derive(
        self, script: Path, output: Path, report: Report = print, timeout: float = TIMEOUT, flags: tuple[str, ...] = ()
    ) -> None:
        """Run `script` in its own folder with output_file set to `output` and the `flags` set to true; lines that it
        prints go to `report`.

        MaximaError where a claim is not proved, the script stops early or writes nothing, or the time is
        over.
        """
        output.unlink(missing_ok=True)
        # One statement: an error in the script ends it, so that END is printed by a complete run only.
        settings = "".join(f"{flag}: true, " for flag in flags)
        batch = (
            f'(print("{BEGIN}"), display2d: false, {settings}output_file: {quoted(output)}, '
            f'load({quoted("./" + script.name)}), print("{END}"))$'
        )
        with tempfile.TemporaryDirectory(prefix="omniroll-home-") as home:
            said, is_late = self._run(batch, script.parent, Path(home), report, timeout)
        wrong = next((place for place, line in enumerate(said) if SYNTAX.match(line)), None)
        if wrong is not None:
            raise MaximaError("\n".join(said[wrong:][:LINES_OF_A_SYNTAX_ERROR]))
        if is_late:
            raise MaximaError(f"{script.name}: stopped after {timeout:g} s; Maxima said last:\n{last(said)}")
        if END not in said:
            raise MaximaError(f"{script.name}: the derivation stopped; Maxima said last:\n{last(said)}")
        if not output.is_file():
            raise MaximaError(f"{script.name}: the derivation wrote no data")

    def _run(self, batch: str, folder: Path, home: Path, report: Report, timeout: float) -> tuple[list[str], bool]:
        """(what Maxima said after BEGIN, whether it ran out of time)."""
        # An init file that does not exist: Maxima looks for one in the current folder too.
        command = [self.program, "--very-quiet", "--init=omniroll-no-init", f"--batch-string={batch}"]
        process = subprocess.Popen(
            command,
            cwd=folder,
            env=environment(self.program, home),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            start_new_session=True,
        )
        late = threading.Event()
        timer = threading.Timer(timeout, lambda: (late.set(), stop(process)))
        timer.start()
        said: list[str] = []
        try:
            has_begun = has_failed = False
            reading = ""
            assert process.stdout is not None
            for line in map(str.strip, process.stdout):
                if has_begun and line:
                    reading = next_file[1] if (next_file := NEXT_FILE.match(line)) else reading
                    line = f"{reading}.mac: {line}" if line.startswith("incorrect syntax") else line
                    said.append(line)
                    has_failed = has_failed or line.startswith(FAILED_CLAIM) or bool(SYNTAX.match(line))
                    if line != END and not has_failed:
                        report(line)
                if has_begun and len(said) >= LINES_OF_A_SYNTAX_ERROR and SYNTAX.match(said[-LINES_OF_A_SYNTAX_ERROR]):
                    stop(process)
                has_begun = has_begun or line == BEGIN
            process.wait()
        finally:
            timer.cancel()
            if process.poll() is None:
                stop(process)
        return said, late.is_set()


def stop(process: subprocess.Popen) -> None:
    """End a process and those that it started."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.wait()


def last(said: list[str]) -> str:
    """What Maxima said last: from the claim that failed on, where there is one."""
    kept = [line for line in said if not line.startswith("-- an error. To debug")]
    failed = [place for place, line in enumerate(kept) if line.startswith(FAILED_CLAIM)]
    start = failed[-1] if failed else max(0, len(kept) - LINES_OF_A_FAILURE)
    return "\n".join(f"  {line}" for line in kept[start:][:LINES_OF_A_FAILURE]) or "  nothing"


def answer_of(program: Path, *options: str) -> subprocess.CompletedProcess:
    """What the program says when it is called with these options."""
    return subprocess.run(
        [program, *options],
        env=environment(program),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
    )


def quoted(text: object) -> str:
    """A Maxima string."""
    return '"' + re.sub(r'(["\\])', r"\\\1", str(text)) + '"'


def environment(program: Path, home: Path | None = None) -> dict[str, str]:
    """The user's environment without what changes Maxima's text, its files or its prefix."""
    dropped = ("MAXIMA", "LC_", "LANG", "ECL", "GCL", "SBCL")
    kept = {key: value for key, value in os.environ.items() if not key.startswith(dropped)}
    kept["LC_ALL"] = "C"
    kept.setdefault("GC_INITIAL_HEAP_SIZE", HEAP)
    if home is not None:
        kept |= {"HOME": str(home), "MAXIMA_USERDIR": str(home), "MAXIMA_TEMPDIR": str(home)}
    prefix = program.resolve().parent.parent
    if prefix.name == "sage_wheels":  # a wheel's Maxima does not know where it was installed
        kept["MAXIMA_PREFIX"] = str(prefix)
        for folder in prefix.glob("lib/ecl-*"):
            kept["ECLDIR"] = f"{folder}/"
    return kept


# The Maxima of the wheels


def pinned_folder() -> Path:
    """Where this Python's copy of the pinned Maxima is, or will be."""
    key = REQUIREMENTS.read_bytes() + repr((sys.version_info[:2], sys.platform, platform.machine())).encode()
    return cache.user_folder() / f"maxima-{hashlib.sha256(key).hexdigest()[:12]}"


def installed(report: Report = print) -> Path:
    """The pinned Maxima's program, from the cache; installed there first where it is not.

    An installation is built beside its place and renamed, under a lock: it is there whole or not at all.
    """
    place = pinned_folder()
    found = wheel_program(place)
    if found:
        return found
    with cache.lock(place):
        found = wheel_program(place)
        if found is None:
            report("maxima: installing the pinned one into the user's cache (once)")
            install(place)
            found = wheel_program(place)
    if found is None:
        raise MaximaError("the pinned Maxima was installed, but its program is not there")
    return found


def wheel_program(place: Path) -> Path | None:
    return next(iter(sorted(place.glob("lib/python3*/site-packages/sage_wheels/bin/maxima"))), None)


def install(place: Path) -> None:
    """Build the environment beside `place`, then rename it. The caller holds the lock."""
    building = place.with_suffix(".part")
    shutil.rmtree(building, ignore_errors=True)
    shutil.rmtree(place, ignore_errors=True)
    try:
        venv.create(building, with_pip=True)
        command = [
            building / "bin" / "python",
            "-m",
            "pip",
            "install",
            "--quiet",
            "--no-deps",
            "--only-binary=:all:",
            "--disable-pip-version-check",
            "--require-hashes",
            "--requirement",
            REQUIREMENTS,
        ]
        answer = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    except (OSError, subprocess.SubprocessError) as problem:
        raise MaximaError(f"Maxima could not be installed: {problem}") from problem
    if answer.returncode != 0:
        raise MaximaError(f"Maxima could not be installed:\n{answer.stdout}{answer.stderr}".rstrip())
    building.rename(place)

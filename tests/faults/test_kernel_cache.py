"""The cache of kernels: damaged, foreign and half-made files, a full disk, builds that are killed."""

import errno
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from omniroll import Vehicle
from omniroll.kernels import building, sets
from omniroll.kernels.kernel import CompiledKernel, kept_kernel, kernel

SLOPE = (("gravity", 9.8), ("slope_angle", 0.1), ("slope_direction", 0.0))
ASKS = f"""
from omniroll import Vehicle
from omniroll.kernels.kernel import kernel
made = kernel(Vehicle.paper(), "locked", effects=("slope",), constants={SLOPE!r})
print(made.backend, made.forward_dynamics([1, 0.2, 0.3], [0.1, -0.2, 0.3], 0.4).tolist())
"""
pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="cc is not installed")


def sloped(backend="compiled"):
    return kernel(Vehicle.paper(), "locked", backend, effects=("slope",), constants=SLOPE)


def forget():
    """What this process remembers of folders, as a new process would not."""
    sets.WHOLE.clear()
    for remembered in (sets._loaded, sets._opened_pair, sets._opened_engine, kept_kernel):
        remembered.cache_clear()


def damage(path, content):
    """Another file in its place: what this process has loaded stays as it was."""
    path.unlink()
    path.write_bytes(content)


def asked_elsewhere():
    """What another process gets, which a damaged library would end."""
    done = subprocess.run([sys.executable, "-c", ASKS], capture_output=True, text=True, env=os.environ.copy())
    assert done.returncode == 0, f"{done.returncode}: {done.stderr}"
    return done.stdout, done.stderr


@pytest.mark.long
def test_every_text_may_be_damaged(fresh_cache):
    """Cut off, empty, gone, or another's: it is made anew as it was."""
    place = sets.c_folder("locked", ("slope",))
    texts = [path for folder in (place, place.parent) for path in sorted(folder.iterdir()) if path.suffix]
    texts = [path for path in texts if path.suffix != ".lock"]
    assert {"locked_slope.py", "functions.json", "declarations.h", "checksums.json"} <= {path.name for path in texts}
    for k, path in enumerate(texts):
        whole = path.read_bytes()
        damage(path, (b"", whole[: len(whole) // 2], b"\x7fELF foreign")[k % 3])
        if k % 4 == 3:
            path.unlink()
        forget()
        with pytest.warns(RuntimeWarning, match="is damaged; it is made anew"):
            sets.c_folder("locked", ("slope",))
        assert path.read_bytes() == whole, path


@pytest.mark.long
def test_a_foreign_library_and_a_damaged_bytecode_are_made_anew(fresh_cache, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    expected, _ = asked_elsewhere()
    (library,), (module,) = fresh_cache.rglob("double.so"), fresh_cache.rglob("locked_slope.py")
    damage(library, b"\x7fELF foreign")
    found, said = asked_elsewhere()
    assert found == expected and "double.so is damaged" in said
    state = [1, 0.2, 0.3], [0.1, -0.2, 0.3], 0.4
    rates = sloped("python").forward_dynamics(*state).tolist()
    (bytecode,) = module.with_name("__pycache__").iterdir()
    damage(bytecode, bytecode.read_bytes()[:100])
    forget()
    assert sloped("python").forward_dynamics(*state).tolist() == rates


def test_a_library_that_came_with_the_package_may_be_damaged(fresh_cache, tmp_path, monkeypatch):
    """Today's symptom was SIGBUS."""
    built = tmp_path / "built"
    shutil.copytree(sets.BUILT, built)
    monkeypatch.setattr(sets, "BUILT", built)
    expected = kernel(Vehicle.paper(), "locked").wheel_speeds([1, 0, 1]).tolist()
    damage(built / "locked/double.so", (built / "locked/double.so").read_bytes()[:20_000])
    forget()
    with pytest.warns(RuntimeWarning, match="damaged; it is compiled anew"):
        made = kernel(Vehicle.paper(), "locked")
    assert isinstance(made, CompiledKernel) and made.wheel_speeds([1, 0, 1]).tolist() == expected
    assert list(fresh_cache.rglob("double.so"))


def test_libraries_of_other_sources_are_not_loaded(fresh_cache, tmp_path, monkeypatch):
    """An engine compiled before its sources changed would be called with other arguments, and end the process."""
    built = tmp_path / "built"
    shutil.copytree(sets.BUILT, built, ignore=shutil.ignore_patterns("engine-*"))
    monkeypatch.setattr(sets, "BUILT", built)
    (effects, *_) = sets.general_sets("locked")
    assert sets.is_general("locked", effects) and sets._pair("locked", (), "double")[0] == built / "locked"
    (built / building.SOURCES).write_text("0" * 64)
    sets._is_current.cache_clear()
    with pytest.warns(RuntimeWarning, match="compiled from other sources than are there now: 'make build'") as said:
        place, file = sets._pair("locked", (), "double")
        assert not sets.is_general("locked", effects)
    assert len(said) == 1 and place.is_relative_to(fresh_cache) and building.is_whole(place / file)
    sets._is_current.cache_clear()


def test_the_digest_of_the_sources_knows_each_of_them(tmp_path):
    folders = [tmp_path / name for name in ("data", "codegen", "csrc", "c")]
    for folder in (*folders, folders[1] / "templates"):
        folder.mkdir()
    for name in ("programs", "effects", "symbols", "bounds"):
        (folders[0] / f"{name}.json").write_text(name)
    found = [building.sources_digest(*folders)]
    of_data_and_codegen = ("data/programs.json", "codegen/a.py", "codegen/templates/a.j2")
    for path in (*of_data_and_codegen, "csrc/a.c", "csrc/room/a.h", "c/gauss.h"):
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text("new")
        found.append(building.sources_digest(*folders))
    assert len(set(found)) == len(found)
    (tmp_path / "csrc/notes.txt").write_text("new")
    assert building.sources_digest(*folders) == found[-1]


@pytest.mark.long
def test_a_full_disk_gives_way_to_a_folder_of_the_process(fresh_cache, monkeypatch):
    write = Path.write_text

    def full(path, *arguments, **options):
        if path.is_relative_to(fresh_cache):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        return write(path, *arguments, **options)

    monkeypatch.setattr(Path, "write_text", full)
    with pytest.warns(RuntimeWarning, match="No space left on device.*for this process alone") as said:
        assert isinstance(sloped(), CompiledKernel)
        assert isinstance(kernel(Vehicle.paper(), "massless", effects=("slope",), constants=SLOPE), CompiledKernel)
    assert len(said) == 1 and not [path for path in fresh_cache.rglob("*") if path.suffix != ".lock"]


@pytest.mark.long
def test_builds_that_are_killed_leave_nothing_that_is_used(fresh_cache, tmp_path, monkeypatch):
    """A compiler that is slow enough to be killed with its caller, at three moments; then it is asked again."""
    script = tmp_path / "compiler"
    script.write_text('#!/bin/sh\nsleep "$SLOW"\nexec cc "$@"\n')
    script.chmod(0o755)
    monkeypatch.setenv("CC", str(script))
    for moment in (0.5, 1.2):
        environment = os.environ | {"SLOW": "30"}
        process = subprocess.Popen([sys.executable, "-c", ASKS], env=environment, start_new_session=True)
        time.sleep(moment)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    monkeypatch.setenv("SLOW", "0")
    found, _ = asked_elsewhere()
    assert found.startswith("compiled [")
    assert not list(fresh_cache.rglob("tmp*"))


def test_what_killed_processes_left_is_removed_after_an_hour(fresh_cache):
    old, new = fresh_cache / f"{sets.MAKING_PREFIX}old", fresh_cache / f"{sets.MAKING_PREFIX}new"
    for left in (old, new):
        left.mkdir(parents=True)
    os.utime(old, (0, time.time() - 2 * sets.LEFT))
    sloped("python")
    assert not old.exists() and new.exists()

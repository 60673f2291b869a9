"""The pair of free rollers on a bare Cortex-M4F and M7: code size, stack, instructions a step, float against double.

QEMU counts instructions, not cycles: it models no pipeline, no flash memory and no latencies.
"""

import re
import subprocess
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest

from firmware.files import EXAMPLES, STRICT, run, tool, write, write_driven

HERE = Path(__file__).resolve().parent / "bare_metal"
CONTROLLER = EXAMPLES / "controller.c"
PREFIX = "arm-none-eabi-"
CODE = ("-mthumb", "-mfloat-abi=hard", "-std=c99", "-ffp-contract=off", "-fno-math-errno", "-ffunction-sections")
MATHEMATICS = {"sinf", "cosf", "sqrtf", "expf"}
BY_THE_COMPILER = {"memset", "memcpy", "memmove"}  # which it puts in the place of loops
MOST_CODE = 16 * 1024  # bytes, M4F, float, -Os
MOST_STACK = 1024  # bytes, of a step with all that it calls
MOST_INSTRUCTIONS = 6000  # of a step of three wheels without a joint
MOST_JOINTS = 15  # in a call: the header's default for three wheels of five rollers
MOST_FOR_A_JOINT = 25_000  # instructions
STEPS = 1000  # of count.c


write_free = partial(write, "free")


@dataclass(frozen=True)
class Target:
    machine: str
    flags: tuple[str, ...]


FLOAT = ("-DOMNIROLL_FLOAT",)
TARGETS = {
    "M4F float": Target("mps2-an386", ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", *FLOAT)),
    "M7 float": Target("mps2-an500", ("-mcpu=cortex-m7", "-mfpu=fpv5-sp-d16", *FLOAT)),
    "M7 double": Target("mps2-an500", ("-mcpu=cortex-m7", "-mfpu=fpv5-d16")),
}
targets = pytest.mark.parametrize("name", TARGETS)


def compiled(name, folder, optimise="-Os", writes=write_free):
    """The object file of a pair for a target, and what the compiler says of its stack."""
    source = writes(folder)
    made = folder / "kernel.o"
    flags = (*CODE, *TARGETS[name].flags, "-Wall", "-Wextra", "-Werror", "-fstack-usage", optimise)
    run(tool(f"{PREFIX}gcc"), *flags, "-c", source, "-o", made)
    return made


def on_the_machine(name, folder, main, kernel, *flags):
    """What a program prints on the emulated machine."""
    program = folder / "program.elf"
    files = (HERE / "startup.c", main, kernel)
    target = TARGETS[name]
    how = ("-Wl,--gc-sections", "--specs=rdimon.specs", "-T", HERE / "link.ld", "-I", folder)
    emulator = tool("qemu-system-arm")
    run(tool(f"{PREFIX}gcc"), "-Os", *CODE, *target.flags, *flags, *how, *files, "-lm", "-o", program)
    console = ("-nographic", "-monitor", "none", "-serial", "none")
    return run(
        emulator, "-M", target.machine, *console, "-icount", "shift=5",
        "-semihosting-config", "enable=on,target=native", "-kernel", program, stdin=subprocess.DEVNULL,
    )  # fmt: skip


@dataclass(frozen=True)
class Counted:
    instructions: float
    early_joints: int
    instructions_with_joints: float
    joints: int
    at_the_bound: int
    stack: int
    end: np.ndarray


@pytest.fixture(scope="module")
def counted(tmp_path_factory):
    """What count.c prints on a target."""

    @cache
    def count(name):
        folder = tmp_path_factory.mktemp("count")
        out = on_the_machine(name, folder, HERE / "count.c", compiled(name, folder)).split()
        plain, early, with_joints, joints, bound, stack = map(float, out[:6])
        return Counted(plain, int(early), with_joints, int(joints), int(bound), int(stack), np.array(out[6:], float))

    return count


def test_the_code_is_small(tmp_path, record_property):
    """All functions, both laws and the switches; without the C library's mathematics and the start-up."""
    made = compiled("M4F float", tmp_path)
    text, data, bss = map(int, run(tool(f"{PREFIX}size"), made).splitlines()[1].split()[:3])
    record_property("bytes", text)
    assert text <= MOST_CODE and data == bss == 0


@targets
def test_no_heap_no_other_library_and_no_emulated_numbers(name, tmp_path):
    """In float no helper for double is called: a Cortex-M4F would compute with these in software."""
    symbols = run(tool(f"{PREFIX}nm"), compiled(name, tmp_path))
    wanted = set(re.findall(r"\bU (\w+)", symbols)) - BY_THE_COMPILER
    assert wanted <= ({word[:-1] for word in MATHEMATICS} if "double" in name else MATHEMATICS)


@targets
def test_the_stack_of_every_function_is_fixed_and_small(name, tmp_path):
    compiled(name, tmp_path)
    lines = [line.split("\t") for line in (tmp_path / "kernel.su").read_text().splitlines()]
    assert lines and all(kind == "static" for _, _, kind in lines)
    assert max(int(size) for _, size, _ in lines) <= 512


@targets
def test_the_stack_of_a_step_as_painted(name, counted, record_property):
    record_property("bytes", counted(name).stack)
    assert 0 < counted(name).stack <= MOST_STACK


@targets
def test_instructions_of_a_step(name, counted, record_property):
    """The difference of two loop lengths under a count that is the same on every run."""
    found = counted(name)
    record_property("instructions", found.instructions)
    record_property("with joints", found.instructions_with_joints)
    assert found.early_joints == 0 < found.joints
    assert 0 < found.instructions <= MOST_INSTRUCTIONS
    assert found.instructions < found.instructions_with_joints <= 2 * MOST_INSTRUCTIONS


@targets
def test_instructions_of_a_call_that_comes_to_its_bound(name, counted, record_property):
    """A step of a second, in which the wheels would pass hundreds of joints; the call ends behind one too many."""
    found = counted(name).at_the_bound
    record_property("instructions", found)
    assert 0 < found <= (MOST_JOINTS + 1) * MOST_FOR_A_JOINT


def test_float_stays_with_double(counted):
    """Each of the steps rounds what it adds up once, to 2^-24: they gather the steps times that at worst."""
    double, single = counted("M7 double").end, counted("M4F float").end
    assert np.all(np.abs(single - double) <= STEPS * 2.0**-24 * np.maximum(np.abs(double), 1))


def test_both_machines_give_the_same_bits(counted):
    assert np.array_equal(counted("M4F float").end, counted("M7 float").end)


@pytest.mark.long
def test_a_controller_on_the_machine_drives_as_on_this_one(tmp_path):
    """examples/controller.c in float on an M4F, in double here; the bound is that of tests/c/test_c.py."""
    joints = ("-DJOINTS=100",)
    kernel = compiled("M4F float", tmp_path, writes=write_driven)
    there = on_the_machine("M4F float", tmp_path, CONTROLLER, kernel, *joints)
    made = tmp_path / "program"
    run(tool("gcc"), *STRICT, *joints, CONTROLLER, tmp_path / "omniroll.c", "-I", tmp_path, "-o", made, "-lm")
    single, double = (np.array(out.split(), float) for out in (there, run(made)))
    assert np.array_equal(single[:2], double[:2])
    bound = double[1] * 2.0**-24 * np.repeat([double[11], 1.0, np.pi / 5], 3)
    assert np.all(np.abs(single - double)[2:11] <= bound)

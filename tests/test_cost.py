"""What the kernels and the engine cost: operation counts, growth with n, vector code. Never a wall time."""

import platform
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import Bearings, Controller, Motor, Slope
from omniroll.effects.effect_set import EffectRun
from omniroll.kernels import building, sets
from omniroll.kernels.kernel import CompiledKernel, form
from omniroll.kernels.neutral_kernel import NeutralKernel

SETS = ("massless", "locked", "free", "locked_sharp", "free_sharp")
NODES = 16  # of a step of the compiled engine
ROOT = Path(__file__).resolve().parents[1]


def operations(set_name, name, effects=()):
    """Operation counts of a generated function by place: once, wheel, slot, roller."""
    model = set_name.removesuffix("_sharp")
    counted = {f["name"]: f["operations"] for f in sets.functions(model, effects)}
    return counted[form(name, model != set_name, counted)]


def total(set_name, name, wheels, rollers, effects=()):
    """All operations of one call."""
    free = rollers - 1
    counts = {"once": 1, "wheel": wheels, "slot": free, "roller": wheels * free}
    return sum(counts[place] * sum(numbers.values()) for place, numbers in operations(set_name, name, effects).items())


@pytest.mark.parametrize("name", ["forward_dynamics", "wheel_speeds", "pose_rates", "mass_matrix", "forces", "impact"])
@pytest.mark.parametrize("set_name", SETS)
def test_cost_does_not_depend_on_the_number_of_rollers(set_name, name):
    if (set_name, name) == ("massless", "impact"):
        pytest.skip("massless rollers have no impact")
    found = operations(set_name, name)
    for place in ("slot", "roller"):
        assert not any(found[place].values()), f"{name} has operations for each {place}: {found[place]}"


@pytest.mark.parametrize("set_name", ["massless", "locked", "free"])
def test_the_reduced_form_stays_small(set_name):
    """Three wheels: some 300 operations, three sines with cosines and four divisions of the elimination."""
    found = operations(set_name, "forward_dynamics")
    assert total(set_name, "forward_dynamics", 3, 5) <= 320
    assert found["wheel"]["sincos"] <= 2, "the sine and the cosine of one half angle"
    assert found["wheel"]["div"] <= 1
    assert found["once"]["div"] <= 4


@pytest.mark.parametrize("set_name", ["free", "free_sharp"])
def test_accelerations_grow_linearly_with_the_rollers(set_name):
    """Every spin in and out costs O(N n): a bounded number of sums and products for each, no sine, no division."""
    per_roller = operations(set_name, "accelerations")["roller"]
    assert per_roller["sincos"] == per_roller["div"] == per_roller["sqrt"] == 0
    assert 0 < per_roller["add"] + per_roller["mul"] <= 20
    costs = [total(set_name, "accelerations", 3, rollers) for rollers in (5, 15, 30, 60)]
    slopes = np.diff(costs) / np.diff([5, 15, 30, 60])
    assert np.ptp(slopes) == 0
    assert costs[0] <= 2.2 * total(set_name, "forward_dynamics", 3, 5)


# The libraries' object code

VECTOR_PRODUCT = re.compile(r"\bv?mulpd\b.*%(?P<register>[xyz]mm)\d+")
SCALAR_PRODUCT = re.compile(r"\bv?mulsd\b")
FUSED = re.compile(r"\bvfn?m(?:add|sub)\w*")
REGISTERS = {"x86-64-v3": "ymm", "x86-64-v4": "zmm"}


@pytest.fixture(scope="module")
def disassembled(tmp_path_factory):
    """The disassembly of a set's engines at a level of vector instructions, {wheels and function: its code}."""
    if platform.machine() not in ("x86_64", "AMD64") or platform.system() != "Linux":
        pytest.skip("the object code is looked at on x86-64 Linux only")
    for tool in ("objdump", "cc"):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not there")
    folder, known = tmp_path_factory.mktemp("libraries"), {}

    def functions(set_name, level):
        if (set_name, level) not in known:
            engines = [building.Engine(level, wheels) for wheels in (*building.UNROLLED, None)]
            known[set_name, level] = {
                f"{engine.wheels} {name}": code
                for engine in engines
                for name, code in disassembly(library(set_name, engine, folder)).items()
            }
        return known[set_name, level]

    return functions


def library(set_name, engine, folder):
    """The one that was built, where that has the level; else it is compiled now."""
    built = sets.BUILT / set_name / engine.file
    if built.exists():
        return built
    place = folder / set_name
    shutil.copytree(sets.c_folder(set_name, ()), place, dirs_exist_ok=True)
    building.engine_library(place, sets._engine_sources(), ROOT / "generated/c", engine)
    return place / built.name


def disassembly(file):
    shown = subprocess.run(["objdump", "-d", "--no-show-raw-insn", file], capture_output=True, text=True)
    if shown.returncode != 0:
        pytest.skip(f"objdump cannot read the library: {shown.stderr.strip()}")
    parts = re.split(r"^[0-9a-f]+ <(.+)>:$", shown.stdout, flags=re.MULTILINE)[1:]
    return dict(zip(parts[::2], parts[1::2], strict=True))


@pytest.mark.long
@pytest.mark.parametrize("level", REGISTERS)
def test_the_batch_kernel_is_vectorised(disassembled, level):
    text = "\n".join(code for name, code in disassembled("locked", level).items() if "forward_dynamics_batch" in name)
    vectors = [match["register"] for match in VECTOR_PRODUCT.finditer(text)]
    scalars = SCALAR_PRODUCT.findall(text)
    assert vectors.count(REGISTERS[level]) > 100, f"{vectors.count(REGISTERS[level])} products in {REGISTERS[level]}"
    assert len(scalars) < 0.1 * len(vectors), "most of the kernel is scalar"


@pytest.mark.long
@pytest.mark.parametrize("set_name, level", [("free", "x86-64-v4"), ("locked", "x86-64-v3")])
def test_no_level_fuses_products_and_sums(disassembled, set_name, level):
    """Fused, results would depend on the machine."""
    code = disassembled(set_name, level)
    code = code | disassembly(sets.BUILT / set_name / "double.so")
    assert {"3 omniroll_run", "4 omniroll_run", "None omniroll_run", "omniroll_nu_from_wheels"} <= code.keys()
    assert {name: FUSED.findall(text) for name, text in code.items() if FUSED.search(text)} == {}


# The engine's evaluations


def evaluations(duration=10.0, accuracy=1e-9, rollers=5):
    found = omniroll.simulate(
        omniroll.Vehicle.paper(3, rollers),
        nu=(1, 0, 1),
        duration=duration,
        roller_model="locked",
        switching="smooth",
        accuracy=accuracy,
        control=False,
    )
    return found.stats["evaluations"], found.stats["steps"], len(found.switches)


def test_evaluations_grow_with_the_switches_alone():
    """Twice the time, twice the switches, twice the evaluations."""
    short, _, switches = evaluations(20.0)
    long, _, more_switches = evaluations(40.0)
    assert long / short == pytest.approx(more_switches / switches, rel=0.25)


# A call, in what it makes anew


def counted(monkeypatch, owner, name):
    """A list that grows by one with each call of a method."""
    calls, method = [], getattr(owner, name)
    monkeypatch.setattr(owner, name, lambda *args, **options: (calls.append(1), method(*args, **options))[1])
    return calls


def test_a_call_with_effects_makes_what_it_needs_once(monkeypatch):
    """The second call prepares nothing: no effects of a run, no rates, no checks, no laws of motors."""
    effects = [
        Motor(voltage=3, torque_constant=0.02, resistance=1.5, current_limit=2),
        Controller(target=(1, 0, 0.5), proportional=0.125, sample_time=0.01, output="voltage"),
        Slope(0.1),
        Bearings(wheel_viscous=1e-3, roller_viscous=1e-6),
    ]
    runs = counted(monkeypatch, EffectRun, "__init__")
    checks = counted(monkeypatch, Controller, "check")
    bound = counted(monkeypatch, CompiledKernel, "bind")
    laws = counted(monkeypatch, NeutralKernel, "motor_laws")
    for _ in range(3):
        omniroll.simulate(omniroll.Vehicle.paper(), nu=(1, 0, 1), duration=1e-3, effects=effects)
        assert (len(runs), len(checks), len(bound), len(laws)) == (1, 1, 0, 1)

"""The compiled engine called from C alone, under the sanitizers, gives what simulate() gives."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll.kernels import building, sets

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]
SCALARS = (
    "mass", "yaw_inertia", "wheel_inertia", "roller_inertia", "yaw_scale", "platform_radius", "wheel_radius",
    "roller_axis_radius",
)  # fmt: skip
FLAGS = [
    "-std=c11",
    "-g",
    "-O0",  # the compiler takes a third of the time of -O1
    "-march=native",  # one level of vector instructions, not three
    "-ffp-contract=off",
    "-Wno-psabi",
    "-fsanitize=address,undefined",
    "-fno-sanitize-recover=all",
]


ROLLERS = omniroll.Bearings(
    wheel_coulomb=(3e-3, 4e-3, 5e-3), wheel_break_away=(3.6e-3, 4.8e-3, 6e-3),
    roller_coulomb=(3e-7, 4e-7, 5e-7), roller_break_away=(6e-7, 8e-7, 1e-6),
)  # fmt: skip
GROUND = omniroll.Contact((30, 20), wheel_rates=(5, -3, 2))
STANDING = omniroll.Contact(law="coulomb", friction=(0.3, 0.2), wheel_rates=(5, -3, 2))
ALL_BEARINGS = omniroll.Bearings(
    wheel_coulomb=(3e-2, 4e-2, 5e-2), wheel_break_away=(3.6e-2, 4.8e-2, 6e-2),
    roller_coulomb=(3e-4, 4e-4, 5e-4), roller_break_away=(3.6e-4, 4.8e-4, 6e-4),
)  # fmt: skip
SERIES = omniroll.Bearings(
    wheel_coulomb=(6e-4, 8e-4, 1e-3), wheel_break_away=(7.2e-4, 9.6e-4, 1.2e-3),
    roller_coulomb=(6e-4, 8e-4, 1e-3), roller_break_away=(7.2e-4, 9.6e-4, 1.2e-3),
)  # fmt: skip
CASES = {  # effects of the set, flags, what acts, as in engine.c, and for how long
    "axles and rollers that stick": (
        ("axle_sticking", "roller_sticking"), ["-DSTICKING"], [ROLLERS], 5.0,
    ),
    "axles and massless rollers that stick where wheels slip": (
        ("contact_viscous", "axle_sticking", "roller_sticking"), ["-DSLIPPING", "-DSERIES"], [GROUND, SERIES], 2.0,
    ),
    "axles and rollers that stick beside contacts": (
        ("contact_coulomb", "axle_sticking", "roller_sticking"), ["-DSTANDING"], [STANDING, ALL_BEARINGS], 0.3,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_engine_from_c_under_sanitizers(tmp_path, case):
    effects, macro, acting, duration = CASES[case]

    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("no gcc")
    csrc, constants = ROOT / "runtime/csrc", ROOT / "generated/c"
    program = tmp_path / "engine"
    rollers = "massless" if "-DSERIES" in macro else "free"
    for name, text in sets.programs().kernel(rollers, effects).files().items():
        (tmp_path / name).write_text(text)
    sources = [ROOT / "tests/c/engine.c", tmp_path / "omniroll.c", *(csrc / name for name in building.ENGINE_SOURCES)]
    folders = (f"-I{folder}" for folder in (tmp_path, csrc, constants))
    command = [compiler, *FLAGS, *macro, *folders, *map(str, sources), "-lm", "-o", program]
    built = subprocess.run(command, capture_output=True, text=True)
    if "cannot find" in built.stderr and "san" in built.stderr:
        pytest.skip("no sanitizer libraries")
    assert built.returncode == 0, built.stderr
    vehicle = omniroll.Vehicle.paper()
    numbers = [*(getattr(vehicle, name) for name in SCALARS), *vehicle.wheel_angles, duration]
    ran = subprocess.run([program, *map(repr, map(float, numbers)), "0"], capture_output=True, text=True, timeout=120)
    assert ran.returncode == 0, ran.stderr
    status, switched, *state = ran.stdout.splitlines()[-1].split()
    run = omniroll.simulate(
        vehicle, nu=(1, 0.2, 1), chi=(0.1, -0.2, 0.3), duration=duration, accuracy=1e-11, effects=acting,
        roller_model=rollers,
    )  # fmt: skip
    assert (int(status), int(switched)) == (0, len(run.switches))
    nu, chi, pose = np.array(state, float).reshape(3, 3).T
    np.testing.assert_allclose(nu, run.nu[-1], atol=1e-10)
    np.testing.assert_allclose(chi, run.chi[-1], atol=1e-9)
    np.testing.assert_allclose(pose, run.pose[-1], atol=1e-10)

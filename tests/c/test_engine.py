"""The compiled engine under the sanitizers, as the package calls it: the same bits, and no word of theirs."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import omniroll

pytestmark = pytest.mark.long

FLAGS = "-O0 -march=native -fsanitize=address,undefined -fno-sanitize-recover=all"
RUN = "omniroll.simulate(omniroll.Vehicle.paper(), nu=(1, 0.2, 1), chi=(0.1, -0.2, 0.3), control=False, {})"
BEARINGS = "omniroll.Bearings(wheel_coulomb={0}, roller_coulomb={1}, roller_break_away={2})"
CASES = {  # one for each of the engine's ways with friction; on the way some stick, some break away, some switch
    "a platform on springs": (
        "effects=[omniroll.Contact(law='coulomb', friction=(0.3, 0.2), wheel_rates=(5, -3, 2)), "
        "omniroll.Springs(0.06, deflection=1e-4)], duration=0.3"
    ),
    "axles and massless rollers that stick where wheels slip": (
        f"effects=[{BEARINGS.format(6e-4, 8e-4, 1e-3)}, omniroll.Contact((30, 20), wheel_rates=(5, -3, 2))], "
        "duration=2.0, roller_model='massless'"
    ),
    "axles and rollers that stick beside contacts, motors at their limits": (
        f"effects=[{BEARINGS.format(3e-2, 3e-4, 4e-4)}, omniroll.Motor(2.0, 0.02, 1.5, current_limit=0.5), "
        "omniroll.Contact(law='coulomb', friction=(0.3, 0.2), wheel_rates=(5, -3, 2))], duration=0.3"
    ),
}
PROGRAM = """
import omniroll
run = {}
print(run.nu.tobytes().hex(), run.chi.tobytes().hex(), run.pose.tobytes().hex())
"""


@pytest.mark.parametrize("case", CASES)
def test_runs_are_clean_under_sanitizers(case, tmp_path):
    asked = [["gcc", f"-print-file-name=lib{name}.so"] for name in ("asan", "ubsan")]
    libraries = [subprocess.run(command, capture_output=True, text=True).stdout.strip() for command in asked]
    if not all(Path(library).is_absolute() for library in libraries):
        pytest.skip("gcc has no sanitizer libraries")
    watched = {"LD_PRELOAD": " ".join(libraries), "ASAN_OPTIONS": "detect_leaks=0", "OMNIROLL_CFLAGS": FLAGS}
    environment = os.environ | watched | {"OMNIROLL_CACHE": str(tmp_path), "CC": "gcc"}
    call = [sys.executable, "-W", "error", "-c", PROGRAM.format(RUN.format(CASES[case] + ", engine='specialised'"))]
    done = subprocess.run(call, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (engine,) = tmp_path.rglob("engine-*.so")
    assert b"__asan_report" in engine.read_bytes() and b"__ubsan_handle" in engine.read_bytes()
    plain = eval(RUN.format(CASES[case] + ", engine='specialised'"), {"omniroll": omniroll})
    found = [np.frombuffer(bytes.fromhex(part)) for part in done.stdout.split()]
    for one, other in zip(found, (plain.nu, plain.chi, plain.pose), strict=True):
        assert np.array_equal(one, other.ravel())

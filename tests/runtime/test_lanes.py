"""No result depends on how many numbers the engine computes with as one."""

import os
import subprocess
import sys

import pytest

RUNS = """
import numpy as np, omniroll
from omniroll import Bearings, Contact, Motor, Slope

SCENES = {
    "bare": (),
    "friction makes it stiff": (Bearings(wheel_coulomb=2e-3, wheel_speed=1e-6), Slope(0.05)),
    "slip couples the speeds": (Contact(law="regularised", friction=0.3, speed=1e-3, wheel_rates=0),),
    "rollers stick": (Bearings(roller_coulomb=1e-3), Motor(2.0, 0.02, 1.5, current_limit=0.5)),
}
for name, effects in SCENES.items():
    model = "locked" if name == "rollers stick" else "free"
    run = omniroll.simulate(omniroll.Vehicle.paper(), nu=(1, 0.2, 1), duration=1.5, roller_model=model, effects=effects,
                            control=False)
    print(name, run.stats["evaluations"], *(a.tobytes().hex() for a in (run.t, run.nu, run.chi, run.pose)))
"""


def printed(lanes):
    flags = {"OMNIROLL_CFLAGS": f"-DLANES={lanes}"} if lanes else {}
    done = subprocess.run([sys.executable, "-c", RUNS], env=os.environ | flags, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.long
def test_runs_have_the_same_bits_with_any_number_of_lanes():
    assert printed(8) == printed(None)

"""Runs of the compiled engine, as digests of their bits: what a machine of another kind must print, too."""

import hashlib

import numpy as np

import omniroll

MOTOR, BEARINGS = omniroll.Motor((3, -2, 1), 0.02, 1.5), omniroll.Bearings(wheel_viscous=1e-4)
RUNS = {
    "three wheels": {"wheels": 3, "nu": (1, 0, 1), "duration": 5},
    "four wheels": {"wheels": 4, "nu": (1, 0.3, 1), "duration": 3},
    "motors": {"wheels": 3, "nu": (0, 0, 0), "duration": 1, "effects": [MOTOR, BEARINGS]},
}

for name, options in RUNS.items():
    run = omniroll.simulate(omniroll.Vehicle.paper(options.pop("wheels")), **options)
    assert run.stats["engine"] == "compiled"
    bits = b"".join(np.ascontiguousarray(getattr(run, part)).tobytes() for part in ("t", "nu", "chi", "pose", "spins"))
    print(name, len(run), len(run.switches), hashlib.sha256(bits).hexdigest(), run.pose[-1].tolist())

"""Reference motions in 25 digits and more, kept as data: `python -m oracle.references` in tests/ writes them.

A case holds the vehicle and the start as floats, and the end, the switches and some samples as decimal
strings.
"""

import json
import math
import sys
from pathlib import Path

import numpy as np

from . import taylor
from .states import ordinary_vehicle, paper_vehicle, random_state, time_for_switches
from .vehicle import SCALARS, OracleVehicle

FILE = Path(__file__).parent.parent / "data" / "reference_motions.json"
DIGITS = 26
PAPER_MOTIONS = {1: (0.0, 0.0, 1.0), 2: (1.0, 0.0, 0.0), 3: (1.0, 0.0, 1.0)}
PAIRS = [(m, law) for m in ("massless", "locked", "free") for law in ("smooth", "impact")]


def as_floats(vehicle):
    """The vehicle with every number rounded to a float."""
    fields = vehicle.fields()
    del fields["wheels"]
    return OracleVehicle(**(fields | {"wheel_angles": tuple(fields["wheel_angles"])}))


def starts():
    """(name, vehicle, start, duration) of every case."""
    paper = as_floats(paper_vehicle())
    rest = {"chi": [0.0] * 3, "spins": [[0.0] * 4] * 3, "pose": [0.0, 0.0, 0.0]}
    for number, nu in PAPER_MOTIONS.items():
        yield f"paper {number}", paper, {"nu": list(nu)} | rest, 4.0 if number == 1 else 1.5
    for seed, (wheels, rollers, switches) in enumerate([(2, 3, 5), (3, 5, 7), (4, 4, 6), (3, 8, 8)]):
        rng = np.random.default_rng([100, seed])
        vehicle = ordinary_vehicle(rng, wheels, rollers)
        nu, chi, spins = random_state(rng, vehicle, filled=0.9)
        start = {"nu": nu.tolist(), "chi": chi.tolist(), "spins": spins.tolist(), "pose": [0.5, -0.25, 0.75]}
        yield f"{wheels} wheels, {rollers} rollers", vehicle, start, time_for_switches(vehicle, nu, switches)


def text(value):
    return value.str(DIGITS, radius=False)


def numbers(values):
    return [text(v) for v in values]


def row(vehicle, state, model):
    spins = [numbers(w[1:]) for w in state.dq.phi] if model == "free" else None
    return {
        "t": text(state.t),
        "pose": numbers(state.pose),
        "nu": numbers(taylor.nu(vehicle, state)),
        "chi": numbers(state.chi),
        "contact": state.contact,
        "contact_spin": None if model == "massless" else numbers(w[0] for w in state.dq.phi),
        "spins": spins,
        "energy": text(taylor.energy(vehicle, state, model=model)),
    }


@taylor.working_precision
def solve(vehicle, start, duration, model, law, digits=DIGITS, order=32):
    """One motion as plain data. Switches within 1e-15 are joint: symmetry that the floats break is meant."""
    state = taylor.start(vehicle, **start, model=model)
    times = [duration * k / 4 for k in range(1, 4)]
    motion = taylor.simulate(
        vehicle, state, duration, model=model, law=law, digits=digits, order=order, times=times, together="1e-15"
    )
    return {
        "end": row(vehicle, motion.end, model),
        "samples": [row(vehicle, s, model) for s in motion.samples],
        "smallest_gap": motion.smallest_gap(),
        "switches": [
            {
                "t": text(s.t),
                "moves": {str(i): d for i, d in sorted(s.moves.items())},
                "energy_jump": text(s.energy_after - s.energy_before),
                "nu_after": numbers(taylor.nu(vehicle, s.after)),
            }
            for s in motion.switches
        ],
    }


def cases():
    for name, vehicle, start, duration in starts():
        fields = {key: getattr(vehicle, key) for key in SCALARS}
        fields |= {"wheel_angles": list(vehicle.wheel_angles), "rollers_per_wheel": vehicle.rollers_per_wheel}
        for model, law in PAIRS:
            print(name, model, law, file=sys.stderr)
            given = {"name": name, "model": model, "law": law, "vehicle": fields, "start": start, "duration": duration}
            yield given | solve(vehicle, start, duration, model, law)


def load():
    """The cases, with OracleVehicle in place of the fields."""
    found = json.loads(FILE.read_text())
    for case in found:
        fields = case["vehicle"]
        case["vehicle"] = OracleVehicle(**(fields | {"wheel_angles": tuple(fields["wheel_angles"])}))
        assert all(math.isfinite(float(v)) for v in case["end"]["nu"])
    return found


if __name__ == "__main__":
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text("[\n" + ",\n".join(json.dumps(case) for case in cases()) + "\n]\n")

"""Every column of every table has the unit that it says: a run in other units of mass, length and time scales so."""

import csv
from dataclasses import fields

import numpy as np
import pytest

import omniroll
from omniroll import cli
from omniroll.results.measurements import NAMES
from omniroll.results.tables import about
from omniroll.vocabulary import BEARINGS, CONTACT, MOTOR, SLOPE, STANDARD_GRAVITY, VEHICLE, by_name

SCALES = {"kg": 2.0**3, "m": 2.0**-2, "s": 2.0**1}  # of a number where the unit is that much smaller; exact
POWERS = {  # kg, m, s
    "kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2), "J": (1, 2, -2), "W": (1, 2, -3),
    "V": (1, 2, -3), "ohm": (1, 2, -3), "A": (0, 0, 0), "rad": (0, 0, 0), "1": (0, 0, 0), "": (0, 0, 0),
}  # fmt: skip
UNITS = {name: entry.unit for name, entry in by_name(VEHICLE, BEARINGS, CONTACT, MOTOR, SLOPE).items()}
RUNS = {
    "slipping": [omniroll.Contact(law="coulomb", friction=0.3, normal_gravity=STANDARD_GRAVITY, wheel_rates=2.0)],
    "driven": [
        omniroll.Motor(1.0, torque_constant=0.02, resistance=1.0, gear_ratio=3.0),
        omniroll.Bearings(wheel_viscous=1e-3, wheel_coulomb=2e-3),
        omniroll.Slope(0.1, gravity=STANDARD_GRAVITY),
    ],
}


def scale(unit):
    """What a number in this unit is multiplied by."""
    total = 1.0
    for power, part in zip((1, -1), unit.split("/"), strict=False):
        for name in part.split():
            base, _, exponent = name.partition("^")
            for k, size in zip(POWERS[base], SCALES.values(), strict=True):
                total *= size ** (power * k * int(exponent or 1))
    return total


def scaled(thing, names):
    """A vehicle or an effect in the other units."""
    changed = {}
    for name in names:
        value = getattr(thing, name)
        if name in UNITS and value not in (None, ()) and not isinstance(value, (str, int)):
            factors = [scale(unit) for unit in UNITS[name].split(", ")]
            changed[name] = (np.array(value) * factors[0]).tolist()
    return changed


def run_in(effects, is_scaled):
    vehicle, nu, duration = omniroll.Vehicle.paper().replace(yaw_scale=1.0), np.array([1.0, 0.3, 0.5]), 0.2
    if is_scaled:
        vehicle = vehicle.replace(**scaled(vehicle, by_name(VEHICLE)))
        effects = [type(e)(**({f.name: getattr(e, f.name) for f in fields(e)} | scaled(e, [f.name for f in fields(e)])))
                   for e in effects]  # fmt: skip
        nu, duration = nu / SCALES["s"], duration * SCALES["s"]
    return omniroll.simulate(vehicle, nu=nu, duration=duration, effects=effects, control=False)


@pytest.mark.parametrize("name", RUNS)
def test_every_column_scales_as_its_unit_says(name):
    plain, other = (run_in(RUNS[name], is_scaled) for is_scaled in (False, True))
    times = np.linspace(0.01, 0.19, 7)
    one, two = plain.arrays(times), other.arrays(times * SCALES["s"])
    read = [reading for reading in NAMES if name == "driven" or not reading.startswith("motor")]
    one |= plain.measure(times, names=read)
    two |= other.measure(times * SCALES["s"], names=read)
    assert set(one) == set(two) and len(one) > 12
    for column, values in one.items():
        unit = about(column)["units"]
        factors = [scale(part) for part in unit.split(", ")]
        wanted = values * (factors[0] if len(factors) == 1 else np.array(factors))
        np.testing.assert_allclose(two[column], wanted, rtol=1e-6, atol=1e-9 * np.abs(wanted).max(), err_msg=column)


def test_wheels_count_from_1_wherever_people_read(tmp_path):
    text = "[vehicle]\npreset = 'paper'\n[start]\nnu = [1, 0, 1]\n[run]\nduration = 2\nstep = 0.5\n[measurements]\n"
    (tmp_path / "scene.toml").write_text(text)
    assert cli.main(["run", str(tmp_path / "scene.toml"), "--output", str(tmp_path / "out")]) == 0
    for path in (tmp_path / "out").glob("*.csv"):
        rows = list(csv.DictReader(line for line in path.open() if not line.startswith("#")))
        names = [column for column in rows[0] if column[-2:] in ("_0", "_1", "_2", "_3")]
        numbers = {int(column[-1]) for column in names} | {int(row["wheel"]) for row in rows if "wheel" in row}
        assert 3 in numbers <= {1, 2, 3}, path.name

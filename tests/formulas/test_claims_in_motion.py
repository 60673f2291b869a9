"""Runs of the simulator that show what the comparison says of the claims in words; each test names its entry."""

import json

import numpy as np
import pytest
from maxima_session import ROOT

import omniroll
from omniroll.studies.motions import measures

VERDICTS = {
    r["id"]: r["verdict"] for r in json.loads((ROOT / "generated/formulas/formulas.json").read_text())["formulas"]
}
VEHICLE = omniroll.Vehicle.paper()
MOTIONS = {1: (0, 0, 1), 2: (1, 0, 0), 3: (1, 0, 1)}
ACCURACY, EXACT = 1e-10, 1e-9


def run(motion, model, switching="smooth", duration=4.0, **start):
    return omniroll.simulate(
        VEHICLE, nu=MOTIONS[motion], duration=duration, roller_model=model, switching=switching, accuracy=ACCURACY,
        **start,
    )  # fmt: skip


def nu_dot(nu, chi, spins=None, model="locked"):
    return omniroll.accelerations(VEHICLE, nu, chi, spins, roller_model=model)


def test_property_1_energy_integral():
    assert VERDICTS["property:1"] == "holds"
    for model in ("massless", "locked", "free"):
        trajectory = run(3, model)
        assert measures.energy_drift(trajectory) < 1e-12 and len(trajectory.switches) > 3


def test_property_2_platform_at_rest():
    assert VERDICTS["property:2"] == "holds"
    spins = np.linspace(-3, 4, 12).reshape(3, 4)
    trajectory = omniroll.simulate(
        VEHICLE, nu=(0, 0, 0), chi=(0.1, -0.2, 0.3), spins=spins, duration=2, roller_model="free"
    )
    assert np.ptp(trajectory.spins, axis=0).max() == 0 and np.abs(trajectory.nu).max() == 0


def test_property_3_uniform_rotation():
    """Kept by locked rollers on equal wheels; not on unequal ones, and not by free rollers."""
    assert VERDICTS["property:3"] == "holds-if"
    equal = nu_dot((0, 0, 1), (0.2, 0.2, 0.2))[0]
    unequal = nu_dot((0, 0, 1), (0.2, -0.1, 0.3))[0]
    assert np.abs(equal).max() < 1e-15 < 1e-6 < np.abs(unequal).max()
    spins_dot = nu_dot((0, 0, 1), (0, 0, 0), np.zeros((3, 4)), "free")[1]
    kappa = 2 * np.pi * np.arange(1, 5) / 5
    expected = VEHICLE.platform_radius * np.cos(kappa) / VEHICLE.wheel_radius / VEHICLE.yaw_scale**2
    assert np.allclose(spins_dot, expected, rtol=1e-12)


def test_property_5_the_linear_integral_is_lost():
    assert VERDICTS["property:5"] == "holds"
    assert measures.spread(run(3, "massless").nu[:, 2]) < EXACT
    assert measures.spread(run(3, "locked").nu[:, 2]) > 1e-5
    assert measures.spread(run(3, "free").nu[:, 2]) > 1e-5


def test_property_5_growth_with_B():
    """To first order only: nu_3'/B is not the same at two values of B, its limit is finite."""
    assert VERDICTS["property:5:proportional"] == "holds-if"
    ratios = []
    for scale in (1e-6, 1e-3, 1.0):
        fields = {name: getattr(VEHICLE, name) for name in VEHICLE.__dataclass_fields__}
        vehicle = omniroll.Vehicle(**fields | {"roller_inertia": VEHICLE.roller_inertia * scale})
        rate = omniroll.accelerations(vehicle, (1, 0.5, 2), (0.5, -0.2, 0.4), roller_model="locked")[0][2]
        ratios.append(rate / vehicle.roller_inertia)
    assert ratios[0] != 0 and np.isclose(ratios[0], ratios[1], rtol=1e-2)
    assert not np.isclose(ratios[0], ratios[2], rtol=1e-6)


def test_section4_same_spin():
    """The spin relative to the disk is the same on both sides of a switch, the absolute one is not."""
    assert VERDICTS["section4:same-spin"] == "holds-if"
    trajectory = run(3, "locked")
    before = np.flatnonzero((trajectory.contact[1:] != trajectory.contact[:-1]).any(axis=1))
    assert len(before) > 3
    for row in before:
        assert np.allclose(trajectory.contact_spin[row], trajectory.contact_spin[row + 1], rtol=1e-9)
        switched = trajectory.contact[row] != trajectory.contact[row + 1]
        assert np.all(np.abs(np.sin(trajectory.chi[row + 1]) - np.sin(trajectory.chi[row]))[switched] > 0.5)


def test_section5_1_rotation():
    """Motion 1 stays uniform with massless and locked rollers; free rollers change its rate as the note says."""
    assert (VERDICTS["section5:1"], VERDICTS["section5:1:free"]) == ("holds-if", "fails")
    for model in ("massless", "locked"):
        trajectory = run(1, model)
        assert measures.spread(trajectory.nu[:, 2]) < EXACT and measures.path_length(trajectory) < EXACT
        assert measures.energy_spread(trajectory) < EXACT
    free = run(1, "free", "impact", duration=0.9 * switch_time())
    assert len(free.switches) == 0 and measures.path_length(free) < EXACT
    v, chi = VEHICLE, free.chi[:, 0]
    inertia = v.yaw_inertia + 3 * v.wheel_inertia * (v.platform_radius / v.wheel_radius) ** 2
    inertia = inertia - 3 * v.roller_inertia * (v.rollers_per_wheel / 2 - np.sin(chi) ** 2)
    kept = inertia * free.nu[:, 2] ** 2
    assert np.ptp(kept) < 1e-10 * kept[0] and measures.spread(free.nu[:, 2]) > 1e-7


def switch_time():
    """When motion 1 reaches its first switch, about."""
    rate = VEHICLE.platform_radius / VEHICLE.wheel_radius / VEHICLE.yaw_scale
    return np.pi / VEHICLE.rollers_per_wheel / rate


@pytest.mark.parametrize(
    "model, switching, has_steps", [("locked", "smooth", False), ("locked", "impact", True), ("free", "smooth", True)]
)
def test_section5_2_steps_of_the_energy(model, switching, has_steps):
    """Motion 2 has no steps in the paper's own setting, locked rollers and speeds kept."""
    assert (VERDICTS["section5:2"], VERDICTS["section5:2:steps"]) == ("fails", "fails")
    trajectory = run(2, model, switching)
    assert len(trajectory.switches) > 3
    step = measures.largest_energy_step(trajectory)
    assert step > 1e-7 if has_steps else step < 1e-12
    if switching == "smooth":
        assert np.abs(trajectory.nu[:, 1:]).max() < EXACT
        assert measures.spread(trajectory.nu[:, 0]) > 1e-6


def test_section5_3_twist():
    assert VERDICTS["section5:3"] == "holds"
    trajectory = run(3, "locked")
    assert measures.largest_energy_step(trajectory) > 1e-6 and measures.spread(trajectory.nu[:, 2]) > 1e-5


def test_section5_energy_term():
    """Each step under locked rollers with speeds kept is the jump of B theta' sin(chi) phi'."""
    assert VERDICTS["section5:energy-term"] == "holds-if"
    trajectory = run(3, "locked")
    before = np.flatnonzero((trajectory.contact[1:] != trajectory.contact[:-1]).any(axis=1))
    for row in before:
        terms = [
            VEHICLE.roller_inertia * trajectory.nu[k, 2] / VEHICLE.yaw_scale
            * np.sin(trajectory.chi[k]) @ trajectory.contact_spin[k] for k in (row, row + 1)
        ]  # fmt: skip
        step = trajectory.energy[row + 1] - trajectory.energy[row]
        assert np.isclose(step, terms[1] - terms[0], rtol=1e-6, atol=1e-13 * trajectory.energy[0])


def test_figure_5_circle():
    assert VERDICTS["figure:5"] == "holds"
    radius, deviation = measures.circle(run(3, "massless", duration=20.0))
    assert deviation < 1e-8 and radius > 0

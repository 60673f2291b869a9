"""Closed forms of mecanum wheels and two rows, beside integrals of the rolling condition; what explain prints."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

import omniroll
from omniroll.robots.catalogue import robot
from omniroll.scenes.wheels_explained import text, wheels_explained

REST = "[start]\ntwist = [0.4, 0.3, 0.5]\n[run]\nduration = 1\n"


@pytest.fixture
def forms(tmp_path):
    def of(vehicle, more=""):
        (tmp_path / "scene.toml").write_text(f"[vehicle]\n{vehicle}\n{REST}{more}")
        found = wheels_explained(omniroll.load_scene(tmp_path / "scene.toml"))
        return found, {form["name"]: form["value"] for form in found.get("forms", ())}

    return of


def rates(chi, l, r, psi):  # noqa: E741
    """chi' and phi' of a wheel whose centre moves at 1 m/s along its axle, from the velocity of the point that touches.

    Axes: x along the axle, y across it, z up. The contact is where the ground's normal meets the roller's axis.
    """
    inward = np.array([0, -math.sin(chi), math.cos(chi)])
    axis = math.cos(psi) * np.array([0, math.cos(chi), math.sin(chi)]) + np.array([math.sin(psi), 0, 0])
    place = -r * inward
    above = place - place[1] / axis[1] * axis
    contact = np.array([above[0], 0, -l])
    by_wheel, by_roller = np.cross([1.0, 0, 0], contact), np.cross(axis, contact - place)
    columns = np.column_stack([by_wheel[:2], by_roller[:2]])
    return np.linalg.solve(columns, [-1.0, 0.0]), contact[0]


@pytest.mark.parametrize("name", ["youbot", "robomaster-hero", "strafer", "mecanum-trio"])
def test_closed_forms_are_the_integrals(forms, name):
    vehicle = robot(name).vehicle
    _, found = forms(f"preset = '{name}'")
    l, r, n = vehicle.wheel_radius, vehicle.roller_axis_radius, vehicle.rollers_per_wheel  # noqa: E741
    joint = math.pi / n

    def turned(chi):
        return abs(rates(chi, l, r, math.pi / 4)[0][0])

    (_, spin), _ = rates(0.0, l, r, math.pi / 4)
    (_, faster), aside = rates(joint, l, r, math.pi / 4)
    way = quad(lambda chi: 1 / turned(chi), -joint, joint, epsabs=1e-15)[0] / (2 * joint)  # m per rad
    assert found["sideways_radius"] == pytest.approx(way, rel=1e-12)
    assert found["strafe_factor"] == pytest.approx(way * turned(0.0), rel=1e-12)
    assert found["rate_ripple"] == pytest.approx(turned(joint) / turned(0.0) - 1, rel=1e-12)
    assert found["spin_ratio"] == pytest.approx(faster / spin, rel=1e-12)
    assert found["contact_shift"] == pytest.approx(abs(aside), rel=1e-12)
    assert found["lever_jump"] == pytest.approx(2 * abs(aside), rel=1e-12) and found["forward_radius"] == l


def test_the_youbots_numbers(forms):
    """Those that are printed of it elsewhere: 0.9549, 15.5 %, 1.86, 20.5 mm."""
    found, values = forms("preset = 'youbot'")
    assert values["strafe_factor"] == pytest.approx(3 / math.pi, rel=1e-14)
    assert values["rate_ripple"] == pytest.approx(2 / math.sqrt(3) - 1, rel=1e-14)
    # 0.4 ahead, 0.3 to the left, 0.5 about: the wheel front right has (0.4 + 0.3 + 0.385 * 0.5)/0.05 rad/s
    assert values["roller_frequency"] == pytest.approx(6 * (0.7 + 0.5 * 0.385) / 0.05 / (2 * math.pi), rel=1e-12)
    said = "\n".join(text(found))
    assert "strafe_factor" in said and "* free" in said and "classical" in said


def test_two_rows_shift_their_contacts(forms):
    found, values = forms("preset = 'paper'\nrollers_per_wheel = 10\nrows = 2\nrow_offset = -0.004")
    assert values["contact_shift"] == 0.004 and values["lever_jump"] == 0.008 and "strafe_factor" not in values


def test_wheels_of_the_paper_have_nothing_to_explain(forms):
    found, _ = forms("preset = 'paper'")
    assert found == {} and text(found) == []

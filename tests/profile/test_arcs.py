"""Rollers whose meridian has several arcs: where each carries, what passing from one to the next does, what is refused.
tests/mecanum/test_all_bodies.py has the kernels beside a model of all bodies."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import omniroll
from omniroll import InvalidValueError, Vehicle, cli
from omniroll.kernels.by_state import piece_numbers
from omniroll.kernels.kernel import kernel
from omniroll.vehicles import profiles
from tests.mecanum.all_bodies import after_impact
from tests.mecanum.vehicles import coordinates, drawn, free_places, platform_rates, rolling_rates

from .test_runs import CYLINDERS, EDGES, MODELS, NU, PAPER, ROUNDED, THICK, run


def test_a_short_cylinder_stands_on_its_edges():
    """The Robot Soccer Kit's wheel: 4 mm of a pitch of 9 mm; 34.5 mm high in the middle, highest 3.3 degrees away."""
    kit = PAPER.replace(rollers_per_wheel=20, wheel_radius=34.5, roller_axis_radius=28.5,
                        roller_profile=[[-2, 6, 0], [2, 6, 0]])  # fmt: skip
    riding = profiles.riding(kit)
    assert [riding["lowest"], riding["highest"]] == pytest.approx([34.388, 34.558], abs=5e-4)
    assert riding["highest"] == pytest.approx(np.hypot(34.5, 2), rel=1e-14)
    joint = np.pi / 20
    mean = (34.5 * np.sin(joint) + 2 * (1 - np.cos(joint))) / joint
    assert riding["forward_radius"] == pytest.approx(mean, rel=1e-14)
    first, second = profiles.pieces(kit, 0.0)
    assert first.arc == (2, 6, 0) and second.arc == (-2, 6, 0)  # ahead of its middle a roller stands on its rear edge
    assert [*first[1:], *second[1:]] == [-joint, 0, 0, joint]


def test_a_barrel_ends_where_its_edges_begin():
    """A barrel that is too short: an arc with an edge on it at each end, which carries where the arc has ended."""
    radius, half = 3 * THICK, 0.6 * THICK
    away = np.sqrt(radius**2 - half**2) - radius + THICK
    short = PAPER.replace(roller_profile=[[-half, away, 0], [0, THICK - radius, radius], [half, away, 0]])
    whole = PAPER.replace(meridian_radius=radius)
    (rear, barrel, ahead) = profiles.pieces(short, 0.0)
    assert barrel.last == pytest.approx(np.arcsin(half / radius), rel=1e-7) and rear.last == -barrel.last
    for turn in np.linspace(-1, 1, 9) * barrel.last:
        (arc,) = profiles.arcs_of(whole)
        assert profiles.ride(barrel.arc, short, turn, 0.0) == profiles.ride(arc, whole, turn, 0.0)
    edge, arc = (profiles.ride(piece.arc, short, barrel.last, 0.0) for piece in (ahead, barrel))
    assert edge["height"] == pytest.approx(arc["height"], rel=1e-14)
    assert edge["slope"] == pytest.approx(arc["slope"], rel=1e-7)
    ends = [[-2 * THICK, THICK - radius + np.sqrt(radius**2 - 4 * THICK**2), 0], [0, THICK - radius, radius]]
    long = PAPER.replace(roller_profile=[*ends, [2 * THICK, ends[0][1], 0]])
    assert [piece[1:] for piece in profiles.pieces(long, 0.0)] == [(-np.pi / 9, np.pi / 9)]
    np.testing.assert_array_equal(run(long, duration=0.3).pose, run(whole, duration=0.3).pose)


@pytest.mark.parametrize("model", MODELS)
def test_passing_from_arc_to_arc_is_the_impact_of_the_bodies(model):
    seen, jump = 0, 0.0
    for seed in (1, 2):
        bodies, vehicle, nu, chi, spins = drawn("arcs", seed, 4, 6, model)
        start = {"chi": chi} | ({"spins": spins} if model == "free" else {})
        found = run(vehicle, nu, 0.6, roller_model=model, accuracy=1e-11, **start)
        arcs = [vehicle.roller_profile.index(piece.arc) for piece in profiles.pieces(vehicle, vehicle.roller_angle[0])]
        on = np.array(arcs)[piece_numbers(vehicle, found.chi)]
        stands = (found.pivots[1:] + found.pivots[:-1]).any(axis=1)
        same = (found.contact[1:] == found.contact[:-1]).all(axis=1) & ~stands
        for row in np.flatnonzero(same & (on[1:] != on[:-1]).any(axis=1)):
            own = found.spins[row] if model == "free" else np.zeros((4, 5))
            q, held = coordinates(bodies, found.chi[row]), [] if model == "free" else free_places(bodies)
            before = rolling_rates(replace(bodies, carries=on[row]), vehicle, found.nu[row], found.chi[row], own)
            expected = after_impact(replace(bodies, carries=on[row + 1]), q, before, held)[:3]
            got = platform_rates(vehicle, found.nu[row + 1])
            np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
            seen, jump = seen + 1, max(jump, np.abs(found.nu[row + 1] - found.nu[row]).max())
    assert seen > 20 and (jump > 1e-5 or model == "massless")  # whose wheels' rates do not jump there


def test_a_wheel_that_starts_on_a_border_stands_on_the_arc_to_which_it_turns():
    found = run(CYLINDERS, duration=0.01)
    forward = kernel(CYLINDERS, "free").wheel_speeds(NU, np.zeros(4)) > 0
    assert forward.any() and not forward.all() and (found.switches.t > 0).all()
    np.testing.assert_array_equal(found.chi[1] > 0, forward)


@pytest.mark.parametrize("backend", ["python", "compiled"])
@pytest.mark.parametrize("model", ["massless", "locked"])
def test_kernels_and_linear_models_know_the_arc_from_the_angles(backend, model):
    bound, chi = kernel(ROUNDED, model, backend), np.array([0.2, -0.2, 0.02, -0.25])
    assert len(set(piece_numbers(ROUNDED, chi).tolist())) == 3
    states = np.array([chi, -chi, 0 * chi])
    together = bound.forward_dynamics(NU, states)
    for one, state in zip(together, states, strict=True):
        np.testing.assert_array_equal(bound.forward_dynamics(NU, state), one)
        np.testing.assert_array_equal(bound.flow(None)(0.0, np.array([*NU, *state, 0, 0, 0]))[:3], one)
    slopes = omniroll.linearise(ROUNDED, nu=NU, chi=chi, roller_model=model).A[:3, 3:7]
    ahead, behind = (bound.forward_dynamics(NU, chi + way * 1e-5 * np.eye(4)) for way in (1, -1))
    np.testing.assert_allclose(slopes, (ahead - behind).T / 2e-5, rtol=1e-6, atol=1e-6 * np.abs(slopes).max())


def test_arcs_that_make_no_meridian_are_refused_in_a_sentence():
    top, wide = THICK, 0.3 * THICK
    for profile, words in (
        ([[-wide, top, 0], [wide, top, 0], [2 * wide, top, 0]], "same from both ends"),
        ([[wide, top, 0], [-wide, top, 0]], "must increase"),
        ([[-wide, top, -1e-3], [wide, top, -1e-3]], "no radius below 0"),
        ([[-wide, 0.9 * top, 0], [wide, 0.9 * top, 0]], "in the middle"),
        ([[-wide, 0.5 * top, 0], [0, top, 0], [wide, 0.5 * top, 0], [2 * wide, 0, 0]], "same from both ends"),
        ([[-wide, 0.1 * top, 0], [0, 0, top], [wide, 0.1 * top, 0]], "inside another"),
        ([[-wide, top, 0], [0, 0.9 * top, 0], [wide, top, 0]], "never carries"),
        ([[0, top]], "rows of 3 numbers"),
    ):
        with pytest.raises(InvalidValueError, match=words):
            PAPER.replace(roller_profile=profile)
    with pytest.raises(InvalidValueError, match="does not go with meridian_radius"):
        PAPER.replace(roller_profile=EDGES, meridian_radius=THICK)
    with pytest.raises(InvalidValueError, match="one size"):
        CYLINDERS.replace(roller_angle=[0, 0.1, 0.2, 0.3])


def test_tips_that_a_meridian_makes_sharp_are_refused():
    radius = THICK / (1 - np.cos(np.pi / 9)) * (1 - 1e-6)  # rho vanishes at the joint
    vehicle = PAPER.replace(meridian_radius=radius)
    assert vehicle.sharpness() > 1e2
    with pytest.raises(InvalidValueError, match="meridian_radius = .*sharp tips"):
        run(vehicle, roller_model="locked")
    assert Vehicle(**vehicle.as_dict()) == vehicle


def test_commands_that_know_one_arc_or_round_wheels_say_so(tmp_path, capsys):
    scene = tmp_path / "edges.toml"
    shipped = Path("scenes/mecanum-balls.toml").read_text(encoding="utf-8")
    thick = shipped.split("meridian_radius = ")[1].split()[0]
    profile = f"roller_profile = [[-0.004, {thick}, 0], [0.004, {thick}, 0]] #"
    scene.write_text(shipped.replace("meridian_radius = ", profile), encoding="utf-8")
    for command, words in (
        (["accuracy", str(scene)], "the reference knows no others"),
        (["kernel", str(scene), "--output", str(tmp_path), "--constants"], "constants are those of one"),
        (["mjcf", str(scene)], "roller_profile = .*cannot be exported"),
    ):
        assert cli.main(command) == 2
        assert re.search(words, capsys.readouterr().err)

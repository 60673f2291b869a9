"""Wheels that stand on their joint on a ground where they may slip: two rows of rollers, and mecanum wheels."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import omniroll
from omniroll.kernels.kernel import kernel
from omniroll.kernels.phases import Carry, kernel_in_phase
from omniroll.results.accelerations import call_named
from tests.contact.moving_bodies import named
from tests.rows import reversals
from tests.rows.ground_study import MODELS, ground

LAWS = {
    "viscous": ("contact_viscous", {"ground_damping": (3.7, 1.9)}),
    "regularised": (
        "contact_regularised", {"contact_load": 8.5, "ground_friction": (0.7, 0.3), "ground_fade_speed": 0.02}
    ),
    "coulomb": ("contact_coulomb", {}),
}  # fmt: skip
FRICTION, LOAD = np.array([0.7, 0.3]), 8.5


def in_phases(found, law, model):
    """The state of a random vehicle whose first wheel stands; the kernels in which it does, and on either roller."""
    draw = np.random.default_rng([len(law), found.rollers_per_wheel])
    name, constants = LAWS[law]
    bound = kernel(found, model, "python", effects=("drive", "contact", name), constants=tuple(constants.items()))
    count, places = found.wheels, found.rollers_per_wheel - 1
    chi = draw.uniform(-1, 1, count) * np.pi / found.rollers_per_wheel
    chi[0] = np.pi / found.rollers_per_wheel
    rates = draw.normal(0, 5, count)
    rates[0] = 0
    axial = draw.normal(0, 5, (count, places + 1))  # the roller in contact first; the last is the next one
    yaw, place = 4.0, np.array(found.wheel_places[0])  # about which it nearly turns, so that the rollers slip apart
    nu = np.append(yaw * np.array([place[1], -place[0]]) / found.platform_radius + (1e-3, -2e-3), yaw * found.yaw_scale)
    state = {"nu": nu, "chi": chi, "rates": rates, "torque": draw.normal(0, 0.01, count)}
    contact, nobody = np.zeros(count, int), np.zeros(count)
    of_next = contact.copy()
    of_next[0] = found.rollers_per_wheel - 1
    there = state | {"chi": np.append(-chi[0], chi[1:])}
    moved = axial.copy()
    moved[0] = np.roll(axial[0], 1)
    if model == "free":
        plain = kernel(found, model, "python")
        state |= {"contact_omega": axial[:, 0], "momenta": plain.momenta(axial[:, 1:])}
        there |= {"contact_omega": moved[:, 0], "momenta": plain.momenta(moved[:, 1:])}
        state |= {"next_omega": axial[:, -1], "next_before": axial[:, -1]}
        there |= {"next_omega": nobody, "next_before": nobody}
    stands = Carry(contact, np.append(1, nobody[1:]))
    kernels = [kernel_in_phase(bound, carry) for carry in (stands, Carry(contact, nobody), Carry(of_next, nobody))]
    return kernels, state, there


def forces(bound, state, law):
    """What gives the accelerations of a state by name, with Coulomb's forces on all contacts that turn."""
    if law != "coulomb":
        return named(bound, "slip_dynamics", state)
    none = {name: np.zeros(bound.wheels) for name in ("sticks", "ground_yield", "next_share", "slip_preload")}
    given = none | {"load": np.full(bound.wheels, LOAD), "friction": np.tile(FRICTION, (bound.wheels, 1)),
                    "ground_push": np.zeros((bound.wheels, 2))}  # fmt: skip
    slip = np.asarray(call_named(bound, "slip_forces", state | given)[0])
    size = np.sqrt(((FRICTION * slip) ** 2).sum(axis=1, keepdims=True))
    push = -LOAD * FRICTION**2 * slip / size
    turns = np.array(dict(bound.given)["turns"])
    return named(bound, "ground_dynamics", state | given | {"ground_push": push * turns[:, None]})


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("is_mecanum", [False, True])
def test_two_rollers_share_the_load_so_that_the_wheel_stays(model, law, is_mecanum):
    """Filippov's mixture of what either roller does alone; under Coulomb's law but for how it fades at a creep."""
    found = reversals.vehicle(np.random.default_rng(5), is_mecanum)
    (both, here, there), state, state_there = in_phases(found, law, model)
    mixed, one, other = (
        forces(bound, given, law) for bound, given in ((both, state), (here, state), (there, state_there))
    )
    close = {"rtol": 1e-11, "atol": 1e-11} if law != "coulomb" else {"rtol": 1e-6, "atol": 1e-5}
    share = one["rates_dot"][0] / (one["rates_dot"][0] - other["rates_dot"][0])
    np.testing.assert_allclose(mixed["next_share"][0], share, **close)
    share = mixed["next_share"][0]
    assert abs(mixed["rates_dot"][0]) == 0
    np.testing.assert_allclose(mixed["nu_dot"], (1 - share) * one["nu_dot"] + share * other["nu_dot"], **close)
    np.testing.assert_allclose(mixed["rates_dot"][1:], one["rates_dot"][1:], **close)
    if model == "free":
        np.testing.assert_allclose(mixed["contact_omega_dot"][0], (1 - share) * one["contact_omega_dot"][0], **close)
        np.testing.assert_allclose(mixed["next_omega_dot"][0], share * other["contact_omega_dot"][0], **close)


def handed_over(found, coefficient, nu, chi, rolling, angle, duration):
    """nu in the end by SciPy, of massless rollers in two rows on a viscous ground, where the load passes from row to
    row over an angle of each wheel: at its middle both have half of it."""
    angles, places, count = np.array(found.wheel_angles), np.array(found.wheel_places), found.wheels
    across, pitch = np.stack([-np.sin(angles), np.cos(angles)], axis=-1), 2 * np.pi / found.rollers_per_wheel
    axles = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    center, mass, radius = np.array(found.center_of_mass), found.mass, found.platform_radius
    inertia = found.yaw_inertia

    def rates(_, y):
        velocity, yaw, turned = y[:2], y[2], y[3 : 3 + count]
        whole = np.floor(turned / pitch + 0.5)
        beyond = turned - (whole - 0.5) * pitch  # behind the last joint
        part = np.clip(np.minimum(beyond, pitch - beyond) / angle + 0.5, 0, 1)
        neighbour = np.where(beyond < pitch / 2, whole - 1, whole + 1)
        force, moment, torque = np.zeros(2), 0.0, np.zeros(count)
        for roller, load in ((whole, part), (neighbour, 1 - part)):
            side = np.where(roller % 2, -1.0, 1.0)
            at = places + (side * found.row_offset)[:, None] * axles
            moving = velocity + yaw * np.stack([-at[:, 1], at[:, 0]], axis=-1)
            slip = (moving * across).sum(axis=1) + found.wheel_radius * y[3 + count :]
            push = -(coefficient * load * slip)[:, None] * across
            force = force + push.sum(axis=0)
            moment += (at[:, 0] * push[:, 1] - at[:, 1] * push[:, 0]).sum()
            torque += -found.wheel_radius * coefficient * load * slip
        central = inertia - mass * center @ center
        about = moment - (center[0] * force[1] - center[1] * force[0])
        spin = about / central
        of_center = force / mass
        point = of_center - spin * np.array([-center[1], center[0]]) + yaw**2 * center
        own = point + yaw * np.array([velocity[1], -velocity[0]])
        return np.concatenate([own, [spin], y[3 + count :], torque / found.wheel_inertia])

    start = np.concatenate([radius * np.array(nu[:2]), [nu[2] / found.yaw_scale], chi, rolling])
    moved = solve_ivp(rates, (0, duration), start, method="LSODA", rtol=1e-10, atol=1e-12, max_step=1e-4)
    end = moved.y[:, -1]
    return np.append(end[:2] / radius, end[2] * found.yaw_scale)


def two_at_joints():
    """A vehicle, and a start from which two of its wheels come to stand."""
    found = omniroll.Vehicle.paper(wheels=4, rollers_per_wheel=6).replace(yaw_scale=1.0, rows=2, row_offset=0.01)
    angles = np.array(found.wheel_angles)
    found = found.replace(wheel_places=tuple(map(tuple, found.platform_radius * np.stack(
        [np.cos(angles), np.sin(angles)], axis=-1))))  # fmt: skip
    across = np.stack([-np.sin(angles[:2]), np.cos(angles[:2])], axis=-1)
    nu = [*np.linalg.solve(across, [1.0, 1.0]), -1.0]
    return found, {"nu": nu, "chi": (np.pi / 6, np.pi / 6, 0.1, -0.2)}


def test_standing_is_the_limit_of_a_load_that_passes_over_an_angle():
    """Two wheels at rest on their joints: the shorter the angle, the nearer the motion, to first order."""
    found, start = two_at_joints()
    nu, chi, duration, coefficient = start["nu"], start["chi"], 0.05, 100.0
    run = omniroll.simulate(found, nu=nu, chi=chi, duration=duration, accuracy=1e-10, roller_model="massless",
                            effects=(omniroll.Contact(coefficient=coefficient),))  # fmt: skip
    assert (run.times_on_joints()[:2] > 0.5 * duration).all()
    rolling = run.quantity("rates")[0]
    away = [
        np.abs(handed_over(found, coefficient, nu, chi, rolling, angle, duration) - run.nu[-1]).max()
        for angle in (0.001, 0.00025)
    ]
    assert away[1] < 2e-4
    assert 3 < away[0] / away[1] < 5


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("is_mecanum", [False, True])
def test_random_vehicles_reverse_on_the_ground(model, law, is_mecanum):
    """They end, the ledger closes, what acts on the vehicle while wheels stand is what its rows say, and each goes on
    with the roller that has all of its load."""
    stood = 0.0
    for seed in (3, 33):
        task = reversals.task(np.random.default_rng([seed, 7]), driven=False, is_mecanum=is_mecanum)
        task |= {"effects": (ground(law, task["vehicle"]),), "accuracy": 1e-7, "duration": 0.7}
        run = omniroll.simulate(**task, roller_model=model)
        stood += run.times_on_joints().sum()
        assert abs(run.ledger.residual) < 1e-6 * run.energy.max()
        rows = run.step_rows[run.pivots[run.step_rows].any(axis=1) & (np.diff(run.elapsed)[run.step_rows] > 1e-5)]
        told, goes_on = run.contacts.accelerations(run.nu, run.chi), np.diff(run.pivots, axis=0) < 0
        passes = np.diff(run.contact, axis=0)[goes_on] != 0
        np.testing.assert_allclose(told["next_share"][:-1][goes_on], passes, atol=1e-6)
        for row in rows[:: max(1, len(rows) // 5)]:
            step = 1e-3 * (run.elapsed[row + 1] - run.elapsed[row])
            moved = run.sample(run.t[row] + np.array([0, step, 2 * step])).nu
            np.testing.assert_allclose(
                (-3 * moved[0] + 4 * moved[1] - moved[2]) / (2 * step), told["nu_dot"][row], rtol=1e-3, atol=1e-3
            )
    assert stood > 0.005


@pytest.mark.parametrize("law", ["viscous", "coulomb"])
def test_a_session_stands_as_a_run_does(law):
    task = reversals.task(np.random.default_rng([33, 7]), driven=False)
    task |= {"effects": (ground(law, task["vehicle"]),), "duration": 0.6, "control": False}
    run = omniroll.simulate(**task, roller_model="free")
    options = {name: value for name, value in task.items() if name not in ("duration", "control")}
    session = omniroll.Session(**{"subject": options.pop("vehicle")} | options, roller_model="free", driven=False)
    for _ in range(10):
        session.step(0.06)
    np.testing.assert_allclose(session.nu, run.nu[-1], atol=1e-6)
    assert run.times_on_joints().sum() > 0

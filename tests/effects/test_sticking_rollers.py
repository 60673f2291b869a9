"""Rollers that stick in their bearings: against Moreau's scheme on bodies, the regularised law, the law itself.

tests/runtime holds the compiled engine to the Python engine over random scenes, and sessions to runs.
"""

import numpy as np
import pytest

from omniroll import (
    Bearings,
    Instruments,
    InvalidValueError,
    Torque,
    Vehicle,
    linearise,
    reactions,
    simulate,
)
from omniroll.results.accelerations import torques_of_free_rollers, with_accelerations
from omniroll.results.reactions import modes_of_free_rollers

PAPER = Vehicle.paper()
TASK = {"accuracy": 1e-9, "control": False}


class Bodies:
    """The vehicle of paper.md as bodies in all coordinates: platform, wheels, each roller; nothing of the project.

    Speeds are (v_x, v_y, theta') along the platform's axes, chi'_i, phi'_ij; j = 0 is in contact. The platform's axes
    turn, so that what the mass keeps of its velocity turns in them.
    """

    def __init__(self, vehicle):
        self.v, self.wheels, self.rollers = vehicle, vehicle.wheels, vehicle.rollers_per_wheel
        self.angles = np.array(vehicle.wheel_angles)
        self.kappa = 2 * np.pi * np.arange(self.rollers) / self.rollers
        self.size = 3 + self.wheels * (1 + self.rollers)

    def place(self, i, j):
        return 3 + self.wheels + i * self.rollers + j

    def matrix(self, chi):
        v, m = self.v, np.zeros((self.size, self.size))
        m[0, 0] = m[1, 1] = v.mass
        m[2, 2] = v.yaw_inertia
        for i in range(self.wheels):
            m[3 + i, 3 + i] = v.wheel_inertia
            for j in range(self.rollers):
                k = self.place(i, j)
                m[k, k] = v.roller_inertia
                m[2, k] = m[k, 2] = v.roller_inertia * np.sin(chi[i] + self.kappa[j])
        return m

    def turning(self, chi, w):
        """What the changing axes and angles add to the rates of the momenta."""
        force = np.zeros(self.size)
        force[:2] = self.v.mass * w[2] * np.array([w[1], -w[0]])
        for i in range(self.wheels):
            for j in range(self.rollers):  # dT/dchi
                force[3 + i] += self.v.roller_inertia * w[self.place(i, j)] * w[2] * np.cos(chi[i] + self.kappa[j])
        return force

    def rolling(self, chi):
        """(2 N, size) rows that are zero where contacts do not slip: along the axle, and across it."""
        v, rows = self.v, []
        for i, angle in enumerate(self.angles):
            along, across = np.zeros(self.size), np.zeros(self.size)
            along[:2] = np.cos(angle), np.sin(angle)
            along[self.place(i, 0)] = -(v.wheel_radius * np.cos(chi[i]) - v.roller_axis_radius)
            across[:2], across[2] = (-np.sin(angle), np.cos(angle)), v.platform_radius
            across[3 + i] = v.wheel_radius
            rows += [along, across]
        return np.array(rows)


def moreau(vehicle, start, steps, duration, sliding, axles=0.0):
    """(size,) the speeds at the end: momentum balance, rolling and the law of friction at the end of each step.

    start  chi (N,) and the speeds (size,); sliding torques of all rollers and all axles
    """
    bodies = Bodies(vehicle)
    (chi, w), dt = start, duration / steps
    chi = np.array(chi, float)
    rubbing = np.arange(3 if axles else 3 + bodies.wheels, bodies.size)
    bounds = np.where(rubbing < 3 + bodies.wheels, axles, sliding) * dt
    taken = np.zeros(len(rubbing))
    for _ in range(steps):
        before = bodies.matrix(chi) @ w
        free = before + dt * bodies.turning(chi, w)
        chi = chi + dt * w[3 : 3 + bodies.wheels]
        m, rows = bodies.matrix(chi), bodies.rolling(chi)
        whole = np.block([[m, -rows.T], [rows, np.zeros((len(rows), len(rows)))]])
        answer = np.linalg.inv(whole)[: bodies.size, : bodies.size]
        w = answer @ free
        matrix, given = answer[np.ix_(rubbing, rubbing)], w[rubbing]
        while True:
            last = taken.copy()
            for k in range(len(rubbing)):
                rate = given[k] + matrix[k] @ taken
                taken[k] = np.clip(taken[k] - rate / matrix[k, k], -bounds[k], bounds[k])
            if np.abs(last - taken).max() <= 1e-12 * bounds.max():
                break
        w = answer[:, rubbing] @ taken + w
    return w


def begun(vehicle, nu, chi):
    """The same start: chi and the speeds, where the free rollers do not spin on their disks."""
    bodies, v = Bodies(vehicle), vehicle
    w = np.zeros(bodies.size)
    w[:3] = v.platform_radius * nu[0], v.platform_radius * nu[1], nu[2] / v.yaw_scale
    for i, angle in enumerate(bodies.angles):
        w[3 + i] = -(v.platform_radius * w[2] - np.sin(angle) * w[0] + np.cos(angle) * w[1]) / v.wheel_radius
        along = np.cos(angle) * w[0] + np.sin(angle) * w[1]
        w[bodies.place(i, 0)] = along / (v.wheel_radius * np.cos(chi[i]) - v.roller_axis_radius)
    return np.array(chi), w


@pytest.mark.long
@pytest.mark.parametrize("axles", [0.0, 4e-3])
def test_bodies_under_moreaus_scheme_move_so(axles):
    """Rollers and axles stop one by one, some stick while the vehicle goes on; errors fall with the step."""
    nu, chi, duration, torque = (0.1, 0.02, 0.25), (-0.3, 0.1, 0.2), 0.5, 2e-5
    errors = []
    friction = {"wheel_coulomb": axles} if axles else {}
    acting = [Bearings(roller_coulomb=torque, **friction)]
    run = simulate(PAPER, nu=nu, chi=chi, duration=duration, effects=acting, **TASK)
    assert not len(run.switches)
    for steps in (250, 1000):
        w = moreau(PAPER, begun(PAPER, nu, chi), steps, duration, torque, axles)
        spins = w[3 + PAPER.wheels :].reshape(PAPER.wheels, -1)[:, 1:]
        found = np.array([w[0] / PAPER.platform_radius, w[1] / PAPER.platform_radius, w[2] * PAPER.yaw_scale])
        errors.append(max(np.abs(found - run.nu[-1]).max(), 1e-2 * np.abs(spins - run.spins[-1]).max()))
    assert errors[1] < 0.4 * errors[0] and errors[1] < 2e-3


@pytest.mark.long
@pytest.mark.parametrize("model", ["massless", "locked", "free"])
def test_reactions_and_instruments_have_what_the_rollers_bearings_take(model):
    """Those of the regularised law tend to them; without the friction they would be far from them."""
    start = {"nu": (0.5, 0.1, 0.5), "chi": (0.1, 0.2, -0.1), "duration": 0.3, "roller_model": model, **TASK}

    def felt(*acting):
        run = simulate(PAPER, **start, effects=acting)
        found = reactions(run, height=0.1, friction=5.0)
        accelerometer = run.measure([0.2999], Instruments(place=(0.05, 0.02)))["accelerometer"]
        return np.concatenate([found.contact_force[-1].ravel(), found.load[-1], accelerometer.ravel()])

    limit, free = felt(Bearings(roller_coulomb=3e-3)), felt()
    near = [np.abs(felt(Bearings(roller_coulomb=3e-3, roller_speed=w)) - limit).max() for w in (1e-2, 1e-3)]
    assert near[1] < 0.3 * near[0] and near[0] < 0.01 * np.abs(free - limit).max()


def test_reactions_take_each_free_roller_as_it_sticks_or_turns():
    """Where nu' of the reactions is that of the rows' polynomials, the torques are those of the run."""
    acting = [Bearings(roller_coulomb=2e-6, roller_break_away=3e-6), Torque((2e-3, 0, -1e-3))]
    run = simulate(PAPER, nu=(0.4, 0.1, 2.0), duration=1.0, effects=acting, **TASK)
    signs = np.sign(np.where(np.abs(run.spins) < 1e-12, 0, run.spins))
    assert {-1.0, 0.0, 1.0} <= set(signs.ravel().tolist()) and len(run.switches)
    values = {"nu": run.nu, "chi": run.chi, "spins": run.spins, "heading": run.pose[:, 2]}
    values |= {name: run.drive[:, k] for k, name in enumerate(run.effects.drives())}
    bound = run.effects.kernel(PAPER, "free", "python", also=("reactions",))
    values |= torques_of_free_rollers(bound, run.effects, values, modes_of_free_rollers(run))
    found = with_accelerations(bound, values)["nu_dot"][run.step_rows]
    h = np.diff(run.elapsed)[run.step_rows]
    degree = run.dense.shape[1] - 1
    slopes = degree * (run.dense[:, 1, :3] - run.dense[:, 0, :3]) / h[:, None]
    np.testing.assert_allclose(found, slopes, rtol=0, atol=1e-6 * np.abs(slopes).max())
    assert (np.abs(values["free_bearing"]) <= 3e-6 * (1 + 1e-9)).all()


def test_what_does_not_fit_is_refused():
    stick = Bearings(roller_coulomb=1e-4)
    makers = {
        "roller_break_away": lambda: Bearings(roller_break_away=1.0),
        "roller_speed": lambda: Bearings(roller_viscous=1.0, roller_speed=0.1),
        "roller_coulomb": lambda: linearise(PAPER, effects=(stick,)),
    }
    for field, make in makers.items():
        with pytest.raises(InvalidValueError) as refused:
            make()
        assert refused.value.field == field
    weak = Bearings(roller_coulomb=1e-4, roller_break_away=1e-5)
    with pytest.raises(InvalidValueError, match="roller_"):
        simulate(PAPER, nu=(0, 0, 0), duration=0, effects=[weak])

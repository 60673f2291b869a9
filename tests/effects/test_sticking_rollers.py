"""Rollers that stick in their bearings: against Moreau's scheme on bodies, the regularised law, the law itself.

tests/runtime holds the compiled engine to the Python engine over random scenes, and sessions to runs.
"""

import numpy as np
import pytest

from omniroll import (
    Bearings,
    Instruments,
    InvalidValueError,
    Slope,
    Torque,
    Vehicle,
    linearise,
    reactions,
    simulate,
    simulate_many,
)
from omniroll.commands.run import text
from omniroll.engine.simulate import checked_task
from omniroll.results.accelerations import torques_of_free_rollers, with_accelerations
from omniroll.results.reactions import modes_of_free_rollers
from omniroll.scenes import load_scene
from omniroll.scenes.explanation import runs_on
from omniroll.scenes.outcome import run_scene

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


def spinning(vehicle, nu_3):
    """theta' and chi' on the spot, and the energy where all rollers rest on their disks."""
    yaw = nu_3 / vehicle.yaw_scale
    rate = -vehicle.platform_radius / vehicle.wheel_radius * yaw
    return yaw, rate, (vehicle.yaw_inertia * yaw**2 + vehicle.wheels * vehicle.wheel_inertia * rate**2) / 2


@pytest.mark.long
@pytest.mark.parametrize("switching", ["impact", "smooth"])
def test_where_all_rollers_rest_on_their_disks_nothing_slows_the_vehicle_down(switching):
    """On the spot the wheels' centres do not move along their axles: no roller spins, and no switch takes energy."""
    law = {"switching": switching, **TASK}
    run = simulate(PAPER, nu=(0, 0, 3.0), duration=5, effects=[Bearings(roller_coulomb=1.0)], **law)
    _, rate, energy = spinning(PAPER, 3.0)
    assert len(run.switches) >= 3 * int(abs(rate) * 5 / (2 * np.pi / PAPER.rollers_per_wheel) - 0.5) > 3
    np.testing.assert_allclose(run.nu, np.tile([0, 0, 3.0], (len(run), 1)), rtol=0, atol=1e-12)
    np.testing.assert_allclose(run.energy, energy, rtol=1e-12)
    assert np.abs(run.spins).max() < 1e-12 and run.quantity("roller_loss")[-1] == pytest.approx(0, abs=1e-15)


def test_a_free_roller_breaks_away_where_its_disk_asks_for_more():
    """Its disk takes it along: B theta' chi' cos(psi) with constant rates. The first one is near the top."""
    yaw, rate, _ = spinning(PAPER, 1.0)
    beside = 0.3  # rad from the top
    torque = PAPER.roller_inertia * yaw * abs(rate) * np.cos(beside)
    acting = [Bearings(roller_coulomb=torque)]
    run = simulate(PAPER, nu=(0, 0, 1.0), duration=0.7, effects=acting, **TASK)
    instant = (np.pi / PAPER.rollers_per_wheel - beside) / abs(rate)
    assert np.isclose(run.t, instant, rtol=1e-9).any()
    resting = run.t <= instant * (1 + 1e-9)
    assert np.abs(run.spins[resting]).max() < 1e-14 < 1e-6 < np.abs(run.spins[~resting]).max()


def test_the_regularised_law_tends_to_it():
    start = {"nu": (0.5, 0.1, 0.5), "duration": 0.6, **TASK}
    limit = simulate(PAPER, **start, effects=[Bearings(roller_coulomb=5e-5)])
    errors = [
        np.abs(simulate(PAPER, **start, effects=[Bearings(roller_coulomb=5e-5, roller_speed=w)]).nu[-1] - limit.nu[-1])
        for w in (1.0, 0.1)
    ]
    assert errors[1].max() < 0.3 * errors[0].max() < 1e-3


@pytest.mark.long
@pytest.mark.parametrize("seed", range(8))
def test_any_vehicle_keeps_the_law_and_the_account(seed):
    rng = np.random.default_rng(seed)
    vehicle = Vehicle.paper(int(rng.choice([2, 3, 4])), int(rng.integers(4, 7)))
    sliding = rng.uniform(0, 2e-4, vehicle.wheels)
    holding = sliding * rng.choice([1.0, 1.5])
    effects = [Bearings(roller_coulomb=sliding, roller_break_away=holding), Slope(0.02, 1.0), Torque(1e-3)]
    run = simulate(
        vehicle, nu=rng.normal(size=3) * rng.choice([0.0, 0.3]), duration=0.3, effects=effects,
        roller_model=str(rng.choice(["massless", "locked", "free"])), accuracy=1e-8, control=False,
    )  # fmt: skip
    torques = run.drive[:, run.effects.drives().index("contact_bearing")]
    assert (np.abs(torques) <= holding * (1 + 1e-12)).all()
    turns = np.abs(run.contact_spin) > 1e-8
    np.testing.assert_allclose((torques * np.sign(run.contact_spin) + sliding)[turns], 0, atol=1e-15)
    assert abs(run.ledger.residual) < 1e-7 * max(run.ledger.scale, 1e-9)


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


def test_explain_and_run_say_that_the_compiled_engine_runs(tmp_path):
    path = tmp_path / "scene.toml"
    tables = ('[vehicle]\npreset = "paper"', "[start]\nnu = [0.0, 0.0, 0.5]", "[run]\nduration = 0.01\nstep = 0.01")
    path.write_text("\n\n".join((*tables, "[bearings]\nroller_coulomb = 1e-4\n")))
    scene = load_scene(path)
    assert runs_on(checked_task(scene.vehicle, **scene.options)) == "compiled engine, compiled kernel"
    outcome = run_scene(scene)
    assert outcome.trajectory.stats["engine"] == "compiled" and "Python engine" not in text(outcome)


def test_sweeps_run_in_c_and_give_what_single_runs_do():
    starts = ((0.3, 0.1, 0.2), (0.0, 0.0, 1.0))
    effects = [[Bearings(roller_coulomb=torque, roller_break_away=4e-5)] for torque in (1e-6, 3e-5)]
    many = simulate_many(PAPER, nu=starts, duration=0.4, effects=effects, accuracy=1e-9)
    for end, start, acting in zip(many.end.nu, starts, effects, strict=True):
        run = simulate(PAPER, nu=start, duration=0.4, effects=acting, accuracy=1e-9)
        assert run.stats["engine"] == "compiled"
        np.testing.assert_array_equal(end, run.nu[-1])

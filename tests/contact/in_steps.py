"""What a run is beside others: in the steps of a session, which are random, lead back, or end beside its events; as one
of a sweep; and between its rows, beside one with finer steps."""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from numpy.typing import ArrayLike

from omniroll import Session, Trajectory, Vehicle, simulate, simulate_many

BESIDE = (1e-5, 1e-7, 3e-10, 1e-12, 1e-14, 0.0, -1e-14, -1e-12)  # s before an event


def assert_a_session_ends_as_the_run(
    vehicle: Vehicle, *, duration: float, control: bool = False, **options
) -> Trajectory:
    """The run, at whose end the session has the same motion and the same rates of its wheels.

    options  arguments of simulate that a session takes, too
    """
    run = simulate(vehicle, duration=duration, control=control, **options)
    session = Session(vehicle, driven=False, **options)
    for step in np.random.default_rng(1).dirichlet(np.ones(20)) * duration:
        session.step(step)
    assert session.wheel_speeds == pytest.approx(run.quantity("rates")[-1], rel=1e-8, abs=1e-9)
    assert session.nu == pytest.approx(run.nu[-1], rel=1e-8, abs=1e-9)
    return run


def of_rollers(run: Trajectory | Session) -> list[np.ndarray]:
    """What is asked of massless rollers that stick, of a run in its rows, of a session now."""
    outputs = {"roller_loss": run.quantity("roller_loss")} if isinstance(run, Trajectory) else run.outputs
    return [np.array(run.nu), run.contact_spin, run.slip, run.ground_force, outputs["roller_loss"]]


def assert_a_session_goes_back_to_the_bit(vehicle: Vehicle, run: Trajectory, seed: int, **options) -> None:
    """A session ends as its run does, within 1e-9 of the largest value; once more to the bit after a part of its steps,
    and from the start on."""
    session = Session(vehicle, driven=False, **options)
    steps = np.random.default_rng(seed).dirichlet(np.ones(30)) * run.t[-1]

    def go(steps: np.ndarray) -> list[np.ndarray]:
        for step in steps:
            session.step(step)
        return of_rollers(session)

    assert not session.contact_spin.any()
    go(steps[:12])
    saved = session.save()
    end = go(steps[12:])
    for found, rows in zip(end, of_rollers(run), strict=True):
        np.testing.assert_allclose(found, rows[-1], rtol=0, atol=1e-9 * np.abs(rows).max())
    session.restore(saved)
    assert all(np.array_equal(after, before) for after, before in zip(go(steps[12:]), end, strict=True))
    session.reset()
    again = go(steps[:12]) and go(steps[12:])
    assert all(np.array_equal(after, before) for after, before in zip(again, end, strict=True))


def assert_steps_may_end_beside(vehicle: Vehicle, run: Trajectory, events: np.ndarray, **options) -> None:
    """A session goes on as the run does, however little before one of its events or behind it a step ends."""
    for event in events:
        for before in BESIDE:
            session = Session(vehicle, driven=False, **options)
            for step in (event - before, 1e-9, 0.01):
                session.step(step)
            assert session.nu == pytest.approx(run.sample(session.time).nu, abs=1e-10 * np.abs(run.nu).max())


def assert_a_sweep_ends_where_its_runs_end(vehicle: Vehicle, options: dict, of_spins: float = 1e-12) -> None:
    """options: arguments of simulate; another start is made beside theirs. Spins agree to this part."""
    common = dict(options)
    starts = [common.pop("nu"), np.array([0.5, 0.0, 1.0])]
    many = simulate_many(vehicle, nu=starts, **common)
    for k, nu in enumerate(starts):
        run = simulate(vehicle, nu=nu, **common)
        assert run.stats["engine"] == common.get("engine", "compiled")
        np.testing.assert_array_equal(many.end.nu[k], run.nu[-1])
        np.testing.assert_allclose(many.end.contact_spin[k], run.contact_spin[-1], rtol=of_spins, atol=1e-12)
        assert many.end.energy[k] == pytest.approx(run.energy[-1], rel=1e-12)


def assert_samples_are_those_of_finer_runs(
    vehicle: Vehicle, options: Mapping, times: ArrayLike, names: Sequence[str], accuracy: float
) -> None:
    """Quantities of these names between the rows of a run with this accuracy are those of a run that is a hundred times
    as accurate, to 1e-6 of their largest values; options are arguments of simulate."""
    run, finer = (simulate(vehicle, **{**options, "accuracy": own}) for own in (accuracy, accuracy / 100))
    for t in times:
        one, other = run.sample(t), finer.sample(t)
        for name in names:
            scale = np.abs(getattr(run, name)).max()
            assert getattr(one, name) == pytest.approx(getattr(other, name), abs=1e-6 * scale), (t, name)

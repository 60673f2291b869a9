"""Environments of Gymnasium: its own checker passes, the vector's motions are those of a session, the seed decides."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import omniroll
import omniroll.gym
from omniroll.gym import TwistEnv, TwistTask, TwistVectorEnv, raster

TASK = TwistTask(steps=8)


@pytest.mark.filterwarnings("ignore:.*Box observation space m.*imum value is .*inf")
def test_gymnasiums_checker_passes():
    check_env(gymnasium.make(omniroll.gym.TWIST, render_mode="rgb_array").unwrapped)


def test_an_episode_is_cut_off_after_its_steps():
    env = TwistEnv(TASK)
    env.reset(seed=1)
    ends = [env.step(np.zeros(3))[2:4] for _ in range(8)]
    assert ends == [(False, False)] * 7 + [(False, True)]


def test_the_vector_moves_as_a_session():
    """Each vehicle as one by itself with the same actions, from the same start."""
    many = gymnasium.make_vec(omniroll.gym.TWIST, num_envs=3, vectorization_mode="vector_entry_point", steps=40)
    seen, _ = many.reset(seed=7)
    starts, targets = seen[:, 6:] * np.pi / 5, many.unwrapped.target.copy()
    actions = np.random.default_rng(5).uniform(-1, 1, (30, 3, 3))
    rewards = np.zeros((30, 3))
    for step, action in enumerate(actions):
        seen, rewards[step], *_ = many.step(action)
    task = many.unwrapped.task
    for k in range(3):
        session = omniroll.Session(task.vehicle, driven=False, **task.options)
        session.reset(chi=starts[k])
        for step, action in enumerate(actions):
            session.step(task.step, voltage=6.0 * action[k])
            away = session.nu - targets[k]
            wanted = -(away @ away) / 9 - 0.01 * (action[k] @ action[k]) / 3
            assert rewards[step, k] == pytest.approx(wanted, abs=1e-9)
        assert np.abs(seen[k, :3] * task.largest_nu - session.nu).max() < 1e-9


def test_vehicles_begin_anew_one_by_one():
    many = TwistVectorEnv(2, TASK)
    many.reset(seed=2)
    many.count[1] = 3
    over, rewards = [], []
    for _ in range(9):
        _, reward, terminated, truncated, _ = many.step(np.ones((2, 3)))
        over.append(truncated.tolist())
        rewards.append(reward)
        assert not terminated.any()
    assert over[4] == [False, True] and over[7] == [True, False]
    assert rewards[5][1] == 0 and rewards[5][0] < 0 and rewards[8][0] == 0


@pytest.mark.parametrize("field, value", [("steps", 0), ("step", -1), ("largest_nu", (1, 0, 1)), ("largest_volts", 0)])
def test_wrong_numbers_are_refused(field, value):
    with pytest.raises(omniroll.InvalidValueError) as raised:
        TwistTask(**{field: value})
    assert raised.value.field == field


@pytest.mark.parametrize("make", [lambda: TwistEnv(TASK), lambda: TwistVectorEnv(2, TASK)])
def test_actions_and_targets_that_are_no_numbers_are_refused(make):
    env, lead = make(), getattr(make(), "num_envs", ())
    shape = (lead, 3) if lead else (3,)
    env.reset(seed=1)
    for wrong in (np.full(shape, np.nan), np.full(shape, np.inf), np.zeros(7), "one"):
        with pytest.raises(omniroll.InvalidValueError, match="action"):
            env.step(wrong)
        with pytest.raises(omniroll.InvalidValueError, match="target"):
            env.reset(options={"target": wrong})
    seen, reward, *_ = env.step(np.full(shape, 7.0))  # which counts as 1
    assert np.isfinite(seen).all() and np.isfinite(reward).all()


def test_without_the_extra_one_line_says_what_to_install():
    program = """
import sys
sys.modules["gymnasium"] = None
try:
    import omniroll.gym
except ImportError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "omniroll.gym needs gymnasium, which is missing: pip install 'omniroll[gymnasium]'\n"


def test_why_an_episode_is_terminated_is_in_its_info(monkeypatch):
    env, many, why = TwistEnv(TASK), TwistVectorEnv(3, TASK), "a step that cannot be made"
    env.reset(seed=1)
    many.reset(seed=1)

    def stopping(*_, **__):
        raise omniroll.SimulationStopped(why, t=0.0, wheel=None, state={})

    monkeypatch.setattr(env.session, "step", stopping)
    monkeypatch.setattr(many.sessions, "step", lambda *_: {1: why})
    _, _, terminated, _, info = env.step(np.zeros(3))
    assert terminated is True and info["reason"] == why
    _, _, terminated, _, infos = many.step(np.zeros((3, 3)))
    assert terminated.tolist() == infos["_reason"].tolist() == [False, True, False]
    assert infos["reason"].tolist() == [None, why, None]


def test_a_picture_shows_the_vehicle_and_moves_with_its_wheels():
    env = gymnasium.make(omniroll.gym.TWIST, render_mode="rgb_array").unwrapped
    env.reset(seed=1, options={"target": (2.0, 0.0, 0.0)})
    first = env.render()
    assert first.shape == (256, 256, 3) and first.dtype == np.uint8
    assert (first[128, 180:] == raster.WANTED).all(axis=-1).sum() > 20  # to the right: heading 0, target ahead
    for _ in range(5):
        env.step(np.ones(3))
    assert (env.render() != first).any() and env.metadata["render_fps"] == 100
    assert TwistEnv(TASK).render() is None
    many = TwistVectorEnv(2, TASK, render_mode="rgb_array")
    many.reset(seed=1)
    assert [shown.shape for shown in many.render()] == [(256, 256, 3)] * 2
    with pytest.raises(omniroll.InvalidValueError, match="render_mode"):
        TwistEnv(TASK, render_mode="human")

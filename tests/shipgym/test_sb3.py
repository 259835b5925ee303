"""ShipVecEnv: stable-baselines3's promises, and its DummyVecEnv of single environments
step by step."""

import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv

import shipgym
from shipgym import InputError, ShipVecEnv

COURSE, PATH = "shipgym/CourseKeeping-v0", "shipgym/PathFollowing-v0"
LOST = {"max_heading_error_deg": 20.0}  # so that episodes end before their time
MARINER = shipgym.load_model("mariner")


def dummy(name, num_envs, info_keywords=(), **options):
    def make():
        return Monitor(
            gymnasium.make(name, model=MARINER, **options), info_keywords=info_keywords
        )

    return DummyVecEnv([make] * num_envs)


def ours(name, num_envs=3, **options):
    return ShipVecEnv(name, num_envs, model=MARINER, **options)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        (COURSE, {"episode_steps": 23, **LOST}),
        (PATH, {"episode_steps": 39, "corridor": 0.4, "ground": 0.5}),
        (
            PATH,
            {
                "episode_steps": 33,
                "n_legs": 1,
                "leg_lengths": (1.0, 2.0),
                "corridor": 3.0,
            },
        ),
        (
            COURSE,
            {
                "episode_steps": 23,
                "action": "rudder-discrete",
                "sea": "rough",
                "noise": 1.0,
                "measurement": "filtered",
            },
        ),
    ],
    ids=["course", "ground", "arrival", "discrete"],
)
def test_it_is_a_dummy_vec_env_step_by_step(name, options):
    n = 20 if options.get("sea") else 70  # more than a tile of the kernels
    mine, theirs = ours(name, n, **options), dummy(name, n, **options)
    assert mine.observation_space == theirs.observation_space
    assert mine.action_space == theirs.action_space
    mine.seed(11)
    theirs.seed(11)
    ends = {True: 0, False: 0}
    random = np.random.default_rng(0)
    sides = random.uniform(-1.0, 1.0, n)
    np.testing.assert_array_equal(mine.reset(), theirs.reset())
    assert mine.reset_infos == theirs.reset_infos
    for _ in range(80):
        actions = (sides * random.uniform(0.0, 1.0, n)).astype(np.float32)[:, None]
        if name == COURSE and options.get("action"):
            actions = random.integers(0, mine.action_space.n, n)
        got, expected = mine.step(actions), theirs.step(actions)
        for one, other in zip(got[:3], expected[:3], strict=True):
            assert one.dtype == other.dtype
            np.testing.assert_array_equal(one, other)
        for done, info, full in zip(got[2], got[3], expected[3], strict=True):
            truncated = info.get("TimeLimit.truncated", False)
            assert truncated == full["TimeLimit.truncated"]
            if done:
                ends[truncated] += 1
                _same_last_info(info, full)
            else:
                assert info == {}
        assert mine.reset_infos == theirs.reset_infos
    assert ends[True] + ends[False] > n
    assert min(ends.values()) > 0 or options.get("action")


def _same_last_info(info, full):
    np.testing.assert_array_equal(
        info["terminal_observation"], full["terminal_observation"]
    )
    if "success" in full:
        assert info["is_success"] == full["success"]
    assert info["episode"]["l"] == full["episode"]["l"]
    assert info["episode"]["r"] == pytest.approx(full["episode"]["r"], abs=2e-6)
    assert (
        0.0 <= info["episode"]["t"] < 3600.0
    )  # since the environment was made, not since 1970
    same = full.keys() - {"terminal_observation", "episode"}
    assert info.keys() - same <= {"terminal_observation", "episode", "is_success"}
    assert {key: info[key] for key in same} == {key: full[key] for key in same}


def test_infos_are_reused():
    env = ours(COURSE, 4, episode_steps=3, seed=0)
    env.reset()
    lists = [env.step(np.ones((4, 1), np.float32))[-1] for _ in range(4)]
    assert all(infos is lists[0] for infos in lists)
    assert lists[0] == [{}] * 4


def test_attributes_are_those_of_all_rows():
    env, theirs = ours(PATH, 3), dummy(PATH, 3)
    for name in ("dt", "observation_names", "action_space"):
        assert env.get_attr(name, indices=[1]) == theirs.get_attr(name, indices=[1])
    assert env.get_attr("model") == [MARINER] * 3
    assert env.has_attr("task")
    assert not env.has_attr("cargo")
    for refused in (
        lambda: env.set_attr("model", MARINER),
        lambda: env.env_method("physical_state"),
    ):
        with pytest.raises(InputError, match="expected"):
            refused()


def test_seeds_fix_the_next_reset_only():
    env = ours(PATH, 2)
    assert env.seed(3) == [3, 4]
    first, second = env.reset(), env.reset()
    assert not np.array_equal(first, second)
    env.seed(3)
    np.testing.assert_array_equal(env.reset(), first)
    np.testing.assert_array_equal(env.reset(), second)
    np.testing.assert_array_equal(ours(PATH, 2, seed=3).reset(), first)


def test_what_is_wrong_is_said():
    for make, message in (
        (lambda: ours("shipgym/CourseKeeping-v0", sae="calm"), "Did you mean 'sea'"),
        (lambda: ours(COURSE, 0), "num_envs: expected .*got 0"),
        (lambda: ShipVecEnv(env=COURSE), "Did you mean 'env_id'"),
        (lambda: ours("CartPole-v1"), "an environment of shipgym, got 'CartPole-v1'"),
        (lambda: ours(COURSE, seed="3"), "seed: expected an integer"),
        (lambda: ours(COURSE, autoreset_mode="NextStep"), "autoreset_mode: expected"),
    ):
        with pytest.raises(InputError, match=message):
            make()
    env = ours(COURSE, 2)
    for options, message in (
        ([{}, {"depth": 3.0}], "options: expected the same for all rows"),
        ({"depth": 3.0}, "options: unknown key 'depth'"),
    ):
        env.set_options(options)
        with pytest.raises(InputError, match=message):
            env.reset()
    env.reset()
    with pytest.raises(InputError, match="expected numbers"):
        env.step(np.array([[0.0], [np.nan]]))


def test_options_of_a_reset_are_those_of_single_environments():
    env, singles = ours(COURSE, 2), dummy(COURSE, 2)
    for ships in (env, singles):
        ships.seed(4)
        ships.set_options({"start": {"heading_error": 0.3}})
    np.testing.assert_array_equal(env.reset(), singles.reset())
    action = np.full((2, 1), 0.2, np.float32)
    for _ in range(20):
        np.testing.assert_array_equal(env.step(action)[0], singles.step(action)[0])

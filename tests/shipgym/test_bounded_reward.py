"""The reward of a step is bounded, and apart from its cost; ends are ends."""

import copy

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import shipgym

COURSE = "shipgym/CourseKeeping-v0"
PATH = "shipgym/PathFollowing-v0"
LOST_BY = {COURSE: {}, PATH: {"ground": 1.5}}  # hard over
EPISODE_STEPS = {COURSE: 600, PATH: 1500}
HALF_REWARD_COST = {COURSE: 3.0, PATH: 1.0}
PERFECT_STEP = {COURSE: 0.0, PATH: 1.0}
HARD_OVER = np.ones(1, np.float32)
DISCOUNTS = st.floats(0.95, 0.999)


def episode(env_id, policy, **options):
    """Rewards and infos of an episode."""
    env = gymnasium.make(env_id, **options)
    seen, _ = env.reset(seed=3)
    rewards, infos, over = [], [], False
    while not over:
        seen, reward, terminated, truncated, info = env.step(policy(seen))
        over = terminated or truncated
        rewards.append(reward)
        infos.append(info)
    return np.array(rewards), infos


def hard_over(seen):
    """Lose control."""
    return HARD_OVER


def steered(seen):
    """Feed back heading error and yaw rate."""
    error = np.arctan2(seen[0], seen[1])
    return np.clip([1.5 * error - 0.7 * seen[2]], -1.0, 1.0).astype(np.float32)


def costs_of(infos):
    return np.array([info["cost"] for info in infos])


@pytest.mark.parametrize("env_id", [COURSE, PATH])
@pytest.mark.parametrize("scale", [True, 0.5])
def test_a_step_earns_less_by_a_bounded_part_for_its_cost(env_id, scale):
    rewards, infos = episode(env_id, hard_over, **LOST_BY[env_id], bounded=scale)
    costs, half = costs_of(infos)[:-1], HALF_REWARD_COST[env_id]
    half = half if scale is True else scale
    perfect = PERFECT_STEP[env_id]
    expected = perfect - costs / (costs + half)
    np.testing.assert_allclose(rewards[:-1], expected, rtol=1e-12)
    # lost in this step, and for the rest of the episode
    steps_lost = 1 + EPISODE_STEPS[env_id] - len(rewards)
    assert rewards[-1] == (perfect - 1.0) * steps_lost
    assert infos[-1]["cost"] > 1000.0


@pytest.mark.parametrize("env_id", [COURSE, PATH])
def test_the_cost_is_what_it_was_and_minus_it_is_the_other_reward(env_id):
    _, infos = episode(env_id, hard_over, **LOST_BY[env_id])
    rewards, others = episode(env_id, hard_over, **LOST_BY[env_id], bounded=False)
    np.testing.assert_array_equal(rewards, -costs_of(others))
    assert infos == others
    for info in infos:
        parts = [value for name, value in info.items() if name.startswith("reward_")]
        assert info["cost"] == pytest.approx(-sum(parts))

    shorter, _ = episode(
        env_id, hard_over, **LOST_BY[env_id], bounded=False, loss_horizon=50
    )
    left = EPISODE_STEPS[env_id] - len(shorter)
    end = infos[-1]["reward_end"]
    assert shorter[-1] - rewards[-1] == pytest.approx((50.0 / left - 1.0) * end)


LOST, _ = episode(COURSE, hard_over)
ARRIVED, ARRIVAL = episode(PATH, steered, model="mariner-tls-svm")


@given(DISCOUNTS, st.integers(0, 600 - len(LOST)))
def test_to_be_lost_never_pays(discount, more):
    """A ship that goes on earns more at the worst cost than a lost one."""
    before = LOST[:-1]
    worst = -9.0 / 12.0  # at the largest heading error
    going_on = np.concatenate([before, np.full(1 + more, worst)])
    weights = discount ** np.arange(len(going_on))
    assert weights[: len(LOST)] @ LOST < weights @ going_on


@given(DISCOUNTS, st.integers(1, 400))
def test_to_arrive_pays_more_than_to_linger(discount, more):
    """A step without progress costs 1; the end stands for perfect ones."""
    assert ARRIVAL[-1]["success"]
    left = EPISODE_STEPS[PATH] - len(ARRIVED)
    assert ARRIVED[-1] == pytest.approx(left, abs=1.0)
    lingering = np.append(np.full(min(more, left), 0.5), max(left - more, 0.0))
    assert ARRIVED[-1] > discount ** np.arange(len(lingering)) @ lingering


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"bounded": "yes"}, "bounded: expected a number"),
        ({"bounded": 0}, "bounded: expected a number"),
        ({"loss_horizon": -1}, "loss_horizon: expected a number"),
    ],
)
def test_a_reward_that_cannot_be_is_refused(options, words):
    with pytest.raises(shipgym.InputError, match=words):
        gymnasium.make(COURSE, **options)


def test_a_check_says_when_one_event_drowns_the_rest():
    for bounded in (True, False):
        remarks = shipgym.check_task("PathFollowing", bounded=bounded).remarks
        drowned = [remark for remark in remarks if "drowns the rest" in remark]
        assert len(drowned) == (0 if bounded else 1)


def test_an_episode_that_is_over_has_to_be_reset():
    env = gymnasium.make(COURSE, episode_steps=2).unwrapped
    env.reset(seed=0)
    env.step(HARD_OVER)
    assert list(env.step(HARD_OVER)[2:4]) == [False, True]
    for over in (env, copy.deepcopy(env)):
        with pytest.raises(shipgym.InputError, match="it is over"):
            over.step(HARD_OVER)
    env.reset()
    assert list(env.step(HARD_OVER)[2:4]) == [False, False]


def test_rows_that_are_over_have_to_be_reset_without_autoreset():
    envs = gymnasium.make_vec(
        COURSE, num_envs=2, autoreset_mode="Disabled", episode_steps=2
    )
    orders = np.zeros((2, 1), np.float32)
    envs.reset(seed=0)
    envs.step(orders)
    envs.reset(options={"reset_mask": np.array([True, False])})
    _, _, _, truncated, _ = envs.step(orders)
    with pytest.raises(shipgym.InputError, match=r"ends in rows \[1\]"):
        envs.step(orders)
    envs.reset(options={"reset_mask": truncated})
    envs.step(orders)


def test_rendering_without_a_mode_warns():
    for env in (gymnasium.make(COURSE).unwrapped, gymnasium.make_vec(COURSE)):
        with pytest.warns(UserWarning, match="expected a render_mode, got none"):
            assert env.render() is None

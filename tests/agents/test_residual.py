"""What an agent sees and does in training beside a base controller is worked out by hand, ship by ship."""

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from agents import LQ, LQG, IntegralLineOfSight, LearnedPolicy, load_agent
from agents.training.residual import ResidualVecEnv
from shipgym import ShipVecEnv
from shipgym.errors import InputError
from shipgym.ships import load_model

COURSE, PATH = "shipgym/CourseKeeping-v0", "shipgym/PathFollowing-v0"
MARINER = load_model("mariner")
BASES = {
    "lq": (COURSE, LQ.from_model(MARINER)),
    "lqg": (COURSE, LQG.from_model(MARINER)),
    "ilos-lqg": (PATH, IntegralLineOfSight.from_model(MARINER, autopilot=LQG.from_model(MARINER))),
}
SHIPS, STEPS, HISTORY, AUTHORITY = 3, 11, 3, 0.4


def ships(env, n=SHIPS, seed=7):
    return ShipVecEnv(env, n, seed=seed, noise=1.0, sea="rough", episode_steps=5)


def by_hand(env, base, seed, outputs):
    """What one ship shows an agent with these outputs: observations, terminal ones by step, rewards."""
    one, state, start, past = ships(env, 1, seed), None, True, []
    seen = one.reset()
    shown, last, rewards = [], {}, []
    for step, output in enumerate(outputs):
        past = [seen[0]] * HISTORY if start else [*past[1:], seen[0]]
        action, state = base.predict(seen, state, np.array([start]))
        shown.append(np.concatenate([*past, action[0]]))
        command = np.clip(action[0] + AUTHORITY * output, -1.0, 1.0)
        seen, reward, done, infos = one.step(command[None])
        rewards.append(reward[0])
        if done[0]:
            end = infos[0]["terminal_observation"]
            proposed, _ = base.predict(end[None], state, np.array([False]))
            last[step] = np.concatenate([*past[1:], end, proposed[0]])
        start = bool(done[0])
    return np.array(shown), last, np.array(rewards)


@pytest.mark.interpreted
@pytest.mark.parametrize("name", BASES)
def test_shows_and_does_what_is_worked_out_by_hand(name):
    env, base = BASES[name]
    outputs = np.random.default_rng(1).uniform(-1.0, 1.0, (STEPS, SHIPS, 1)).astype(np.float32)
    residual = ResidualVecEnv(ships(env), base, authority=AUTHORITY, frame_stack=HISTORY)
    seen, shown, rewards, last = residual.reset(), [], [], [{} for _ in range(SHIPS)]
    for step in range(STEPS):
        shown.append(seen)
        seen, reward, dones, infos = residual.step(outputs[step])
        rewards.append(reward)
        for row in np.flatnonzero(dones):
            last[row][step] = infos[row]["terminal_observation"]
    for row in range(SHIPS):
        expected, ends, earned = by_hand(env, base, 7 + row, outputs[:, row])
        np.testing.assert_allclose(np.array(shown)[:, row], expected, atol=1e-6)
        np.testing.assert_allclose(np.array(rewards)[:, row], earned, rtol=1e-5, atol=1e-7)
        assert list(last[row]) == list(ends) == [4, 9]
        for step, end in ends.items():
            np.testing.assert_allclose(last[row][step], end, atol=1e-6)


def test_an_agent_that_adds_nothing_steers_as_the_base():
    env, base = BASES["lqg"]
    residual, bare = ResidualVecEnv(ships(env), base), ships(env)
    residual.reset()
    seen, state, starts = bare.reset(), None, np.ones(SHIPS, bool)
    for _ in range(STEPS):
        action, state = base.predict(seen, state, starts)
        seen, expected, starts, _ = bare.step(action)
        np.testing.assert_array_equal(residual.step(np.zeros((SHIPS, 1)))[1], expected)


def test_only_history():
    residual, bare = ResidualVecEnv(ships(COURSE), frame_stack=2), ships(COURSE)
    first = bare.reset()
    np.testing.assert_array_equal(residual.reset(), np.hstack([first, first]))
    action = np.full((SHIPS, 1), 0.3, np.float32)
    second = bare.step(action)[0]
    np.testing.assert_array_equal(residual.step(action)[0], np.hstack([first, second]))
    assert residual.observation_space.shape == (16,)
    assert residual.observation_space.contains(residual.step(action)[0][0])


@pytest.mark.parametrize("name", BASES)
def test_a_held_output_is_that_many_steps_with_it_and_none_after_an_episode_s_end(name):
    env, base = BASES[name]
    long, short = ResidualVecEnv(ships(env), base, action_repeat=3), ResidualVecEnv(ships(env), base)
    np.testing.assert_array_equal(long.reset(), short.reset())
    random, endings = np.random.default_rng(2), 0
    for _ in range(STEPS):
        outputs = random.uniform(-1.0, 1.0, (SHIPS, 1)).astype(np.float32)
        seen, rewards, dones, infos = long.step(outputs)
        earned, over, ends = np.zeros(SHIPS), np.zeros(SHIPS, bool), [None] * SHIPS
        for _ in range(3):
            expected, more, ended, told = short.step(np.where(over[:, None], 0.0, outputs))
            earned += np.where(over, 0.0, more)
            ends = [told[k] if ended[k] and not over[k] else ends[k] for k in range(SHIPS)]
            over |= ended
        np.testing.assert_array_equal(seen, expected)
        np.testing.assert_array_equal(dones, over)
        np.testing.assert_allclose(rewards, earned, rtol=1e-6)
        for k in np.flatnonzero(over):
            np.testing.assert_array_equal(infos[k]["terminal_observation"], ends[k]["terminal_observation"])
        endings += over.sum()
    assert endings == SHIPS * (3 * STEPS // 5)


def test_an_output_beyond_its_limits_counts_as_the_limit():
    env, base = BASES["lq"]
    one, other = (ResidualVecEnv(ships(env), base, authority=0.1) for _ in range(2))
    one.reset(), other.reset()
    beyond, limit = one.step(np.full((SHIPS, 1), 5.0)), other.step(np.ones((SHIPS, 1)))
    np.testing.assert_array_equal(beyond[0], limit[0])


@pytest.mark.parametrize("rate_limit", [2.0, 0.01])
def test_what_was_learned_beside_a_base_is_flown_from_its_file_as_in_training(rate_limit, tmp_path):
    torch.set_num_threads(1)
    asked = {"authority": 0.2, "frame_stack": 2, "rate_limit": rate_limit}
    env = ResidualVecEnv(ships(COURSE, 8), BASES["lqg"][1], **asked)
    scaled = VecNormalize(env, norm_obs=False, gamma=0.9)
    agent = PPO("MlpPolicy", scaled, n_steps=16, batch_size=64, n_epochs=1, seed=0, device="cpu")
    before = agent.predict(scaled.reset(), deterministic=True)[0]
    agent.learn(128)
    LearnedPolicy.from_sb3(agent, scaled).save(tmp_path / "agent.json")
    policy, bare = load_agent(tmp_path / "agent.json", MARINER), ships(COURSE, 8)
    twin = ResidualVecEnv(ships(COURSE, 8), BASES["lqg"][1], **asked)
    seen, shown, state, starts = bare.reset(), twin.reset(), None, np.ones(8, bool)
    assert not np.array_equal(agent.predict(shown, deterministic=True)[0], before)
    for _ in range(STEPS):
        action, state = policy.predict(seen, state, starts)
        seen, rewards, starts, _ = bare.step(action)
        shown, expected, ends, _ = twin.step(agent.predict(shown, deterministic=True)[0])
        np.testing.assert_allclose(rewards, expected, rtol=1e-4, atol=1e-7)
        np.testing.assert_array_equal(starts, ends)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: ResidualVecEnv(ships(COURSE), authority=0.5), "authority: 0.5 found without a base"),
        (lambda: ResidualVecEnv(ships(COURSE), BASES["lq"][1], authority=3.0), "authority: 3"),
        (lambda: ResidualVecEnv(ships(COURSE), frame_stack=0), "frame_stack: 0"),
        (lambda: ResidualVecEnv(ships(COURSE), action_repeat=0), "action_repeat: 0"),
        (lambda: ResidualVecEnv(ships(COURSE), "lq"), "base: str found"),
        (lambda: ResidualVecEnv(ships(COURSE), BASES["ilos-lqg"][1]), "cross_track"),
        (lambda: ResidualVecEnv(ships(COURSE), LQ.from_model(load_model("kvlcc2"))), "base: the scale of"),
        (
            lambda: ResidualVecEnv(ShipVecEnv(COURSE, 2, action="rudder-discrete"), BASES["lq"][1]),
            "actions in Discrete",
        ),
    ],
)
def test_what_does_not_fit_is_refused(made, message):
    with pytest.raises(InputError, match=message):
        made()

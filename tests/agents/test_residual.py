"""What an agent sees and does in training beside a base controller is worked out by
hand, ship by ship."""

import numpy as np
import pytest
import torch
from gymnasium.spaces import Box
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from agents import LQ, LQG, IntegralLineOfSight, LearnedPolicy, load_agent
from agents.training.residual import ResidualVecEnv
from shipgym import ShipVecEnv
from shipgym.errors import InputError
from shipgym.models import load_model

COURSE, PATH = "shipgym/CourseKeeping-v0", "shipgym/PathFollowing-v0"
DISCRETE = "shipgym/CourseKeepingDiscrete-v0"
MARINER = load_model("mariner")
BASES = {
    "lq": (COURSE, LQ.from_model(MARINER)),
    "lqg": (COURSE, LQG.from_model(MARINER)),
}
SHIPS, STEPS, HISTORY, AUTHORITY = 3, 11, 3, 0.4


def ships(env, n=SHIPS, seed=7):
    options = {"model": "mariner", "noise": 1.0, "sea": "rough", "episode_steps": 5}
    return ShipVecEnv(env, n, seed=seed, **options)


def by_hand(env, base, seed, outputs):
    """What one ship shows an agent with these outputs: observations, terminal ones by
    step, rewards."""
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
    outputs = (
        np.random.default_rng(1)
        .uniform(-1.0, 1.0, (STEPS, SHIPS, 1))
        .astype(np.float32)
    )
    residual = ResidualVecEnv(
        ships(env), base, authority=AUTHORITY, frame_stack=HISTORY
    )
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
        np.testing.assert_allclose(
            np.array(rewards)[:, row], earned, rtol=1e-5, atol=1e-7
        )
        assert list(last[row]) == list(ends) == [4, 9]
        for step, end in ends.items():
            np.testing.assert_allclose(last[row][step], end, atol=1e-6)


class Counting(VecEnv):
    """Two rows that show the number of the step and keep what they are commanded; row 1
    ends at `end`."""

    def __init__(self, end=99, commands=1, bound=1.0):
        super().__init__(2, Box(-100.0, 100.0, (1,)), Box(-bound, bound, (commands,)))
        self.end, self.commanded, self.number = end, [], 0

    def reset(self):
        self.number = 0
        return self.shown()

    def shown(self):
        return np.array([[self.number], [self.number]], np.float32)

    def step_async(self, actions):
        self.commanded.append(np.round(actions.astype(float), 6).tolist())

    def step_wait(self):
        self.number += 1
        ends, infos = np.array([False, self.number == self.end]), [{}, {}]
        seen = self.shown()
        if ends[1]:
            infos[1]["terminal_observation"], seen[1] = seen[1].copy(), -1.0
        return seen, np.full(2, 0.5, np.float32), ends, infos

    def close(self): ...
    def env_method(self, *_, **__): ...
    def env_is_wrapped(self, *_, **__): ...
    def get_attr(self, *_):
        return [None, None]

    def set_attr(self, *_): ...


class Steady:
    """Proposes 0.9, and keeps which states it was asked with, and who began."""

    def __init__(self):
        self.asked = []

    def predict(self, observation, state=None, episode_start=None, deterministic=True):
        self.asked.append((state, episode_start.tolist()))
        return np.full((2, 1), 0.9), len(self.asked)


def test_rewards_of_a_decision_are_summed_up_to_the_end_of_the_episode():
    for base, after in (
        (None, 1.0),
        (Steady(), 0.9),
    ):  # after an end the base alone, or the output
        inner = Counting(end=2)
        held = ResidualVecEnv(inner, base, action_repeat=3)
        held.reset()
        _, rewards, dones, _ = held.step(np.ones((2, 1)))
        assert (rewards.tolist(), dones.tolist()) == ([1.5, 1.0], [False, True])
        assert inner.commanded == [[[1.0], [1.0]], [[1.0], [1.0]], [[1.0], [after]]]


def test_what_was_learned_beside_a_base_is_flown_from_its_file_as_in_training(tmp_path):
    torch.set_num_threads(1)
    asked = {"authority": 0.2, "frame_stack": 2, "rate_limit": 0.01}
    env = ResidualVecEnv(ships(COURSE, 8), BASES["lqg"][1], **asked)
    scaled = VecNormalize(env, norm_obs=False, gamma=0.9)
    agent = PPO(
        "MlpPolicy", scaled, n_steps=16, batch_size=64, n_epochs=1, seed=0, device="cpu"
    )
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
        shown, expected, ends, _ = twin.step(
            agent.predict(shown, deterministic=True)[0]
        )
        np.testing.assert_allclose(rewards, expected, rtol=1e-4, atol=1e-7)
        np.testing.assert_array_equal(starts, ends)


@pytest.mark.parametrize(
    ("env", "base", "settings", "message"),
    [
        (COURSE, None, {"authority": 0.5}, "authority: expected 1 without a base"),
        (COURSE, BASES["lq"][1], {"authority": 3.0}, "authority: expected .*got 3"),
        (COURSE, None, {"frame_stack": 0}, "frame_stack: expected .*got 0"),
        (COURSE, None, {"action_repeat": 0}, "action_repeat: expected .*got 0"),
        (COURSE, "lq", {}, "base: expected a controller, .*got str"),
        (COURSE, IntegralLineOfSight.from_model(MARINER), {}, "cross_track"),
        (COURSE, LQ.from_model(load_model("kvlcc2")), {}, "base: scale of"),
        (DISCRETE, BASES["lq"][1], {}, "expected actions in a Box .* got Discrete"),
    ],
)
def test_what_does_not_fit_is_refused(env, base, settings, message):
    with pytest.raises(InputError, match=message):
        ResidualVecEnv(ShipVecEnv(env, 2, model="mariner"), base, **settings)

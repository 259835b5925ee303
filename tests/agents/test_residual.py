"""What an agent sees and does in training beside a base controller is what its file
does later alone."""

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from agents import LQ, LQG, IntegralLineOfSight, LearnedPolicy, load_agent
from agents.training.residual import ResidualVecEnv
from shipgym import ShipVecEnv
from shipgym.errors import InputError
from shipgym.models import load_model

COURSE = "shipgym/CourseKeeping-v0"
DISCRETE = "shipgym/PathFollowingDiscrete-v0"
MARINER = load_model("mariner")
LQ_MARINER = LQ.from_model(MARINER)


def ships():
    options = {"model": "mariner", "noise": 1.0, "sea": "rough", "episode_steps": 5}
    return ShipVecEnv(COURSE, 8, seed=7, **options)


@pytest.mark.parametrize(
    ("base", "asked", "decisions"),
    [
        (LQG.from_model(MARINER), {"authority": 0.2, "rate_limit": 0.01}, 11),
        (LQ_MARINER, {"action_repeat": 3}, 2),  # the second ends after two intervals
    ],
    ids=["slow", "held"],
)
def test_what_was_learned_beside_a_base_is_flown_from_its_file_as_in_training(
    base, asked, decisions, tmp_path
):
    torch.set_num_threads(1)
    scaled = VecNormalize(ResidualVecEnv(ships(), base, **asked), norm_obs=False)
    small = {"n_steps": 16, "batch_size": 64, "n_epochs": 1}
    agent = PPO("MlpPolicy", scaled, **small, seed=0, device="cpu")
    before = agent.predict(scaled.reset(), deterministic=True)[0]
    agent.learn(128)
    LearnedPolicy.from_sb3(agent, scaled).save(tmp_path / "agent.json")
    policy, bare = load_agent(tmp_path / "agent.json", MARINER), ships()
    twin = ResidualVecEnv(ships(), base, **asked)
    seen, shown, state, starts = bare.reset(), twin.reset(), None, np.ones(8, bool)
    assert not np.array_equal(agent.predict(shown, deterministic=True)[0], before)
    for _ in range(decisions):
        np.testing.assert_allclose(shown[:, :8], seen, rtol=1e-5, atol=1e-6)
        earned, ended, infos = np.zeros(8), np.zeros(8, bool), []
        for _ in range(asked.get("action_repeat", 1)):
            action, state = policy.predict(seen, state, starts)
            seen, rewards, starts, latest = bare.step(action)
            earned += np.where(ended, 0.0, rewards)
            infos = infos if ended.any() else list(latest)
            ended |= starts
        output, _ = agent.predict(shown, deterministic=True)
        shown, expected, ends, told = twin.step(output)
        np.testing.assert_allclose(earned, expected, rtol=1e-4, atol=1e-6)
        np.testing.assert_array_equal(ended, ends)
        for row in np.flatnonzero(ends):
            last = infos[row]["terminal_observation"]
            found = told[row]["terminal_observation"][:8]
            np.testing.assert_allclose(found, last, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("env", "base", "settings", "message"),
    [
        (COURSE, LQ_MARINER, {"authority": 3.0}, "authority: expected .*got 3"),
        (COURSE, LQ_MARINER, {"action_repeat": 0}, "action_repeat: .*got 0"),
        (COURSE, IntegralLineOfSight.from_model(MARINER), {}, "cross_track"),
        (COURSE, LQ.from_model(load_model("kvlcc2")), {}, "base: scale of"),
        (DISCRETE, LQ_MARINER, {}, "expected actions in a Box .* got Discrete"),
    ],
)
def test_what_does_not_fit_is_refused(env, base, settings, message):
    with pytest.raises(InputError, match=message):
        ResidualVecEnv(ShipVecEnv(env, 2, model="mariner"), base, **settings)


def test_a_base_knows_the_rudder_by_the_orders_that_were_given():
    """After a while it steers as one that begins with that order in force."""
    names = LQ_MARINER.observation_names
    shown = np.zeros(len(names))
    shown[[names.index("heading_error_cos"), names.index("surge")]] = 1.0
    shown[names.index("last_command")] = 0.5
    expected, state = LQ_MARINER.predict(shown)
    for _ in range(100):
        state = LQ_MARINER.after_order(state, np.array([0.5]))
        order, state = LQ_MARINER.predict(shown, state)
    assert order == pytest.approx(expected)
    assert order != pytest.approx(LQ_MARINER.predict(0.0 * shown)[0])


def test_one_observation_that_is_no_number_does_not_stay():
    agent = load_agent("path-following-ppo")
    seen = np.zeros((3, len(agent.observation_names)), dtype=np.float32)
    seen[1, 0] = np.nan
    state = None
    for row in seen:
        action, state = agent.predict(row, state)
    assert np.isfinite(action).all()

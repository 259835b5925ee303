"""Several ships in the same water: PettingZoo's parallel interface."""

import gymnasium
import numpy as np
import pytest

from shipgym import InputError, parallel_env
from shipgym.engine.motion import Motion
from shipgym.tasks.traffic import Target, approach

FEW = {"n_ships": 3, "dt": 5.0}


@pytest.fixture
def ships():
    return parallel_env(**FEW)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of PettingZoo's own games
def test_it_has_the_interface(ships):
    from pettingzoo.test import parallel_api_test, parallel_seed_test

    parallel_api_test(ships, num_cycles=200)
    parallel_seed_test(lambda: parallel_env(**FEW), num_cycles=20)


def wrap_all(angles):
    return (angles + np.pi) % (2.0 * np.pi) - np.pi


def rollout(env, seed, steps=30):
    seen, _ = env.reset(seed=seed)
    found = [np.concatenate(list(seen.values()))]
    for k in range(steps):
        action = np.array([np.sin(k / 5.0)], dtype=np.float32)
        seen, rewards, *_ = env.step(dict.fromkeys(env.agents, action))
        found.append(np.concatenate([*seen.values(), list(rewards.values())]))
    return found


def test_a_seed_fixes_an_encounter_and_those_after_it(ships):
    first = rollout(ships, 7), rollout(ships, None)
    again = rollout(ships, 7), rollout(ships, None)
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(np.concatenate(one), np.concatenate(other))
    assert not np.array_equal(first[0][0], first[1][0])


def test_each_sees_where_the_others_are(ships):
    seen, _ = ships.reset(seed=1)
    names = [quantity.name for quantity in ships.task.observed(ships.model)]
    scales = [quantity.scale for quantity in ships.task.observed(ships.model)]
    for step in range(20):
        if step:
            actions = dict.fromkeys(ships.agents, np.array([0.5], dtype=np.float32))
            seen, *_ = ships.step(actions)
        state = ships.state()
        for own, agent in enumerate(ships.possible_agents):
            values = dict(zip(names, seen[agent] * scales, strict=True))
            for place in range(2):
                x, y, psi, u, v, _ = state[(own + place + 1) % 3]
                drift = np.arctan2(v, u)
                other = Target(x, y, psi + drift, np.hypot(u, v))
                x, y, psi, u, v, r = state[own]
                motion = Motion(x, y, psi, u, v, r, 0.0, 0.0, 0.0, 0.0, 0.0)
                near = approach(motion, other)
                distance = values[f"others_{place}_distance"]
                assert distance == pytest.approx(near.distance, rel=1e-5)
                sine = values[f"others_{place}_bearing_sin"]
                assert sine == pytest.approx(np.sin(near.bearing), abs=1e-5)


def test_case_one_of_imazu_is_a_collision_of_both():
    ships = parallel_env(n_ships=2, dt=5.0, render_mode="rgb_array")
    ships.reset(seed=0, options={"case": 1})
    assert ships.render().shape == (600, 600, 3)
    while ships.agents:
        errors = wrap_all(ships.state()[:, 2] - [0.0, np.pi])
        rudders = np.clip(-3.0 * errors - 60.0 * ships.state()[:, 5], -1.0, 1.0)
        actions = dict(zip(ships.agents, rudders[:, None], strict=False))
        last = ships.step(actions)
    _, rewards, terminated, truncated, infos = last
    assert terminated == {"ship_0": True, "ship_1": True}
    assert truncated == {"ship_0": False, "ship_1": False}
    for agent, reward in rewards.items():
        assert infos[agent]["reward_end"] < 0.0
        assert reward == 0.0  # a lost ship earns nothing
    x, y = ships.state()[:, :2].T
    assert np.hypot(np.diff(x), np.diff(y)) < ships.model.particulars["length"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n_ships": 5}, "n_ships: expected an integer"),
        ({"n_ships": 2, "sea": "rough"}, "sea: expected 'calm'"),
        ({"n_ships": 2, "render_mode": "human"}, "render_mode: expected 'rgb_array'"),
        ({"n_ships": 2, "half_width": 1.0}, "unknown key 'half_width'"),
    ],
)
def test_other_options_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        parallel_env(**options)


def test_wrong_actions_and_cases_are_refused(ships):
    ships.reset(seed=0)
    with pytest.raises(InputError, match="actions: expected one of 'ship_0'"):
        ships.step({})
    wrong = dict.fromkeys(ships.agents, np.zeros(2))
    with pytest.raises(InputError, match="actions: ship_0: expected shape"):
        ships.step(wrong)
    with pytest.raises(InputError, match="case: expected one of 3 ships, got 1"):
        ships.reset(options={"case": 1})
    with pytest.raises(InputError, match="id you mean 'case'"):
        ships.reset(options={"cases": 1})
    assert isinstance(ships.action_space("ship_0"), gymnasium.spaces.Box)

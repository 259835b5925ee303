"""What a learner earns is in the order of what it costs, at any usual discount.

A hundred controllers sail the same episodes: PD autopilots of many gains, held rudders,
saws, ships that are thrown away after a while, and feedback of the wrong sign.
"""

from typing import NamedTuple

import gymnasium
import numpy as np
import pytest
from scipy.stats import spearmanr

from shipgym.envs.registration import ENVIRONMENTS

EPISODES = 10
#: Of `rudder-discrete`, by the rudder limit.
RUDDER_ORDERS = np.array([-1.0, -0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5, 1.0])
FIRST_SEED = 1000


class Controller(NamedTuple):
    """A PD autopilot with a held rudder, and a saw of a period in steps, added to it.

    From a step on, the rudder is hard over; 0: never.
    """

    gain: float = 0.0
    damping: float = 0.0
    held: float = 0.0
    amplitude: float = 0.0
    period: float = 2.0
    hard_over_from: float = 0.0


def grid():
    """Return a hundred controllers."""
    gains = np.geomspace(0.2, 10.0, 8)
    dampings = np.geomspace(0.1, 5.0, 7)
    steered = [Controller(gain, damping) for gain in gains for damping in dampings]
    angles = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
    held = [Controller(held=side * angle) for side in (-1.0, 1.0) for angle in angles]
    saws = [
        Controller(1.0, 0.7, 0.0, amplitude, period)
        for amplitude in (0.05, 0.15, 0.4, 1.0)
        for period in (2, 6, 20, 60, 150)
    ]
    thrown_away = [
        Controller(1.0, 0.7, hard_over_from=step)
        for step in (20, 60, 100, 150, 250, 400)
    ]
    wrong = [Controller(gain=-gain) for gain in (0.1, 0.5, 2.0)]
    biased = [Controller(1.0, 0.7, held) for held in (0.2, -0.5)]
    return [*steered, Controller(), *held, *saws, *thrown_away, *wrong, *biased]


def rudders(controllers, step, seen):
    """Rudder orders of controllers, one to a row of what is seen."""
    error = np.arctan2(seen[:, 0], seen[:, 1])
    side = np.where(step // (controllers.period / 2) % 2 < 1, 1.0, -1.0)
    steered = controllers.gain * error - controllers.damping * seen[:, 2]
    orders = steered + controllers.held + controllers.amplitude * side
    leaving = (controllers.hard_over_from > 0) & (step >= controllers.hard_over_from)
    return np.clip(np.where(leaving, 1.0, orders), -1.0, 1.0)


def as_actions(orders, space):
    """Actions of rudder orders; the shaft stays at service speed."""
    if isinstance(space, gymnasium.spaces.Discrete):
        return np.abs(orders[:, None] - RUDDER_ORDERS).argmin(axis=1)
    actions = np.ones((len(orders), *space.shape), np.float32)
    actions[:, 0] = orders
    return actions


def sailed(env_id, **options):
    """Rewards and costs of the steps of each controller, means over the episodes."""
    controllers = grid()
    rows = Controller(*np.repeat(np.array(controllers), EPISODES, axis=0).T)
    envs = gymnasium.make_vec(env_id, num_envs=len(rows.gain), **options)
    episodes = range(FIRST_SEED, FIRST_SEED + EPISODES)
    seen, _ = envs.reset(seed=[*episodes] * len(controllers))
    going = np.ones(len(rows.gain), bool)
    rewards, costs = [], []
    step = 0
    while going.any():
        actions = as_actions(rudders(rows, step, seen), envs.single_action_space)
        seen, reward, terminated, truncated, info = envs.step(actions)
        rewards.append(np.where(going, reward, 0.0))
        costs.append(np.where(going, info["cost"], 0.0))
        going &= ~(terminated | truncated)
        step += 1
    shape = (step, len(controllers), EPISODES)
    return [np.reshape(each, shape).mean(axis=2) for each in (rewards, costs)]


def order_and_best(rewards, costs, discount):
    """Rank correlation of returns and costs; cost of who earns most over the least."""
    returns = discount ** np.arange(len(rewards)) @ rewards
    cost = costs.sum(axis=0)
    order = spearmanr(returns, -cost).statistic
    return order, cost[returns.argmax()] / cost.min()


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_who_earns_most_costs_least(env_id):
    """A discount of 0.99 sees a tenth of a path or a third of an encounter."""
    rewards, costs = sailed(env_id, action_repeat=1)
    assert rewards.shape[1] == 100
    discounts = (1.0, 0.999)
    if ENVIRONMENTS[env_id]["task"] == "CourseKeeping":
        discounts += (0.99,)
    for discount in discounts:
        order, best = order_and_best(rewards, costs, discount)
        assert order >= 0.98
        assert best <= 1.02

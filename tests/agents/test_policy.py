"""A learned policy steers as its network and its base say, and refuses what it was not
made for."""

from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, LQG, check_controller, sail
from agents.policies.policy import ORDERS, order_numbers
from shipgym.errors import InputError
from shipgym.models import load_model
from shipgym.tasks import course_keeping_task, path_following_task
from tests.agents.policies import MARINER, random_network, random_policy

RNG = np.random.default_rng(1)
SEEN = RNG.uniform(-1.0, 1.0, (30, 8)).astype(np.float32)
SLOW = replace(MARINER, particulars=replace(MARINER.particulars, speed=4.0))
LQ_MARINER = LQ.from_model(MARINER)
WITH_MEMORY = {
    "frame stack": {"frame_stack": 3},
    "base": {"base": LQ_MARINER, "authority": 0.3},
    "stateful base": {
        "base": LQG.from_model(MARINER),
        "authority": 0.3,
        "frame_stack": 2,
    },
    "held": {"base": LQ_MARINER, "action_repeat": 3},
    "held without base": {"action_repeat": 2},
    "slow": {"base": LQ_MARINER, "action_repeat": 4, "rate_limit": 0.1},
    "slow and small": {"base": LQ_MARINER, "authority": 0.05, "rate_limit": 0.05},
}


def by_hand(network, x):
    """In double precision, layer by layer."""
    for i, (weight, bias) in enumerate(network.layers):
        x = weight.astype(float) @ x + bias
        if i + 1 < len(network.layers):
            x = np.tanh(x) if network.activation == "tanh" else np.maximum(x, 0.0)
    return np.tanh(x) if network.output == "tanh" else np.clip(x, -1.0, 1.0)


@pytest.mark.parametrize("activation", ["relu", "tanh"])
@pytest.mark.parametrize("output", ["linear", "tanh"])
def test_the_action_is_that_of_the_layers(activation, output):
    policy = random_policy(
        network=random_network(8, 16, 16, 1, activation=activation, output=output)
    )
    actions, state = policy.predict(SEEN)
    assert actions.dtype == np.float32
    assert state is None
    expected = [by_hand(policy.network, row.astype(float)) for row in SEEN]
    np.testing.assert_allclose(actions, expected, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(
        policy.predict(SEEN[0])[0], expected[0], rtol=0.0, atol=1e-6
    )


def test_a_discrete_policy_gives_the_order_with_the_largest_output():
    policy = random_policy(action="rudder-discrete")
    actions, _ = policy.predict(SEEN)
    best = policy.network(SEEN).argmax(axis=1)
    assert len(set(best.tolist())) > 1
    np.testing.assert_array_equal(actions, ORDERS[best, None])
    np.testing.assert_array_equal(order_numbers(actions), best)


def steered_by_hand(policy, rows, starts):
    """Actions of one ship by the rule in the module's docstring, interval by
    interval."""
    actions, base_state = [], None
    for step, (seen, begins) in enumerate(zip(rows, starts, strict=True)):
        if begins or step == 0:
            frames, left, in_force = [seen] * policy.frame_stack, 0, 0.0
        frames = [*frames[1:], seen]
        inputs, proposed = np.concatenate(frames), 0.0
        if policy.base is not None:
            order, base_state = policy.base.predict(seen, base_state, begins)
            inputs, proposed = np.append(inputs, order), order[0]
        if left == 0:
            output, left = (
                np.clip(by_hand(policy.network, inputs), -1.0, 1.0),
                (policy.action_repeat),
            )
        left -= 1
        change = np.clip(output - in_force, -policy.rate_limit, policy.rate_limit)
        in_force = in_force + change
        action = np.clip(proposed + policy.authority * in_force, -1.0, 1.0)
        if policy.base is not None:
            base_state = policy.base.after_order(base_state, action)
        actions.append(action)
    return np.array(actions)


@pytest.mark.parametrize("name", WITH_MEMORY)
def test_ships_are_steered_side_by_side_and_alone_by_the_rule(name):
    policy = random_policy(**WITH_MEMORY[name])
    random = np.random.default_rng(7)
    seen = random.uniform(-2.0, 2.0, (24, 5, 8)).astype(np.float32)
    starts = random.random((24, 5)) < 0.1

    state, alone, actions, single = None, None, [], []
    for rows, begins in zip(seen, starts, strict=True):
        action, state = policy.predict(rows, state, begins)
        actions.append(action)
        action, alone = policy.predict(rows[2], alone, begins[2])
        single.append(action)

    expected = [steered_by_hand(policy, seen[:, k], starts[:, k]) for k in range(5)]
    np.testing.assert_allclose(actions, np.stack(expected, axis=1), atol=1e-5)
    np.testing.assert_allclose(single, expected[2], atol=1e-5)


@pytest.mark.parametrize(
    "more", [{}, {"action": "rudder-discrete"}, *WITH_MEMORY.values()], ids=list
)
def test_learned_policies_pass_the_conformance_suite(more):
    policy = random_policy(**more)
    check_controller(policy, n_steps=8)
    check_controller(policy, MARINER, path_following_task(), n_steps=3)


def path_policy():
    shown = path_following_task(corridor=0.5).observed(MARINER)
    return random_policy(
        network=random_network(len(shown), 16, 1),
        observation_names=tuple(one.name for one in shown),
        observation_scales=tuple(one.scale for one in shown),
        env_id="shipgym/PathFollowing-v0",
        env_options={"corridor": 0.5},
    )


def shown_by(task):
    shown = task.observed(MARINER)
    return [one.name for one in shown], [one.scale for one in shown]


#: What a policy is used for, and what the message says.
MISUSES = [
    (
        lambda: random_policy().check_fits_model(SLOW),
        "model 'mariner': scale of 'yaw_rate': .* policy 'learned'",
    ),
    (
        lambda: sail(random_policy(), load_model("kvlcc2")),
        "scale of 'yaw_rate'",
    ),
    (
        lambda: path_policy().check_fits(*shown_by(course_keeping_task())),
        "observation 8: expected 'cross_track', got 'none'",
    ),
    (
        lambda: path_policy().predict(SEEN),
        r"expected shape \(15,\) .* 'second_turn_angle' is the last",
    ),
    (
        lambda: path_policy().check_fits(*shown_by(path_following_task())),
        "scale of 'cross_track': expected 80.4.*, got 160.9",
    ),
]


@pytest.mark.parametrize(("use", "message"), MISUSES)
def test_another_environment_is_refused_with_the_difference(use, message):
    with pytest.raises(InputError, match=message):
        use()

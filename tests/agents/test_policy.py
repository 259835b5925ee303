"""A learned policy steers as its network and its base say, and refuses what it was not
made for."""

from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, LQG, check_controller, sail
from agents.policies.network import Layer, Network
from agents.policies.policy import ORDERS, order_numbers
from shipgym.errors import InputError
from shipgym.models import load_model
from shipgym.models.catalogue import mariner
from shipgym.tasks.task import course_keeping_task, path_following_task
from tests.agents.policies import MARINER, random_network, random_policy

RNG = np.random.default_rng(1)
SEEN = RNG.uniform(-1.0, 1.0, (30, 8)).astype(np.float32)
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


def test_an_order_has_the_number_of_the_nearest_in_the_list():
    assert len(ORDERS) == 9
    assert order_numbers([0.04]) == 4
    assert order_numbers([[-9.0], [-0.4], [0.3], [9.0]]).tolist() == [0, 1, 6, 8]
    assert order_numbers(ORDERS[:, None]).tolist() == list(range(9))


def test_rudder_and_shaft_are_two_commands():
    policy = random_policy(action="rudder-shaft")
    assert policy.predict(SEEN)[0].shape == (30, 2)
    assert policy.predict(SEEN[0])[0].shape == (2,)


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
        actions.append(np.clip(proposed + policy.authority * in_force, -1.0, 1.0))
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


def test_what_was_no_number_is_not_held():
    policy = random_policy(action_repeat=4)
    broken, state = policy.predict(np.where(np.arange(8) == 2, np.nan, SEEN[0]))
    assert np.isnan(broken).all()
    np.testing.assert_array_equal(
        policy.predict(SEEN[1], state)[0], policy.predict(SEEN[1])[0]
    )


@pytest.mark.parametrize("state", [3, (1, 2), "state"])
def test_a_state_that_is_none_is_refused(state):
    with pytest.raises(InputError, match="state: expected what the last predict"):
        random_policy(frame_stack=2).predict(SEEN, state)


def test_a_state_of_other_ships_is_refused():
    policy = random_policy(frame_stack=2)
    _, state = policy.predict(SEEN)
    with pytest.raises(InputError, match=r"state: .*\(4, 1, 8\).*got \(30, 1, 8\)"):
        policy.predict(SEEN[:4], state)
    with pytest.raises(InputError, match=r"episode_start: .* 30 ships, got 3"):
        policy.predict(SEEN, state, np.zeros(3, bool))


def test_a_network_that_says_nothing_leaves_the_base():
    policy = random_policy(base=LQ_MARINER, authority=0.3)
    silent = tuple(
        Layer(0.0 * layer.weight, 0.0 * layer.bias) for layer in policy.network.layers
    )
    quiet = replace(policy, network=replace(policy.network, layers=silent))
    assert sail(quiet, MARINER).cost == sail(LQ_MARINER, MARINER).cost


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


def test_a_policy_fits_what_it_learned_with():
    random_policy().check_fits_model(MARINER)
    path_policy().check_fits_model(MARINER)
    task = course_keeping_task(episode_steps=5)
    assert sail(random_policy(), MARINER, task).cost > 0.0


def shown_by(task):
    shown = task.observed(MARINER)
    return [one.name for one in shown], [one.scale for one in shown]


#: What a policy is used for, and what the message says.
MISUSES = [
    (
        lambda: random_policy().check_fits_model(mariner(service_speed=4.0)),
        "model 'mariner': scale of 'yaw_rate': .* policy 'learned'",
    ),
    (
        lambda: random_policy(action="rudder-shaft").check_fits_model(MARINER),
        "action: .*shaft",
    ),
    (
        lambda: sail(random_policy(), load_model("kvlcc2")),
        "scale of 'yaw_rate'",
    ),
    (
        lambda: path_policy().check_fits(*shown_by(course_keeping_task())),
        "with in shipgym/PathFollowing-v0: expected 15 observations, got 8",
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


#: Fields of a policy that do not fit together, and what the message says.
BAD_FIELDS = [
    ({"network": random_network(7, 4, 1)}, "network: expected 8 inputs.*got 7"),
    ({"network": random_network(8, 4, 2)}, "network: expected 1 outputs .*got 2"),
    ({"action": "rudders"}, "action: expected.*Did you mean 'rudder'"),
    ({"frame_stack": 0}, "frame_stack: expected an integer of at least 1"),
    ({"action_repeat": 1.5}, "action_repeat: expected an integer of at least 1"),
    ({"authority": 0.5}, "authority: expected 1 without a base, got 0.5"),
    ({"base": LQ_MARINER, "authority": -1.0}, "authority: expected"),
    ({"base": LQ_MARINER, "action": "rudder-shaft"}, "action: expected 'rudder'"),
    ({"base": LQ.from_model(load_model("kvlcc2"))}, "base: scale of 'yaw_rate'"),
    ({"observation_scales": (1.0,)}, "observation_scales: expected 8 numbers, got 1"),
    ({"action": "rudder-discrete", "rate_limit": 0.1}, "rate_limit: expected 2 with"),
]


@pytest.mark.parametrize(("more", "message"), BAD_FIELDS)
def test_a_field_that_does_not_fit_is_named(more, message):
    with pytest.raises(InputError, match=message):
        random_policy(**more)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"activation": "elu"}, "network.activation: expected"),
        ({"output": "relu"}, "network.output: expected"),
        ({"layers": ()}, "network.layers: expected at least one"),
    ],
)
def test_networks_that_cannot_be_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        replace(random_network(8, 4, 1), **changes)


FIRST, LAST = random_network(8, 4, 1).layers


@pytest.mark.parametrize(
    ("first", "message"),
    [
        (
            {"weight": FIRST.weight.astype(float)},
            r"weight: .*got float64 of .*\(4, 8\)",
        ),
        ({"weight": FIRST.weight[0]}, r"weight: expected float32 with 2 axes.*\(8,\)"),
        ({"weight": FIRST.weight.tolist()}, "weight: expected float32"),
        ({"weight": FIRST.weight[:, :0]}, "weight: .*none of them empty"),
        ({"weight": FIRST.weight * np.float32(np.nan)}, "weight: expected finite"),
        ({"bias": FIRST.bias[:-1]}, "bias: expected 4, one for each row.*got 3"),
        ({"weight": FIRST.weight[:3], "bias": FIRST.bias[:3]}, "expected 3 inputs"),
    ],
)
def test_layers_that_cannot_be_are_refused(first, message):
    with pytest.raises(InputError, match=message):
        Network((FIRST._replace(**first), LAST))

"""A learned policy steers as its network and its base say, and refuses what it was not made for."""

from dataclasses import replace

import numpy as np
import pytest

from agents import LQ, LQG, LearnedPolicy, check_controller, sail
from agents.policies.policy import ORDERS, Memory, order_numbers
from shipgym.errors import InputError
from shipgym.ships import load_model
from shipgym.ships.mariner import mariner
from shipgym.tasks.task import Task, course_keeping_task, path_following_task
from tests.agents.policies import MARINER, random_network, random_policy

RNG = np.random.default_rng(1)
SEEN = RNG.uniform(-1.0, 1.0, (30, 8)).astype(np.float32)
LQ_MARINER = LQ.from_model(MARINER)
WITH_MEMORY = {
    "frame_stack": {"frame_stack": 3},
    "base": {"base": LQ_MARINER, "authority": 0.3},
    "stateful base": {
        "base": LQG.from_model(MARINER),
        "authority": 0.3,
        "frame_stack": 2,
    },
    "held": {"base": LQ_MARINER, "action_repeat": 3},
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


def test_a_share_of_the_rudder_however_small_is_a_share():
    small = random_policy(base=LQ_MARINER, authority=0.05, rate_limit=0.05)
    base, _ = LQ_MARINER.predict(SEEN)
    steered, _ = small.predict(SEEN)
    assert 0.0 < np.abs(steered - base)[np.abs(base) < 0.9].max() <= 0.05 * 0.05 + 1e-6


def test_rudder_and_shaft_are_two_commands():
    assert random_policy(action="rudder-shaft").predict(SEEN)[0].shape == (30, 2)
    assert random_policy(action="rudder-shaft").predict(SEEN[0])[0].shape == (2,)


def test_the_history_begins_with_the_first_observation_and_is_kept_oldest_first():
    policy = random_policy(frame_stack=3)
    state, rows = None, [SEEN[:4], SEEN[4:8], SEEN[8:12], SEEN[12:16]]
    shown = [[0, 0, 0], [0, 0, 1], [0, 1, 2], [1, 2, 3]]
    for step, numbers in enumerate(shown):
        actions, state = policy.predict(rows[step], state, np.zeros(4, bool))
        inputs = np.concatenate([rows[k] for k in numbers], axis=1)
        np.testing.assert_array_equal(
            actions, np.clip(policy.network(inputs), -1.0, 1.0)
        )
    begins = np.array([False, True, False, False])
    actions, _ = policy.predict(SEEN[16:20], state, begins)
    np.testing.assert_allclose(
        actions[1], policy.predict(SEEN[17])[0], rtol=0.0, atol=1e-6
    )
    np.testing.assert_allclose(
        actions[0],
        policy.predict(SEEN[16], Memory(state.seen[0], None, state.repeated[0]))[0],
        atol=1e-6,
    )


def test_an_output_is_held_while_the_base_goes_on():
    policy, silent = (
        random_policy(base=LQ_MARINER, authority=0.3, action_repeat=3),
        random_policy(action_repeat=2),
    )
    bases = [
        LQ_MARINER.predict(rows)[0]
        for rows in (SEEN[:2], SEEN[2:4], SEEN[4:6], SEEN[6:8])
    ]
    begins = [[True, True], [False, False], [False, True], [False, False]]
    decided = [
        [0, 0],
        [0, 0],
        [0, 2],
        [3, 2],
    ]  # the step whose output each ship steers with
    outputs = [
        np.clip(
            policy.network(np.concatenate([SEEN[2 * k : 2 * k + 2], bases[k]], axis=1)),
            -1.0,
            1.0,
        )
        for k in range(4)
    ]
    state = None
    for k in range(4):
        actions, state = policy.predict(
            SEEN[2 * k : 2 * k + 2], state, np.array(begins[k])
        )
        held = np.stack([outputs[step][ship] for ship, step in enumerate(decided[k])])
        expected = np.clip(bases[k] + np.float32(0.3) * held, -1.0, 1.0)
        np.testing.assert_allclose(actions, expected, rtol=0.0, atol=1e-6)
    first, state = silent.predict(SEEN[0])
    second, state = silent.predict(SEEN[1], state)
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(
        silent.predict(SEEN[2], state)[0], silent.predict(SEEN[2])[0]
    )


def test_what_is_added_changes_by_no_more_than_the_rate_limit_in_an_interval():
    policy = random_policy(base=LQ_MARINER, action_repeat=4, rate_limit=0.1)
    state, before, reached = None, np.zeros((4, 1)), []
    for step in range(24):
        seen = SEEN[step % 4 : step % 4 + 4] * 3.0
        _, state = policy.predict(seen, state, np.full(4, step == 0))
        outputs, now = np.split(state.repeated[:, 1:], 2, axis=1)
        np.testing.assert_allclose(
            now - before, np.clip(outputs.clip(-1, 1) - before, -0.1, 0.1), atol=1e-6
        )
        reached.append(np.isclose(now, outputs.clip(-1, 1)))
        before = now
    assert 0.1 < np.mean(reached) < 0.9
    _, state = policy.predict(SEEN[:4], state, np.full(4, True))
    assert (
        np.abs(state.repeated[:, 2]).max() <= 0.1 + 1e-6
    )  # an episode begins with the base alone
    with pytest.raises(
        InputError, match=r"rate_limit: 0\.1 found with discrete orders"
    ):
        random_policy(action="rudder-discrete", rate_limit=0.1)


def test_what_was_no_number_is_not_held():
    policy = random_policy(action_repeat=4)
    broken, state = policy.predict(np.where(np.arange(8) == 2, np.nan, SEEN[0]))
    assert np.isnan(broken).all()
    np.testing.assert_array_equal(
        policy.predict(SEEN[1], state)[0], policy.predict(SEEN[1])[0]
    )


@pytest.mark.parametrize("state", [3, (1, 2), "state"])
def test_a_state_that_is_none_is_refused(state):
    with pytest.raises(
        InputError, match=r"state: .* found, expected what the last predict returned"
    ):
        random_policy(frame_stack=2).predict(SEEN, state)


def test_the_network_adds_its_part_to_the_base():
    policy = random_policy(base=LQ_MARINER, authority=0.3)
    base, _ = LQ_MARINER.predict(SEEN)
    part = np.clip(policy.network(np.concatenate([SEEN, base], axis=1)), -1.0, 1.0)
    np.testing.assert_array_equal(
        policy.predict(SEEN)[0], np.clip(base + np.float32(0.3) * part, -1.0, 1.0)
    )
    silent = tuple((0.0 * weight, 0.0 * bias) for weight, bias in policy.network.layers)
    quiet = replace(policy, network=replace(policy.network, layers=silent))
    np.testing.assert_array_equal(
        sail(quiet, MARINER).cost, sail(LQ_MARINER, MARINER).cost
    )


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
    assert (
        sail(random_policy(), MARINER, course_keeping_task(episode_steps=5)).cost > 0.0
    )


def test_another_environment_is_refused_with_the_difference():
    other = mariner(service_speed=4.0)
    with pytest.raises(
        InputError,
        match=r"model 'mariner': scale of 'yaw_rate': expected .* policy 'learned'",
    ):
        random_policy().check_fits_model(other)
    with pytest.raises(
        InputError,
        match="action: 'rudder-shaft' found, but 'mariner' has no shaft speed",
    ):
        random_policy(action="rudder-shaft").check_fits_model(MARINER)
    with pytest.raises(InputError, match="scale of 'yaw_rate'"):
        sail(random_policy(), load_model("kvlcc2"))
    with pytest.raises(
        InputError,
        match=r"expected 15 observations, got 8; .*: cross_track, course_error",
    ):
        sail(path_policy(), MARINER)
    with pytest.raises(
        InputError,
        match=r"expected shape \(15,\) .* 'second_turn_angle' is the last",
    ):
        path_policy().predict(SEEN)
    second = Task.of("PathFollowing", corridor=0.5).observed(MARINER)
    with pytest.raises(
        InputError, match=r"with in shipgym/PathFollowing-v0: observation 11 is 'next_"
    ):
        path_policy().check_fits(
            [one.name for one in second], [one.scale for one in second]
        )
    wider = path_following_task().observed(MARINER)
    with pytest.raises(
        InputError, match=r"scale of 'cross_track' is 160.9.*learned with 80.4"
    ):
        path_policy().check_fits(
            [one.name for one in wider], [one.scale for one in wider]
        )


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (
            {"network": random_network(7, 4, 1)},
            "network: 7 inputs found, expected 8: 1 x 8 observations",
        ),
        (
            {"network": random_network(8, 4, 2)},
            "network: 2 outputs found, expected 1: for action 'rudder'",
        ),
        ({"action": "rudders"}, "action: expected.*Did you mean 'rudder'"),
        (
            {"frame_stack": 0},
            "frame_stack: expected an integer of at least 1",
        ),
        (
            {"action_repeat": 1.5},
            "action_repeat: expected an integer of at least 1",
        ),
        ({"authority": 0.5}, "authority: 0.5 found without a base"),
        ({"base": LQ_MARINER, "authority": -1.0}, "authority: expected"),
        (
            {"base": LQ_MARINER, "action": "rudder-shaft"},
            "'rudder-shaft' found together with a base",
        ),
        (
            {"base": LQ.from_model(load_model("kvlcc2"))},
            "base: scale of 'yaw_rate'",
        ),
        ({"observation_scales": (1.0,)}, "observation_scales: 1 found, expected 8"),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, dict) else "",
)
def test_a_field_that_does_not_fit_is_named(more, message):
    with pytest.raises(InputError, match=message):
        random_policy(**more)


def test_a_state_of_other_ships_is_refused():
    policy = random_policy(frame_stack=2)
    _, state = policy.predict(SEEN)
    with pytest.raises(
        InputError, match=r"state: expected shape \(4, 1, 8\).*got \(30, 1, 8\)"
    ):
        policy.predict(SEEN[:4], state)
    with pytest.raises(
        InputError, match="episode_start: expected one for each of 30 ships, got 3"
    ):
        policy.predict(SEEN, state, np.zeros(3, bool))


def test_the_public_name():
    import agents

    assert agents.LearnedPolicy is LearnedPolicy


def test_a_base_of_other_observations_is_refused():
    """A course autopilot that sees in other scales would steer by other numbers than the policy's."""
    names, scales = LQ_MARINER.observation_names, LQ_MARINER.observation_scales
    assert random_policy(base=LQ_MARINER, authority=0.3).base is LQ_MARINER
    other = replace(
        LQ_MARINER, observation_scales=tuple(2.0 * scale for scale in scales)
    )
    assert other.observation_names == names
    with pytest.raises(InputError, match="base"):
        random_policy(base=other, authority=0.3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"activation": "elu"}, "network.activation: expected"),
        ({"output": "relu"}, "network.output: expected"),
    ],
)
def test_networks_that_cannot_be_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        replace(random_network(8, 4, 1), **changes)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda w, b: (w.astype(np.float64), b),
            r"weight: float64 of shape \(4, 8\) found, expected",
        ),
        (
            lambda w, b: (w[0], b),
            r"weight: float32 of shape \(8,\) found, expected float32 with 2 axes",
        ),
        (lambda w, b: (w.tolist(), b), r"weight: list of shape \(\) found"),
        (
            lambda w, b: (w, b[:-1]),
            "bias: 3 found, expected 4, one for each row of weight",
        ),
        (
            lambda w, b: (w[:, :0], b),
            r"weight: float32 of shape \(4, 0\) found, .* none of them empty",
        ),
        (
            lambda w, b: (w + np.float32(np.nan), b),
            r"weight: nan found at \[0, 0\], expected finite numbers",
        ),
    ],
)
def test_layers_that_cannot_be_are_refused(change, message):
    network = random_network(8, 4, 1)
    first, *rest = network.layers
    with pytest.raises(InputError, match=message):
        replace(network, layers=(change(*first), *rest))

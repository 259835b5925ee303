"""Learning by CMA-ES: networks side by side, what is found, kept and refused."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from agents import load_agent
from agents.policies.candidate_networks import CandidateNetworks, NetworkShape
from agents.rollouts.rollout import episode_costs, rollout
from agents.training import training
from agents.training.evolution import EvolutionLearner
from agents.training.request import TrainingRequest, make_plan
from agents.training.training_run import TrainingRun
from shipgym.errors import InputError

pytest.importorskip("cma", reason="cma is not installed")

SHORT = {"episode_steps": 20, "change_interval_steps": 10}
SMALL = {
    "population": 6,
    "episodes": 4,
    "net_arch": [],
    "total_steps": 4_000,
    "evaluate_every": 1_000,
}


def small(**settings):
    return make_plan(
        TrainingRequest("cma-es", options=SHORT, settings={**SMALL, **settings})
    )


@pytest.mark.parametrize("activation", ["relu", "tanh"])
@pytest.mark.parametrize("hidden", [(), (5,), (4, 3)])
def test_networks_side_by_side_answer_as_each_of_them_alone(hidden, activation):
    shape = NetworkShape((6, *hidden, 2), activation)
    numbers = np.random.default_rng(1)
    vectors = numbers.standard_normal((3, shape.n_weights))
    inputs = numbers.standard_normal((12, 6)).astype(np.float32)
    together = CandidateNetworks.of(shape, vectors)
    alone = [shape.network(vector) for vector in vectors]
    assert together.sizes == alone[0].sizes == (6, *hidden, 2)
    for number, network in enumerate(alone):
        rows = slice(4 * number, 4 * number + 4)
        np.testing.assert_allclose(
            together(inputs)[rows], network(inputs[rows]), atol=1e-5
        )


def test_a_search_begins_with_outputs_of_zero_and_weights_of_their_usual_size():
    shape = NetworkShape((99, 100, 1), "tanh")
    weights = shape.scales() * shape.start(np.random.default_rng(0))
    network = shape.network(weights)
    assert not network(np.ones((3, 99), np.float32)).any()
    assert network.layers[0].weight.std() == pytest.approx(0.1, rel=0.02)


def test_a_search_on_top_of_a_controller_ends_with_a_lower_cost():
    result = training.train(
        small(base="pid", authority=0.5, total_steps=20_000), evaluation_episodes=20
    )
    start = result.curve[0]["cost"]
    assert result.best_cost < 0.98 * start
    assert result.policy.base.kind == "pid"
    assert result.steps >= 20_000
    assert all(row["mean_return"] < 0.0 for row in result.curve[1:])


def test_what_cannot_be_bettered_stays_as_it_was():
    """The base itself is among the policies that the best is chosen from."""
    result = training.train(small(base="lq", sigma=10.0), evaluation_episodes=10)
    assert result.curve[0]["cost"] == result.lq_cost
    assert result.best_cost <= result.lq_cost


def test_the_file_of_the_best_steers_as_it_does(tmp_path):
    plan = small(net_arch=[3], base="lq", frame_stack=2, action_repeat=4)
    result = training.train(plan, tmp_path / "run", evaluation_episodes=10)
    agent = load_agent(tmp_path / "run" / "agent.json")
    seeds = np.arange(5)
    engine = plan.task.engine(5)
    costs = episode_costs(agent, engine, seeds)
    np.testing.assert_array_equal(costs, episode_costs(result.policy, engine, seeds))
    assert agent.name == "cma-es"
    assert agent.training["training_seeds"] == [0, 3]
    assert agent.network.sizes == (2 * len(agent.observation_names) + 1, 3, 1)


@pytest.mark.parametrize("action", ["rudder-shaft", "rudder-discrete"])
def test_other_actions_are_learned_from_nothing(action):
    request = TrainingRequest(
        "cma-es",
        model="kvlcc2",
        options={**SHORT, "action": action},
        settings={**SMALL, "total_steps": 500},
    )
    result = training.train(make_plan(request), evaluation_episodes=4)
    assert result.policy.action == action
    assert np.isfinite(result.best_cost)


def test_a_search_over_many_weights_adapts_the_diagonal_alone():
    few = EvolutionLearner(small(base="none"), None)
    many = EvolutionLearner(small(base="none", net_arch=[16]), None)
    diagonal = [one.search.strategy.opts["CMA_diagonal"] for one in (few, many)]
    assert diagonal == [False, True]


def test_each_generation_sails_other_episodes():
    plan = small(base="none")
    learner = EvolutionLearner(plan, None)
    policy = learner.policy()
    engine = plan.task.engine(3)
    costs = []
    for number in (0, 1, 0):
        found = rollout(policy, engine, [0, 1, 2], number=number)
        costs.append(found.costs.tolist())
    assert costs[0] == costs[2]
    assert not set(costs[0]) & set(costs[1])
    assert learner.seeds.tolist() == [0, 1, 2, 3] * 6


def test_the_search_over_drawn_models_is_that_of_the_suite():
    plan = make_plan(TrainingRequest("cma-es", task="sharp-turns"))
    assert plan.settings.base == "tuned"
    assert plan.settings.model_uncertainty == "covariance"


def test_a_checkpoint_of_another_search_is_refused():
    learner = EvolutionLearner(small(base="none"), None)
    other = EvolutionLearner(small(base="none", population=7), None)
    other.search.ask()
    other.search.tell(np.arange(7.0))
    with pytest.raises(ValueError, match=r"agent\.costs: .* shape \(1, 6\), got .*7"):
        learner.restore(other.state())


def test_a_search_that_diverges_says_so():
    run = TrainingRun(small(), None, 4, 45.0)
    run.learner.search.strategy.mean[:] = np.nan
    with pytest.raises(InputError, match=r"diverged after 0 steps: .*; lower sigma"):
        run.learn(None, None)


def test_without_the_package_the_extra_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "cma", None)
    message = r"cma is not installed, cma-es needs it: pip install 'shipgym\[tune\]'"
    with pytest.raises(InputError, match=message):
        training.train(small(), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_the_result_does_not_depend_on_threads_or_other_random_numbers():
    plan = small()
    first = training.train(plan, evaluation_episodes=4)
    np.random.seed(5)
    second = training.train(replace(plan, threads=2), evaluation_episodes=4)
    assert [row["cost"] for row in first.curve] == [row["cost"] for row in second.curve]

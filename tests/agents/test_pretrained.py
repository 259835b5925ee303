"""The shipped agents are what their records say."""

import numpy as np
import pytest

from agents import load_agent
from agents.benchmarking.contestants import pretrained
from agents.controllers.controller import model_hash
from agents.policies.policy import LearnedPolicy
from agents.rollouts.rollout import check_fits, episode_costs
from agents.suites.suite import load_suite
from agents.training.plan import Given, make_plan
from agents.training.settings import present_names

SUITE = load_suite()
SECOND = [task for task in load_suite("shipgym-v2").tasks if task.on == "ship"]
SEEDS = 5  # training seeds of the second suite's agents
PARTS = 1e-4  # of a cost: what rounding of other processors comes to over an episode


def agent_of(task):
    paths = pretrained(task.name, "ppo")
    assert len(paths) == 1
    return paths[0], load_agent(paths[0])


@pytest.mark.parametrize("task", SUITE.tasks, ids=lambda task: task.name)
def test_each_task_has_an_agent_with_a_whole_record(task):
    path, agent = agent_of(task)
    assert isinstance(agent, LearnedPolicy)
    check_fits(agent, task.task, task.ship, task.name)
    assert agent.model_sha256 == model_hash(task.ship)
    assert (
        path.stat().st_size + path.with_suffix(".safetensors").stat().st_size < 300_000
    )
    later = {
        "rate_limit": 2.0,
        "model_uncertainty": "none",
    }  # settings that there were none of then
    record = {
        **agent.training,
        "settings": later | present_names(agent.training["settings"]),
    }
    assert record["task"] == task.name
    assert f"--task {task.name} --seed {record['seed']}" in record["command"]
    commanded = make_plan(
        Given("ppo", task=task.name, seed=record["seed"])
    ).configuration()
    assert {name: record[name] for name in commanded} == commanded
    held_out = {run["seed"]: run["held_out_cost"] for run in record["runs"]}
    assert record["seed"] == min(held_out, key=held_out.get)
    for run in record["runs"]:
        assert run["held_out_cost"] == pytest.approx(
            min(cost for _, cost in run["curve"]), abs=1e-3
        )
    for first, last in (record["training_seeds"], record["evaluation_seeds"]):
        assert first <= last < task.seeds[0]


@pytest.mark.parametrize("task", SECOND, ids=lambda task: task.name)
def test_each_task_of_the_second_suite_has_an_agent_of_every_training_seed(task):
    paths = pretrained(task.name, "ppo")
    assert [path.stem for path in paths] == [
        f"{task.name}-ppo-s{seed}" for seed in range(SEEDS)
    ]
    for seed, agent in enumerate(map(load_agent, paths)):
        check_fits(agent, task.task, task.ship, task.name)
        assert agent.model_sha256 == model_hash(
            task.ship
        )  # the design model, which is handed out
        assert agent.rate_limit == 0.1
        record = agent.training
        plan = make_plan(Given("ppo", task=task.name, seed=seed))
        commanded = plan.configuration()
        assert {name: record[name] for name in commanded} == commanded
        assert record["held_out_cost"] == pytest.approx(
            min(cost for _, cost in record["curve"]), abs=1e-3
        )
        assert record["curve"][-1][0] == record["steps"] >= plan.settings.total_steps
        for first, last in (record["training_seeds"], record["evaluation_seeds"]):
            assert first <= last < task.seeds[0]
    sizes = [
        path.stat().st_size + path.with_suffix(".safetensors").stat().st_size
        for path in paths
    ]
    assert sum(sizes) < 300_000


@pytest.mark.parametrize("name", ["mariner-calm", "container-path"])
def test_the_score_is_what_it_costs(name):
    task = SUITE.task(name)
    _, agent = agent_of(task)
    costs = episode_costs(agent, task.engine(len(task.seeds)), np.asarray(task.seeds))
    assert costs.mean() == pytest.approx(agent.training["score"]["cost"], rel=PARTS)

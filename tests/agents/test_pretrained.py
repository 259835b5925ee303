"""The shipped agents are what their records say."""

import numpy as np
import pytest

from agents import load_agent
from agents.agent_file import PRETRAINED
from agents.controllers.interface import check_fits, model_hash
from agents.rollouts.rollout import episode_costs
from agents.suites.suite import load_suite
from agents.training.plan import TrainingRequest, make_plan

TASKS = [task.design_task for task in load_suite().tasks if task.on == "ship"]
SEEDS = 5  # of training, an agent each
ROUNDING = 1e-4  # of a cost over an episode, on other processors


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
def test_each_task_has_an_agent_of_every_training_seed(task):
    paths = sorted(PRETRAINED.glob(f"{task.name}-ppo-*.json"))
    names = [f"{task.name}-ppo-s{seed}" for seed in range(SEEDS)]
    assert [path.stem for path in paths] == names
    for seed, agent in enumerate(map(load_agent, paths)):
        check_fits(agent, task.task, task.ship, task.name)
        assert agent.model_sha256 == model_hash(task.ship)
        assert agent.rate_limit == 0.1
        record = agent.training
        plan = make_plan(TrainingRequest("ppo", task=task.name, seed=seed))
        commanded = plan.configuration()
        # agents that are older than the choice learned from the cost
        settings = {"reward": "cost", **record["settings"]}
        learned = {**record, "settings": settings}
        assert {name: learned[name] for name in commanded} == commanded
        lowest = min(cost for _, cost in record["curve"])
        assert record["held_out_cost"] == pytest.approx(lowest, abs=1e-3)
        assert record["curve"][-1][0] == record["steps"] >= plan.settings.total_steps
        for first, last in (record["training_seeds"], record["evaluation_seeds"]):
            assert first <= last < task.seeds[0]

    files = [path.with_suffix(".safetensors") for path in paths] + paths
    assert sum(file.stat().st_size for file in files) < 300_000


@pytest.mark.parametrize("task", TASKS[:2], ids=lambda task: task.name)
def test_an_agent_costs_what_its_record_says(task):
    agent = load_agent(sorted(PRETRAINED.glob(f"{task.name}-ppo-*.json"))[0])
    first, last = agent.training["evaluation_seeds"]
    seeds = np.arange(first, last + 1)
    costs = episode_costs(agent, task.engine(len(seeds)), seeds)
    assert costs.mean() == pytest.approx(agent.training["held_out_cost"], rel=ROUNDING)

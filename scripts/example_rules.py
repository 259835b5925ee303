"""A rule of a few numbers against an agent in the example berth.

    python scripts/example_rules.py                   # table of docs/environments
    python scripts/example_rules.py --steps 0   # without an agent
    python scripts/example_rules.py --tune 60   # search the rule's numbers

Judged on 100 episodes that none of them has seen. A search (CMA-ES) has episodes of
its own and so many seconds of processor; it begins with the numbers of the rule's file
in `shipgym/examples` and prints what it finds. The agent is stable-baselines3's PPO
with its defaults. The row "lowest" has the lowest cost in each episode of the rule with
40 draws of its numbers: it is no rule, since nobody knows beforehand which are best.
"""

import argparse
import runpy
from collections.abc import Mapping
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO

import shipgym
from agents.rollouts.rollout import Rollout, rollout
from agents.suites.suite import BenchmarkTask
from agents.training.controller_search import FIRST_SEED, SearchBudget, search
from agents.training.controller_space import factor
from shipgym.arrays import Floats
from shipgym.examples import FOLDER

SEARCHED = FIRST_SEED + np.arange(100)
JUDGED = 1_000_000 + np.arange(100)
N_DRAWS = 40


class Ends(NamedTuple):
    """How episodes end: costs of shape (n,), and shares or means."""

    costs: Floats
    lost: float
    arrived: float
    reward: float  # that an agent earns


def main() -> None:
    """Print the table, or search the numbers of a rule."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("names", nargs="*", default=["berth"])
    parser.add_argument("--tune", type=float, default=0.0, metavar="SECONDS")
    parser.add_argument("--steps", type=int, default=229_376, help="of the agent")
    given = parser.parse_args()
    torch.set_num_threads(1)
    print("| example | | cost, mean | median | lost | arrive | reward |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: |")
    for name in given.names:
        task = task_of(name)
        rule = Rule(task)
        if given.tune:
            print(rule.tuned(given.tune))
            continue
        show(task, "rule", judged(task, rule.policy()))
        if given.steps:
            show(task, "PPO", judged(task, learned(task, given.steps)))
        lowest = rule.lowest()
        print(f"| {name} | lowest | {lowest.mean():.1f} | {np.median(lowest):.1f} |")


def task_of(name: str) -> BenchmarkTask:
    """The example as a task of a benchmark."""
    options = {"model": "mariner-tls-svm", **gymnasium.spec(id_of(name)).kwargs}
    task = options.pop("task")
    model = options.pop("model")
    return BenchmarkTask(name, task, model, options=options)


def id_of(name: str) -> str:
    """The id of an example."""
    return f"examples/{name.capitalize()}-v0"


def judged(task: BenchmarkTask, policy: Any) -> Ends:
    """How a policy does in the scored episodes."""
    engine = task.engine(len(JUDGED))
    sailed = rollout(policy, engine, JUDGED, record=["reward_end"])
    ends = sailed.infos["reward_end"][1:] < 0.0
    lost = (ends & sailed.sailing).any(axis=0)
    arrived = sailed.terminated & ~lost
    earned = rewards(sailed, ends).sum(axis=0) + 100.0 * arrived
    return Ends(sailed.costs, lost.mean(), arrived.mean(), earned.mean())


def rewards(sailed: Rollout, ends: Any) -> Floats:
    """Bounded rewards of each step, shape (n_steps, n)."""
    scale = 0.1
    costs = -sailed.rewards
    earned = scale / (costs + scale)
    return np.where(sailed.sailing & ~ends, earned, 0.0)


def learned(task: BenchmarkTask, steps: int) -> Any:
    """An agent of stable-baselines3."""
    ships = shipgym.ShipVecEnv(id_of(task.name), num_envs=32, seed=0)
    agent = PPO("MlpPolicy", ships, n_steps=256, seed=0)
    return agent.learn(steps)


class Rule:
    """The rule of an example, as its file has it."""

    def __init__(self, task: BenchmarkTask) -> None:
        self.task = task
        self.file = runpy.run_path(str(FOLDER / f"{task.name}_rule.py"))
        self.numbers: dict[str, float] = self.file["NUMBERS"]
        self.engines: dict[int, Any] = {}

    def policy(self, numbers: Mapping[str, Any] | None = None) -> Any:
        """The rule with some numbers, floats or an entry for each ship."""
        return self.file["factory"](self.task, numbers or self.numbers)

    def costs(self, candidates: Any, seeds: Any) -> Floats:
        """Costs of some numbers in some episodes, shape (n_candidates, n_episodes)."""
        numbers = {}
        for name in self.numbers:
            values = [one[name] for one in candidates]
            numbers[name] = np.repeat(values, len(seeds))
        n = len(candidates)
        n_ships = n * len(seeds)
        if n_ships not in self.engines:
            self.engines[n_ships] = self.task.engine(n_ships)
        engine = self.engines[n_ships]
        sailed = rollout(self.policy(numbers), engine, np.tile(seeds, n))
        return sailed.costs.reshape(n, -1)

    def tuned(self, seconds: float) -> dict[str, float]:
        """Numbers that a search finds on episodes of its own."""
        budget = SearchBudget(seconds=seconds)

        def mean_costs(candidates: Any) -> Floats:
            return np.asarray(self.costs(candidates, SEARCHED).mean(axis=1))

        numbers = self.numbers.items()
        space = [factor(name, start, step=0.5) for name, start in numbers]
        found = search(mean_costs, space, budget)
        best, mean = mean_costs([found.best, found.mean])
        print(f"{found.evaluations} candidates, cost {best:.2f}, mean's {mean:.2f}")
        return found.best if best < mean else found.mean

    def lowest(self) -> Floats:
        """Lowest cost in each judged episode of 40 draws of the numbers, shape (n,)."""
        random = np.random.default_rng(0)
        draws = [self.numbers]
        for _ in range(N_DRAWS):
            factors = np.exp(0.4 * random.normal(size=len(self.numbers)))
            values = np.array(list(self.numbers.values())) * factors
            draws.append(dict(zip(self.numbers, values.tolist(), strict=True)))
        return np.asarray(self.costs(draws, JUDGED).min(axis=0))


def show(task: BenchmarkTask, who: str, ends: Ends) -> None:
    """Print a row of the table."""
    costs = f"{ends.costs.mean():.1f} | {np.median(ends.costs):.1f}"
    shares = f"{100.0 * ends.lost:.0f} % | {100.0 * ends.arrived:.0f} %"
    row = f"| {task.name} | {who} | {costs} | {shares} | {ends.reward:.0f} |"
    print(row, flush=True)


if __name__ == "__main__":
    main()

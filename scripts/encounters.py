"""Rules and agents in the encounters of shipgym/Encounter-v0, on 100 paired episodes.

    python scripts/encounters.py                           # rules as they are shipped
    python scripts/encounters.py --tune scenarios --seconds 180
    python scripts/encounters.py --agents 3 --seconds 180  # and agents, so many seeds
    python scripts/encounters.py --agents 3 --base scenarios   # which add to a rule

A search (CMA-ES) and an agent (stable-baselines3's PPO) have the same seconds of
processor each, and episodes of their own. A line "less" is what an agent costs less
than the rule "scenarios" in the same episodes, with its 95 % interval.
"""

import argparse
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

import shipgym
from agents.rollouts.rollout import Rollout, rollout
from agents.suites.suite import BenchmarkTask
from agents.training.controller_search import FIRST_SEED, SearchBudget, search
from agents.training.controller_space import factor
from agents.training.residual import ResidualVecEnv
from shipgym.arrays import Floats
from shipgym.envs.registration import ENVIRONMENTS
from shipgym.examples.encounter_rule import KINDS, rule_of

ID = "shipgym/Encounter-v0"
SEARCHED = FIRST_SEED + np.arange(32)
JUDGED = 1_000_000 + np.arange(100)
AUTHORITY = 0.5  # of an agent that adds to a rule
RULE_NUMBERS = range(13, 18)
SHOWN = ("closest", "success", *(f"rule_{number}" for number in RULE_NUMBERS))


class Hold:
    """Keeps the track, and sees nobody."""

    def predict(self, seen: Any, *_: Any) -> tuple[Any, None]:
        """Rudder to the heading of the task."""
        return np.clip(2.0 * seen[:, :1] - 2.0 * seen[:, 2:3], -1.0, 1.0), None


class Agent(NamedTuple):
    """An agent, alone or on top of a rule."""

    network: Any
    base: Any = None

    def predict(self, seen: Any, state: Any = None, starts: Any = None, *_: Any) -> Any:
        """Rudder for each ship, and the state of the rule."""
        if self.base is None:
            return self.network.predict(seen, deterministic=True)[0], None
        proposed, state = self.base.predict(seen, state, starts)
        shown = np.concatenate([seen, proposed], axis=1)
        added = np.clip(self.network.predict(shown, deterministic=True)[0], -1.0, 1.0)
        return np.clip(proposed + AUTHORITY * added, -1.0, 1.0), state


def main() -> None:
    """Print the table, or search the numbers of a rule."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--tune", choices=list(KINDS))
    parser.add_argument("--seconds", type=float, default=180.0, help="of processor")
    parser.add_argument("--agents", type=int, default=0, help="seeds")
    parser.add_argument("--base", choices=list(KINDS))
    given = parser.parse_args()
    torch.set_num_threads(1)
    task = task_of_suite()
    if given.tune:
        print(tuned(task, given.tune, given.seconds))
        return
    print("| | cost, mean | median | too close | arrived | rules 13 to 17 broken |")
    print("| --- | ---: | ---: | ---: | ---: | --- |")
    show("track alone", sailed(task, Hold()))
    best = sailed(task, rule_of("scenarios", task))
    show("velocity obstacles", sailed(task, rule_of("obstacles", task)))
    show("scenarios", best)
    for seed in range(given.agents):
        base = rule_of(given.base, task) if given.base else None
        agent = learned(seed, given.seconds, base)
        run = sailed(task, agent)
        name = f"PPO on {given.base}" if given.base else "PPO"
        show(f"{name}, seed {seed}, {agent.network.num_timesteps} steps", run)
        less = best.costs - run.costs
        half = 1.96 * less.std(ddof=1) / np.sqrt(len(less))
        print(f"| less | {less.mean():.1f} ± {half:.1f} |", flush=True)


def task_of_suite() -> BenchmarkTask:
    """The environment as a task of a suite."""
    options = dict(ENVIRONMENTS[ID])
    return BenchmarkTask("encounter", "encounter", options["model"])


def sailed(task: BenchmarkTask, policy: Any) -> Rollout:
    """The judged episodes of a policy."""
    return rollout(policy, task.engine(len(JUDGED)), JUDGED, record=SHOWN)


def show(name: str, run: Rollout) -> None:
    """Print a row of the table."""
    last = run.steps.astype(int), np.arange(len(run.costs))
    ends = {entry: run.infos[entry][last] for entry in SHOWN}
    least = run.task.least_distance * run.model.particulars["length"]
    half = 1.96 * run.costs.std(ddof=1) / np.sqrt(len(run.costs))
    too_close = 100.0 * (ends["closest"] < least).mean()
    arrived = 100.0 * ends["success"].mean()
    broken = [f"{ends[f'rule_{number}'].mean():.2f}" for number in RULE_NUMBERS]
    print(
        f"| {name} | {run.costs.mean():.1f} ± {half:.1f} | {np.median(run.costs):.1f}"
        f" | {too_close:.0f} % | {arrived:.0f} % | {', '.join(broken)} |",
        flush=True,
    )


def tuned(task: BenchmarkTask, kind: str, seconds: float) -> Mapping[str, float]:
    """Numbers of a rule that a search finds on episodes of its own."""
    _, usual = KINDS[kind]
    engines: dict[int, Any] = {}

    def costs(candidates: Any) -> Floats:
        n = len(candidates)
        if n not in engines:
            engines[n] = task.engine(n * len(SEARCHED))
        numbers = {}
        for name in usual:
            values = [one[name] for one in candidates]
            numbers[name] = np.repeat(values, len(SEARCHED))
        rule = rule_of(kind, task, numbers)
        run = rollout(rule, engines[n], np.tile(SEARCHED, n))
        return np.asarray(run.costs.reshape(n, -1).mean(axis=1))

    space = [factor(name, start, step=0.3) for name, start in usual.items()]
    found = search(costs, space, SearchBudget(seconds=seconds))
    best, mean = costs([found.best, found.mean])
    print(f"{found.evaluations} candidates, cost {best:.2f}, mean's {mean:.2f}")
    return found.best if best < mean else found.mean


def learned(seed: int, seconds: float, base: Any = None) -> Agent:
    """An agent after so many seconds of processor."""
    ships = shipgym.ShipVecEnv(ID, num_envs=64, seed=1000 * seed)
    if base is not None:
        ships = ResidualVecEnv(ships, base, authority=AUTHORITY)
    scaled = VecNormalize(ships, norm_obs=False, gamma=0.99)
    began = time.process_time()

    def rate(_: float) -> float:
        used = (time.process_time() - began) / seconds
        return 3e-4 * max(1.0 - used, 0.05)

    agent = PPO(
        "MlpPolicy",
        scaled,
        rate,
        n_steps=128,
        batch_size=1024,
        n_epochs=5,
        seed=seed,
        policy_kwargs={"log_std_init": -1.0},
    )
    within = lambda *_: time.process_time() - began < seconds  # noqa: E731
    return Agent(agent.learn(100_000_000, callback=within), base)


if __name__ == "__main__":
    main()

"""Does learning pay in a task? A rule and agents on the same 100 episodes.

    python scripts/learning_tasks.py rudder-roll --seconds 60
    python scripts/learning_tasks.py encounter --search 0    # the rule as it is shipped
    python scripts/learning_tasks.py unknown-ship --seeds 3 --frames 8

The numbers of a rule are searched by CMA-ES, and agents (stable-baselines3's PPO)
learn, for as many seconds of processor each, on episodes of their own. With `--on-rule`
an agent adds to the rule's rudder. "Beyond" is what it costs more than the rule in the
same episodes, with its 95 % interval.
"""

import argparse
import time
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from agents.controllers.learning_rules import LearningRule, RollDamping, Scenarios
from agents.training.controller_search import SearchBudget, search
from agents.training.controller_space import factor
from agents.training.residual import ResidualVecEnv
from shipgym.arrays import Floats
from shipgym.envs.sb3 import ShipVecEnv

JUDGED, SEARCHED = 1_000_000, 500_000  # first seeds
EPISODES = 100


class PD(LearningRule):
    """Feedback of heading error, yaw rate and the integral of the error."""

    numbers: Mapping[str, float] = {"error": 2.0, "rate": 2.0, "integral": 0.1}

    def steer(self, rows: Floats, state: Any, starts: Any) -> tuple[Floats, Any]:
        """No memory."""
        k = self.known
        error = k.error * np.arctan2(rows[:, 0], rows[:, 1])
        return error - k.rate * rows[:, 2] + k.integral * rows[:, 7], state


class Berth(LearningRule):
    """PD on the line of the berth; the shaft holds the speed from which she stops."""

    numbers: Mapping[str, float] = {
        "error": 20.3,
        "rate": 14.8,
        "off": 7.3,
        "sway": 2.6,
        "base": 0.14,  # shaft
        "way": 1.9,  # shaft by speed
        "fast": 13.2,  # against speed above that
        "margin": 0.064,
    }

    def steer(self, rows: Floats, state: Any, starts: Any) -> tuple[Floats, Any]:
        """No memory."""
        k = self.known
        sine, cosine, yaw_rate, surge, sway, _, off, fast = rows.T
        rudder = -k.error * np.arctan2(sine, cosine) - k.rate * yaw_rate
        rudder -= k.off * off + k.sway * sway
        shaft = k.base + k.way * surge - k.fast * (fast + k.margin)
        return np.stack([rudder, shaft], axis=1), state


class River(LearningRule):
    """PD on the course of the river, with its bend; the shaft holds the limit."""

    numbers: Mapping[str, float] = {
        "error": 8.7,
        "rate": 9.4,
        "bend": 6.3,
        "off": 3.0,
        "base": 0.86,  # shaft by limit
        "speed": 0.93,  # shaft by what is short of it
        "stream": 0.01,  # above the limit, through the water
    }

    def steer(self, rows: Floats, state: Any, starts: Any) -> tuple[Floats, Any]:
        """No memory."""
        k = self.known
        sine, cosine, bend, yaw_rate, _, surge, off, limit = rows.T
        rudder = k.error * np.arctan2(sine, cosine) - k.rate * yaw_rate
        rudder += k.bend * bend - k.off * off
        limit = np.minimum(limit + k.stream, 1.0)
        shaft = k.base * limit + k.speed * (limit - surge)
        return np.stack([rudder, shaft], axis=1), state


class Task(NamedTuple):
    """An environment, and a rule for it, whose numbers a search begins from."""

    env: str
    rule: type[LearningRule]


TASKS = {
    "rudder-roll": Task("shipgym/RudderRoll-v0", RollDamping),
    "encounter": Task("shipgym/Encounter-v0", Scenarios),
    "unknown-ship": Task("shipgym/UnknownShip-v0", PD),
    "berth": Task("shipgym.examples:examples/Berth-v0", Berth),
    "river": Task("shipgym.examples:examples/River-v0", River),
}


class Judged(NamedTuple):
    """How the episodes of a policy ended, shape (n,) each."""

    costs: Floats
    success: Floats


def main() -> None:
    """Search, learn and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("task", choices=list(TASKS))
    parser.add_argument("--seconds", type=float, default=60.0, help="of an agent")
    parser.add_argument("--search", type=float, help="seconds; as long by default")
    parser.add_argument("--seeds", type=int, default=1, help="agents; 0: none")
    parser.add_argument("--frames", type=int, default=1, help="observations shown")
    parser.add_argument("--on-rule", action="store_true")
    given = parser.parse_args()
    torch.set_num_threads(1)
    task = TASKS[given.task]
    ships = ships_of(task, EPISODES, JUDGED)
    rule = rule_of(task, ships)
    print("| | cost | beyond | success |\n| --- | ---: | ---: | ---: |")
    best = show("rule, set by hand", judged(rule, ships))
    seconds = given.seconds if given.search is None else given.search
    if seconds:
        rule = searched(task, seconds)
        ships.seed(JUDGED)
        best = show(f"rule, {seconds:.0f} s", judged(rule, ships))
    for seed in range(given.seeds):
        base = rule if given.on_rule else None
        ships = ships_of(task, 64, 1000 * seed, given.frames, base)
        agent = learned(ships, seed, given.seconds)
        run = judged(agent, ships_of(task, EPISODES, JUDGED, given.frames, base))
        show(f"PPO, seed {seed}, {agent.num_timesteps} steps", run, best)


def ships_of(task: Task, n: int, seed: int, frames: int = 1, base: Any = None) -> Any:
    """Ships of a task, with a rule whose rudder an agent changes, or none."""
    ships = ShipVecEnv(task.env, n, seed=seed, frame_stack=frames)
    return ships if base is None else ResidualVecEnv(ships, base, authority=0.5)


def rule_of(task: Task, ships: Any, numbers: Mapping[str, float] | None = None) -> Any:
    """The rule of a task with some numbers."""
    (names,) = ships.get_attr("observation_names", 0)
    return task.rule(names, numbers)


def judged(policy: Any, ships: Any) -> Judged:
    """One episode of each ship."""
    seen = ships.reset()
    costs = np.full(ships.num_envs, np.nan)
    success = np.zeros(ships.num_envs)
    state = None
    starts = np.ones(ships.num_envs, dtype=bool)
    while np.isnan(costs).any():
        actions, state = policy.predict(seen, state, starts, deterministic=True)
        seen, _, starts, infos = ships.step(actions)
        for row in np.flatnonzero(starts & np.isnan(costs)):
            costs[row] = infos[row]["episode"]["cost"]
            success[row] = infos[row]["is_success"]
    return Judged(costs, success)


def show(name: str, run: Judged, best: Judged | None = None) -> Judged:
    """Print a row of the table."""
    beyond = "" if best is None else interval(run.costs - best.costs)
    success = f"{100.0 * run.success.mean():.0f} %"
    print(f"| {name} | {interval(run.costs)} | {beyond} | {success} |", flush=True)
    return run


def interval(numbers: Floats) -> str:
    """Mean and half of its 95 % interval."""
    half = 1.96 * numbers.std(ddof=1) / np.sqrt(len(numbers))
    return f"{numbers.mean():.1f} ± {half:.1f}"


def searched(task: Task, seconds: float) -> Any:
    """The rule with numbers that a search finds on 48 episodes."""
    ships = ships_of(task, 48, SEARCHED)

    def costs(candidates: Any) -> Floats:
        found = []
        for numbers in candidates:
            ships.seed(SEARCHED)
            found.append(judged(rule_of(task, ships, numbers), ships).costs.mean())
        return np.array(found)

    space = [factor(name, start, step=0.5) for name, start in task.rule.numbers.items()]
    found = search(costs, space, SearchBudget(seconds=seconds))
    print(found.mean)
    return rule_of(task, ships, found.mean)


def learned(ships: Any, seed: int, seconds: float) -> PPO:
    """An agent after so many seconds of processor."""
    scaled = VecNormalize(ships, norm_obs=False, gamma=0.99)
    began = time.process_time()

    def rate(_: float) -> float:
        used = (time.process_time() - began) / seconds
        return 5e-4 * max(1.0 - used, 0.05)

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
    return agent.learn(10**9, lambda *_: time.process_time() - began < seconds)


if __name__ == "__main__":
    main()

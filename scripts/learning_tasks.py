"""Does learning pay in a task? The best rules and the best agents, compared.

    python scripts/learning_tasks.py rudder_roll            search, train, compare
    python scripts/learning_tasks.py rudder_roll --table    print what was found

Each rule's numbers are searched by CMA-ES for so many seconds of processor time, as
often as agents learn, with other seeds. All are judged on the same 100 episodes that
neither has seen. Results: build/learning_tasks/TASK.json. A task is a module in
scripts/learning with its id, `signals` and `RULES`.
"""

from __future__ import annotations

import argparse
import importlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cma
import gymnasium
import numpy as np

from agents.training.plan import make_plan
from agents.training.training import train
from shipgym.arrays import Floats
from shipgym.files import make_folder, read_json, write_json

FOLDER = Path(__file__).parents[1] / "build" / "learning_tasks"
EPISODES, FIRST_SEED = 100, 900_000
SEARCHED, SEARCH_SEED = 48, 1_000
#: What learners share: rollouts small enough for many updates.
PPO = {
    "base": "none",
    "ships": 32,
    "n_steps": 128,
    "batch_size": 256,
    "n_epochs": 8,
    "learning_rate": 7e-4,
    "reward_scale": "running",
    "total_steps": 393_216,
    "evaluate_every": 49_152,
}
#: Learners: algorithm and settings.
AGENTS: dict[str, tuple[str, dict[str, Any]]] = {
    "PPO": ("ppo", PPO),
    "PPO, 4 frames": ("ppo", {**PPO, "frame_stack": 4}),
    "SAC": ("sac", {"base": "none", "total_steps": 50_000}),
}
Law = Callable[[Floats, Any], tuple[Floats, Any]]


def costs(envs: Any, act: Law, seed: int) -> dict[str, Floats]:
    """Cost of an episode in each row, and its parts; `act` takes observations."""
    seen, _ = envs.reset(seed=seed)
    found: dict[str, Floats] = {}
    memory = None
    ended = np.zeros(envs.num_envs, dtype=bool)
    while not ended.all():
        action, memory = act(seen, memory)
        seen, _, terminated, truncated, info = envs.step(action)
        for name, values in info.items():
            if name == "cost" or name.startswith("reward_"):
                part = values if name == "cost" else -values
                found[name] = found.get(name, 0.0) + np.where(ended, 0.0, part)
        ended = ended | terminated | truncated
    return found


def steered(law: Law, envs: Any, signals: Callable[[Floats], Floats]) -> Law:
    """Make a law of signals one of observations and commands."""
    scales = envs.observation_scales
    limit = scales[list(envs.observation_names).index("rudder")]

    def act(seen: Floats, memory: Any) -> tuple[Floats, Any]:
        order, memory = law(signals(seen * scales), memory)
        command = np.clip(order / limit, -1.0, 1.0)
        return command[:, None].astype(np.float32), memory

    return act


def searched(task: Any, rule: Any, seconds: float, seed: int) -> tuple[Floats, int]:
    """Best numbers of a rule, and how many candidates were tried."""
    envs = gymnasium.make_vec(task.ID, num_envs=SEARCHED, autoreset_mode="Disabled")
    start = np.array(rule.start)
    search = cma.CMAEvolutionStrategy(
        start, 0.5, {"seed": seed + 1, "verbose": -9, "maxiter": 100_000}
    )
    began = time.process_time()
    generation = 0
    while time.process_time() - began < seconds:
        candidates = search.ask()
        first = SEARCH_SEED + SEARCHED * (10 * seed + generation % 10)
        found = []
        for numbers in candidates:
            act = steered(rule.make(numbers), envs, task.signals)
            found.append(float(costs(envs, act, first)["cost"].mean()))
        search.tell(candidates, found)
        generation += 1
    return search.result.xfavorite, generation * len(candidates)


def learned(task: Any, name: str, seed: int) -> Law:
    """Agent that has learned, as `costs` takes it."""
    algorithm, settings = AGENTS[name]
    policy = train(make_plan(algorithm, task.ID, seed=seed, settings=settings)).policy

    def act(seen: Floats, memory: Any) -> tuple[Floats, Any]:
        command, memory = policy.predict(seen, memory)
        return command, memory

    return act


def compared(
    task: Any, seeds: int, seconds: float, only: Sequence[str]
) -> dict[str, Any]:
    """Run what is not in the results yet: by name, one entry a seed."""
    path = FOLDER / f"{task.__name__.rpartition('.')[2]}.json"
    make_folder(path.parent)
    found: dict[str, Any] = {}
    if path.exists():
        found = dict(read_json(path, "results", "remove it"))
    envs = gymnasium.make_vec(task.ID, num_envs=EPISODES, autoreset_mode="Disabled")
    for seed in range(seeds):
        for name in only or (*task.RULES, *AGENTS):
            runs = found.setdefault(name, [])
            if len(runs) > seed:
                continue
            began = time.process_time()
            about: dict[str, Any] = {}
            if name in task.RULES:
                rule = task.RULES[name]
                numbers, candidates = searched(task, rule, seconds, seed)
                about = {"numbers": numbers.tolist(), "candidates": candidates}
                act = steered(rule.make(numbers), envs, task.signals)
            else:
                act = learned(task, name, seed)
            about["processor_s"] = round(time.process_time() - began)
            parts = costs(envs, act, FIRST_SEED)
            about |= {part: values.tolist() for part, values in parts.items()}
            runs.append(about)
            write_json(found, path)
            mean = float(np.mean(about["cost"]))
            print(f"{name}, seed {seed}: {mean:.1f}", flush=True)
    return found


def interval(differences: Floats) -> tuple[float, float]:
    """Mean of differences of shape (seeds, episodes), and half their 95 % interval.

    Seeds and episodes are drawn again, as pairs.
    """
    random = np.random.default_rng(0)
    n, m = differences.shape
    means = []
    for _ in range(2000):
        rows = random.integers(n, size=n)
        columns = random.integers(m, size=m)
        means.append(differences[np.ix_(rows, columns)].mean())
    low, high = np.quantile(means, [0.025, 0.975])
    return float(differences.mean()), float(high - low) / 2.0


def table(task: Any, found: dict[str, Any]) -> str:
    """Costs by name, and their difference to the best rule, as Markdown."""
    by_name = {
        name: np.array([run["cost"] for run in runs]) for name, runs in found.items()
    }
    best = min(task.RULES, key=lambda name: by_name[name].mean())
    fewest = min(len(rows) for rows in by_name.values())
    lines = [
        f"| entry, {fewest} seeds | cost | beyond {best} | processor, s |",
        "| --- | --- | --- | --- |",
    ]
    for name, rows in by_name.items():
        mean, half = interval(rows)
        difference, apart = interval(rows[:fewest] - by_name[best][:fewest])
        seconds = np.mean([run["processor_s"] for run in found[name]])
        lines.append(
            f"| {name} | {mean:.1f} ± {half:.1f} | {difference:+.1f} ± {apart:.1f}"
            f" | {seconds:.0f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Compare, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("task", help="module of scripts/learning")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=240.0, help="of a search")
    parser.add_argument("--only", nargs="+", default=(), help="rules and agents")
    parser.add_argument("--table", action="store_true", help="of what was found")
    given = parser.parse_args()
    task = importlib.import_module(f"learning.{given.task}")
    seeds = 0 if given.table else given.seeds
    print(table(task, compared(task, seeds, given.seconds, given.only)))


if __name__ == "__main__":
    main()

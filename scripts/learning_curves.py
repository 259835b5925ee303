"""Learners of stable-baselines3 with their defaults, against classical autopilots.

    python scripts/learning_curves.py                 train what is missing; the table
    python scripts/learning_curves.py --only PPO DQN  some learners
    python scripts/learning_curves.py --table         the table of what was trained

Each run learns on `gymnasium.make` of its id. Its last policy and the autopilot steer
fifty other episodes; the table has the policy's mean cost and rudder travel over the
autopilot's, for each seed. Results: build/default_learners.json.
"""

from __future__ import annotations

import argparse
import time
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from agents.controllers.registry import controller_class
from agents.training.plan import EVALUATION_SEED
from shipgym.files import make_folder, read_json, write_json

FOUND = Path(__file__).parents[1] / "build" / "default_learners.json"
EPISODES = 50


class Learner(NamedTuple):
    """A learner with its defaults on an id, and the autopilot beside it."""

    algorithm: str
    env_id: str
    steps: int
    seeds: int
    autopilot: str = "lq"


LEARNERS = (
    Learner("PPO", "shipgym/CourseKeeping-v0", 65_000, 5),
    Learner("DQN", "shipgym/CourseKeepingDiscrete-v0", 100_000, 3),
    Learner("A2C", "shipgym/CourseKeeping-v0", 65_000, 3),
    Learner("SAC", "shipgym/CourseKeeping-v0", 20_000, 3),
    Learner("TD3", "shipgym/CourseKeeping-v0", 20_000, 3),
    Learner("TQC", "shipgym/CourseKeeping-v0", 20_000, 3),
    Learner("PPO", "shipgym/PathFollowing-v0", 150_000, 3, "wheel-over"),
)


def judged(policy: Any, env_id: str, **keywords: Any) -> dict[str, float]:
    """Mean cost and rudder travel (rad) of an episode, and the share of successes."""
    ships: Any = gymnasium.make_vec(env_id, num_envs=EPISODES, **keywords)
    seen, _ = ships.reset(seed=EVALUATION_SEED)
    sailing = np.ones(EPISODES, dtype=bool)
    costs, travel, successes = np.zeros((3, EPISODES))
    memory, starts = None, sailing
    while sailing.any():
        rudder = ships.physical_state()["delta"]
        actions, memory = policy.predict(seen, memory, starts, deterministic=True)
        seen, _, terminated, truncated, info = ships.step(actions)
        costs += np.where(sailing, info["cost"], 0.0)
        moved = np.abs(ships.physical_state()["delta"] - rudder)
        travel += np.where(sailing, moved, 0.0)
        ended = sailing & (terminated | truncated)
        if ended.any():
            successes += ended & info["is_success"]
        sailing = sailing & ~ended
        starts = np.zeros_like(sailing)
    means = {"cost": costs, "travel": travel, "successes": successes}
    return {name: float(values.mean()) for name, values in means.items()}


def autopilot(learner: Learner) -> dict[str, float]:
    """Judge the classical autopilot of a learner's task."""
    env_id = learner.env_id.replace("Discrete", "")
    model = gymnasium.make(env_id).unwrapped.model  # type: ignore[attr-defined]
    return judged(controller_class(learner.autopilot).from_model(model), env_id)


def trained(learner: Learner, seed: int, **keywords: Any) -> dict[str, Any]:
    """Train as a user types it, and judge the last policy."""
    library = "sb3_contrib" if learner.algorithm == "TQC" else "stable_baselines3"
    kind = getattr(import_module(library), learner.algorithm)
    env = gymnasium.make(learner.env_id, **keywords)
    began = time.process_time()
    agent = kind("MlpPolicy", env, seed=seed).learn(learner.steps)
    seconds = round(time.process_time() - began)
    return {"processor_s": seconds, **judged(agent, learner.env_id, **keywords)}


def table(found: dict[str, Any]) -> str:
    """Table of all runs, in Markdown."""
    lines = [
        "| learner | cost | rudder travel | successes |",
        "| --- | --- | --- | --- |",
    ]
    for learner in LEARNERS:
        name = f"{learner.algorithm}, {learner.env_id.removeprefix('shipgym/')}"
        if name not in found:
            continue
        runs, beside = found[name]["runs"].values(), found[name]["autopilot"]
        row = [f"{name}, {learner.steps:,} steps"]
        for part in ("cost", "travel"):
            row.append(", ".join(f"{run[part] / beside[part]:.2f}" for run in runs))
        row.append(", ".join(f"{run['successes']:.0%}" for run in runs))
        lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def main() -> None:
    """Train what is missing, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    algorithms = sorted({learner.algorithm for learner in LEARNERS})
    parser.add_argument("--only", nargs="+", choices=algorithms, default=algorithms)
    parser.add_argument("--table", action="store_true", help="of what was trained")
    given = parser.parse_args()
    found: dict[str, Any] = {}
    if FOUND.exists():
        found = dict(read_json(FOUND, "results", "remove it"))
    for learner in LEARNERS if not given.table else ():
        if learner.algorithm not in given.only:
            continue
        name = f"{learner.algorithm}, {learner.env_id.removeprefix('shipgym/')}"
        if name not in found:
            found[name] = {"autopilot": autopilot(learner), "runs": {}}
        for seed in map(str, range(learner.seeds)):
            if seed in found[name]["runs"]:
                continue
            run = trained(learner, int(seed))
            print(name, seed, run, flush=True)
            found[name]["runs"][seed] = run
            make_folder(FOUND.parent)
            write_json(found, FOUND)
    print(table(found))


if __name__ == "__main__":
    main()

"""Learning curves of PPO from scratch, with seeds, against classical autopilots.

    python scripts/learning_curves.py              six runs of a minute, and the picture
    python scripts/learning_curves.py --draw       the picture alone
    python scripts/learning_curves.py --defaults   learners of stable-baselines3 with
                                                   their defaults, minutes each; only
                                                   some with their names, such as PPO
    python scripts/learning_curves.py --defaults --draw

The picture is docs/images/learning_curves.png, its data
build/learning_curves.json; of the defaults default_learners.png, and a folder.
Costs are means of a hundred episodes held out, of the defaults of fifty.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np

from agents import IntegralLineOfSight
from agents.controllers.designs import design
from agents.controllers.lq import LQ
from agents.rollouts.rollout import rollout
from agents.training.evaluation import HeldOut
from agents.training.plan import (
    EVALUATION_SEED,
    N_EVALUATIONS,
    TrainingRequest,
    make_plan,
)
from agents.training.training import train
from shipgym.envs.engine import Engine
from shipgym.files import make_folder, read_json, write_json
from shipgym.tasks.task import RUDDER_ORDERS

ROOT = Path(__file__).parents[1]
FOUND, PICTURE = (
    ROOT / "build" / "learning_curves.json",
    ROOT / "docs" / "images" / "learning_curves.png",
)
SEEDS = (0, 1, 2)
#: Classical autopilots by id.
CLASSICAL = {
    "shipgym/CourseKeeping-v0": ("lq",),
    "shipgym/PathFollowing-v0": ("ilos", "wheel-over"),
}
SETTINGS = {"base": "none", "total_steps": 1_000_000, "evaluate_every": 32_768}


def curves() -> dict[str, Any]:
    """Of each id, costs of the classical autopilots and evaluations of the runs."""
    found: dict[str, Any] = (
        dict(read_json(FOUND, "results", "remove it")) if FOUND.exists() else {}
    )
    for env_id, classical in CLASSICAL.items():
        task = make_plan(TrainingRequest("ppo", environment=env_id)).task
        held_out = HeldOut(task, EVALUATION_SEED, N_EVALUATIONS)
        lines = {name: held_out.cost(design(name, task)) for name in classical}
        runs = found.setdefault(
            env_id, {"model": task.model, "classical": lines, "runs": []}
        )["runs"]
        for seed in SEEDS[len(runs) :]:
            before = time.process_time()
            result = train(
                make_plan(
                    TrainingRequest(
                        "ppo", environment=env_id, settings=SETTINGS, seed=seed
                    )
                )
            )
            seconds = time.process_time() - before
            run = {
                "seed": seed,
                "processor_s": round(seconds, 1),
                "best_cost": result.best_cost,
            }
            print(f"{env_id}: {lines}, {run}", flush=True)
            points = [[row["steps"], row["cost"]] for row in result.curve]
            runs.append(run | {"curve": points})
            make_folder(FOUND.parent)
            write_json(found, FOUND)
    return found


def draw(found: dict[str, Any]) -> None:
    """Cost against decisions, a line a seed; classical autopilots are level lines."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, len(found), figsize=(9.0, 3.6), layout="constrained")
    for axis, (env_id, about) in zip(axes, found.items(), strict=True):
        for run in about["runs"]:
            steps, costs = zip(*run["curve"], strict=True)
            axis.plot(
                [step / 1e3 for step in steps],
                costs,
                lw=1.1,
                label=f"PPO, seed {run['seed']}",
            )
        for style, (name, cost) in zip(
            ("-", "--"), about["classical"].items(), strict=False
        ):
            axis.axhline(cost, color="black", lw=1.0, ls=style, label=name)
        axis.set_title(f"{env_id}, {about['model']}", fontsize=9)
        axis.set(xlabel="decisions, thousands", yscale="log")
        axis.set_ylabel("cost of an episode")
        axis.grid(alpha=0.3, which="both")
        axis.legend(fontsize=8)
    figure.savefig(PICTURE, dpi=100, metadata={"Software": None})


class DefaultRun(NamedTuple):
    """A learner of stable-baselines3 with its defaults, on an environment's id."""

    algorithm: str
    env_id: str
    steps: int
    classical: Any  # the autopilot that its cost is compared with


DEFAULTS = (
    DefaultRun("PPO", "shipgym/CourseKeeping-v0", 65_000, LQ),
    DefaultRun("SAC", "shipgym/CourseKeeping-v0", 20_000, LQ),
    DefaultRun("DQN", "shipgym/CourseKeepingDiscrete-v0", 100_000, LQ),
    DefaultRun("PPO", "shipgym/PathFollowing-v0", 150_000, IntegralLineOfSight),
)
DEFAULTS_FOLDER = ROOT / "build" / "default_learners"
DEFAULTS_PICTURE = ROOT / "docs" / "images" / "default_learners.png"
EVALUATIONS = 10  # of each run


class Orders:
    """An agent of discrete rudder orders, whose commands are parts of the limit."""

    def __init__(self, agent: Any) -> None:
        self.agent = agent

    def predict(self, *seen: Any) -> tuple[Any, Any]:
        """Return commands, and no memory."""
        numbers, memory = self.agent.predict(*seen)
        return np.array(RUDDER_ORDERS)[numbers][:, None], memory


def held_out(policy: Any, env: Any) -> dict[str, float]:
    """Mean cost of a policy, and share of episodes that reach the end of their path."""
    seeds = EVALUATION_SEED + np.arange(50)
    engine = Engine(env.model, len(seeds), env.task)
    run = rollout(policy, engine, seeds, record=["success"])
    found = {"cost": float(run.costs.mean())}
    if "success" in run.infos:
        found["arrived"] = float((run.infos["success"] > 0.0).any(axis=0).mean())
    return found


def default_run(asked: DefaultRun, seed: int, env: Any) -> dict[str, Any]:
    """Evaluations of one learner, as a user types it."""
    import stable_baselines3

    kind = getattr(stable_baselines3, asked.algorithm)
    agent = kind("MlpPolicy", asked.env_id, seed=seed)
    policy = Orders(agent) if env.task.action == "rudder-discrete" else agent
    curve: list[dict[str, float]] = []

    def evaluate() -> None:
        evaluation = {"steps": agent.num_timesteps, **held_out(policy, env)}
        print(asked.algorithm, asked.env_id, seed, evaluation, flush=True)
        curve.append(evaluation)

    def after_step(*_: Any) -> bool:
        """Evaluate where it is time to, and go on; the last time is after learning."""
        number = 1 + len(curve)
        due = number * asked.steps // EVALUATIONS
        if number < EVALUATIONS and agent.num_timesteps >= due:
            evaluate()
        return True

    before = time.process_time()
    agent.learn(asked.steps, callback=after_step)
    evaluate()
    seconds = time.process_time() - before
    return {"seed": seed, "processor_s": round(seconds, 1), "curve": curve}


def default_file(asked: DefaultRun, seed: int) -> Path:
    """File of the evaluations of one learner."""
    task = asked.env_id.removeprefix("shipgym/")
    return DEFAULTS_FOLDER / f"{asked.algorithm}-{task}-{seed}.json"


def default_curves(names: list[str]) -> None:
    """Evaluate learners of some algorithms that were not evaluated before."""
    make_folder(DEFAULTS_FOLDER)
    for seed in SEEDS:
        for asked in DEFAULTS:
            file = default_file(asked, seed)
            if file.exists() or asked.algorithm not in names:
                continue
            env: Any = gymnasium.make(asked.env_id).unwrapped
            classical = asked.classical.from_model(env.model)
            cost = held_out(classical, env)["cost"]
            run = default_run(asked, seed, env)
            write_json(run | {"classical": cost}, file)


def evaluated(asked: DefaultRun) -> list[dict[str, Any]]:
    """Evaluations of one learner, of each seed that was run."""
    files = [default_file(asked, seed) for seed in SEEDS]
    found = [file for file in files if file.exists()]
    return [dict(read_json(file, "results", "remove it")) for file in found]


def draw_defaults() -> None:
    """Cost against steps, a line a seed, for each learner that was evaluated."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot as plt

    found = {asked: evaluated(asked) for asked in DEFAULTS}
    found = {asked: runs for asked, runs in found.items() if runs}
    size = (1.0 + 3.2 * len(found), 3.4)
    figure, axes = plt.subplots(
        1, len(found), figsize=size, layout="constrained", squeeze=False
    )
    for axis, (asked, runs) in zip(axes[0], found.items(), strict=True):
        for run in runs:
            steps = [row["steps"] / 1e3 for row in run["curve"]]
            costs = [row["cost"] for row in run["curve"]]
            axis.plot(steps, costs, lw=1.1, label=f"seed {run['seed']}")
            last = run["curve"][-1]
            share = last["cost"] / run["classical"]
            print(asked.algorithm, asked.env_id, run["seed"], last, f"{share:.2f}")
        classical = asked.classical.__name__
        axis.axhline(runs[0]["classical"], color="k", lw=1.0, label=classical)
        axis.set_title(f"{asked.algorithm}, {asked.env_id}", fontsize=8)
        axis.set(xlabel="steps, thousands", yscale="log")
        axis.set_ylabel("cost of an episode")
        axis.grid(alpha=0.3, which="both")
        axis.legend(fontsize=8)
    figure.savefig(DEFAULTS_PICTURE, dpi=100, metadata={"Software": None})


if __name__ == "__main__":
    only_draw = "--draw" in sys.argv
    if "--defaults" in sys.argv:
        algorithms = [asked.algorithm for asked in DEFAULTS]
        named = [name for name in algorithms if name in sys.argv]
        if not only_draw:
            default_curves(named or algorithms)
        draw_defaults()
    else:
        draw(
            dict(read_json(FOUND, "results", "run it without --draw"))
            if only_draw
            else curves()
        )

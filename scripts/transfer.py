"""Transfer: autopilots made on an identified model, run on the ship behind it, beside the same made on her.

    python scripts/transfer.py [TASK ...] --out transfer/    # resumes where it stopped

Tasks are those of `shipgym-v2`: contestants know the identified model and are
evaluated, in the same 100 episodes, on the ship behind her trials. Each is made twice,
alike but for what is known:

    wheel-over     designed on the model, or on the ship
    tuned          the classical controller that cost least on the model, its settings
                   by direct search there, or, with the same budget, on the ship
    ppo            the five agents of `agents/pretrained`, learned over models drawn
                   from the covariance and added to `tuned`; or three learned on the
                   ship, with the same settings, and added to that tuned on her

What one costs on the ship over what its twin costs that knew her is the loss by the
model's error. How large that error is stands beside it: turning circles at 35 deg and
zigzags 15/15 and 25/25, which are in no model's trials, and the factor by which trials
left out widen its standard errors.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from agents.benchmarking.contestants import pretrained
from build_models import COMPARED_DEG, errors
from direct_search import tune
from numpy.typing import NDArray

import shipgym
from agents.agent_file import load_agent
from agents.benchmarking.statistics import Draws, Interval, interval
from agents.controllers.controller import Controller, Policy
from agents.controllers.designs import NO_BASES, design, tuned
from agents.rollouts.metrics import evaluate
from agents.suites.reference import load_tuned
from agents.suites.suite import SETS, BenchmarkTask, load_suite, suite_file
from agents.training import run_folder
from agents.training.plan import TrainingPlan
from agents.training.settings import load_settings
from agents.training.training import train
from shipgym.files import read_json, write_json

Floats = NDArray[np.float64]

SUITE, RUNS = "shipgym-v2", 3
#: One for each kind of model: the ship's own form, with roll, with shaft; another
#: ship's form with a kernel; two trials only; and the control, Nomoto's form for an MMG
#: ship.
TASKS = (
    "sharp-turns",
    "tight-corridor",
    "roll-limit",
    "speed-loss",
    "course-unstable",
    "two-zigzags",
    "nomoto-to-mmg",
)
KINDS = ("on_model", "on_ship", "knowing")
HEAD = (
    "task",
    "model",
    "error: turns, %; overshoots, deg",
    "factor",
    "contestant",
    "made on the model: cost on the model",
    "cost on the ship",
    "made on the ship: cost on the ship",
    "loss, %",
)


@dataclass(frozen=True, eq=False)
class Contestant:
    """What one cost, shape (n_runs, n_episodes)."""

    name: str
    on_model: Floats
    on_ship: Floats
    knowing: Floats  # on the ship, made on the ship

    @property
    def lost(self) -> Interval:
        """What part more it costs on the ship than its twin that knew her, over runs and paired episodes."""
        draws = Draws(1, self.on_ship.shape[1])
        here, there = (
            draws.means(costs, 0, who).mean(axis=1)
            for who, costs in enumerate((self.on_ship, self.knowing))
        )
        return interval(
            float(self.on_ship.mean() / self.knowing.mean() - 1.0), here / there - 1.0
        )


def contestants(task: BenchmarkTask, out: Path, runs: int) -> Iterator[Contestant]:
    """All of one task, each made on the model and on the ship."""
    model, ship = task.design_task, replace(task.design_task, model=task.true_ship)
    pairs: dict[str, tuple[Sequence[Policy], Sequence[Policy]]] = {
        "wheel-over": ([design("wheel-over", model)], [design("wheel-over", ship)])
    }
    known = tuned_on(ship, base_of(task))
    pairs[f"tuned {base_of(task)}"] = ([tuned("base", model, SUITE)], [known])
    base = out / f"{task.name}-tuned.json"
    known.save(base)
    agents = [load_agent(path) for path in pretrained(task.name, "ppo")]
    pairs["ppo"] = (agents, [learned_on(ship, base, seed, out) for seed in range(runs)])
    on_model = load_suite(SUITE).task(task.name + SETS["model"])
    for name, (ours, theirs) in pairs.items():
        yield Contestant(
            name, costs(ours, on_model), costs(ours, task), costs(theirs, task)
        )


def base_of(task: BenchmarkTask) -> str:
    """The kind of controller that cost least on the model, which the agents add to."""
    found = load_tuned(SUITE)[task.name]
    return min(
        (kind for kind in found if kind not in NO_BASES),
        key=lambda kind: float(found[kind]["cost"]),
    )


def tuned_on(task: BenchmarkTask, kind: str) -> Controller:
    """A controller with the suite's search budget on a task; guidance leads the LQ found first."""
    found = read_json(suite_file(SUITE, "tuned"), "tuned settings", "take another copy")
    budget = found["evaluations"], found["episodes"]
    lq = tune("lq", task, None, *budget).settings
    return design(kind, task, tune(kind, task, {"lq": lq}, *budget).settings)


def learned_on(task: BenchmarkTask, base: Path, seed: int, out: Path) -> Policy:
    """One training run, begun, gone on with, or read where it has ended."""
    folder, settings = out / f"{task.name}-{seed}", {"base": str(base)}
    plan = TrainingPlan(
        "ppo",
        task,
        load_settings("ppo", task.environment, task.name, settings),
        seed=seed,
    )
    train(plan, folder, resume=(folder / run_folder.RUN).is_file())
    agent: Policy = load_agent(folder / run_folder.AGENT)
    return agent


def costs(policies: Sequence[Policy], task: BenchmarkTask) -> Floats:
    """Costs of the scored episodes, shape (n_runs, n_episodes)."""
    return np.stack([evaluate(policy, task).figures["cost"] for policy in policies])


def kept(task: BenchmarkTask, out: Path, runs: int) -> list[Contestant]:
    """All of one task, read from the folder where they are there already."""
    file = out / f"{task.name}.json"
    if not file.is_file():
        found = {one.name: one for one in contestants(task, out, runs)}
        parts = {
            name: {kind: getattr(one, kind).tolist() for kind in KINDS}
            for name, one in found.items()
        }
        write_json({"task": task.name, "costs": parts}, file)
    costs = read_json(file, "costs of a task", "delete it")["costs"]
    return [
        Contestant(name, *(np.array(one[kind]) for kind in KINDS))
        for name, one in costs.items()
    ]


def rows(task: BenchmarkTask, found: Sequence[Contestant]) -> Iterator[str]:
    """A line of Markdown for each contestant; what is said of the model stands in the first."""
    model = shipgym.load_model(task.model)
    turn, held_out, _ = errors(model, *COMPARED_DEG)
    factor = (model.provenance or {})["model_error"]["factor"]
    about = (
        task.name,
        f"`{task.model}`",
        f"{turn:.1f}; {held_out:.1f}",
        f"{factor:.1f}",
    )
    for one in found:
        lost = one.lost
        figures = [
            f"{costs.mean():.1f}" for costs in (one.on_model, one.on_ship, one.knowing)
        ]
        figures.append(
            f"{100 * lost.value:.1f} ({100 * lost.low:.1f} to {100 * lost.high:.1f})"
        )
        yield f"| {' | '.join((*about, one.name, *figures))} |"
        about = ("",) * len(about)


def main() -> None:
    """Run the tasks asked for, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("tasks", nargs="*", help=f"by default {', '.join(TASKS)}")
    parser.add_argument("--out", type=Path, default=Path("transfer"))
    parser.add_argument(
        "--runs", type=int, default=RUNS, help="of training on the ship"
    )
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    suite = load_suite(SUITE)
    print(f"| {' | '.join(HEAD)} |\n|{' --- |' * len(HEAD)}")
    for name in asked.tasks or TASKS:
        task = suite.task(name)
        print("\n".join(rows(task, kept(task, asked.out, asked.runs))), flush=True)


if __name__ == "__main__":
    main()

"""Transfer: autopilots made on an identified model against the same made on the ship.

    python scripts/transfer.py [TASK ...] --out transfer/    # resumes where it stopped

Each autopilot of a task of the benchmark is made twice in the same way, and both run
the same 100 episodes on the ship:

    wheel-over     designed on the model, or on the ship
    tuned          the classical controller that cost least on the model, its settings
                   searched there, or, with the same budget, on the ship
    ppo            the five agents of `agents/pretrained`, learned over models drawn
                   from the covariance and added to `tuned`; or three learned on the
                   ship, with the same settings, and added to that tuned on her

The difference in cost on the ship is the loss due to the model's error. How large that
error is stands beside it: turning circles at 35 deg and zigzags 15/15 and 25/25, which
are in no model's trials, and the factor by which trials left out widen its standard
errors.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from build_models import COMPARED_DEG, errors

import shipgym
from agents.agent_file import load_agent
from agents.benchmarking.sources import pretrained
from agents.benchmarking.statistics import ConfidenceInterval, Draws, interval
from agents.controllers.controller import Controller
from agents.controllers.designs import NO_BASES, design, tuned
from agents.controllers.interface import Policy
from agents.rollouts.metrics import evaluate
from agents.suites.reference import load_tuned
from agents.suites.suite import DEFAULT_SUITE, BenchmarkTask, load_suite, suite_file
from agents.training import run_folder
from agents.training.controller_search import SearchBudget, tune_controller
from agents.training.plan import TrainingPlan
from agents.training.settings import load_settings
from agents.training.training import train
from shipgym.arrays import Floats
from shipgym.files import read_json, write_json

RUNS = 3  # of training on the ship
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
HEADS = (
    "task",
    "model",
    "error: turns, %; overshoots, deg",
    "factor",
    "controller",
    "made on the model: cost on the model",
    "cost on the ship",
    "made on the ship: cost on the ship",
    "loss, %",
)


@dataclass(frozen=True, eq=False)
class Transfer:
    """Costs of a controller, each of shape (n_runs, n_episodes)."""

    on_model: Floats  # made on the model
    on_ship: Floats
    made_on_ship: Floats  # on the ship

    @property
    def loss(self) -> ConfidenceInterval:
        """Share that the controller made on the model costs more on the ship."""
        draws = Draws(1, self.on_ship.shape[1])
        ours = draws.means(self.on_ship, 0, 0).mean(axis=1)
        theirs = draws.means(self.made_on_ship, 0, 1).mean(axis=1)
        loss = self.on_ship.mean() / self.made_on_ship.mean() - 1.0
        return interval(float(loss), ours / theirs - 1.0)


def main() -> None:
    """Run the tasks asked for, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("tasks", nargs="*", help=f"by default {', '.join(TASKS)}")
    parser.add_argument("--out", type=Path, default=Path("transfer"))
    parser.add_argument(
        "--runs",
        type=int,
        default=RUNS,
        help="of training on the ship; 0 leaves the agents out",
    )
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print(f"| {' | '.join(HEADS)} |\n|{' --- |' * len(HEADS)}")
    for name in arguments.tasks or TASKS:
        transfers = kept_transfers(name, arguments.out, arguments.runs)
        print("\n".join(rows(name, transfers)), flush=True)


def kept_transfers(name: str, out: Path, runs: int) -> dict[str, Transfer]:
    """Costs of all controllers of a task, read from the folder if they are there."""
    file = out / f"{name}.json"
    if not file.is_file():
        costs = {}
        for controller, transfer in run_transfers(name, out, runs):
            parts = vars(transfer).items()
            costs[controller] = {part: values.tolist() for part, values in parts}
        write_json({"task": name, "costs": costs}, file)
    content = read_json(file, "costs of a task", "delete it")["costs"]
    transfers = {}
    for controller, parts in content.items():
        arrays = {part: np.array(values) for part, values in parts.items()}
        transfers[controller] = Transfer(**arrays)
    return transfers


def run_transfers(name: str, out: Path, runs: int) -> Iterator[tuple[str, Transfer]]:
    """Make all controllers of a task on the model and on the ship, and run them."""
    on_ship, on_model, *_ = load_suite().select(name)
    model = on_ship.design_task
    ship = replace(model, model=on_ship.true_ship)

    def transfer(ours: Sequence[Policy], theirs: Sequence[Policy]) -> Transfer:
        return Transfer(
            on_model=costs(ours, on_model),
            on_ship=costs(ours, on_ship),
            made_on_ship=costs(theirs, on_ship),
        )

    wheel_over = transfer([design("wheel-over", model)], [design("wheel-over", ship)])
    yield "wheel-over", wheel_over

    base = base_of(model)
    tuned_on_ship = tune_on(ship, base)
    yield (
        f"tuned {base}",
        transfer([tuned("base", model, DEFAULT_SUITE)], [tuned_on_ship]),
    )

    if runs == 0:
        return
    base_file = out / f"{name}-tuned.json"
    tuned_on_ship.save(base_file)
    agents = [load_agent(path) for path in pretrained(name, "ppo")]
    learned = [learn_on(ship, base_file, seed, out) for seed in range(runs)]
    yield "ppo", transfer(agents, learned)


def base_of(task: BenchmarkTask) -> str:
    """Kind of the controller that cost least on the model, which the agents add to."""
    found = load_tuned(DEFAULT_SUITE)[task.name]
    bases = [kind for kind in found if kind not in NO_BASES]
    return min(bases, key=lambda kind: float(found[kind]["cost"]))


def tune_on(task: BenchmarkTask, kind: str) -> Controller:
    """Tune a controller with the suite's search budget."""
    path = suite_file(DEFAULT_SUITE, "tuned")
    kept = read_json(path, "tuned settings", "take another copy")
    budget = SearchBudget(seconds=kept["seconds"], episodes=kept["episodes"])
    found = tune_controller(kind, task, budget)
    return design(kind, task, found.settings)


def learn_on(task: BenchmarkTask, base: Path, seed: int, out: Path) -> Policy:
    """One training run, begun, gone on with, or read where it has ended."""
    folder = out / f"{task.name}-{seed}"
    own = {"base": str(base)}
    settings = load_settings("ppo", task.environment, task.name, own)
    plan = TrainingPlan("ppo", task, settings, seed=seed)
    train(plan, folder, resume=(folder / run_folder.RUN).is_file())
    return load_agent(folder / run_folder.AGENT)


def costs(policies: Sequence[Policy], task: BenchmarkTask) -> Floats:
    """Costs of the scored episodes, shape (n_runs, n_episodes)."""
    return np.stack([evaluate(policy, task).figures["cost"] for policy in policies])


def rows(name: str, transfers: Mapping[str, Transfer]) -> Iterator[str]:
    """Lines of Markdown, one a controller; the model's error stands in the first."""
    task = load_suite().task(name)
    model = shipgym.load_model(task.model)
    turn, overshoot, _ = errors(model, *COMPARED_DEG)
    factor = (model.provenance or {})["model_error"]["factor"]
    about = (
        name,
        f"`{task.model}`",
        f"{turn:.1f}; {overshoot:.1f}",
        f"{factor:.1f}",
    )
    for controller, transfer in transfers.items():
        loss, low, high = (100.0 * share for share in transfer.loss)
        figures = [f"{values.mean():.1f}" for values in vars(transfer).values()]
        figures.append(f"{loss:.1f} ({low:.1f} to {high:.1f})")
        yield f"| {' | '.join((*about, controller, *figures))} |"
        about = ("",) * len(about)


if __name__ == "__main__":
    main()

"""Transfer: autopilots learned and tuned on an identified model, run on the ship behind its trials.

    python scripts/transfer.py [TASK ...] --out transfer/    # 5 training runs each; resumes where it stopped

A task of the suite is taken as it is but for the ship. Contestants know what can be known of her:

    tuned          the best classical controller, settings found by direct search on the identified model
    identified     learned in the identified model, added to the controller tuned there
    covariance     the same, learned in models drawn from its estimated covariance, a new one each episode
    reference      tuned and learned on the ship behind the trials: what knowing her would have brought

and all sail, in the same episodes, the identified model, the ship behind its trials and, where there is one,
a model of the same ship identified from measurements. The measurements of KVLCC2 lie beside the checkout;
without them there is no such model.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from direct_search import tune
from numpy.typing import NDArray
from real_ships.data import Data
from real_ships.recipe import fitted

from agents.agent_file import load_agent
from agents.benchmarking.statistics import Draws, Interval, interval, mean_cost
from agents.cli.terminal import progress_bars
from agents.controllers.controller import Controller, Policy
from agents.controllers.designs import design
from agents.engines.jobs import run_jobs
from agents.rollouts.metrics import evaluate
from agents.suites.suite import BenchmarkTask, load_suite
from agents.training.plan import Plan
from agents.training.settings import load_settings
from agents.training.training import train
from shipgym import InputError, ShipModel, load_model
from shipgym.checks import check_whole
from shipgym.files import write_json
from shipgym.ships.scaling import scale_model

ROOT = Path(__file__).parents[1]
Floats = NDArray[np.float64]

IDENTIFIED, COVARIANCE, REFERENCE, TUNED = "identified", "covariance", "reference", "tuned"
LEARNERS = (IDENTIFIED, COVARIANCE, REFERENCE)
N_RUNS = 5
CLASSICAL = ("pid", "lq", "lqg", "ilos")
#: Task whose settings of PPO all cases are learned with.
SETTINGS_OF = "container-path"
#: Tasks of the suite, and the identified model of their ship.
CASES = {
    "mariner-sharp-turns": "mariner-tls-svm",
    "mariner-current": "mariner-tls-svm",
    "container-path": "container-abc-lssvr",
    "kvlcc2-sharp-turns": "kvlcc2-rm-svm",
}


@dataclass(frozen=True, eq=False)
class TransferCase:
    """One task and the ships that sail it.

    Attributes
    ----------
    task : BenchmarkTask
        With the ship behind the trials.
    identified : str
        Name of the model identified from her trials.
    others : dict of str to ShipModel
        Further ships, such as one identified from measurements.
    """

    task: BenchmarkTask
    identified: str
    others: Mapping[str, ShipModel] = field(default_factory=dict)

    def learned_in(self, learner: str) -> BenchmarkTask:
        """The task in which a learner learns."""
        if learner == REFERENCE:
            return self.task
        uncertain = {"model_uncertainty": "covariance"} if learner == COVARIANCE else {}
        options = {**self.task.options, **uncertain}
        name = f"{self.task.name}-{learner}"
        return BenchmarkTask(name, self.task.environment, self.identified, self.task.why, options)

    @property
    def ships(self) -> dict[str, ShipModel]:
        """All of them, by what they are."""
        return {IDENTIFIED: load_model(self.identified), REFERENCE: self.task.ship, **self.others}


@dataclass(frozen=True, eq=False)
class Transfer:
    """What the contestants cost in one case.

    Attributes
    ----------
    case : TransferCase
    costs : dict of str to dict of str to array of shape (n_runs, n_episodes)
        By contestant and ship.
    """

    case: TransferCase
    costs: Mapping[str, Mapping[str, Floats]]

    def cost(self, contestant: str, ship: str) -> Interval:
        """Mean cost with its interval over training runs and episodes."""
        costs = self.costs[contestant][ship]
        return mean_cost(costs, Draws(1, costs.shape[1]), 0)

    def gain(self, contestant: str, ship: str) -> Interval:
        """How much less a contestant costs than the tuned classical one on the same ship, a part of that."""
        return self._paired(ship, contestant, lambda own, tuned: 1.0 - own / tuned, TUNED)

    def gain_kept(self, contestant: str, ship: str = REFERENCE) -> float:
        """Gain on a ship over that on the identified model, where it was learned."""
        there = self.gain(contestant, IDENTIFIED).value
        return self.gain(contestant, ship).value / there if there > 0.0 else np.nan

    def _paired(self, ship: str, contestant: str, compare: Callable[[Any, Any], Any], other: str) -> Interval:
        """A comparison of mean costs of two contestants in the same episodes."""
        own, against = self.costs[contestant][ship], self.costs[other][ship]
        draws = Draws(1, own.shape[1])
        drawn = [draws.means(costs, 0, who).mean(axis=1) for who, costs in enumerate((own, against))]
        return interval(float(compare(own.mean(), against.mean())), compare(*drawn))


def transfer_case(name: str, others: Mapping[str, ShipModel] | None = None) -> TransferCase:
    """One of `CASES` by the name of its task."""
    return TransferCase(load_suite().task(name), CASES[name], others or {})


def transfer(
    case: TransferCase,
    out: str | Path,
    *,
    n_runs: int = N_RUNS,
    learners: Sequence[str] = LEARNERS,
    settings: Mapping[str, Any] | None = None,
    engine: str = "local",
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Transfer:
    """Learn, tune and run one case.

    Parameters
    ----------
    case : TransferCase
    out : str or Path
        Folder of the training runs; what is there already is not learned again.
    n_runs : int
        Training runs of each learner, with seeds from 0 on.
    learners : sequence of str
        Of `LEARNERS`.
    settings : mapping, optional
        Of PPO, in place of those of `SETTINGS_OF`.
    engine, workers
        See `agents.engines.jobs.run_jobs`.
    progress : callable, optional
        Told the number of training runs done and their total.

    Returns
    -------
    Transfer
        The same for the same arguments, whatever was done at once.
    """
    check_whole(n_runs, "n_runs", at_least=1)
    folder = Path(out)
    tuned = _tuned(case, folder, engine, workers)
    file = folder / f"{case.task.name}-tuned.json"
    tuned.save(file)
    own = {learner: {"base": str(file), **(settings or {})} for learner in learners}
    if REFERENCE in own:  # who knows the ship tunes on her
        own[REFERENCE] |= {"base": "tuned"}
    jobs = [
        {
            **_identity(case), "learner": learner, "seed": seed, "settings": own[learner],
            "out": str(folder / f"{case.task.name}-{learner}-{seed}"),
        }
        for learner in learners
        for seed in range(n_runs)
    ]  # fmt: skip
    files = run_jobs(learn, jobs, engine=engine, workers=workers, keep=folder / "jobs", progress=progress)
    found: dict[str, dict[str, Floats]] = {TUNED: _costs([tuned], case)}
    for k, learner in enumerate(learners):
        runs = files[k * n_runs : (k + 1) * n_runs]
        found[learner] = _costs([load_agent(file) for file in runs], case)
    return Transfer(case, found)


def learn(job: dict[str, Any]) -> str:
    """One training run, begun or gone on with; returns the file of its agent."""
    case = _case(job)
    task = case.learned_in(job["learner"])
    settings = load_settings("ppo", task.environment, SETTINGS_OF, job["settings"])
    folder = Path(job["out"])
    train(Plan("ppo", task, settings, seed=job["seed"]), folder, resume=folder.exists())
    return str(folder / "agent.json")


def _tuned(case: TransferCase, folder: Path, engine: str, workers: int) -> Controller:
    """The best classical controller on the identified model."""
    searches = [{**_identity(case), "kind": kind} for kind in CLASSICAL]
    found = run_jobs(tune_one, searches, engine=engine, workers=workers, keep=folder / "searches")
    best = min(found, key=lambda result: float(result["cost"]))
    return design(best["kind"], case.learned_in(IDENTIFIED), best["settings"])


def tune_one(job: dict[str, Any]) -> dict[str, Any]:
    """Direct search of one classical controller on the identified model."""
    found = tune(job["kind"], _case(job).learned_in(IDENTIFIED))
    return {"kind": job["kind"], "settings": found.settings, "cost": found.cost}


def _identity(case: TransferCase) -> dict[str, str]:
    return {"case": case.task.name, "identified": case.identified}


def _case(job: Mapping[str, Any]) -> TransferCase:
    return TransferCase(load_suite().task(job["case"]), job["identified"])


def _costs(policies: Sequence[Policy], case: TransferCase) -> dict[str, Floats]:
    """Costs of the scored episodes on every ship, each of shape (n_runs, n_episodes)."""
    return {
        ship: np.stack([evaluate(policy, case.task, model=model).figures["cost"] for policy in policies])
        for ship, model in case.ships.items()
    }


def save_transfer(result: Transfer, path: str | Path) -> None:
    """Write costs of all episodes, and what follows from them, as JSON."""
    ships = list(result.case.ships)
    write_json(
        {
            "format": 1,
            "task": result.case.task.name,
            "identified": result.case.identified,
            "ships": ships,
            "contestants": {
                who: {
                    ship: {
                        "cost": result.cost(who, ship).to_dict(),
                        "gain": result.gain(who, ship).to_dict(),
                        "runs": result.costs[who][ship].mean(axis=1).tolist(),
                        "episodes": result.costs[who][ship].tolist(),
                    }
                    for ship in ships
                }
                for who in result.costs
            },
        },
        Path(path),
    )


@cache
def measured(data: Path) -> dict[str, ShipModel]:
    """KVLCC2 as identified from HSVA's measured zigzags, at full scale; nothing without the measurements."""
    try:
        ship = Data(ROOT / "tests" / "ships", data).ship("kvlcc2_hsva", 20)
    except InputError:
        return {}
    model = fitted(ship, tuple(sorted(ship.runs)))
    return {"measured": scale_model(model, load_model("kvlcc2").particulars["length"])}


def table(result: Transfer) -> str:
    """Costs of one case as Markdown: contestants down, ships across."""
    ships = list(result.case.ships)
    head = [
        "learned or tuned in",
        *(f"cost, {ship}" for ship in ships),
        "gain, identified",
        "gain, reference",
        "kept",
    ]
    rows = [head, ["---"] * len(head)]
    for who in result.costs:
        costs = [result.cost(who, ship) for ship in ships]
        gains = [result.gain(who, ship) for ship in ("identified", "reference")]
        cells = [f"{cost.value:.1f} ({cost.low:.1f} to {cost.high:.1f})" for cost in costs]
        cells += [f"{100 * gain.value:.1f} %" for gain in gains]
        kept = result.gain_kept(who)
        rows.append([who, *cells, f"{100 * kept:.0f} %" if np.isfinite(kept) else ""])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def main() -> None:
    """Run the cases asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tasks", nargs="*", help=f"some of {', '.join(CASES)}; by default all")
    parser.add_argument("--out", type=Path, default=ROOT / "transfer")
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--runs", type=int, default=N_RUNS)
    parser.add_argument("--total-steps", type=int, default=400_000, help="of each training run")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    for task in options.tasks or CASES:
        with progress_bars(True) as bars:
            tell = None if bars is None else partial(bars, task)
            case = transfer_case(task, measured(options.data) if task.startswith("kvlcc2") else {})
            result = transfer(
                case, options.out, n_runs=options.runs, settings={"total_steps": options.total_steps},
                workers=options.workers, progress=tell,
            )  # fmt: skip
        save_transfer(result, options.out / f"{task}.json")
        print(f"## {task}\n\n{table(result)}\n", flush=True)


if __name__ == "__main__":
    main()

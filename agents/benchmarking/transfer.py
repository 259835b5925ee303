"""Transfer: autopilots learned and tuned on an identified model, flown on the ship behind its trials.

A task of the suite is taken as it is but for the ship. Contestants know what can be known of her:

    tuned          the best classical controller, settings found by direct search on the identified model
    identified     learned in the identified model, added to the controller tuned there
    posterior      the same, learned in models drawn from its covariance, a new one each episode
    reference      tuned and learned on the ship behind the trials: what knowing her would have brought

and all fly, in the same episodes, on the identified model, on the ship behind its trials and, where there is
one, on a model of the same ship identified from measurements.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.benchmarking.direct_search import tune
from agents.benchmarking.statistics import Draws, Interval, interval, mean_cost
from agents.controllers.controller import Controller, Policy
from agents.controllers.designs import design
from agents.engines.jobs import run_jobs
from agents.rollouts.metrics import evaluate
from agents.suites.suite import BenchmarkTask, load_suite
from shipgym.checks import check_whole
from shipgym.json_file import write_json
from shipgym.ships import ShipModel, load_model

Floats = NDArray[np.float64]

LEARNERS = ("identified", "posterior", "reference")
IDENTIFIED, REFERENCE, TUNED = "identified", "reference", "tuned"
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
    """One task and the ships that it is flown with.

    Attributes
    ----------
    task : BenchmarkTask
        With the ship behind the trials.
    identified : str
        Name of the model identified from her trials.
    others : dict of str to ShipModel
        Further ships to fly on, such as one identified from measurements.
    """

    task: BenchmarkTask
    identified: str
    others: Mapping[str, ShipModel] = field(default_factory=dict)

    def learned_in(self, learner: str) -> BenchmarkTask:
        """The task as a learner meets it."""
        if learner == REFERENCE:
            return self.task
        uncertain = {"model_uncertainty": "posterior"} if learner == "posterior" else {}
        options = {**self.task.options, **uncertain}
        name = f"{self.task.name}-{learner}"
        return BenchmarkTask(name, self.task.environment, self.identified, self.task.why, options)

    @property
    def ships(self) -> dict[str, ShipModel]:
        """Those that are flown, by what they are."""
        return {IDENTIFIED: load_model(self.identified), REFERENCE: self.task.ship, **self.others}


@dataclass(frozen=True, eq=False)
class Transfer:
    """What was flown in one case.

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

    def loss(self, contestant: str, ship: str = REFERENCE) -> Interval:
        """How much more a contestant costs on a ship than what was learned on her, as a part of that."""
        return self._paired(ship, contestant, lambda own, known: own / known - 1.0, REFERENCE)

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
    """Learn, tune and fly one case.

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
    from agents.agent_file import load_agent

    found: dict[str, dict[str, Floats]] = {TUNED: _flown([tuned], case)}
    for k, learner in enumerate(learners):
        runs = files[k * n_runs : (k + 1) * n_runs]
        found[learner] = _flown([load_agent(file) for file in runs], case)
    return Transfer(case, found)


def learn(job: dict[str, Any]) -> str:
    """One training run, begun or gone on with; returns the file of its agent."""
    from agents.training.plan import Plan
    from agents.training.settings import load_settings
    from agents.training.training import train

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


def _flown(policies: Sequence[Policy], case: TransferCase) -> dict[str, Floats]:
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

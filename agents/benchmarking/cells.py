"""Cells of a benchmark: one controller in one task, all of its training runs."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from types import NoneType
from typing import Any, Self

import numpy as np

from agents.benchmarking.entries import Entry
from agents.benchmarking.sources import BEST_KNOWN, file_hash, policy_hash
from agents.controllers.interface import Policy
from agents.suites.reference import best_costs
from agents.suites.suite import BenchmarkTask
from shipgym.arrays import Floats
from shipgym.checks import ANY_KEY, Shape, check_shape
from shipgym.errors import InputError

RUN: Shape = {
    "figures": {ANY_KEY: (np.ndarray,)},
    "failure": (str,),
    "seconds_per_action": (int, float),
    "policy_sha256": (str, NoneType),
}
CELL: Shape = {"refused": (str,), "runs": [RUN]}


@dataclass(frozen=True, eq=False)
class ScoredRun:
    """Scored episodes of one training run; a controller that does not learn has one.

    Attributes
    ----------
    figures : mapping of str to array of shape (n_episodes,)
        Figures of each episode by name (`agents.rollouts.metrics`).
    failure : str
        How the controller failed first; empty if it did not.
    seconds_per_action : float
        Processor time of a command.
    policy_sha256 : str or None
        Hash of the controller's file; None for one that has no file.
    """

    figures: Mapping[str, Floats]
    failure: str = ""
    seconds_per_action: float = np.nan
    policy_sha256: str | None = None


@dataclass(frozen=True, eq=False)
class Cell:
    """One controller in one task.

    Attributes
    ----------
    runs : sequence of ScoredRun
        None where it could not run the task.
    refused : str
        Why it could not; empty if it could.
    """

    runs: Sequence[ScoredRun] = ()
    refused: str = ""

    @property
    def costs(self) -> Floats:
        """Cost of each episode, shape (n_runs, n_episodes)."""
        return np.stack([run.figures["cost"] for run in self.runs])

    def count(self, figure: str) -> int:
        """Return the number of episodes in which a figure is true."""
        counts = [np.nansum(run.figures.get(figure, 0.0)) for run in self.runs]
        return int(sum(counts))

    def values(self, figure: str) -> Floats:
        """Return a figure of all episodes that have it."""
        values = np.concatenate([run.figures[figure] for run in self.runs])
        finite: Floats = values[np.isfinite(values)]
        return finite

    @classmethod
    def from_dict(cls, content: Any, n_episodes: int, where: str) -> Self:
        """Read the result of `run_job`, which may have been kept in a file.

        Raises InputError, beginning with `where`, if it is not of so many episodes.
        """
        check_shape(content, CELL, where)
        runs = [ScoredRun(**run) for run in content["runs"]]
        for run in runs:
            same_figures = run.figures.keys() == runs[0].figures.keys()
            if not same_figures or not _has_figures(run, n_episodes):
                raise InputError(
                    f"{where}: expected cost and other figures of {n_episodes} episodes"
                )
        return cls(runs, content["refused"])


def _has_figures(run: ScoredRun, n_episodes: int) -> bool:
    """Return whether a run has costs, and only numbers of so many episodes."""
    if "cost" not in run.figures:
        return False
    for figure in run.figures.values():
        if figure.dtype.kind not in "bif" or figure.shape != (n_episodes,):
            return False
    return True


#: Names of the controller and the task of a cell.
CellName = tuple[str, str]
Cells = Mapping[CellName, Cell]


def run_cell(entry: Entry, task: BenchmarkTask, n_episodes: int) -> Cell:
    """Run the first scored episodes of a task with every training run of an entry."""
    try:
        if entry.source == BEST_KNOWN:
            costs = best_costs(task)[:n_episodes]
            return Cell([ScoredRun({"cost": costs})])
        policies = entry.policies(task)
    except InputError as error:
        return Cell(refused=str(error))
    except Exception as error:
        if entry.is_text and not entry.is_code:
            raise
        # a user's own function may raise anything
        return Cell(refused=f"{type(error).__name__}: {error}")
    return Cell([_run(policy, task, n_episodes) for policy in policies])


def _run(policy: Policy, task: BenchmarkTask, n_episodes: int) -> ScoredRun:
    from agents.rollouts.metrics import evaluate  # whoever shares work out does without

    evaluation = evaluate(policy, task, task.seeds[:n_episodes])
    return ScoredRun(
        figures=evaluation.figures,
        failure=evaluation.run.failure,
        seconds_per_action=evaluation.run.seconds_per_action,
        policy_sha256=policy_hash(policy),
    )


def job_of(entry: Entry, task: BenchmarkTask, n_episodes: int) -> dict[str, Any]:
    """Return the job of a cell; it names all that the result depends on."""
    task_files = {str(path): file_hash(path) for path in task.files}
    return {
        "task": task.to_dict(),
        "entry": entry.name,
        "source": entry.source,
        "files": {**entry.fingerprint(task), **task_files},
        "episodes": n_episodes,
    }


def run_job(job: dict[str, Any]) -> dict[str, Any]:
    """Do a job of `job_of`, in any process; `Cell.from_dict` reads the result."""
    entry = Entry(job["entry"], job["source"])
    task = BenchmarkTask.from_dict(job["task"])
    return asdict(run_cell(entry, task, job["episodes"]))

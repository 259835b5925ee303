"""Cells of a benchmark: one controller in one task, all of its training runs."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Self

import numpy as np
import pandas as pd

from agents.benchmarking.entries import Entry, file_hash
from agents.suites.suite import FIRST_SEED, BenchmarkTask
from shipgym.arrays import Floats
from shipgym.checks import check_table
from shipgym.errors import InputError

#: Types of a cell's fields in a file.
CELL = {
    "refused": str,
    "figures": dict,
    "failure": str,
    "seconds_per_action": int | float,
}


@dataclass(frozen=True, eq=False)
class Cell:
    """One controller in one task.

    Attributes
    ----------
    refused : str
        Why it could not run the task; empty if it could.
    figures : mapping of str to array of shape (n_runs, n_episodes)
        Figures of each episode by name (`agents.rollouts.metrics`), for each training
        run; a controller that does not learn has one.
    failure : str
        How the controller failed first; empty if it did not.
    seconds_per_action : float
        Processor time of a command, mean over the runs.
    """

    refused: str = ""
    figures: Mapping[str, Floats] = field(default_factory=dict)
    failure: str = ""
    seconds_per_action: float = np.nan

    @property
    def costs(self) -> Floats:
        """Cost of each episode, shape (n_runs, n_episodes); no runs where refused."""
        return self.figures.get("cost", np.zeros((0, 0)))

    def table(self, controller: str, task: str) -> pd.DataFrame:
        """Return a row for each run and episode, with its seed."""
        n_runs, n_episodes = self.costs.shape
        keys = {
            "controller": controller,
            "task": task,
            "run": np.repeat(np.arange(n_runs), n_episodes),
            "seed": np.tile(FIRST_SEED + np.arange(n_episodes), n_runs),
        }
        figures = {name: values.ravel() for name, values in self.figures.items()}
        return pd.DataFrame({**keys, **figures})

    @classmethod
    def from_dict(cls, content: Any, n_episodes: int, where: str) -> Self:
        """Read the result of `run_job`, which may have been kept in a file.

        Raises InputError, beginning with `where`, if it is not of so many episodes.
        """
        table = check_table(content, where, CELL, CELL)
        cell = cls(**table)
        needed = {"cost", "terminated", "failed"}
        whole = all(isinstance(table[name], kind) for name, kind in CELL.items())
        whole = whole and (bool(cell.refused) or needed <= cell.figures.keys())
        if whole and cell.figures:
            arrays = [np.asarray(values) for values in cell.figures.values()]
            n_runs = len(arrays[0]) if arrays[0].ndim else 0
            for array in arrays:
                is_number = array.dtype.kind in "bif"
                whole = whole and is_number and array.shape == (n_runs, n_episodes)
        if not whole:
            raise InputError(
                f"{where}: expected cost and other figures of {n_episodes} episodes"
            )
        return cell


#: Names of the controller and the task of a cell.
CellName = tuple[str, str]
Cells = Mapping[CellName, Cell]


def run_cell(entry: Entry, task: BenchmarkTask, n_episodes: int) -> Cell:
    """Run the first scored episodes of a task with every training run of an entry."""
    from agents.rollouts.metrics import evaluate  # whoever shares work out does without

    try:
        policies = entry.policies(task)
    except InputError as error:
        return Cell(refused=str(error))
    except Exception as error:
        if entry.is_text and not entry.is_code:
            raise
        # a user's own function may raise anything
        return Cell(refused=f"{type(error).__name__}: {error}")

    seeds = task.seeds[:n_episodes]
    sailed = [evaluate(policy, task, seeds) for policy in policies]
    figures = {}
    for name in sailed[0].figures:
        figures[name] = np.stack([one.figures[name] for one in sailed])
    failures = [one.run.failure for one in sailed if one.run.failure]
    seconds = [one.run.seconds_per_action for one in sailed]
    return Cell(
        figures=figures,
        failure=failures[0] if failures else "",
        seconds_per_action=float(np.mean(seconds)),
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

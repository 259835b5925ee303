"""Cells of a benchmark: one entry in one task, all of its runs and sets of episodes."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from agents.benchmarking.entries import Entry, file_hash, names_code
from agents.rollouts.metrics import evaluate
from agents.suites.benchmark_task import BenchmarkTask, judging_seeds
from shipgym.arrays import Floats
from shipgym.errors import InputError
from shipgym.python_files import told

Figures = dict[str, Floats]


class Options(NamedTuple):
    """What all entries of a benchmark have in common.

    Attributes
    ----------
    episodes : int
        Episodes of each set.
    seed : int
        Which episodes: each seed has others.
    runs : int
        How often an entry that searches or learns is made.
    budget : float
        Most ship steps that making a run may take.
    """

    episodes: int
    seed: int
    runs: int
    budget: float


@dataclass(frozen=True, eq=False)
class Cell:
    """One entry in one task.

    Attributes
    ----------
    refused : str
        Why it could not run the task; empty if it could.
    figures : mapping of str to mapping
        By set of episodes, figures of each episode by name (`agents.rollouts.metrics`),
        each of shape (n_runs, n_episodes).
    failures : mapping of str to str
        By set of episodes, how the controller failed first, if it did.
    ship_steps, seconds : float
        Steps of simulated ships, and processor time, that making a run took.
    """

    refused: str = ""
    figures: Mapping[str, Figures] = field(default_factory=dict)
    failures: Mapping[str, str] = field(default_factory=dict)
    ship_steps: float = 0.0
    seconds: float = 0.0

    def table(self, controller: str, task: str, options: Options) -> pd.DataFrame:
        """Return a row for each set, run and episode, with its seed."""
        tables = []
        for on, figures in self.figures.items():
            n_runs, n_episodes = figures["cost"].shape
            seeds = judging_seeds(on, options.episodes, options.seed)
            columns = {
                "controller": controller,
                "task": task,
                "set": on,
                "run": np.repeat(np.arange(n_runs), n_episodes),
                "seed": np.tile(seeds, n_runs),
            }
            columns |= {name: values.ravel() for name, values in figures.items()}
            tables.append(pd.DataFrame(columns))
        return pd.concat(
            tables,
            ignore_index=True,
        )


#: Every cell by the names of its entry and its task.
Cells = Mapping[tuple[str, str], Cell]


def run_cell(entry: Entry, task: BenchmarkTask, options: Options) -> Cell:
    """Make an entry for a task and steer all sets of episodes with each of its runs."""
    try:
        made = entry.made(task, options.runs, options.budget)
    except InputError as error:
        return Cell(refused=str(error))
    except Exception as error:
        if entry.is_text and not names_code(entry.source):
            raise
        # a user's own function may raise anything
        return Cell(refused=told(error))

    figures: dict[str, Figures] = {}
    failures: dict[str, str] = {}
    for on in task.sets:
        seeds = judging_seeds(on, options.episodes, options.seed)
        sailed = [evaluate(policy, task, seeds, on) for policy in made.policies]
        figures[on] = {
            name: np.stack([found[name] for found, _ in sailed])
            for name in sailed[0][0]
        }
        for _, run in sailed:
            if run.failure:
                failures.setdefault(on, run.failure)
    return Cell(
        figures=figures,
        failures=failures,
        ship_steps=made.ship_steps,
        seconds=made.seconds,
    )


def job_of(entry: Entry, task: BenchmarkTask, options: Options) -> dict[str, Any]:
    """Return the job of a cell; it names all that the result depends on."""
    return {
        "task": task.to_dict(),
        "entry": entry.name,
        "source": entry.source,
        "files": {
            **entry.fingerprint(task),
            **{str(path): file_hash(path) for path in task.files},
        },
        "options": options._asdict(),
    }


def read_cell(result: dict[str, Any]) -> Cell:
    """Return the cell of a job's result, whose arrays are lists."""
    figures = {}
    for on, found in result["figures"].items():
        figures[on] = {name: np.array(values) for name, values in found.items()}
    return Cell(**{**result, "figures": figures})


def run_job(job: dict[str, Any]) -> dict[str, Any]:
    """Do a job of `job_of`, in any process; a `Cell` as a dict."""
    cell = run_cell(
        Entry(
            job["entry"],
            job["source"],
        ),
        BenchmarkTask(**job["task"]),
        Options(**job["options"]),
    )
    return asdict(cell)

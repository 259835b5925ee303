"""What the search of a task has found so far, in a file."""

import json
import zipfile
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from agents.benchmarking.entries import Entry
from agents.rollouts.rollout import rollout
from agents.suites.suite import N_EPISODES, BenchmarkTask
from rudder_search.lanes import Commands, replayed_cost
from rudder_search.search import Found
from shipgym.arrays import Floats
from shipgym.drafts import atomic_path
from shipgym.errors import InputError


class Steered(NamedTuple):
    """Commands of a controller in the scored episodes, and their costs."""

    name: str
    commands: Commands  # shape (n_episodes, n_steps)
    costs: Floats


class Kept:
    """Sequences of all scored episodes of a task.

    Attributes
    ----------
    about : dict
        Task, hash of the suite, seed, names of the entries, processor seconds spent.
    starts : array of shape (n_starts, n_episodes, n_steps)
        Commands of the entries.
    best, course : array of shape (n_episodes, n_steps)
    costs, start_costs : array of shape (n_episodes,)
    visits, started_from : int array of shape (n_episodes,)
        The latter: number of the entry that cost least.
    """

    names = (
        "starts",
        "best",
        "course",
        "costs",
        "start_costs",
        "visits",
        "started_from",
    )

    def __init__(self, about: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> None:
        self.about = about
        self.arrays = arrays

    @classmethod
    def begin(cls, about: dict[str, Any], steered: Sequence[Steered]) -> Self:
        """Begin with what costs least in each episode."""
        costs = np.stack([one.costs for one in steered])
        starts = np.stack([one.commands for one in steered])
        least = costs.argmin(axis=0)
        episodes = np.arange(len(least))
        arrays = {
            "starts": starts,
            "best": starts[least, episodes],
            "course": starts[least, episodes],
            "costs": costs.min(axis=0),
            "start_costs": costs.min(axis=0),
            "visits": np.zeros(len(least), dtype=np.int64),
            "started_from": least,
        }
        named = {**about, "entries": [one.name for one in steered]}
        return cls(named, arrays)

    @classmethod
    def read(cls, path: Path, about: dict[str, Any]) -> Self:
        """Read a file; InputError if it is broken, or about something else."""
        remedy = "give another --out"
        try:
            content = BytesIO(path.read_bytes())
            with np.load(content, allow_pickle=False) as file:
                written = json.loads(str(file["about"]))
                arrays = {name: file[name] for name in cls.names}
        except (
            OSError,
            ValueError,
            TypeError,  # a single array, which is no archive
            KeyError,
            EOFError,
            zipfile.BadZipFile,
        ):
            raise InputError(
                f"{path}: expected a file of this search, got another or a broken one;"
                f" {remedy}"
            ) from None
        for name, value in about.items():
            if written.get(name) != value:
                raise InputError(
                    f"{path}: {name}: expected {value}, got {written.get(name)};"
                    f" {remedy}"
                )
        return cls(written, arrays)

    def save(self, path: Path) -> None:
        """Write the file, whole or not at all."""
        content = BytesIO()
        about = np.array(json.dumps(self.about))
        arrays: dict[str, Any] = {"about": about, **self.arrays}
        np.savez_compressed(content, **arrays)
        with atomic_path(path) as draft:
            draft.write_bytes(content.getvalue())

    def found(self, number: int) -> Found:
        """Return where the search of an episode stands."""
        arrays = self.arrays
        return Found(
            best=arrays["best"][number],
            cost=float(arrays["costs"][number]),
            course=arrays["course"][number],
            visits=int(arrays["visits"][number]),
        )

    def put(self, number: int, found: Found) -> None:
        """Note what was found in an episode."""
        self.arrays["best"][number] = found.best
        self.arrays["course"][number] = found.course
        self.arrays["costs"][number] = found.cost
        self.arrays["visits"][number] = found.visits

    def source(self, number: int) -> str:
        """Name of the entry that an episode was started from."""
        entries: list[str] = self.about["entries"]
        return entries[int(self.arrays["started_from"][number])]

    def check(self, task: BenchmarkTask, number: int) -> None:
        """Replay an episode in an engine of one ship; InputError for another cost."""
        cost = float(self.arrays["costs"][number])
        seed = int(task.seeds[number])
        again = replayed_cost(task, seed, self.arrays["best"][number])
        if abs(again - cost) > 1e-9:
            raise InputError(
                f"{task.name}: episode {number}: expected cost {cost}, got {again} when"
                " it was replayed; the ship or the task has changed since"
            )


def steer_all(entries: Sequence[Entry], task: BenchmarkTask) -> list[Steered]:
    """Let every entry steer the scored episodes; each training run is one.

    Raises InputError if none of them can.
    """
    engine = task.engine(N_EPISODES)
    shape = (N_EPISODES, engine.task.episode_steps)
    steered = []
    for entry in entries:
        for policy in entry.policies(task):
            run = rollout(policy, engine, task.seeds, record=["cost"], tolerant=True)
            commands = np.zeros(shape, dtype=np.float32)
            recorded = np.nan_to_num(run.actions[:, :, 0]).T
            commands[:, : recorded.shape[1]] = np.clip(recorded, -1.0, 1.0)
            costs = np.where(run.failed, np.inf, run.costs)
            steered.append(Steered(entry.name, commands, costs))
    least = np.min([one.costs for one in steered], axis=0)
    if not np.isfinite(least).all():
        raise InputError(
            f"controllers: expected one that steers every episode of '{task.name}', got"
            " none"
        )
    return steered

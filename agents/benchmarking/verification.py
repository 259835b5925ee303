"""Whether a file of benchmark results is true: a sample of it is run again and compared."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from agents.benchmarking.contestants import remade
from agents.benchmarking.results import REMEDY, BenchmarkResult, load_results, versions
from agents.benchmarking.run import job_of, run_job
from agents.benchmarking.submission import KIND, read_submission
from agents.controllers.designs import CLASSICAL
from agents.jobs import JobEngine, run_jobs
from agents.suites.suite import load_suite, suite_hash
from shipgym.arrays import finite
from shipgym.checks import check_number, check_whole
from shipgym.errors import InputError
from shipgym.files import read_json

N_SAMPLED = 8
#: Largest relative difference of an episode's cost with another processor, other
#: versions, or a learned policy, whose matrix products may be summed in another order.
ROUNDING = 1e-6


@dataclass(frozen=True)
class Check:
    """One contestant and task, all episodes and training runs of it run again."""

    contestant: str
    task: str
    episodes: int  # how many were compared
    #: largest relative difference of an episode's cost; 0 if all figures are the same
    #: bit for bit
    difference: float
    exact: bool  # whether they are
    allowed: float  # difference up to which it passes
    note: str  # what is wrong, or why a difference is allowed

    @property
    def passed(self) -> bool:
        """Whether it is what the file says."""
        return self.exact or self.difference <= self.allowed

    def to_dict(self) -> dict[str, Any]:
        """For programs; a difference that is no number is null."""
        return {
            **asdict(self),
            "difference": finite(self.difference),
            "passed": self.passed,
        }


def verify(
    path: str | Path,
    *,
    sample: int = N_SAMPLED,
    seed: int = 0,
    tolerance: float | None = None,
    workers: int | None = 1,
    allow_code: Sequence[str] = (),
) -> list[Check]:
    """Run a sample of a benchmark again and compare.

    `path`: folder of the results, their `results.json`, or a submission. `sample`:
    pairs of a contestant and a task; all their episodes are run, at most all pairs
    there are. `seed`: of the sample. `tolerance`: largest relative difference of an
    episode's cost. By default 0, and 1e-6 for a learned policy or where processor or
    versions differ from those the file was written with. `workers`: as in `benchmark`.
    `allow_code`: functions, `module:function`, that may be run where the file names
    them; contestants of others, and of files that are not those that took part, do not
    pass. Raises InputError if the files are broken, written on another suite of the
    name, or hold nothing that can be run again: contestants given as objects.
    """
    result = _read(Path(path))
    check_whole(sample, "sample", at_least=1)
    if tolerance is not None:
        check_number(tolerance, "tolerance", at_least=0.0)
    suite = result.summary["suite"]
    if suite_hash(suite["name"]) != suite["sha256"]:
        raise InputError(
            f"{path}: is of another suite '{suite['name']}' than that of this version"
            f" of shipgym ({result.summary['versions'].get('shipgym')}): install the"
            " version it was written with"
        )
    jobs: dict[tuple[str, str], dict[str, Any]] = {}
    checks: dict[tuple[str, str], Check] = {}
    for name, task in _sampled(result, sample, seed):
        try:
            jobs[name, task] = _job(result, name, task, allow_code)
        except InputError as error:
            size = result.figures(name, task).size
            checks[name, task] = Check(name, task, size, np.inf, False, 0.0, str(error))
    found = run_jobs(run_job, list(jobs.values()), JobEngine(workers=workers))
    for (name, task), again in zip(jobs, found, strict=True):
        checks[name, task] = _compared(result, name, task, again, tolerance)
    return list(checks.values())


def _read(path: Path) -> BenchmarkResult:
    """Results of a folder, or a submission."""
    content = (
        read_json(path, "file of benchmark results", REMEDY) if path.is_file() else {}
    )
    return (
        read_submission(content, str(path))
        if content.get("kind") == KIND
        else load_results(path)
    )


def _sampled(result: BenchmarkResult, sample: int, seed: int) -> list[tuple[str, str]]:
    """Pairs by chance, the contestants by turns."""
    sources = {
        name: about["source"] for name, about in result.summary["contestants"].items()
    }
    pairs = [
        (one, task)
        for task, by_name in result.summary["tasks"].items()
        for one, found in by_name.items()
        if sources[one] is not None and found["runs"]
    ]
    if not pairs:
        raise InputError(
            "results: no contestant that can be made again; name them by a text: a"
            " file, or module:function"
        )
    shuffled = [pairs[k] for k in np.random.default_rng(seed).permutation(len(pairs))]
    turns = {
        pair: sum(one == pair[0] for one, _ in shuffled[:k])
        for k, pair in enumerate(shuffled)
    }
    return sorted(shuffled, key=turns.__getitem__)[:sample]


def _job(
    result: BenchmarkResult, name: str, task: str, allow_code: Sequence[str]
) -> dict[str, Any]:
    suite = result.summary["suite"]["name"]
    asked = load_suite(suite).task(task)
    one = remade(name, result.summary["contestants"][name], asked, allow_code)
    return job_of(one, asked, suite, result.summary["seeds"]["count"])


def _compared(
    result: BenchmarkResult,
    name: str,
    task: str,
    again: dict[str, Any],
    tolerance: float | None,
) -> Check:
    cost = result.figures(name, task)
    about = result.summary["contestants"][name]
    other = [
        key
        for key, one in result.summary["versions"].items()
        if versions().get(key) != one
    ]
    learned = about["source"] not in CLASSICAL
    allowed = (
        tolerance if tolerance is not None else ROUNDING if learned or other else 0.0
    )
    note = f"{', '.join(other)} differ from those of the file" if other else ""
    if len(again["runs"]) != len(cost):
        runs = f"{len(again['runs'])} training runs found, {len(cost)} in the file"
        return Check(
            name,
            task,
            cost.size,
            np.inf,
            False,
            allowed,
            again["refused"] or note or runs,
        )
    costs = np.stack([run["episodes"]["cost"] for run in again["runs"]])
    exact = all(
        np.array_equal(
            run["episodes"][figure],
            result.figures(name, task, figure)[k],
            equal_nan=True,
        )
        for k, run in enumerate(again["runs"])
        for figure in run["episodes"]
        if figure in result.episodes
    )
    difference = float(np.max(np.abs(costs - cost) / np.maximum(np.abs(cost), 1e-12)))
    if not exact and difference == 0.0:  # of another figure than the cost
        difference, note = (
            np.inf,
            note or "the costs are the same, but another figure is not",
        )
    return Check(
        name, task, cost.size, 0.0 if exact else difference, exact, allowed, note
    )

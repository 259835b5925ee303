"""The page of a benchmark: one HTML file with tables that sort, curves, and its worst episodes to replay."""

import base64
import gzip
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from agents.benchmarking import page_figures as figures
from agents.benchmarking.contestants import BEST_KNOWN
from agents.benchmarking.page_replays import (
    bests_of,
    contestants_of,
    hardest_of,
    replay_data,
    replayable,
)
from agents.benchmarking.replays import EpisodeId, Rerun, rerun
from agents.benchmarking.results import RESULTS, BenchmarkResult
from agents.output import check_page
from agents.suites.suite import N_EPISODES, load_suite
from identification.progress import Progress
from shipgym.files import shipped_toml, write_text
from shipgym.pages import render

PAGE = "index.html"
WORST = 3  # episodes of each contestant in each task that may be replayed

#: Further figures of a task: what the head shows, and how a number is written.
METRICS: dict[str, tuple[str, str]] = shipped_toml("agents.benchmarking", "words.toml")[
    "metrics"
]
RARE = ("extrapolating",)  # shown only where not 0 throughout


def write_page(
    result: BenchmarkResult,
    path: str | Path,
    controllers: Any = None,
    worst: int = WORST,
    workers: int | None = 1,
    progress: Progress | None = None,
) -> None:
    """Write the page of a benchmark. The worst episodes are run again for it.

    Raises InputError if plotly is not installed or the page cannot be written; nothing
    is written then.

    Parameters
    ----------
    result : BenchmarkResult
        Of `benchmark` or `load_results`.
    path : str or Path
        The HTML file; one that exists is replaced. It loads nothing.
    controllers : optional
        As `benchmark` was given them; needed to replay contestants that were given as
        objects.
    worst : int
        How many episodes of each contestant in each task may be replayed; fewer if they
        are too many.
    workers : int or None
        Processes that run them; None for as many as there are cores.
    progress : callable, optional
        Told the stage of the work, what is done and the total.
    """
    target = Path(path)
    check_page(target, plots=True)
    count, episodes = replayable(result, worst)
    write_text(
        _page(result, rerun(result, episodes, controllers, workers, progress), count),
        target,
    )


def _page(result: BenchmarkResult, again: Rerun, count: int) -> str:
    """The text of the page, with so many of the worst episodes of each contestant to replay."""
    wins = [name for task in result.tasks for name in bests_of(result, task)]
    scores, profile = figures.scores_figure(result), result.summary["profile"]
    replays = {
        "count": count,
        "episodes": len(again.episodes),
        "different": again.different,
        "refused": dict.fromkeys(
            (name, why) for (name, _), why in again.refused.items()
        ),
        "data": replay_data(result, again, count),
    }
    return render(
        "agents.benchmarking/page.html",
        about=result.summary,
        names=result.ranking,
        best_known=BEST_KNOWN,
        styles=figures.styles(result.ranking),
        wins={name: wins.count(name) for name in result.ranking},
        failures=result.failures,
        tasks=[_task(result, again, task) for task in result.tasks],
        figures={
            "scores": scores,
            "profile": figures.profile_figure(profile, result.ranking),
        },
        replays=replays,
        command=command(result),
        results_file=RESULTS,
        packed=packed,
    )


def packed(text: str) -> str:
    """A text that the page's script unpacks: gzip in base64."""
    return base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode()


def _task(result: BenchmarkResult, again: Rerun, task: str) -> dict[str, Any]:
    """What the page shows of a task."""
    found = result.summary["tasks"][task]
    return {
        "name": task,
        **result.summary["suite"]["tasks"][task],
        "found": found,
        "best": bests_of(result, task),
        "metrics": [
            (name, *METRICS[name]) for name in METRICS if _is_shown(name, found)
        ],
        "costs": figures.costs_figure(result, task),
        "seed": hardest_of(result, task),
        "hardest": _hardest(result, again, task),
    }


def _is_shown(metric: str, found: Mapping[str, Any]) -> bool:
    """Whether a metric is known of one of the contestants, and not 0 throughout if it is a rare one."""
    means = [one["metrics"].get(metric, {}).get("mean") for one in found.values()]
    return any(means) if metric in RARE else any(mean is not None for mean in means)


def _hardest(result: BenchmarkResult, again: Rerun, task: str) -> dict[str, Any]:
    """Figures of all contestants in the hardest episode; none where none of them can be replayed."""
    names, seed = contestants_of(result, task), hardest_of(result, task)
    wanted = {
        name: again.episodes.get(EpisodeId(name, task, 0, seed)) for name in names
    }
    episodes = {
        name: episode for name, episode in wanted.items() if episode is not None
    }
    if not episodes:
        return {}
    found = {"histories": figures.histories_figure(episodes, result.ranking)}
    if any(episode.waypoints is not None for episode in episodes.values()):
        found["tracks"] = figures.tracks_figure(episodes, result.ranking)
    return found


def command(result: BenchmarkResult) -> str:
    """The command that makes these results; contestants that were objects stand as `...`."""
    about = result.summary
    sources = {
        name: one["source"] or "..." for name, one in about["contestants"].items()
    }
    given = [
        source if source == name else f"{name}={source}"
        for name, source in sources.items()
    ]
    words = [
        "shipgym",
        "benchmark",
        "--controllers",
        ",".join(given),
        "--suite",
        about["suite"]["name"],
    ]
    if len(about["tasks"]) < len(load_suite(about["suite"]["name"]).tasks):
        words += ["--tasks", ",".join(about["tasks"])]
    if about["seeds"]["count"] != N_EPISODES:
        words += ["--episodes", str(about["seeds"]["count"])]
    return shlex.join([*words, "--out", "results"])

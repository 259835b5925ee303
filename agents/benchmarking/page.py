"""The page of a benchmark: one HTML file with tables, figures and replays."""

import base64
import gzip
import shlex
from pathlib import Path
from typing import Any, NamedTuple

from agents.benchmarking.episode_figures import histories_figure, tracks_figure
from agents.benchmarking.page_figures import (
    costs_figure,
    looks,
    profile_figure,
    scores_figure,
)
from agents.benchmarking.page_replays import (
    hardest_seed,
    replay_data,
    replayable,
    usable_controllers,
)
from agents.benchmarking.page_tables import (
    costs_table,
    gains_table,
    improvement_table,
    metrics_table,
    ranking_table,
)
from agents.benchmarking.replays import EpisodeId, Rerun, rerun
from agents.benchmarking.results import RESULTS, BenchmarkResult
from agents.output import check_page
from agents.suites.suite import N_EPISODES
from identification.progress import Progress
from shipgym.envs.episode import Episode
from shipgym.files import write_text
from shipgym.pages import render
from shipgym.pages.numbers import counted
from shipgym.plots.style import Figure


class PageFigure(NamedTuple):
    """Figure of the page, which its script draws when it comes into sight."""

    name: str  # id, unique in the page
    caption: str
    height: int  # pixels
    data: str  # packed JSON


def write_page(
    result: BenchmarkResult,
    path: str | Path,
    controllers: Any = None,
    worst: int = 3,
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
        As `benchmark` was given them; needed to replay those given as objects.
    worst : int
        How many episodes of each controller in each task may be replayed; fewer if they
        are too many.
    workers : int or None
        Processes that run them; None for one per core.
    progress : callable, optional
        Called with the stage of the work, what is done and the total.
    """
    target = Path(path)
    check_page(target, plots=True)
    count, episodes = replayable(result, worst)
    again = rerun(result, episodes, controllers, workers, progress)
    write_text(_page(result, again, count), target)


def _page(result: BenchmarkResult, again: Rerun, count: int) -> str:
    """Return the text of the page with so many episodes of each controller."""
    summary = result.summary
    scores_caption = "Relative costs."
    cost_tables = [costs_table(result)]
    if summary["reference"]:
        scores_caption = (
            "Scores with their 95 % intervals: ● geometric mean, ◇ interquartile mean."
            " Dotted: the tuned rule, 1, and the bound from clairvoyance."
        )
        cost_tables.append(gains_table(result))
    profile = None
    if summary["profile"]["shares"]:
        profile_caption = (
            "Share of all episodes that score more than the threshold, which is the"
            " cost of the tuned rule in the same episode over that of the controller;"
            " higher is better. Dotted: as cheap as the rule."
        )
        profile = _figure("profile-figure", profile_figure(result), profile_caption)
    failures_title = (
        f"{len(result.failures)} times a controller failed or could not run a task"
    )
    return render(
        "agents.benchmarking/page.html",
        suite=summary["suite"]["name"],
        lead=_lead(result),
        failures=result.failures,
        failures_title=failures_title,
        looks=looks(result.ranking),
        ranking=ranking_table(result),
        scores_figure=_figure("scores", scores_figure(result), scores_caption),
        cost_tables=cost_tables,
        improvement=improvement_table(result),
        profile=profile,
        tasks=[
            _task(result, again, task, number)
            for number, task in enumerate(result.tasks)
        ],
        replays=_about_replays(again, count),
        not_replayed=_not_replayed(again),
        replay_data=replay_data(result, again, count),
        origin=_origin(result),
        controllers=_files_and_hashes(result),
        packed=packed,
    )


def packed(text: str) -> str:
    """Return a text that the page's script unpacks: gzip in base64."""
    return base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode()


def _figure(name: str, figure: Figure, caption: str) -> PageFigure:
    return PageFigure(name, caption, figure.layout.height, packed(figure.to_json()))


def _lead(result: BenchmarkResult) -> str:
    controllers = counted(len(result.ranking), "controller")
    tasks = counted(len(result.tasks), "task")
    episodes = counted(len(result.seeds), "episode")
    return (
        f"{controllers} in {tasks}, {episodes} each, the same for all. Tables sort by a"
        " click on a head; figures may be zoomed."
    )


def _task(
    result: BenchmarkResult, again: Rerun, task: str, number: int
) -> dict[str, Any]:
    """Return what the page shows of a task."""
    about = result.summary["suite"]["tasks"][task]
    costs = costs_figure(result, task)
    costs_caption = (
        "Cost of each episode, with the box of the middle half and the median."
    )
    return {
        "name": task,
        "about": f"{about['environment']}, {about['model']}: {about['why']}.",
        "costs": _figure(f"costs-{number}", costs, costs_caption),
        "metrics": metrics_table(result, task, f"metrics-{number}"),
        "seed": hardest_seed(result, task),
        "hardest": _hardest(result, again, task, number),
    }


def _hardest(
    result: BenchmarkResult, again: Rerun, task: str, number: int
) -> list[PageFigure]:
    """Return the figures of the hardest episode; none if it cannot be replayed."""
    seed = hardest_seed(result, task)
    episodes: dict[str, Episode] = {}
    for name in usable_controllers(result, task):
        key = EpisodeId(name, task, 0, seed)
        if key in again.episodes:
            episodes[name] = again.episodes[key]
    if not episodes:
        return []

    histories = histories_figure(episodes, result.ranking)
    about = f"histories-{number}"
    first, *_ = episodes.values()
    if first.waypoints is None:
        caption = "Heading, with the ordered course, and the rudder."
        return [_figure(about, histories, caption)]

    tracks = tracks_figure(episodes, result.ranking)
    tracks_caption = (
        "Paths over ground; dashed the path to follow, shaded its corridor."
    )
    caption = "Cross-track error, with the bounds of the corridor, and the rudder."
    return [
        _figure(f"tracks-{number}", tracks, tracks_caption),
        _figure(about, histories, caption),
    ]


def _about_replays(again: Rerun, count: int) -> str:
    """Return a paragraph about the episodes that may be replayed."""
    episodes = "the worst episode" if count == 1 else f"the {count} worst episodes"
    text = (
        f"For each controller {episodes} of each task, together with the task's best"
        " controller in the same one; and all controllers in the hardest one. They were"
        " run again for this page from their seeds"
    )
    if not again.different:
        return f"{text}; each cost the same as in the results."
    first = " ".join(str(part) for part in again.different[0])
    return (
        f"{text}; {len(again.different)} of {len(again.episodes)} cost something else"
        " than in the results, as on another processor or version: the first is"
        f" {first}."
    )


def _not_replayed(again: Rerun) -> list[str]:
    """Return why controllers cannot be replayed, each reason once."""
    reasons = []
    for (name, _), why in again.refused.items():
        reason = f"{name}: {why}"
        if reason not in reasons:
            reasons.append(reason)
    return reasons


def _origin(result: BenchmarkResult) -> dict[str, Any]:
    """Return how the results were made."""
    summary = result.summary
    seeds = result.seeds
    return {
        "command": command(result),
        "suite": summary["suite"],
        "seeds": f"{seeds[0]} to {seeds[-1]}",
        "versions": summary["versions"],
        "episodes": summary["episodes"],
        "results": RESULTS,
    }


def _files_and_hashes(result: BenchmarkResult) -> list[tuple[str, str, str]]:
    """Return rows of controller, file or design, and SHA-256."""
    rows = []
    for name, about in result.summary["controllers"].items():
        for path, sha256 in about["files"].items():
            rows.append((name, path, sha256))

        for task in result.tasks:
            cell = result.cells(task).get(name, {"policy_sha256": []})
            for sha256 in cell["policy_sha256"]:
                if sha256:
                    rows.append((name, f"controller for {task}", sha256))
    return rows


def command(result: BenchmarkResult) -> str:
    """Return the command that makes these results; objects stand as `...`."""
    summary = result.summary
    controllers = []
    for name, about in summary["controllers"].items():
        source = about["source"] or "..."
        controllers.append(source if source == name else f"{name}={source}")

    suite = summary["suite"]
    words = ["shipgym", "benchmark", "--controllers", ",".join(controllers)]
    words += ["--suite", suite["file"] or suite["name"]]
    if not suite["complete"]:
        words += ["--tasks", ",".join(result.tasks)]
    n_episodes = len(result.seeds)
    if n_episodes != N_EPISODES:
        words += ["--episodes", str(n_episodes)]
    words += ["--out", "results"]
    return shlex.join(words)

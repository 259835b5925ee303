"""The page of a benchmark: one HTML file with tables that sort, curves, and its worst episodes to replay."""

from __future__ import annotations

import base64
import gzip
import shlex
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents.benchmarking.page_figures import (
    costs_figure,
    histories_figure,
    profile_figure,
    scores_figure,
    styles,
    tracks_figure,
)
from agents.benchmarking.page_replays import as_json, contestants_of, hardest_of, replay_data, replayable
from agents.benchmarking.page_tables import (
    costs_table,
    improvement_table,
    metrics_table,
    ranking_table,
    scores_table,
)
from agents.benchmarking.replays import EpisodeId as Flight
from agents.benchmarking.replays import Rerun as Reflown
from agents.benchmarking.replays import rerun as refly
from agents.benchmarking.results import EPISODES, RESULTS, BenchmarkResult
from agents.output import check_page
from agents.suites.suite import N_EPISODES, load_suite
from shipgym.envs.episode import Episode
from shipgym.envs.path_following_task import PathFollowingTask
from shipgym.pages import (
    NONE,
    Html,
    header,
    html,
    join,
    note,
    page,
    paragraph,
    plotly_script,
    section,
    table,
)
from shipgym.whole_file import write_text

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

    from agents.verification.chain import Progress

PAGE = "index.html"
WORST = 3  # episodes of each contestant in each task that may be replayed

TITLES = {
    "ranking": "Ranking",
    "costs": "Costs by task",
    "improvement": "Who improves on whom",
    "profile": "Performance profile",
    "tasks": "Task by task",
    "replays": "Worst episodes",
    "origin": "How this was made",
}


def write_page(
    result: BenchmarkResult,
    path: str | Path,
    controllers: Any = None,
    worst: int = WORST,
    workers: int | None = 1,
    progress: Progress | None = None,
) -> None:
    """Write the page of a benchmark. The worst episodes are flown again for it.

    Parameters
    ----------
    result : BenchmarkResult
        Of `benchmark` or `load_results`.
    path : str or Path
        The HTML file; one that exists is replaced. It loads nothing, from nowhere.
    controllers : optional
        As `benchmark` was given them; needed to replay contestants that were given as objects.
    worst : int
        How many episodes of each contestant in each task may be replayed; fewer if they are too many.
    workers : int or None
        Processes that fly them; None for as many as there are cores.
    progress : callable, optional
        Told what is done, how many of it, and the total.

    Raises
    ------
    InputError
        If plotly is not installed or the page cannot be written; nothing is written then.
    """
    target = Path(path)
    check_page(target)
    library = plotly_script()
    count, flights = replayable(result, worst)
    reflown = refly(result, flights, controllers, workers, progress)
    replays = as_json(replay_data(result, reflown, count))
    body = {
        "header": _header(result),
        "ranking": _ranking(result),
        "costs": _costs(result),
        "improvement": section("improvement", TITLES["improvement"], improvement_table(result)),
        "profile": _profile(result),
        "tasks": _tasks(result, reflown),
        "replays": _replays(result, reflown, count),
        "origin": _origin(result),
        "packed": join([packed("plotly", library), packed("replay-data", replays), _part("script")]),
    }  # fmt: skip
    name = result.summary["suite"]["name"]
    write_text(page(f"Benchmark {name}", body, TITLES, _part("style")), target)


def packed(name: str, text: str) -> Html:
    """A text that the page's script unpacks: gzip in base64."""
    content = base64.b64encode(gzip.compress(text.encode(), 9, mtime=0)).decode()
    return Html(f'<script type="text/plain" id="{escape(name)}">{content}</script>')


def late_figure(plot: Figure, name: str, caption: str) -> Html:
    """A figure that is drawn when it comes into sight."""
    height = plot.layout.height
    return Html(
        f'<figure id="{escape(name)}"><div class="plot late" style="min-height:{height}px" role="img" '
        f'aria-label="{escape(caption)}"></div><figcaption>{html(caption)}</figcaption>'
        f"{packed(f'{name}-data', str(plot.to_json()))}</figure>"
    )


def _part(name: str) -> Html:
    """One of the files that go into the page as they are."""
    return Html(files("agents.benchmarking").joinpath(f"page_{name}.html").read_text(encoding="utf-8"))


def _header(result: BenchmarkResult) -> Html:
    about = result.summary
    lead = (
        f"{len(about['contestants'])} contestants in {len(about['tasks'])} tasks, "
        f"{about['seeds']['count']} episodes each, the same for all. "
        "Tables sort by a click on a head; figures may be zoomed."
    )
    old = '<div class="note warn" id="old" hidden>Figures and replays need a browser of 2023 or later.</div>'
    return Html(f"{header('shipgym benchmark', about['suite']['name'], lead)}{old}{_warnings(result)}")


def _warnings(result: BenchmarkResult) -> Html:
    """Who failed or could not take part."""
    told = []
    for name, one in result.summary["contestants"].items():
        told += [f"{name} did not fly {task}: {why}" for task, why in one["refused"].items()]
        told += [
            f"{name} failed in {found[name]['failed']} episodes of {task}: {found[name]['failure']}"
            for task, found in result.summary["tasks"].items()
            if name in found and found[name]["failed"]
        ]
    if not told:
        return Html("")
    if len(told) == 1:
        return note(told[0], "warn")
    entries = join(Html(f"<li>{html(one)}</li>") for one in told)
    summary = f"{len(told)} times a contestant failed or did not take part"
    return note(Html(f"<details><summary>{summary}</summary><ul>{entries}</ul></details>"), "warn")


def _ranking(result: BenchmarkResult) -> Html:
    scored = bool(result.summary["reference"])
    caption = "Scores with their 95 % intervals." if scored else "Relative costs."
    figure = late_figure(scores_figure(result), "scores", caption)
    return section("ranking", TITLES["ranking"], ranking_table(result), figure)


def _costs(result: BenchmarkResult) -> Html:
    scores = [scores_table(result)] if result.summary["reference"] else []
    return section("costs", TITLES["costs"], costs_table(result), *scores)


def _profile(result: BenchmarkResult) -> Html:
    profile = result.summary["profile"]
    if not profile["shares"]:
        said = note("There are no scores, so no profile: this suite has no reference costs.")
        return section("profile", TITLES["profile"], said)
    caption = (
        "Share of all episodes that score more than the threshold; higher is better. Dotted: the best PID "
        "and the oracle."
    )
    return section(
        "profile",
        TITLES["profile"],
        _legend(result),
        late_figure(profile_figure(profile, result.ranking), "profile-figure", caption),
    )


def _legend(result: BenchmarkResult) -> Html:
    """Who has which colour; buttons that hide and show them in all figures."""
    chips = join(
        Html(
            f'<button type="button" aria-pressed="true" data-name="{escape(name)}" style="--run:{colour}">'
            f'<i class="{dash}"></i>{html(name)}</button>'
        )
        for name, (colour, dash) in styles(result.ranking).items()
    )
    return Html(f'<div class="chips" role="group" aria-label="Contestants in the figures">{chips}</div>')


def _tasks(result: BenchmarkResult, reflown: Reflown) -> Html:
    """A panel for each task; the page's script shows one at a time."""
    tabs = join(
        Html(
            f'<button type="button" role="tab" id="tab-{escape(task)}" aria-controls="task-{escape(task)}">'
            f"{html(task)}</button>"
        )
        for task in result.tasks
    )
    panels = join((_panel(result, reflown, task, k) for k, task in enumerate(result.tasks)), "\n")
    strip = Html(f'<div class="tabs" role="tablist" aria-label="Tasks">{tabs}</div>')
    return section("tasks", TITLES["tasks"], strip, _legend(result), panels)


def _panel(result: BenchmarkResult, reflown: Reflown, task: str, k: int) -> Html:
    about = result.summary["suite"]["tasks"][task]
    name, replay = escape(task), "Replay the worst ones"
    boxes = "Cost of each episode, with the box of the middle half and the median."
    parts = [
        Html(f"<h3>{html(task)}</h3>"),
        paragraph(f"{about['environment']}, {about['model']}: {about['why']}."),
        late_figure(costs_figure(result, task), f"costs-{k}", boxes),
        metrics_table(result, task, k),
        *_hardest(result, reflown, task, k),
        Html(f'<p><button type="button" class="action" data-replay="{name}">{replay}</button></p>'),
    ]  # fmt: skip
    return Html(
        f'<div role="tabpanel" id="task-{name}" aria-labelledby="tab-{name}" tabindex="0">{join(parts)}</div>'
    )


def _hardest(result: BenchmarkResult, reflown: Reflown, task: str, k: int) -> Sequence[Html]:
    """Paths and histories of all contestants in the episode that is the hardest one."""
    seed = hardest_of(result, task)
    flights = {name: Flight(name, task, 0, seed) for name in contestants_of(result, task)}
    episodes: Mapping[str, Episode] = {
        name: reflown.episodes[flight] for name, flight in flights.items() if flight in reflown.episodes
    }
    if not episodes:
        return ()
    path = isinstance(load_suite(result.summary["suite"]["name"]).task(task).task, PathFollowingTask)
    said = f"The hardest episode, seed {seed}: that with the highest median cost over the contestants."
    found = [Html("<h3>The hardest episode</h3>"), paragraph(said)]
    if path:
        found.append(
            late_figure(
                tracks_figure(episodes, result.ranking),
                f"tracks-{k}",
                "Paths over ground; dashed the path to follow, shaded its corridor.",
            )
        )
    upper = (
        "Cross-track error, with the bounds of the corridor" if path else "Heading, with the ordered course"
    )
    found.append(
        late_figure(histories_figure(episodes, result.ranking), f"histories-{k}", f"{upper}, and the rudder.")
    )
    return found


def _replays(result: BenchmarkResult, reflown: Reflown, count: int) -> Html:
    """The chooser of episodes and the place of the player."""
    selects = join(
        Html(f'<label>{label}<select id="replay-{name}"></select></label>')
        for name, label in (("task", "Task"), ("who", "Contestant"), ("episode", "Episode"))
    )
    many = "the worst episode" if count == 1 else f"the {count} worst episodes"
    said = (
        f"For each contestant {many} of each task, beside the task's best contestant in the same one; and "
        "all contestants in the hardest one. They were flown again for this page from their seeds"
    )
    different = reflown.different
    agree = (
        "; each cost the same as in the results."
        if not different
        else f"; {len(different)} of {len(reflown.episodes)} cost something else than in the results, as on "
        f"another processor or version: the first is {' '.join(map(str, different[0]))}."
    )
    told = [paragraph(said + agree)]
    names = dict.fromkeys((name, why) for (name, _), why in reflown.refused.items())
    told += [note(f"Not to be replayed: {name}: {why}") for name, why in names]
    frame = Html('<iframe id="player" title="Replay of the chosen episode" hidden></iframe>')
    return section("replays", TITLES["replays"], *told, Html(f'<div class="chooser">{selects}</div>'), frame)


def _origin(result: BenchmarkResult) -> Html:
    """Command, versions, hashes and seeds."""
    about = result.summary
    first, count = about["seeds"]["first"], about["seeds"]["count"]
    facts = [
        ["command", Html(f"<code>{html(command(result))}</code>")],
        ["suite", Html(f"{html(about['suite']['name'])}, SHA-256 {_code(about['suite']['sha256'])}")],
        ["seeds", f"{first} to {first + count - 1}"],
        ["intervals", "95 %, stratified bootstrap over runs and episodes, paired over episodes"],
        *([name, version] for name, version in about["versions"].items()),
        [EPISODES, Html(f"{about['episodes']['rows']} rows, SHA-256 {_code(about['episodes']['sha256'])}")],
    ]  # fmt: skip
    ships = [
        [task, one["environment"], one["model"], _code(one["model_sha256"])]
        for task, one in about["suite"]["tasks"].items()
    ]
    return section(
        "origin",
        TITLES["origin"],
        table(["", ""], facts, text_columns=2),
        table(["task", "environment", "model", "SHA-256 of the model"], ships, text_columns=4),
        Html("<details><summary>Contestants: their files and controllers</summary>"),
        table(["contestant", "made from", "SHA-256"], _sources(result), text_columns=3),
        Html("</details>"),
        note(f"The numbers of this page are in {RESULTS} and {EPISODES} beside it."),
    )


def _sources(result: BenchmarkResult) -> list[list[Any]]:
    rows: list[list[Any]] = []
    for name, one in result.summary["contestants"].items():
        rows += [[name, path, _code(sha256)] for path, sha256 in one["files"].items()]
        for task, found in result.summary["tasks"].items():
            hashes = found[name]["policy_sha256"] if name in found else []
            rows += [[name, f"controller for {task}", _code(sha256)] for sha256 in hashes if sha256]
    return rows


def _code(sha256: str | None) -> Html:
    """The beginning of a hash; all of it where the pointer rests."""
    return (
        Html(NONE) if sha256 is None else Html(f'<code title="{escape(sha256)}">{escape(sha256[:16])}</code>')
    )


def command(result: BenchmarkResult) -> str:
    """The command that makes these results; contestants that were objects stand as `...`."""
    about = result.summary
    sources = {name: one["source"] or "..." for name, one in about["contestants"].items()}
    who = [source if source == name else f"{name}={source}" for name, source in sources.items()]
    words = ["shipgym", "benchmark", "--controllers", ",".join(who), "--suite", about["suite"]["name"]]
    if len(about["tasks"]) < len(load_suite(about["suite"]["name"]).tasks):
        words += ["--tasks", ",".join(about["tasks"])]
    if about["seeds"]["count"] != N_EPISODES:
        words += ["--episodes", str(about["seeds"]["count"])]
    return shlex.join([*words, "--out", "results"])

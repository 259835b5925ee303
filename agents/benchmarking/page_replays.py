"""The worst episodes of a benchmark, ready for the replay player of its page."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from agents.benchmarking.page_figures import looks
from agents.benchmarking.replays import SAME_COST, EpisodeId, Rerun, cost_of
from agents.benchmarking.results import BenchmarkResult
from agents.benchmarking.sources import BEST_KNOWN
from agents.rollouts.replay_page import PLAYER
from agents.rollouts.replay_series import quantities, run
from shipgym.pages import render

#: Decimals of the histories in the page.
DECIMALS = {
    "x": 1,
    "y": 1,
    "psi": 1,
    "delta": 1,
    "heading_error": 1,
    "course_order": 1,
    "rudder_order": 1,
    "cross_track_error": 1,
    "speed": 2,
    "yaw_rate": 3,
    "heel": 2,
    "shaft_speed": 1,
    "reward_so_far": 3,
    "wind_speed": 1,
    "wind_from": 0,
    "current_speed": 2,
    "current_towards": 0,
}
#: Runs of the replay player, whole, by episode.
Histories = dict[EpisodeId, dict[str, Any]]


class Choice(NamedTuple):
    """Episodes of a task that may be replayed together, the first of them chosen.

    `controller` is whose worst episode that is; empty for the hardest episode of all.
    """

    controller: str
    episodes: list[EpisodeId]


def usable_controllers(result: BenchmarkResult, task: str) -> list[str]:
    """Return the controllers that could run a task and are usable at sea, as ranked."""
    cells = result.cells(task)
    return [name for name in result.ranking if name in cells and name != BEST_KNOWN]


def best_controllers(result: BenchmarkResult, task: str) -> list[str]:
    """Return those of the lowest mean cost in a task, several if equal to rounding."""
    cells = result.cells(task)
    costs = {}
    for name in usable_controllers(result, task):
        cost = cells[name]["cost"]["value"]
        if cost is not None:
            costs[name] = cost

    best = []
    lowest = min(costs.values(), default=np.nan)
    for name, cost in costs.items():
        if np.isclose(cost, lowest, rtol=SAME_COST):
            best.append(name)
    return best


def worst_episodes(
    result: BenchmarkResult, controller: str, task: str, count: int
) -> list[EpisodeId]:
    """Return the episodes with the highest costs, over all training runs."""
    costs = result.figures(controller, task)
    known = np.nan_to_num(costs, nan=np.inf)
    order = np.argsort(-known, axis=None, kind="stable")

    episodes = []
    for place in order[:count].tolist():
        training_run, number = divmod(place, len(result.seeds))
        seed = result.seeds[number]
        episodes.append(EpisodeId(controller, task, training_run, seed))
    return episodes


def hardest_seed(result: BenchmarkResult, task: str) -> int:
    """Return the seed of the episode with the highest median cost over controllers."""
    mean_costs = []
    for name in usable_controllers(result, task):
        costs = result.figures(name, task)
        mean_costs.append(costs.mean(axis=0))  # over training runs
    if not mean_costs:
        return result.seeds[0]
    known = np.nan_to_num(mean_costs, nan=np.inf)
    medians = np.median(known, axis=0)
    return result.seeds[np.argmax(medians)]


def choices(result: BenchmarkResult, task: str, count: int) -> list[Choice]:
    """Return what may be replayed of a task.

    First all controllers in the hardest episode, then the worst episodes of each with
    the task's best controller in the same episode.
    """
    names = usable_controllers(result, task)
    seed = hardest_seed(result, task)
    hardest = [EpisodeId(name, task, 0, seed) for name in names]
    choices = [Choice("", hardest)]

    best = best_controllers(result, task)[:1]
    for name in names:
        compared = [other for other in best if other != name]
        for worst in worst_episodes(result, name, task, count):
            together = [worst]
            for other in compared:
                together.append(EpisodeId(other, task, 0, worst.seed))
            choices.append(Choice(name, together))
    return choices


def replayable(result: BenchmarkResult, wanted: int) -> tuple[int, list[EpisodeId]]:
    """Return how many of the worst episodes a page has room for, and all it shows.

    At most `wanted` of each controller and task; at least one.
    """
    most_runs = 300  # in a page, 5 kB each
    for count in range(wanted, 0, -1):
        shown: dict[EpisodeId, None] = {}  # in order, each once
        for task in result.tasks:
            for choice in choices(result, task, count):
                shown |= dict.fromkeys(choice.episodes)
        if len(shown) <= most_runs:
            break
    return count, list(shown)


def replay_data(result: BenchmarkResult, again: Rerun, count: int) -> dict[str, Any]:
    """Return all that the page's script needs to replay episodes, ready for JSON.

    `page` is the player, with a mark where its runs go; `quantities` what it shows over
    time; `runs` in their short form; `entries` what may be chosen, by task.
    """
    histories: Histories = {}
    entries: dict[str, list[dict[str, Any]]] = {}
    for task in result.tasks:
        entries[task] = []
        for choice in choices(result, task, count):
            episodes = _available(choice, again)
            if not episodes:
                continue
            _add_histories(histories, result, again, episodes)
            entry = _entry(result, choice.controller, episodes, histories)
            entries[task].append(entry)

    placeholder = "@episodes@"  # in the player, where the page's script puts its runs
    return {
        "page": render(PLAYER, title="Replay", data=placeholder),
        "mark": f'"{placeholder}"',
        "quantities": quantities(list(histories.values())),
        "runs": _short_runs(result, histories),
        "entries": entries,
    }


def _add_histories(
    histories: Histories,
    result: BenchmarkResult,
    again: Rerun,
    episodes: Sequence[EpisodeId],
) -> None:
    for episode in episodes:
        if episode not in histories:
            title = _title(result, episode)
            histories[episode] = run(title, again.episodes[episode])


def _available(choice: Choice, again: Rerun) -> list[EpisodeId]:
    """Episodes of a choice that were run again; none without that of its controller."""
    episodes = [episode for episode in choice.episodes if episode in again.episodes]
    if episodes and choice.controller not in ("", episodes[0].controller):
        return []
    return episodes


def _short_runs(result: BenchmarkResult, histories: Histories) -> list[dict[str, Any]]:
    look = looks(result.ranking)
    runs = []
    for episode, history in histories.items():
        colour = look[episode.controller].colour
        runs.append({**short(history), "colour": colour})
    return runs


def _entry(
    result: BenchmarkResult,
    controller: str,
    episodes: Sequence[EpisodeId],
    histories: Histories,
) -> dict[str, Any]:
    """Return what may be chosen: whose episode it is, and which runs are replayed."""
    first = episodes[0]
    runs = list(histories)
    return {
        "who": controller,
        "seed": first.seed,
        "cost": round(cost_of(result, first), 2),
        "outcome": histories[first]["outcome"],
        "runs": [runs.index(episode) for episode in episodes],
    }


def _title(result: BenchmarkResult, episode: EpisodeId) -> str:
    name = episode.controller
    cell = result.cells(episode.task)[name]
    if cell["runs"] == 1:
        return name
    return f"{name}, run {episode.run + 1}"


def short(whole: dict[str, Any]) -> dict[str, Any]:
    """Return a run with its histories as integers, each the difference to the last."""
    series = {}
    for name, values in whole["series"].items():
        series[name] = differences(values, DECIMALS[name])
    parts = {}
    reward_decimals = 4
    for name, values in whole["parts"].items():
        if np.any(values):
            parts[name] = differences(values, reward_decimals)
    return {
        **whole,
        "series": series,
        "parts": parts,
        "rewards": differences(whole["rewards"], reward_decimals),
        "other": {},
    }


def differences(values: Sequence[float], decimals: int) -> list[int]:
    """Return the decimals, and the differences of values in units of the last one."""
    units = np.round(np.asarray(values) * 10.0**decimals).astype(np.int64)
    steps = np.diff(units, prepend=0)
    return [decimals, *steps.tolist()]

"""The worst episodes of a benchmark, ready for the replay player in its page."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from agents.benchmarking.contestants import BEST_KNOWN
from agents.benchmarking.page_figures import styles
from agents.benchmarking.replays import SAME_COST, EpisodeId, Rerun, cost_of
from agents.benchmarking.results import BenchmarkResult
from agents.rollouts.replay_page import PLAYER
from agents.rollouts.replay_series import quantities, run
from shipgym.files import shipped_toml
from shipgym.pages import render

MOST_RUNS = 300  # in a page, 5 kB each
MARK = "@episodes@"  # what the page's script puts its runs in the place of
DECIMALS: dict[str, int] = shipped_toml("agents.benchmarking", "decimals.toml")
REWARD_DECIMALS = 4


def contestants_of(result: BenchmarkResult, task: str) -> list[str]:
    """Names of those who ran a task and are usable at sea, as they are ranked."""
    return [
        name
        for name in result.ranking
        if name in result.summary["tasks"][task] and name != BEST_KNOWN
    ]


def bests_of(result: BenchmarkResult, task: str) -> list[str]:
    """Names of the lowest mean cost in a task, several where equal to rounding, of those that sail."""
    found = result.summary["tasks"][task]
    costs = {
        name: found[name]["cost"]["value"] for name in contestants_of(result, task)
    }
    known = {name: cost for name, cost in costs.items() if cost is not None}
    least = min(known.values(), default=np.nan)
    return [
        name for name, cost in known.items() if np.isclose(cost, least, rtol=SAME_COST)
    ]


def worst_of(
    result: BenchmarkResult, contestant: str, task: str, count: int
) -> list[EpisodeId]:
    """The episodes that cost a contestant most, the worst first; over all of its training runs."""
    costs = result.figures(contestant, task)
    order = np.argsort(-np.nan_to_num(costs, nan=np.inf).ravel(), kind="stable")[:count]
    first = result.summary["seeds"]["first"]
    runs, places = (one.tolist() for one in np.unravel_index(order, costs.shape))
    return [
        EpisodeId(contestant, task, k, first + place)
        for k, place in zip(runs, places, strict=True)
    ]


def hardest_of(result: BenchmarkResult, task: str) -> int:
    """Seed of the episode whose cost has the highest median over the contestants."""
    costs = [
        result.figures(name, task).mean(axis=0) for name in contestants_of(result, task)
    ]
    place = (
        int(np.argmax(np.median(np.nan_to_num(costs, nan=np.inf), axis=0)))
        if costs
        else 0
    )
    return int(result.summary["seeds"]["first"]) + place


def entries_of(
    result: BenchmarkResult, task: str, count: int
) -> list[tuple[str, list[EpisodeId]]]:
    """What may be replayed of a task: for whom, and the episodes to lay over each other, the first chosen.

    At first all contestants in the hardest episode, of the task as a whole; then the
    worst episodes of each, beside the task's best contestant in the same.
    """
    who, seed = contestants_of(result, task), hardest_of(result, task)
    best = next(iter(bests_of(result, task)), None)
    found = [("", [EpisodeId(name, task, 0, seed) for name in who])]
    for name in who:
        for episode in worst_of(result, name, task, count):
            beside = (
                []
                if best is None or name == best
                else [EpisodeId(best, task, 0, episode.seed)]
            )
            found.append((name, [episode, *beside]))
    return found


def replayable(result: BenchmarkResult, wanted: int) -> tuple[int, list[EpisodeId]]:
    """How many of the worst episodes of each contestant a page has room for, and all that it shows.

    `wanted`: fewer are taken if together they are too many; at least one.
    """
    for count in range(wanted, 0, -1):
        entries = [
            entry for task in result.tasks for entry in entries_of(result, task, count)
        ]
        episodes = list(dict.fromkeys(one for _, some in entries for one in some))
        if len(episodes) <= MOST_RUNS:
            break
    return count, episodes


def replay_data(result: BenchmarkResult, again: Rerun, count: int) -> dict[str, Any]:
    """All that the page's script needs to replay episodes, ready for JSON.

    Returns `page`, the player, with a mark where its runs go; `quantities`, what it
    shows over time; `runs`, in their short form (`short`); `entries`, what may be
    chosen, by task: for whom, seed, cost, outcome and numbers of the runs.
    """
    whole: dict[EpisodeId, dict[str, Any]] = {}
    entries: dict[str, list[dict[str, Any]]] = {task: [] for task in result.tasks}
    for task in result.tasks:
        for who, episodes in entries_of(result, task, count):
            there = [episode for episode in episodes if episode in again.episodes]
            if not there or who not in ("", there[0].contestant):
                continue
            for one in there:
                whole[one] = whole.get(one) or run(
                    _called(result, one), again.episodes[one]
                )
            entry = {
                "who": who,
                "seed": there[0].seed,
                "cost": round(cost_of(result, there[0]), 2),
            }
            places = [list(whole).index(one) for one in there]
            entries[task].append(
                {**entry, "outcome": whole[there[0]]["outcome"], "runs": places}
            )
    look = styles(result.ranking)
    runs = [
        {**short(found), "colour": look[one.contestant][0]}
        for one, found in whole.items()
    ]
    return {
        "page": render(PLAYER, title="Replay", data=MARK),
        "mark": f'"{MARK}"',
        "quantities": quantities([*whole.values()]),
        "runs": runs,
        "entries": entries,
    }


def _called(result: BenchmarkResult, episode: EpisodeId) -> str:
    several = result.summary["tasks"][episode.task][episode.contestant]["runs"] > 1
    return (
        f"{episode.contestant}, run {episode.run + 1}"
        if several
        else episode.contestant
    )


def short(whole: dict[str, Any]) -> dict[str, Any]:
    """A run with its histories as whole numbers, each the difference to the one before; see `DECIMALS`."""
    parts = {key: values for key, values in whole["parts"].items() if np.any(values)}
    return {
        **whole,
        "series": {
            key: differences(values, DECIMALS[key])
            for key, values in whole["series"].items()
        },
        "parts": {
            key: differences(values, REWARD_DECIMALS) for key, values in parts.items()
        },
        "rewards": differences(whole["rewards"], REWARD_DECIMALS),
        "other": {},
    }


def differences(values: Sequence[float], decimals: int) -> list[int]:
    """The decimals, and the differences of values in units of the last of them."""
    units = np.round(np.asarray(values) * 10.0**decimals).astype(np.int64)
    return [decimals, *np.diff(units, prepend=0).tolist()]

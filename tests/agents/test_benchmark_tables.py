"""Tables that `shipgym benchmark` prints, of results that are made up."""

from io import StringIO
from types import SimpleNamespace

from rich.console import Console

from agents.cli.benchmark_tables import costs_table, ranking_table


def cells(table, rows):
    """The last rows of a table as words."""
    file = StringIO()
    Console(file=file, width=200, color_system=None).print(table)
    return [" ".join(line.split()) for line in file.getvalue().splitlines()[-rows:]]


NOTHING = {"value": None, "low": None, "high": None}


def entry(name, failed=0):
    return {
        "name": name,
        "failed": failed,
        "score": {"value": 0.51234, "low": 0.4, "high": 0.6},
        "score_iqm": {"value": 0.75, "low": 0.7, "high": 0.8},
        "relative_cost": 1.5,
        "tasks": 2,
        "lost": 1,
        "exceeding": 2,
    }


def result(reference=True):
    of_lq = {
        "microseconds_per_action": 3.0,
        "cost": {"value": 2.0, "low": 1.5, "high": 2.5},
        "cost_iqm": {"value": 1.9, "low": 1.5, "high": 2.5},
        "gain": {"value": 0.2, "low": 0.15, "high": 0.25},
        "lost": 1,
        "failed": 2,
        "metrics": {"success": {"mean": 0.98}},
    }
    of_pid = of_lq | {
        "microseconds_per_action": None,
        "cost": {"value": 1.0, "low": None, "high": None},
        "gain": NOTHING,
    }
    of_pid["metrics"] = {}
    slower = of_lq | {"microseconds_per_action": 5.0}
    summary = {
        "seeds": {"count": 100},
        "suite": {"name": "shipgym-v1"},
        "ranking": [entry("lq"), entry("pid", 7)],
        "tasks": {
            "calm": {"lq": of_lq, "pid": of_pid},
            "rough": {"lq": slower, "best-known": slower},
        },
        "controllers": {"lq": {"runs": 1}, "pid": {"runs": 3}},
        "reference": {},
    }
    tasks = summary["tasks"]
    if reference:
        summary["reference"] = {task: {"rule": 2.5, "bound": 0.5} for task in tasks}
    return SimpleNamespace(summary=summary, tasks=tuple(tasks), cells=tasks.get)


def test_controllers_are_shown_with_both_scores_and_the_mean_of_their_times():
    first, second = cells(ranking_table(result()), 2)
    scores = "0.512 0.400 to 0.600 0.750 0.700 to 0.800"
    assert first == f"lq {scores} 2 1 1 0 2 4.00"
    assert second == f"pid {scores} 2 3 1 7 2 -"


def test_controllers_without_scores_are_shown_with_relative_costs():
    first, second = cells(ranking_table(result(reference=False)), 2)
    assert first == "lq 1.500 2 1 1 0 2 4.00"
    assert second == "pid 1.500 2 3 1 7 2 -"


def test_costs_are_shown_by_task_the_lowest_first_with_the_bound():
    of_lq = "lq 2.00 1.50 to 2.50 1.90 20.0 15.0 to 25.0 3 98 %"
    assert cells(costs_table(result()), 7) == [
        "calm",
        "bound 0.50 - - 80.0 -",
        "pid 1.00 - 1.90 - - 3 -",
        of_lq,
        "rough",
        of_lq.replace("lq", "best-known"),
        of_lq,
    ]
    assert cells(costs_table(result(reference=False)), 6)[:2] == [
        "calm",
        "pid 1.00 - 1.90 - - 3 -",
    ]

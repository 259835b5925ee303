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


def entry(name, failed=0):
    score = {"value": 0.51234, "low": 0.4, "high": 0.6}
    return {
        "name": name,
        "failed": failed,
        "score": score,
        "relative_cost": 1.5,
        "tasks": 2,
        "lost": 1,
    }


def result():
    of_lq = {
        "microseconds_per_action": 3.0,
        "cost": {"value": 2.0, "low": 1.5, "high": 2.5},
        "score": {"value": None, "low": None, "high": None},
        "lost": 1,
        "failed": 2,
        "metrics": {"success": {"mean": 0.98}},
    }
    of_pid = of_lq | {
        "microseconds_per_action": None,
        "cost": {"value": 1.0, "low": None, "high": None},
    }
    of_pid["metrics"] = {}
    slower = of_lq | {"microseconds_per_action": 5.0}
    summary = {
        "seeds": {"count": 100},
        "suite": {"name": "shipgym-v1"},
        "ranking": [entry("lq"), entry("pid", 7)],
        "tasks": {"calm": {"lq": of_lq, "pid": of_pid}, "rough": {"lq": slower}},
        "controllers": {"lq": {"runs": 1}, "pid": {"runs": 3}},
    }
    tasks = summary["tasks"]
    return SimpleNamespace(summary=summary, tasks=tuple(tasks), cells=tasks.get)


def test_controllers_are_shown_with_the_mean_of_their_times():
    first, second = cells(ranking_table(result()), 2)
    assert first == "lq 0.512 0.400 to 0.600 1.500 2 1 1 0 4.00"
    assert second == "pid 0.512 0.400 to 0.600 1.500 2 3 1 7 -"


def test_costs_are_shown_by_task_the_lowest_first():
    first, second, third = cells(costs_table(result()), 3)
    assert first == "calm pid 1.00 - - 3 -"
    assert second == "lq 2.00 1.50 to 2.50 - 3 98 %"
    assert third == "rough lq 2.00 1.50 to 2.50 - 3 98 %"

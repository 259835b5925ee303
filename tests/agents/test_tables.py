"""Tables of the command line, from results that are made up."""

from io import StringIO
from types import SimpleNamespace

import numpy as np
from rich.console import Console

from agents.cli import tables
from shipgym.manoeuvres import Criterion, IndexInterval

SOURCE = "MSC.137(76), annex, 5.3.1"


def cells(table, rows):
    """The last rows of a table as words."""
    text = StringIO()
    Console(file=text, width=200).print(table)
    return [" ".join(line.split()) for line in text.getvalue().splitlines()[-rows:]]


def interval(value, draws=(), lost=0):
    values = np.array([*draws, *[np.nan] * lost])
    return IndexInterval(value, values, np.zeros(len(values), dtype=bool))


def test_criteria_are_shown_with_their_notes_and_what_was_measured():
    drawn = interval(3.7, [3.0, 4.0, 5.0, np.nan], 1)
    advance = Criterion(
        3.7, 4.5, True, "ship lengths", SOURCE, drawn, "see there", True, 3.9, "turn"
    )
    stopping = Criterion(None, 15.0, None, "ship lengths", SOURCE, None, "no shaft")
    criteria = {"advance": advance, "stopping": stopping}
    first, second = cells(tables.criteria_table(criteria), 2)
    assert first.startswith("advance 3.90 3.70 ")
    assert first.endswith("turn 5.3.1")
    assert second.startswith("stopping - - ")
    notes = tables.criteria_notes(criteria)
    assert notes[:2] == ["advance: see there", "stopping: no shaft"]
    assert notes[2].endswith("which are not in its interval")


def test_indices_are_shown_with_the_intervals_of_the_draws_if_there_are_any():
    overshoot = interval(7.777, np.linspace(7.0, 9.0, 41), 2)
    rows = {"zigzag": {"overshoot": overshoot, "period": interval(None)}}
    found = cells(tables.manoeuvre_table(rows, "shallow water"), 2)
    assert found == ["zigzag overshoot 7.78 7.05 to no upper bound 2", "period - - 0"]
    bare = {"zigzag": {"overshoot": interval(7.777)}}
    heading, _ = cells(tables.manoeuvre_table(bare), 2)
    assert heading == "manoeuvre index value"


def test_predictions_are_shown_by_trial_in_degrees():
    rmse = {"psi": np.radians(2.0), "r": np.radians(0.05), "u": 0.123, "v": None}
    indices = {"overshoot_1_deg": {"measured": 8.0, "predicted": 7.5}}
    trials = {
        "runs/a.csv": {"use": "fit", "rmse": rmse, "diverged": False, **indices},
        "b.csv": {"use": "validate", "rmse": dict.fromkeys(rmse), "diverged": True},
    }
    result = SimpleNamespace(metrics={"trials": trials})
    first, second = cells(tables.prediction_table(result), 2)
    assert first == "a.csv fit 2.000 0.050 0.123 - 1st 8.00 -> 7.50"
    assert second == "b.csv validate - - - - ran away"


def test_margins_without_bound_and_without_number_are_told_apart():
    names = ("cost_mean", "cost_quantile_95", "heading_rmse_deg_mean")
    figures = dict.fromkeys((*names, "rudder_travel_deg_min_mean"), 1.0)
    margins = {"gain_margin": None, "phase_margin_deg": 61.24}
    controllers = {
        "pid": {**figures, "margins": margins, "lost_control": 0},
        "ppo": {**figures, "margins": None, "lost_control": 4},
    }
    metrics = {"draws": {"count": 9}, "ranking": ["pid", "ppo"]}
    result = SimpleNamespace(metrics=metrics | {"controllers": controllers})
    first, second = cells(tables.ranking_table(result), 2)
    assert first == "PID 1.00 1.00 1.00 1.0 inf 61.2 0"
    assert second == "PPO 1.00 1.00 1.00 1.0 - - 4"

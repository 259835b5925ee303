"""Tables of the command line and numbers of pages, from results that are made up."""

# ruff: noqa: RUF001 - pages have a true minus and a dash

from io import StringIO
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from agents.cli import tables
from shipgym.manoeuvres import Criterion, IndexInterval
from shipgym.pages.numbers import counted, degrees, fixed, number, percent

SOURCE = "MSC.137(76), annex, 5.3.1"


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (None, 3, "–"),
        (np.nan, 3, "–"),
        (np.inf, 3, "–"),
        (0.0, 3, "0"),
        (1234.6, 3, "1235"),
        (12.345, 3, "12.3"),
        (-0.012345, 3, "−0.0123"),
        (9999999.0, 3, "9999999"),
        (1e7, 3, "1.00 · 10⁷"),
        (1e-4, 3, "0.000100"),
        (-2.5e-5, 3, "−2.50 · 10⁻⁵"),
        (3.14159, 5, "3.1416"),
        (99.96, 3, "100.0"),
    ],
)
def test_numbers_of_pages_have_significant_digits_and_a_true_minus(
    value, digits, shown
):
    assert number(value, digits) == shown


def test_decimals_shares_and_counts_of_pages():
    assert [fixed(value) for value in (None, np.nan, -1.005, 2.0)] == [
        "–",
        "–",
        "−1.00",
        "2.00",
    ]
    shares = [np.nan, 0.0, 0.0099, 0.01, 0.5, 0.99, 0.9901, 1.0]
    assert [percent(share) for share in shares] == [
        "–",
        "0 %",
        "< 1 %",
        "1 %",
        "50 %",
        "99 %",
        "> 99 %",
        "100 %",
    ]
    assert [counted(count, "run") for count in (0, 1, 2)] == [
        "0 runs",
        "1 run",
        "2 runs",
    ]
    assert degrees(None) is None
    assert degrees(np.pi) == pytest.approx(180.0)


def cells(table, rows):
    """The last rows of a table as words."""
    file = StringIO()
    Console(file=file, width=200, color_system=None).print(table)
    return [" ".join(line.split()) for line in file.getvalue().splitlines()[-rows:]]


def interval(value, values=(), ran_away=0):
    """An index of a model and of draws, the first of which ran away."""
    return IndexInterval(
        value, np.array(values, dtype=float), np.arange(len(values)) < ran_away
    )


def test_criteria_are_shown_with_verdict_and_paragraph():
    lengths = "ship lengths"
    criteria = {
        "advance": Criterion(3.714, 4.5, True, lengths, SOURCE),
        "tactical_diameter": Criterion(None, 5.0, False, lengths, SOURCE),
        "stopping": Criterion(None, 15.0, None, lengths, SOURCE[:-1] + "4"),
    }
    first, second, third = cells(tables.criteria_table(criteria), 3)
    assert first == "advance 3.71 4.50 ship lengths passes 5.3.1"
    assert second == "tactical_diameter - 5.00 ship lengths fails 5.3.1"
    assert third == "stopping - 15.00 ship lengths not assessable 5.3.4"

    drawn = interval(3.7, [3.0, 4.0, 5.0, np.nan])
    criteria["advance"] = Criterion(3.7, 4.5, True, lengths, SOURCE, drawn)
    first, second, _ = cells(tables.criteria_table(criteria), 3)
    assert first.endswith("50.0 % 5.3.1")
    assert second.startswith("tactical_diameter - - ")


def test_criteria_are_shown_with_their_notes_and_what_was_measured():
    lengths = "ship lengths"
    drawn = interval(3.7, [3.0, 4.0, 5.0, np.nan], 1)
    criteria = {
        "advance": Criterion(
            3.7, 4.5, True, lengths, SOURCE, drawn, "see there", True, 3.9, "turn"
        ),
        "overshoot": Criterion(
            9.5, 9.0, None, "deg", SOURCE, drawn, "", False, None, "zigzag"
        ),
        "stopping": Criterion(None, 15.0, None, lengths, SOURCE, None, "no shaft"),
    }
    table = tables.criteria_table(criteria)
    measured = [row.split()[1] for row in cells(table, 3)]
    assert measured == ["3.90", "-", "-"]
    notes = tables.criteria_notes(criteria)
    assert notes[:2] == ["advance: see there", "stopping: no shaft"]
    assert notes[2].endswith("which are not in its interval")


def test_indices_are_shown_with_the_intervals_of_the_draws():
    overshoot = interval(7.777, np.linspace(7.0, 9.0, 41), 2)
    rows = {"zigzag": {"overshoot": overshoot, "period": interval(None)}}
    first, second = cells(tables.manoeuvre_table(rows, "shallow water"), 2)
    assert first == "zigzag overshoot 7.78 7.05 to 8.95 2"
    assert second == "period - - 0"
    bare = {"zigzag": {"overshoot": interval(7.777)}}
    (heading, _) = cells(tables.manoeuvre_table(bare), 2)
    assert heading == "manoeuvre index value"


def test_predictions_are_shown_by_trial_in_degrees():
    rmse = {"psi": np.radians(2.0), "r": np.radians(0.05), "u": 0.123, "v": None}
    indices = {"overshoot_1_deg": {"measured": 8.0, "predicted": 7.5}}
    trials = {
        "runs/a.csv": {"use": "fit", "rmse": rmse, "diverged": False, **indices},
        "b.csv": {"use": "validate", "rmse": dict.fromkeys(rmse), "diverged": True},
    }
    result = SimpleNamespace(metrics={"trials": trials})
    first, second = cells(tables.prediction_table(result, "steered by the model"), 2)
    assert first == "a.csv fit 2.000 0.050 0.123 - 1st 8.00 -> 7.50"
    assert second == "b.csv validate - - - - ran away"


@pytest.mark.parametrize("held_out", ["each trial in turn", "trials marked validate"])
def test_structures_and_methods_are_shown_the_best_first(held_out):
    first = {
        "method": "tls-svm",
        "structure": "abkowitz",
        "coefficients": 40,
        "stable": True,
        "error": 0.12345,
        "heading_deg": 1.234,
        "yaw_rate_deg_s": 0.01234,
        "ran_away": 0,
    }
    lost = dict.fromkeys(("error", "heading_deg", "yaw_rate_deg_s"))
    second = first | lost | {"method": "ls", "stable": False, "ran_away": 3}
    ranking = {"held_out": held_out, "ranking": [first, second]}
    best, worst = cells(tables.selection_table(ranking), 2)
    assert best == "tls-svm abkowitz 40 stable 0.1235 1.23 0.0123 0"
    assert worst == "ls abkowitz 40 unstable - - - 3"


def test_margins_without_bound_and_without_number_are_told_apart():
    names = (
        "cost_mean cost_quantile_95 heading_rmse_deg_mean rudder_travel_deg_min_mean"
    )
    figures = dict.fromkeys(names.split(), 1.0)
    margins = {"gain_margin": None, "phase_margin_deg": 61.24}
    metrics = {
        "draws": {"count": 100},
        "ranking": ["pid", "ppo"],
        "controllers": {
            "pid": {**figures, "margins": margins, "lost_control": 0},
            "ppo": {**figures, "margins": None, "lost_control": 4},
        },
    }
    table = tables.ranking_table(SimpleNamespace(metrics=metrics))
    first, second = cells(table, 2)
    assert first == "PID 1.00 1.00 1.00 1.0 inf 61.2 0"
    assert second == "PPO 1.00 1.00 1.00 1.0 - - 4"

"""What is printed: numbers, tables and progress, from results that are made up."""

# ruff: noqa: RUF001 - pages have a true minus and a dash

import sys
from contextlib import nullcontext
from io import StringIO
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from rich.text import Text

from agents.cli import benchmark_tables, terminal
from identification import progress
from shipgym.manoeuvres import Criterion, IndexInterval
from shipgym.pages.numbers import counted, degrees, fixed, number, percent
from tests.golden.texts import same_text


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


def lines(table):
    """A table as text, without the spaces at the ends of lines; the golden one of its title."""
    file = StringIO()
    Console(file=file, width=200, color_system=None).print(table)
    size = f"{table.row_count} by {len(table.columns)}"
    assert same_text(
        f"tables/{table.title.lower().replace('/', '-')} {size}", file.getvalue()
    )
    return [line.rstrip() for line in file.getvalue().splitlines()]


def interval(value, values=(), ran_away=0):
    """An index of a model and of draws, the first of which ran away."""
    return IndexInterval(
        value, np.array(values, dtype=float), np.arange(len(values)) < ran_away
    )


def test_criteria_are_shown_with_verdict_and_paragraph():
    source = "MSC.137(76), annex, 5.3.1"
    plain = {
        "advance": Criterion(3.714, 4.5, True, "ship lengths", source),
        "tactical_diameter": Criterion(None, 5.0, False, "ship lengths", source),
        "stopping": Criterion(
            None, 15.0, None, "ship lengths", "MSC.137(76), annex, 5.3.4"
        ),
    }
    title, heading, *rows = lines(terminal.criteria_table(plain))
    assert title == "IMO criteria, resolution MSC.137(76)"
    assert heading.split() == [
        "criterion",
        "value",
        "limit",
        "unit",
        "verdict",
        "manoeuvre",
        "paragraph",
    ]
    assert rows[0].split() == [
        "advance",
        "3.71",
        "4.50",
        "ship",
        "lengths",
        "passes",
        "5.3.1",
    ]
    assert rows[1].split() == [
        "tactical_diameter",
        "-",
        "5.00",
        "ship",
        "lengths",
        "fails",
        "5.3.1",
    ]
    assert rows[2].split() == [
        "stopping",
        "-",
        "15.00",
        "ship",
        "lengths",
        "not",
        "assessable",
        "5.3.4",
    ]
    drawn = plain | {
        "advance": Criterion(
            3.7,
            4.5,
            True,
            "ship lengths",
            source,
            interval(3.7, [3.0, 4.0, 5.0, np.nan]),
        )
    }
    _, heading, first, second, *_ = lines(terminal.criteria_table(drawn))
    assert "probability" in heading
    assert "50.0 %" in first
    assert second.split()[1:3] == ["-", "-"]


def test_criteria_are_told_with_their_notes_and_what_was_measured():
    source, drawn = (
        "MSC.137(76), annex, 5.3.1",
        interval(3.7, [3.0, 4.0, 5.0, np.nan], 1),
    )
    criteria = {
        "advance": Criterion(
            3.7,
            4.5,
            True,
            "ship lengths",
            source,
            drawn,
            "see there",
            True,
            3.9,
            "turn",
        ),
        "overshoot": Criterion(
            9.5, 9.0, None, "deg", source, drawn, "", False, None, "zigzag"
        ),
        "stopping": Criterion(
            None, 15.0, None, "ship lengths", source, None, "no shaft"
        ),
    }
    shown = "\n".join(
        [*lines(terminal.criteria_table(criteria)), *terminal.criteria_notes(criteria)]
    )
    assert same_text("criteria with notes", shown)
    narrow = StringIO()
    Console(file=narrow, width=60, color_system=None).print(
        terminal.criteria_table(criteria)
    )
    assert same_text("criteria on a narrow terminal", narrow.getvalue())


def test_indices_are_shown_with_what_the_draws_say():
    found = {
        "zigzag": {
            "overshoot": interval(7.777, np.linspace(7.0, 9.0, 41), 2),
            "period": interval(None),
        }
    }
    title, heading, first, second = lines(
        terminal.manoeuvre_table(found, "shallow water")
    )
    assert title == "Manoeuvres from service speed in shallow water"
    assert heading.split()[:3] == ["manoeuvre", "index", "value"]
    assert first.split() == ["zigzag", "overshoot", "7.78", "7.05", "to", "8.95", "2"]
    assert second.split() == ["period", "-", "-", "0"]
    bare = {"zigzag": {"overshoot": interval(7.777)}}
    assert lines(terminal.manoeuvre_table(bare))[-2].split() == [
        "manoeuvre",
        "index",
        "value",
    ]


def test_predictions_are_shown_by_trial_in_degrees():
    rmse = {"psi": np.radians(2.0), "r": np.radians(0.05), "u": 0.123, "v": None}
    overshoot = {"measured": 8.0, "predicted": 7.5}
    trials = {
        "runs/a.csv": {
            "use": "fit",
            "rmse": rmse,
            "diverged": False,
            "overshoot_1_deg": overshoot,
        },
        "runs/b.csv": {
            "use": "validate",
            "rmse": dict.fromkeys(rmse),
            "diverged": True,
        },
    }
    table = terminal.prediction_table(
        SimpleNamespace(metrics={"trials": trials}), "steered by the model"
    )
    text = lines(table)
    title = (
        "Open-loop simulation of the trials: root mean square errors, steered by the"
        " model"
    )
    assert " ".join(text).startswith(title)
    assert text[-2].split() == [
        "a.csv",
        "fit",
        "2.000",
        "0.050",
        "0.123",
        "-",
        "1st",
        "8.00",
        "->",
        "7.50",
    ]
    assert text[-1].split() == ["b.csv", "validate", "-", "-", "-", "-", "ran", "away"]


def test_structures_and_methods_are_shown_the_best_first():
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
    for held in ("each trial in turn", "trials marked validate"):
        text = lines(
            terminal.selection_table({"held_out": held, "ranking": [first, second]})
        )
        assert text[0] == f"Structures and methods by how they predict {held}"
        assert text[-2].split() == [
            "tls-svm",
            "abkowitz",
            "40",
            "stable",
            "0.1235",
            "1.23",
            "0.0123",
            "0",
        ]
        assert text[-1].split() == [
            "ls",
            "abkowitz",
            "40",
            "unstable",
            "-",
            "-",
            "-",
            "3",
        ]


def test_margins_without_bound_and_without_number_are_told_apart():
    figures = dict.fromkeys(
        (
            "cost_mean",
            "cost_quantile_95",
            "heading_rmse_deg_mean",
            "rudder_travel_deg_min_mean",
        ),
        1.0,
    )
    pid = figures | {
        "margins": {"gain_margin": None, "phase_margin_deg": 61.24},
        "lost_control": 0,
    }
    ppo = figures | {"margins": None, "lost_control": 4}
    metrics = {
        "draws": {"count": 100},
        "ranking": ["pid", "ppo"],
        "controllers": {"pid": pid, "ppo": ppo},
    }
    text = lines(terminal.ranking_table(SimpleNamespace(metrics=metrics)))
    assert text[0] == "Autopilots over 100 models drawn, best first"
    assert text[-2].split() == [
        "PID",
        "1.00",
        "1.00",
        "1.00",
        "1.0",
        "inf",
        "61.2",
        "0",
    ]
    assert text[-1].split() == ["PPO", "1.00", "1.00", "1.00", "1.0", "-", "-", "4"]


def test_a_training_without_a_terminal_is_told_line_by_line(monkeypatch, capsys):
    monkeypatch.setattr(terminal, "err", Console(stderr=True, highlight=False))
    now = {
        "steps": 1000,
        "total": 20000,
        "seconds": 12.4,
        "cost": 5.0,
        "best_cost": 4.5,
        "lq_cost": 6.25,
    }
    with terminal.training_bar() as tell:
        tell(SimpleNamespace(evaluated=True, **now))
        tell(SimpleNamespace(evaluated=False, **now))
        tell(SimpleNamespace(evaluated=True, **now | {"lq_cost": None}))
    told = "step 1,000 of 20,000, 12 s: cost 5.00, best 4.50"
    assert capsys.readouterr().err.splitlines() == [f"{told}, LQ 6.25", told]
    with terminal.printing(as_json=False, quiet=True), terminal.training_bar() as tell:
        assert tell is None
    with terminal.progress_bars() as tell:  # standard error is no terminal
        assert tell is None
    terminal.warn("odd")
    terminal.fail("wrong")
    assert capsys.readouterr().err.splitlines() == ["warning: odd", "error: wrong"]


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
        "contestants": {"lq": {"runs": 1}, "pid": {"runs": 3}},
    }
    return SimpleNamespace(summary=summary, tasks=tuple(summary["tasks"]))


def test_contestants_are_shown_with_the_mean_of_their_times():
    text = lines(benchmark_tables.ranking_table(result()))
    assert text[0] == "shipgym-v1: 2 tasks of 100 episodes, best first"
    assert text[-2].split() == [
        "lq",
        "0.512",
        "0.400",
        "to",
        "0.600",
        "1.500",
        "2",
        "1",
        "1",
        "0",
        "4.00",
    ]
    assert text[-1].split() == [
        "pid",
        "0.512",
        "0.400",
        "to",
        "0.600",
        "1.500",
        "2",
        "3",
        "1",
        "7",
        "-",
    ]


def test_costs_are_shown_by_task_the_lowest_first():
    text = lines(benchmark_tables.costs_table(result()))
    assert [line.split() for line in text[-3:]] == [
        ["calm", "pid", "1.00", "-", "-", "3", "-"],
        ["lq", "2.00", "1.50", "to", "2.50", "-", "3", "98", "%"],
        ["rough", "lq", "2.00", "1.50", "to", "2.50", "-", "3", "98", "%"],
    ]


def test_what_was_run_again_is_the_same_close_or_differs():
    about = {
        "contestant": "lq",
        "task": "calm",
        "episodes": 5,
        "difference": 1.5e-9,
        "note": "",
    }
    checks = [
        SimpleNamespace(exact=exact, passed=passed, **about)
        for exact, passed in ((True, True), (False, True), (False, False))
    ]
    text = lines(benchmark_tables.verification_table(checks))
    assert [line.split()[2:] for line in text[-3:]] == [
        ["5", "none", "the", "same"],
        ["5", "1.5e-09", "close"],
        ["5", "1.5e-09", "differs"],
    ]


def test_a_bar_has_a_share_only_where_the_total_is_known(monkeypatch):
    printed = StringIO()
    monkeypatch.setattr(
        terminal, "err", Console(file=printed, force_terminal=True, width=110)
    )
    with terminal.progress_bars() as tell:
        tell("identifying", 0, 0)
        tell("models drawn", 1, 4)
    last = printed.getvalue().replace("\r", "\n").splitlines()
    unknown, known = (
        next(line for line in last[::-1] if what in line)
        for what in ("identi", "models")
    )
    assert "%" not in unknown
    assert "25%" in known


@pytest.mark.parametrize("quiet", [False, True])
def test_bars_are_shown_on_a_terminal_that_is_not_to_be_quiet(quiet, monkeypatch):
    """Each is 32 characters long; of a training it comes with its costs."""
    printed = StringIO()
    monkeypatch.setattr(
        terminal, "err", Console(file=printed, force_terminal=True, width=110)
    )
    now = {
        "steps": 500,
        "total": 2000,
        "cost": 5.0,
        "best_cost": 4.5,
        "lq_cost": None,
        "evaluated": False,
    }
    with terminal.printing(as_json=False, quiet=quiet):
        with terminal.progress_bars() as tell:
            assert (tell is None) == quiet
            if tell is not None:
                tell("[models] drawn", 1, 4)
        with terminal.training_bar() as tell:
            assert (tell is None) == quiet
            if tell is not None:
                tell(SimpleNamespace(**now))
    lines = Text.from_ansi(printed.getvalue().replace("\r", "\n")).plain.splitlines()
    shown = [
        next((line for line in lines[::-1] if what in line), "")
        for what in ("[models] drawn", "training")
    ]
    assert [line.count("━") + line.count("╸") + line.count("╺") for line in shown] == [
        0 if quiet else 32
    ] * 2
    assert quiet or all("25%" in line for line in shown)
    assert quiet or shown[1].rstrip().endswith("cost 5.00, best 4.50")


def test_what_would_steer_a_terminal_is_left_out_and_no_letter_is(capsys):
    """Control characters but tab and newline, and those that turn the direction of writing."""
    steering = [
        *range(9),
        *range(11, 32),
        *range(0x7F, 0xA0),
        *range(0x202A, 0x202F),
        *range(0x2066, 0x206A),
    ]
    kept = [0x20, 0x7E, 0xA0, 0x2029, 0x202F, 0x2065, 0x206A]
    for code in steering:
        terminal.out.print(f"a{chr(code)}b")
        assert capsys.readouterr().out == "ab\n", hex(code)
    assert set(terminal.CONTROLS) == set(steering)
    for code in kept:
        terminal.out.print(f"a{chr(code)}b", soft_wrap=True)
        assert chr(code) in capsys.readouterr().out, hex(code)


def test_lines_have_110_characters_where_there_is_no_terminal():
    assert terminal.out.width == 110 or sys.__stdout__.isatty()


def test_a_result_for_programs_is_indented_json(capsys):
    with terminal.printing(as_json=True, quiet=False):
        terminal.answer({"a": [1.5], "b": None})
        assert capsys.readouterr().out == '{\n "a": [\n  1.5\n ],\n "b": null\n}\n'
        with pytest.raises(ValueError, match="JSON"):
            terminal.answer({"a": np.nan})


def state():
    return terminal.AS_JSON.get(), terminal.out.quiet, terminal.err.quiet


def test_what_is_printed_after_a_quiet_command_is_printed():
    with terminal.printing(as_json=True, quiet=True):
        assert state() == (True, True, True)
        terminal.fail("said even so")
    assert state() == (False, False, False)


def test_an_identification_tells_its_bars_what_is_counted_and_not_what_is_counted_within(
    monkeypatch,
):
    told = []
    monkeypatch.setattr(
        terminal, "progress_bars", lambda: nullcontext(lambda *now: told.append(now))
    )
    with terminal.identifying("identifying"):
        assert [
            len(list(progress.counted("draws", "ab")))
            for _ in progress.counted("structures", range(2))
        ] == [2, 2]
    assert told == [("identifying", 0, 0), *(("structures", k, 2) for k in range(3))]
    assert list(progress.counted("nobody listens", "ab")) == ["a", "b"]
    assert len(told) == 4

"""What is printed where: messages, JSON and progress."""

import sys
from contextlib import nullcontext
from io import StringIO
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from rich.text import Text

from agents.cli import terminal
from identification import progress


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
    terminal.print_error("wrong")
    assert capsys.readouterr().err.splitlines() == ["warning: odd", "error: wrong"]


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
    """Control characters but tab and newline, and those that turn the direction of
    writing."""
    steering = [
        *range(9),
        *range(11, 32),
        *range(0x7F, 0xA0),
        *range(0x202A, 0x202F),
        *range(0x2066, 0x206A),
    ]
    kept = [0x20, 0x7E, 0xA0, 0x2029, 0x202F, 0x2065, 0x206A]
    for code in steering:
        terminal.console.print(f"a{chr(code)}b")
        assert capsys.readouterr().out == "ab\n", hex(code)
    assert set(terminal.CONTROL_CODES) == set(steering)
    for code in kept:
        terminal.console.print(f"a{chr(code)}b", soft_wrap=True)
        assert chr(code) in capsys.readouterr().out, hex(code)


def test_lines_have_110_characters_where_there_is_no_terminal():
    assert terminal.console.width == 110 or sys.__stdout__.isatty()


def test_a_result_for_programs_is_indented_json(capsys):
    with terminal.printing(as_json=True, quiet=False):
        terminal.answer({"a": [1.5], "b": None})
        assert capsys.readouterr().out == '{\n "a": [\n  1.5\n ],\n "b": null\n}\n'
        with pytest.raises(ValueError, match="JSON"):
            terminal.answer({"a": np.nan})


def state():
    return terminal.AS_JSON.get(), terminal.console.quiet, terminal.err.quiet


def test_what_is_printed_after_a_quiet_command_is_printed():
    with terminal.printing(as_json=True, quiet=True):
        assert state() == (True, True, True)
        terminal.print_error("said even so")
    assert state() == (False, False, False)


def test_an_identification_tells_its_bars_what_is_counted(
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

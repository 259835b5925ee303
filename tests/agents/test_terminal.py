"""What is printed where: messages, JSON, tables and progress."""

from io import StringIO
from time import sleep
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from rich.text import Text

from agents.cli import tables, terminal
from identification import progress
from shipgym.engine.compiling import tell_who_waits

NOW = {"total": 20_000, "seconds": 12.4, "cost": 5.0, "best_cost": 4.5}
NOW["yardsticks"] = {"zero action": 9.0, "LQ": 4.25}


@pytest.mark.parametrize("quiet", [False, True])
def test_bars_are_shown_on_a_terminal_that_is_not_to_be_quiet(quiet, monkeypatch):
    """With a share only where the total is known."""
    printed = StringIO()
    console = Console(file=printed, force_terminal=True, width=110)
    monkeypatch.setattr(terminal, "err", console)
    now = SimpleNamespace(steps=5000, evaluated=True, **NOW)
    with terminal.printing(as_json=False, quiet=quiet):
        with terminal.progress_bars("identifying"):
            list(progress.counted("[models] drawn", "abcd"))
        with terminal.training_bar() as tell:
            tell(now)
    lines = Text.from_ansi(printed.getvalue().replace("\r", "\n")).plain.splitlines()
    last = {line.split()[0]: line for line in lines if line.strip()}
    if quiet:
        assert last == {}
    else:
        assert "%" not in last["identifying"]
        assert "100%" in last["[models]"]
        assert "25%" in last["training"]
        costs = "step 5,000 of 20,000, 12 s: cost 5, best 4.5, LQ 4.25"
        assert last["step"].rstrip() == costs


def test_off_a_terminal_a_line_a_minute_is_printed(monkeypatch, capsys):
    """It says what is done, and at once what is compiled."""
    monkeypatch.setattr(terminal, "FIRST_LINE", 0.2)
    with terminal.progress_bars("models drawn"):
        progress.PROGRESS.get()("models drawn", 1, 4)
        tell_who_waits("compiling a ship")
        sleep(0.4)
    tell_who_waits("compiling another")
    told = "compiling a ship\nmodels drawn, 1 of 4, 0 s so far\n"
    assert capsys.readouterr().err == told


def test_a_piped_table_cuts_no_name(capsys):
    names = [f"{word}{'-very-long' * 5}" for word in ("zigzag", "unit", "verdict")]
    table = tables.plain_table("", "manoeuvre", "unit", "verdict", ">value")
    table.add_row(*names, "1")
    terminal.console.print(table)
    assert names[0] in capsys.readouterr().out


def test_names_from_files_do_not_steer_the_terminal(capsys):
    name = "\x1b[31mred\x1b]0;title\x07 [bold]ship[/] :ship: \u202eright to left\x9b2J"
    table = tables.plain_table(name, name)
    table.add_row(name, Text(name))
    for printed in (name, Text(name), table):
        terminal.console.print(printed, soft_wrap=True)
    terminal.warn(name)
    shown = capsys.readouterr()
    for text in (shown.out, shown.err):
        assert not {*"\x1b\x07\u202e\x9b"} & {*text}
        assert "[31mred]0;title [bold]ship[/] :ship: right to left2J" in text


def test_a_result_for_programs_is_json_and_errors_are_said_even_quietly(capsys):
    with terminal.printing(as_json=True, quiet=True):
        terminal.answer({"a": [1.5], "b": None})
        terminal.say("not this")
        with pytest.raises(ValueError, match="JSON"):
            terminal.answer({"a": np.nan})
        terminal.print_error("wrong")
    shown = capsys.readouterr()
    assert shown.out == '{\n "a": [\n  1.5\n ],\n "b": null\n}\n'
    assert shown.err == "error: wrong\n"
    terminal.warn("odd")
    assert capsys.readouterr().err == "warning: odd\n"

"""Commands for logs as ships make them: `new-ship` and `look`."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from typer import Argument, Exit, Option

from agents.cli.terminal import answer, say, warn
from shipgym.errors import InputError

if TYPE_CHECKING:
    from shipgym.trials.guesses import ColumnGuess, RudderSide, TrialGuess


def new_ship_command(
    logs: Annotated[
        list[Path] | None,
        Argument(
            metavar="LOG...",
            help="Logs: CSV, NMEA 0183 or 2000, Signal K, Excel, Parquet or MATLAB.",
        ),
    ] = None,
    out: Annotated[Path, Option(metavar="FILE", help="The ship file to write.")] = Path(
        "ship.toml"
    ),
    length: Annotated[
        float | None,
        Option(
            min=0.01,
            max=2e3,
            help="Length between perpendiculars, m; or fill it in later.",
        ),
    ] = None,
    update: Annotated[
        Path | None,
        Option(
            metavar="SHIP.TOML",
            help="Check this ship file again after a correction; list all faults.",
        ),
    ] = None,
) -> None:
    """Write a ship file for recorded trials.

    Guesses columns, units and signs, and reports the guesses.
    """
    from shipgym.files import write_text
    from shipgym.pages import render

    if update is not None:
        _check_again(update)
        return
    if not logs:
        raise InputError("new-ship: expected a log, got none; name its file")
    if out.exists():
        raise InputError(
            f"{out}: exists already; choose another name with --out, remove it, or"
            f" check it again: shipgym new-ship --update {out}"
        )
    guessed = _guess_trials(logs)
    facts = _facts(guessed, out) | {"length": length}
    ship_file = render("shipgym.pages/ship.toml.jinja", **facts)
    write_text(ship_file, out)

    trials = [one.trial for one in guessed if one.trial is not None]
    notes = list(dict.fromkeys(note for trial in trials for note in trial.notes))
    answer({"written": str(out), **_fields(guessed[0], facts), "notes": notes})
    summary = render("shipgym.pages/new_ship.txt.jinja", **facts)
    say(summary.strip())
    for note in notes:
        warn(note)


def _check_again(path: Path) -> None:
    """Read all trials of a ship file; exit code 1 where one cannot be read."""
    from shipgym.trials.ship_file import ShipFile

    faults = ShipFile.load(path).faults()
    answer({"checked": str(path), "faults": faults})
    for fault in faults:
        say(f"to correct: {fault}")
    if faults:
        raise Exit(1)
    say(f"{path}: all trials are read; next: shipgym look {path}")


def _fields(first: TrialGuess, facts: dict[str, Any]) -> dict[str, Any]:
    """What was guessed, for a program that reads it."""
    side = facts["side"]
    return {
        "columns": {
            one.channel: {"column": one.name, "unit": one.unit} for one in first.columns
        },
        "unused": first.unused,
        "rudder_positive": side.side if side else None,
        **{one.name: one.value for one in facts["conventions"]},
        "to_decide": facts["to_decide"],
    }


def _facts(guessed: list[TrialGuess], out: Path) -> dict[str, Any]:
    """What the templates of ship file and summary say of the logs."""
    first, *_ = guessed
    side = _rudder_side(guessed)
    speed = _service_speed(guessed)
    named = {column.channel for one in guessed for column in one.columns}
    was_read = any(one.trial is not None for one in guessed)
    needs_speed = was_read and speed is None and "r" in named and "psi" not in named
    declared = [
        {one.channel: one.declaration for one in guess.columns} for guess in guessed
    ]
    is_shared = all(one == declared[0] for one in declared)
    shared = first.columns if is_shared else []
    decisions = {
        one.key: one
        for guess in guessed
        for one in guess.decisions
        if one.section == "columns"
    }
    return {
        "out": out,
        "guessed": guessed,
        "shared": shared,
        "decisions": list(decisions.values()),
        "to_decide": _to_decide(guessed, side, needs_speed=needs_speed),
        "side": side,
        # one log with another convention is enough: others may not tell
        "conventions": list(
            {one.name: one for guess in guessed for one in guess.conventions}.values()
        ),
        "trial": first.trial,
        "trial_columns": first.columns,
        "unused": first.unused_names,
        "speed": speed,
        "needs_speed": needs_speed,
        "files": [_entry(one, shared, out.parent) for one in guessed],
    }


def _rudder_side(guessed: list[TrialGuess]) -> RudderSide | None:
    """Side to which a positive rudder steers, by the logs that tell it.

    None without a rudder.
    """
    from shipgym.trials.guesses import RudderSide

    sides = [one.side for one in guessed if one.side is not None]
    known = [side for side in sides if side.side is not None]
    if len({side.side for side in known}) > 1:
        return RudderSide(None, "the logs contradict each other")
    return next(iter([*known, *sides]), None)


def _to_decide(
    guessed: list[TrialGuess], side: RudderSide | None, *, needs_speed: bool
) -> list[str]:
    """Every decision as a line of the summary."""
    lines = []
    if needs_speed:
        lines.append("speed: the service speed in m/s, as the log has no speed")
    for one in guessed:
        lines += [f"{decision.key}: {decision.choices}" for decision in one.decisions]
    if side is not None and side.side is None:
        lines.append(f"rudder_positive: {side.choices}")
    return lines


def _entry(
    guess: TrialGuess, shared: list[ColumnGuess], folder: Path
) -> dict[str, Any]:
    """A log for the template of the ship file, its path as a text of TOML."""
    of_trial = (one.choices for one in guess.decisions if one.section == "trials")
    return {
        "file": json.dumps(
            os.path.relpath(guess.table.path, folder),
            ensure_ascii=False,
        ),
        "columns": [] if shared else guess.columns,
        "cut": _cut(guess),
        "decision": next(of_trial, None),
    }


def _cut(guess: TrialGuess) -> str:
    """Runs between gaps, or "rudder" in a log that is idle for long; else empty."""
    from shipgym.trials.cuts import active_stretches, runs

    trial = guess.trial
    if trial is None or "delta" not in trial:
        return ""
    between_gaps = runs(trial.t)
    if len(between_gaps) > 1:
        return json.dumps(between_gaps)
    stretches = active_stretches(trial.t, trial["delta"])
    active = sum(last - first for first, last in stretches)
    is_idle = abs(float(np.median(trial["delta"]))) < 0.05  # rad
    is_cut = stretches and is_idle and active < trial.duration / 1.5
    return '"rudder"' if is_cut else ""


def _guess_trials(logs: list[Path]) -> list[TrialGuess]:
    """Logs read with guessed columns; the first has to be a log."""
    from shipgym.trials.guesses import guess_trial

    first, *others = logs
    guessed = [guess_trial(first)]
    for log in others:
        try:
            guessed.append(guess_trial(log))
        except InputError as error:
            warn(f"{error}; left out of the ship file")
    return guessed


def _service_speed(guessed: list[TrialGuess]) -> float | None:
    """Speed, m/s, that is exceeded for a tenth of the time in the fastest trial."""
    trials = [one.trial for one in guessed if one.trial is not None]
    speeds = [float(np.quantile(one["u"], 0.9)) for one in trials if "u" in one]
    return max(speeds, default=None)


def look_command(
    log: Annotated[
        Path,
        Argument(metavar="LOG|SHIP.TOML", help="A log, or a ship file with trials."),
    ],
    out: Annotated[
        Path | None,
        Option(
            metavar="FILE", help="The page to write; by default look-LOG.html, here."
        ),
    ] = None,
) -> None:
    """Draw the trials of a ship file, or a log.

    Shows track, channels, repairs and the problems that were found.
    """
    from agents.output import check_page
    from shipgym.files import write_text
    from shipgym.pages.look import look_page, verdict
    from shipgym.trials.guesses import guess_trial
    from shipgym.trials.ship_file import ShipFile

    out = out or Path(f"look-{log.stem}.html")
    check_page(out, plots=True)
    if log.suffix == ".toml":
        ship_file = ShipFile.load(log)
        trials = ship_file.trials(decided=False)
        readings = [dict[str, str]() for _ in trials]  # as it declares
        remarks = [*ship_file.undecided]
    else:
        guess = guess_trial(log)
        if guess.trial is None:
            wrong = [f"{one.key}: expected {one.choices}" for one in guess.decisions]
            raise InputError(
                f"{log}: {'; '.join(wrong)}; shipgym new-ship {log} writes a ship file"
                " in which to say so"
            )
        trials = [guess.trial]
        readings = [guess.reading]
        remarks = [one.choices for one in guess.decisions]

    write_text(look_page(log.name, trials, readings, remarks), out)
    headline, _ = verdict(trials, remarks)
    say(headline)
    fields = []
    for trial, reading in zip(trials, readings, strict=True):
        fields.append(
            {
                "name": trial.name,
                "samples": len(trial),
                "duration_s": trial.duration,
                "channels": [*trial.channels],
                "read_as": reading,
                "notes": [*trial.notes],
            }
        )
        say(
            f"{trial.name}: {len(trial)} samples over {trial.duration:.5g} s:"
            f" {', '.join(trial.channels)}"
        )
        for channel, words in reading.items():
            say(f"  {channel}: {words}")
        for note in trial.notes:
            warn(f"{trial.name}: {note.removeprefix(f'{trial.name}: ')}")
    for remark in remarks:
        warn(remark)
    answer(
        {
            "written": str(out),
            "verdict": headline,
            "trials": fields,
            "to_decide": remarks,
        }
    )
    say(f"written: {out}")

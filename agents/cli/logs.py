"""Commands for logs as ships make them: `new-ship` and `look`."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

if TYPE_CHECKING:
    from shipgym.trials.guesses import TrialGuess


def new_ship_command(
    logs: Annotated[
        list[Path],
        Argument(
            metavar="LOG...",
            help="Logs: CSV, NMEA 0183 or 2000, Signal K, Excel, Parquet or MATLAB.",
        ),
    ],
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
    strict: Annotated[
        bool,
        Option("--strict", help="Refuse sentences of NMEA 0183 without a checksum."),
    ] = False,
) -> None:
    """Write a ship file for recorded trials.

    Guesses columns, units and signs, and reports the guesses.
    """
    from agents.cli.terminal import answer, say, warn
    from shipgym.checks import shown
    from shipgym.errors import InputError
    from shipgym.files import write_text
    from shipgym.pages import render

    if out.exists():
        raise InputError(
            f"{out}: exists already; choose another name with --out, or remove it"
        )
    checksums = "required" if strict else "optional"
    guessed = _guess_trials(logs, checksums)
    conventions = _conventions(guessed)
    rudder_side = conventions.pop("rudder_positive", "starboard")
    first, *_ = guessed
    facts: dict[str, Any] = {
        "out": out,
        "length": length,
        "checksums": checksums,
        "guesses": first.columns,
        "side": rudder_side,
        "conventions": conventions,
        "trial": first.trial,
        "unused": ", ".join(shown(column) for column in first.unused),
        "speed": _service_speed(guessed),
        "files": [_toml_path(log, out.parent) for log in logs],
    }
    ship_file = render("shipgym.pages/ship.toml.jinja", **facts)
    write_text(ship_file, out)

    notes = first.trial.notes
    answer(
        {
            "written": str(out),
            "columns": _columns(first),
            "unused": first.unused,
            "rudder_positive": rudder_side,
            **conventions,
            "notes": [*notes],
        }
    )
    summary = render("shipgym.pages/new_ship.txt.jinja", **facts)
    say(summary.strip())
    for note in notes:
        warn(note)


def _conventions(guessed: list[TrialGuess]) -> dict[str, str]:
    """Conventions of logs by name.

    One log with another convention is enough: the usual one is also guessed from a log
    that does not tell.
    """
    conventions = {}
    for one in guessed:
        for convention in one.conventions:
            conventions[convention.name] = convention.value
    return conventions


def _columns(guessed: TrialGuess) -> dict[str, Any]:
    """Column and unit of each channel."""
    columns = {}
    for guess in guessed.columns:
        columns[guess.channel] = {"column": guess.column, "unit": guess.unit}
    return columns


def _guess_trials(logs: list[Path], checksums: str) -> list[TrialGuess]:
    """Logs read with guessed columns; only the first has to be readable."""
    from agents.cli.terminal import warn
    from shipgym.errors import InputError
    from shipgym.trials.guesses import guess_trial

    try:
        guessed = [guess_trial(logs[0], checksums=checksums)]
    except InputError as error:
        message = str(error)
        remedies = ("[columns]", "[conventions]", "[sensors]", "declare ")
        if any(remedy in message for remedy in remedies):
            message += (
                "; new-ship has written no ship file in which to do so: write one as in"
                " docs/ship_file.md"
            )
        raise InputError(message) from None

    for log in logs[1:]:
        try:
            guessed.append(guess_trial(log, checksums=checksums))
        except InputError as error:
            warn(str(error))
    return guessed


def _service_speed(guessed: list[TrialGuess]) -> float | None:
    """Speed, m/s, that is exceeded for a tenth of the time in the fastest trial."""
    import numpy as np

    speeds = []
    for one in guessed:
        trial = one.trial
        for channel in ("u", "stw", "sog"):
            if channel in trial.channels:
                speeds.append(float(np.quantile(trial[channel], 0.9)))
                break
    return max(speeds, default=None)


def _toml_path(path: Path, folder: Path) -> str:
    """A path relative to a folder, as a text of TOML."""
    return json.dumps(os.path.relpath(path, folder), ensure_ascii=False)


def look_command(
    log: Annotated[
        Path,
        Argument(metavar="LOG|SHIP.TOML", help="A log, or a ship file with trials."),
    ],
    out: Annotated[Path, Option(metavar="FILE", help="The page to write.")] = Path(
        "look.html"
    ),
    strict: Annotated[
        bool,
        Option("--strict", help="Refuse sentences of NMEA 0183 without a checksum."),
    ] = False,
) -> None:
    """Draw the trials of a ship file, or a log.

    Shows track, channels, repairs and the problems that were found.
    """
    from agents.cli.terminal import answer, say, warn
    from agents.output import check_page
    from shipgym.files import write_text
    from shipgym.pages.look import look_page
    from shipgym.trials.guesses import guess_trial
    from shipgym.trials.ship_file import ShipFile

    check_page(out, plots=True)
    if log.suffix == ".toml":
        trials = ShipFile.load(log).trials()
    else:
        checksums = "required" if strict else "optional"
        trials = [guess_trial(log, checksums=checksums).trial]

    write_text(look_page(log.name, trials), out)
    fields = []
    for trial in trials:
        about = {
            "name": trial.name,
            "samples": len(trial),
            "duration_s": trial.duration,
            "channels": [*trial.channels],
            "notes": [*trial.notes],
        }
        fields.append(about)
    answer({"written": str(out), "trials": fields})
    for trial in trials:
        channels = ", ".join(trial.channels)
        say(
            f"{trial.name}: {len(trial)} samples over {trial.duration:.5g} s:"
            f" {channels}"
        )
        for note in trial.notes:
            warn(f"{trial.name}: {note}")
    say(f"written: {out}")

"""Commands for logs as ships make them: `new-ship` and `look`."""

import json
import os
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from agents.cli.command import answered

NO_FILE_YET = (
    "; new-ship has written no ship file in which to do so: write one as in"
    " docs/ship_file.md"
)


@answered
def new_ship_command(
    logs: Annotated[
        list[Path],
        Argument(
            metavar="LOG...", help="Logs: CSV, NMEA 0183, Excel, Parquet or MATLAB."
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
) -> None:
    """Write a ship file for recorded trials. Guesses columns, units and signs, and reports the guesses."""
    import numpy as np

    from agents.cli.terminal import answer, say, warn
    from shipgym.checks import shown
    from shipgym.errors import InputError
    from shipgym.files import write_text
    from shipgym.pages import render
    from shipgym.trials.guesses import guess_trial

    if out.exists():
        raise InputError(
            f"{out}: exists already; choose another name with --out, or remove it"
        )
    try:
        read = [guess_trial(logs[0])]
    except InputError as error:
        declared = any(
            word in str(error)
            for word in ("[columns]", "[conventions]", "[sensors]", "declare ")
        )
        raise InputError(f"{error}{NO_FILE_YET if declared else ''}") from None
    for log in logs[1:]:
        try:
            read.append(guess_trial(log))
        except InputError as error:
            warn(str(error))
    guesses, trial, unused = read[0].columns, read[0].trial, read[0].unused
    # one log with another convention is enough: the usual one is also what a log says
    # that does not tell
    found = {one.name: one.value for log in read for one in log.conventions}
    side = found.pop("rudder_positive", "starboard")
    known = [
        [one.trial[name] for name in ("u", "stw", "sog") if name in one.trial.channels]
        for one in read
    ]
    speeds = [float(np.quantile(speed[0], 0.9)) for speed in known if speed]
    facts: dict[str, Any] = {
        "out": out,
        "length": length,
        "guesses": guesses,
        "side": side,
        "conventions": found,
        "trial": trial,
        "unused": ", ".join(map(shown, unused)),
        "speed": max(speeds, default=None),
        "files": [
            json.dumps(os.path.relpath(log, out.parent), ensure_ascii=False)
            for log in logs
        ],
    }
    write_text(render("shipgym.pages/ship.toml.jinja", **facts), out)
    columns = {one.channel: {"column": one.column, "unit": one.unit} for one in guesses}
    words = {"rudder_positive": side, **found}
    answer(
        {
            "written": str(out),
            "columns": columns,
            "unused": unused,
            **words,
            "notes": [*trial.notes],
        }
    )
    say(render("shipgym.pages/new_ship.txt.jinja", **facts).strip())
    for note in trial.notes:
        warn(note)


@answered
def look_command(
    log: Annotated[
        Path,
        Argument(metavar="LOG|SHIP.TOML", help="A log, or a ship file with trials."),
    ],
    out: Annotated[Path, Option(metavar="FILE", help="The page to write.")] = Path(
        "look.html"
    ),
) -> None:
    """Draw the trials of a ship file, or a log. Shows track, channels, repairs and problems found."""
    from agents.cli.terminal import answer, say, warn
    from agents.output import check_page
    from shipgym.files import write_text
    from shipgym.pages.look import look_page
    from shipgym.trials.guesses import guess_trial
    from shipgym.trials.ship_file import ShipFile

    check_page(out, plots=True)
    trials = (
        ShipFile.load(log).trials()
        if log.suffix == ".toml"
        else [guess_trial(log).trial]
    )
    write_text(look_page(log.name, trials), out)
    fields = [
        {
            "name": one.name,
            "samples": len(one),
            "duration_s": one.duration,
            "channels": [*one.channels],
            "notes": [*one.notes],
        }
        for one in trials
    ]
    answer({"written": str(out), "trials": fields})
    for trial in trials:
        about = (
            f"{len(trial)} samples over {trial.duration:.5g} s:"
            f" {', '.join(trial.channels)}"
        )
        say(f"{trial.name}: {about}")
        for note in trial.notes:
            warn(f"{trial.name}: {note}")
    say(f"written: {out}")

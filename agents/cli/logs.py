"""Commands for logs as ships make them: `new-ship` and `look`."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from agents.cli.command import answered

if TYPE_CHECKING:
    from shipgym.trials.trial import Trial

HISTORIES = ("psi", "r", "delta", "u", "v", "n", "phi", "wind_speed")


@answered
def new_ship_command(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Logs: CSV, NMEA 0183, Excel, Parquet or MATLAB.")
    ],
    out: Annotated[Path, typer.Option(metavar="SHIP.TOML", help="The ship file to write.")] = Path("ship.toml"),
    length: Annotated[
        float | None, typer.Option(min=0.01, help="Length between perpendiculars, m; else to be filled in.")
    ] = None,
) -> None:
    """Write a ship file for recorded trials, guessing columns, units and signs, and say what was guessed."""
    from agents.cli.terminal import out as console
    from agents.cli.terminal import warn
    from shipgym.errors import InputError
    from shipgym.files import write_text
    from shipgym.pages import render
    from shipgym.trials.guesses import ship_file_data

    if out.exists():
        raise InputError(f"{out}: exists already; choose another name with --out, or remove it")
    data = ship_file_data(logs[0])
    files = [json.dumps(os.path.relpath(log, out.parent), ensure_ascii=False) for log in logs]
    write_text(render("shipgym.pages/ship.toml.jinja", name=out.name, length=length, files=files, **data), out)
    for one in data["guesses"]:
        console.print(f"{one.channel}: column '{one.column}' in {one.unit}, unit {one.reason}", soft_wrap=True)
    trial = data["trial"]
    if not data["guesses"]:
        console.print(f"channels: {', '.join(trial.channels)}")
    console.print(f"a positive rudder steers to {data['side']}, by the yaw that follows it" if "delta" in trial else "")
    for note in trial.notes:
        warn(note)
    missing = "" if length else ", fill in the ship's length"
    console.print(f"written: {out}{missing}; next: shipgym look {out} --out look.html", soft_wrap=True)


@answered
def look_command(
    log: Annotated[Path, typer.Argument(metavar="LOG|SHIP.TOML", help="A log, or a ship file with its trials.")],
    out: Annotated[Path, typer.Option(metavar="LOOK.HTML", help="The page to write.")] = Path("look.html"),
) -> None:
    """Draw the trials of a ship file, or a log: track, channels, and what was repaired or found amiss."""
    import numpy as np

    from agents.cli.terminal import out as console
    from agents.cli.terminal import warn
    from agents.cli.trials_page import check_page
    from shipgym.files import write_text
    from shipgym.pages import render
    from shipgym.trials.guesses import guess_trial
    from shipgym.trials.ship_file import ShipFile

    check_page(out)
    trials = ShipFile.load(log).trials() if log.suffix == ".toml" else [guess_trial(log)[2]]
    figures = [_figures(trial) for trial in trials]
    steps = [float(np.median(np.diff(trial.t))) for trial in trials]
    write_text(render("shipgym.pages/look.html", name=log.name, trials=trials, figures=figures, steps=steps), out)
    for trial in trials:
        console.print(f"{trial.name}: {len(trial)} samples over {trial.duration:.5g} s: {', '.join(trial.channels)}", soft_wrap=True)
        for note in trial.notes:
            warn(f"{trial.name}: {note}")
    console.print(f"written: {out}", soft_wrap=True)


def _figures(trial: Trial) -> list[tuple[str, Any, str]]:
    """Name, figure and caption of the track and of the channels."""
    from shipgym.plots import history_figure, path_figure

    track = "The track from the first position, north up, in metres."
    found = [("track", path_figure({"measured": trial}), track)] if {"x", "y"} <= trial.channels.keys() else []
    return [*found, ("channels", history_figure({"measured": trial}, HISTORIES), "The channels over time.")]

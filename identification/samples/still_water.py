"""Trials as they would have been in still water: without current and wind."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from identification.samples.velocities import CURRENT_COLUMNS, over_ground
from shipgym import InputError, Particulars, Trial
from shipgym.checks import (
    check_choice,
    check_flag,
    check_keys,
    check_number,
    check_text,
)


def check_current(option: Any) -> None:
    """Refuse a current that is neither a word nor a table of north and east, m/s."""
    currents = ("auto", "none")
    if not isinstance(option, Mapping):
        check_choice(
            option,
            currents,
            "current",
            " or a table of north and east",
        )
        return
    check_keys(option, ("north", "east"), "current", ("north", "east"))
    for name, value in option.items():
        check_number(value, f"current {name}", hint="in m/s")


def check_wind(option: Any) -> None:
    """Refuse a wind that is neither a word nor a table of coefficients."""
    if not isinstance(option, Mapping):
        check_text(option, "wind")
        return
    check_keys(option, ("coefficients", "relative"), "wind")
    check_flag(option.get("relative", False), "wind relative")


def in_still_water(
    trials: Sequence[Trial],
    particulars: Particulars | Mapping[str, Any] | None,
    current: str | Mapping[str, float] = "auto",
    wind: str | Mapping[str, Any] = "auto",
) -> tuple[list[Trial], dict[str, Any]]:
    """Trials without current and with the accelerations by wind; a report on both.

    Trials that are skipped keep both; of those whose velocities are through the water a
    current in columns is taken out of the track. `current` and `wind` are those of
    `Options`.
    """
    is_usual_wind = isinstance(wind, str) and wind in ("auto", "none")
    feels_sea = any(_feels_sea(trial) for trial in trials)
    in_still = is_usual_wind and not feels_sea
    if particulars is None or in_still:
        return list(trials), {}

    ship = particulars
    if isinstance(ship, Mapping):
        ship = Particulars.from_mapping(ship)
    remarks: list[str] = []
    report: dict[str, Any] = {}
    free_running = {
        trial.name: trial
        for trial in trials
        if trial.use != "skip" and trial.kind != "captive"
    }
    found = _with_wind(free_running, ship, wind, remarks)
    wind_speeds = {
        name: float(trial["wind_speed"].mean())
        for name, trial in found.items()
        if {"wind_udot", "wind_speed"} <= trial.channels.keys()
    }
    if wind_speeds:
        report["wind"] = {"option": wind, "mean_speeds": wind_speeds}

    speed = ship.speed or _starting_speed(found.values())
    if current != "none" and speed > 0.0:
        from identification.samples.trial_currents import without_current

        rows = without_current(
            found,
            ship.length,
            speed,
            current,
            remarks,
        )
        if rows:
            report["currents"] = rows
    if remarks:
        report["sea_remarks"] = remarks
    return [found.get(trial.name, trial) for trial in trials], report


def _feels_sea(trial: Trial) -> bool:
    columns = {"wind_speed", "wind_from", *CURRENT_COLUMNS}
    return trial.over_ground or bool(columns & trial.channels.keys())


def _starting_speed(trials: Iterable[Trial]) -> float:
    """Median speed over ground at the start of trials, m/s; 0 where none is known."""
    starts = [
        np.hypot(*[component[0] for component in over_ground(trial)])
        for trial in trials
        if {"u", "v"} <= trial.channels.keys()
    ]
    return float(np.median(starts)) if starts else 0.0


def _with_wind(
    trials: Mapping[str, Trial],
    ship: Particulars,
    option: Any,
    remarks: list[str],
) -> dict[str, Trial]:
    """The trials by name, with the accelerations by their wind."""
    if option == "none":
        return dict(trials)

    from identification.samples.wind import measured_wind

    found = {}
    try:
        for name, trial in trials.items():
            found[name] = measured_wind(trial, ship, option)
    except InputError as error:
        if option != "auto":
            raise
        remarks.append(f"the logged wind is not removed: {error}")
        return dict(trials)

    is_logged = any("wind_udot" in trial for trial in found.values())
    if option != "auto" and not is_logged:
        raise InputError(
            f"wind: expected columns wind_speed and wind_from besides psi, u and v for"
            f" {option!r}, got no trial with them; name them in [columns]"
        )
    return found

"""Trials as they would have been in still water: current and wind taken out, and what is known of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np
from scipy.stats import chi2

from identification.regression.current import CurrentEstimate, estimate_current, over_ground
from identification.regression.wind import ACCELERATIONS, measured_wind
from shipgym.arrays import Floats, integral
from shipgym.checks import check_choice, check_keys, check_number
from shipgym.errors import InputError
from shipgym.ships.particulars import Particulars
from shipgym.trials.identify_table import OPTIONS, Options
from shipgym.trials.trial import Trial
from shipgym.trials.trial_import import rotate_to_body

NEEDED = {"psi", "u", "v", "r", "delta"}
COLUMNS = ("current_north", "current_east")
CONTRADICTION = 0.1  # m/s between a current in columns and one that is given
SIGNIFICANT = 0.01  # probability below which a current differs from zero
APART = 1e-6  # the same of the currents of trials from each other, whose covariance is of few blocks
UNCERTAIN = 0.05  # standard error by service speed beyond which a current is not known
ONE_HEADING = 0.85  # length of the mean unit vector of the headings, beyond which speed hides the current
SHORTEST = 5.0  # ship lengths at service speed that a trial lasts from which a current is estimated
REMEDY = (
    "add a turn of a whole circle, or runs on other headings at the same shaft speed, give the current "
    '(current = { north = 0.2, east = -0.1 }, m/s), or take none out (current = "none")'
)


def in_still_water(
    trials: Sequence[Trial], options: Options, particulars: Particulars | Mapping[str, Any] | None
) -> tuple[list[Trial], dict[str, Any]]:
    """The trials without current and with the accelerations by wind, and what was found, for the provenance.

    Trials that are skipped keep both; of those whose velocities are through the water a current in columns is
    taken out of the track. Raises InputError for a current that cannot be told, is larger than the ship's
    speed or contradicts its columns, and for wind that cannot be taken out though it was asked for.
    """
    if isinstance(options.current, str):
        check_choice(options.current, OPTIONS["current"].choices, "current")
    ship = Particulars.from_mapping(particulars) if isinstance(particulars, Mapping) else particulars
    used = [trial for trial in trials if trial.use != "skip" and trial.kind != "captive"]
    if ship is None:
        return list(trials), {}
    remarks: list[str] = []
    found = _with_wind(used, ship, options.wind, remarks)
    windy = {t.name: float(t["wind_speed"].mean()) for t in found.values() if ACCELERATIONS[0] in t}
    report: dict[str, Any] = {"wind": {"option": options.wind, "mean_speeds": windy}} if windy else {}
    starts = [np.hypot(*over_ground(t))[0] for t in found.values() if {"u", "v"} <= t.channels.keys()]
    speed = ship.speed or float(np.median(starts or [0.0]))
    if options.current != "none" and speed > 0.0:
        currents = _take_out_known(found, speed, options.current)
        currents |= _take_out_estimated(found, ship.length, speed, options.current, remarks)
        report |= {"currents": currents} if currents else {}
    report |= {"sea_remarks": remarks} if remarks else {}
    return [found.get(trial.name, trial) for trial in trials], report


def _with_wind(
    trials: Sequence[Trial], ship: Particulars, option: Any, remarks: list[str]
) -> dict[str, Trial]:
    """The trials by name, with the accelerations by their wind."""
    found = {trial.name: trial for trial in trials}
    if option in ("none", "constant"):
        return found
    try:
        found = {trial.name: measured_wind(trial, ship, option) for trial in trials}
    except InputError as error:
        if option != "auto":
            raise
        remarks.append(f"the wind that was logged is not taken out: {error}")
    if option != "auto" and not any(ACCELERATIONS[0] in trial for trial in found.values()):
        raise InputError(
            f"wind: {option!r} found, but no trial has the columns wind_speed and wind_from beside psi, u "
            'and v; name them in [columns], or take wind = "constant"'
        )
    return found


def _take_out_known(found: dict[str, Trial], speed: float, option: Any) -> dict[str, Any]:
    """Take currents in columns, and one that is given, out of trials by name; each in words and numbers."""
    currents = {}
    for trial in found.values():
        known = _known(trial, option)
        if known is None:
            continue
        mean = np.array([np.mean(part) for part in known])
        if np.hypot(*mean) > speed:
            raise InputError(
                f"trial {trial.name!r}: a current of {np.hypot(*mean):.2g} m/s found, expected less than the "
                f"ship's speed of {speed:.3g} m/s; give it in m/s, towards north and east"
            )
        found[trial.name] = through_water(trial, *known)
        source = "columns" if COLUMNS[0] in trial else "given"
        currents[trial.name] = _row(mean, None) | {"source": source}
    return currents


def _take_out_estimated(
    found: dict[str, Trial], length: float, speed: float, option: Any, remarks: list[str]
) -> dict[str, Any]:
    """Take estimated currents out of the trials whose velocities are still over ground."""
    shortest = SHORTEST * length / speed
    unknown = [
        trial
        for trial in found.values()
        if trial.over_ground and trial.channels.keys() >= NEEDED and trial.duration > shortest
    ]
    headings = [trial["psi"] for trial in unknown if trial.use == "fit"]
    one_heading = bool(headings) and abs(np.exp(1j * np.concatenate(headings)).mean()) > ONE_HEADING
    currents: dict[str, Any] = {}
    doubts: dict[str, list[str]] = {}
    for trial, mean, covariance, source in _estimates(unknown, length, speed, option):
        row = _row(mean, covariance) | {"source": source}
        doubt = "the trials keep to one heading" if one_heading else _doubt(mean, covariance, speed)
        if doubt and option != "auto":
            raise InputError(f"trial {trial.name!r}: its current cannot be told: {doubt}; {REMEDY}")
        row["taken_out"] = not doubt and (option != "auto" or row["probability"] < SIGNIFICANT)
        if doubt:
            doubts.setdefault(doubt, []).append(PurePath(trial.name).name)
        if row["taken_out"]:
            found[trial.name] = through_water(trial, *mean)
        currents[trial.name] = row
    remarks += [
        f"{', '.join(names)}: the current cannot be told and is not taken out: {doubt}; {REMEDY}"
        for doubt, names in doubts.items()
    ]
    return currents


def _known(trial: Trial, option: Any) -> Floats | None:
    """North and east of a current in columns or given, shape (2,) or (2, n_samples); None where unknown."""
    given = None
    if isinstance(option, Mapping):
        check_keys(option, ("north", "east"), "current", ("north", "east"))
        parts = (check_number(option[name], f"current {name}", hint="in m/s") for name in ("north", "east"))
        given = np.array([*parts])
    if not trial.channels.keys() >= set(COLUMNS):
        return given if trial.over_ground else None
    columns = np.array([trial[name] for name in COLUMNS])
    if given is not None and np.hypot(*(columns.mean(axis=1) - given)) > CONTRADICTION:
        north, east = columns.mean(axis=1)
        raise InputError(
            f"trial {trial.name!r}: columns current_north and current_east have means of {north:.2f} and "
            f"{east:.2f} m/s, current = {{ north = {given[0]:g}, east = {given[1]:g} }} was given, expected "
            "them to agree; leave one of them out"
        )
    return columns


def _estimates(
    trials: Sequence[Trial], length: float, speed: float, option: str
) -> Iterator[tuple[Trial, Floats, Floats, str]]:
    """Each trial with its current, the covariance of it and whose it is.

    The trials to fit have one current unless they contradict it or are asked one by one. That of a trial held
    out is theirs, or is found by their coefficients.
    """
    fitted = [trial for trial in trials if trial.use == "fit"]
    if not fitted:
        return
    found = estimate_current(fitted, length, speed, shared=option != "trial")
    shared = option != "trial"
    if option == "auto" and len(fitted) > 1:
        each = estimate_current(fitted, length, speed, shared=False)
        if _probability_of_one(each) < APART:
            found, shared = each, False
    held_out = [trial for trial in trials if trial.use != "fit"]
    for k, trial in enumerate(fitted):
        own = slice(2 * k, 2 * k + 2)
        yield trial, found.mean[own], found.covariance[own, own], "all trials" if shared else "trial"
    for trial in held_out:
        last = found if shared else estimate_current([trial], length, speed, True, found.coefficients)
        yield trial, last.mean[:2], last.covariance[:2, :2], "all trials" if shared else "trial"


def _probability_of_one(each: CurrentEstimate) -> float:
    """Probability that currents of trials differ so much though they are one (Wald's test)."""
    count = len(each.mean) // 2
    differences = np.kron(np.eye(count)[1:] - np.eye(count)[0], np.eye(2))
    return _probability(differences @ each.mean, differences @ each.covariance @ differences.T)


def _probability(mean: Floats, covariance: Floats) -> float:
    """Probability of values as far from zero by chance."""
    return float(chi2.sf(mean @ np.linalg.solve(covariance, mean), len(mean)))


def _row(mean: Floats, covariance: Floats | None) -> dict[str, Any]:
    """What the provenance tells of a current; towards in degrees."""
    row = {
        "north": float(mean[0]),
        "east": float(mean[1]),
        "speed": float(np.hypot(*mean)),
        "towards": float(np.degrees(np.arctan2(mean[1], mean[0])) % 360.0),
        "taken_out": True,
    }
    if covariance is None:
        return row
    errors = np.sqrt(np.diag(covariance)).tolist()
    return row | {"standard_errors": errors, "probability": _probability(mean, covariance)}


def _doubt(mean: Floats, covariance: Floats, speed: float) -> str:
    """Why an estimated current cannot be trusted; empty where it can."""
    variances, axes = np.linalg.eigh(covariance)
    if np.sqrt(variances[-1]) > UNCERTAIN * speed:
        axis = float(np.degrees(np.arctan2(axes[1, -1], axes[0, -1])) % 180.0)
        return f"its standard error along {axis:03.0f} deg is {np.sqrt(variances[-1]):.2g} m/s"
    if np.hypot(*mean) > speed:
        return f"{np.hypot(*mean):.2g} m/s is found, more than the ship's speed of {speed:.3g} m/s"
    return ""


def through_water(trial: Trial, north: Any, east: Any) -> Trial:
    """The trial without a current, m/s, each a number or of shape (n_samples,).

    A track is as if the water stood still since the start; velocities over ground become those through the
    water, but for one that was logged.
    """
    north, east = (np.broadcast_to(np.asarray(part, dtype=float), trial.t.shape) for part in (north, east))
    channels = dict(zip(COLUMNS, (north, east), strict=True))
    for name, speed in (("x", north), ("y", east)):
        if name in trial:
            channels[name] = trial[name] - integral(trial.t, speed)
    if trial.over_ground and trial.channels.keys() >= {"u", "v", "psi"}:
        drift = rotate_to_body(north, east, trial["psi"])
        for name, ground, own in zip("uv", over_ground(trial), drift, strict=True):
            if not trial.derived & {"u", "v"} or name in trial.derived:
                channels[name] = ground - own
    return trial.with_channels(channels).with_(over_ground=False)

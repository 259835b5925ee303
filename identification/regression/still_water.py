"""Trials as they would have been in still water: current and wind taken out, and what is known of them."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np
from scipy.stats import chi2

from identification.regression.current import estimate_current, over_ground
from identification.regression.wind import measured_wind
from shipgym import InputError, Particulars, Trial
from shipgym.arrays import Floats, integral
from shipgym.checks import check_choice, check_keys, check_number
from shipgym.trials.identify_table import OPTIONS, Options
from shipgym.trials.navigation import rotate_to_body

NEEDED = {"psi", "u", "v", "r", "delta"}
COLUMNS = ("current_north", "current_east")
CONTRADICTION = 0.1  # m/s between a current in columns and one that is given
SIGNIFICANT = 0.01  # probability below which a current differs from zero
# the same of the currents of trials from each other, whose covariance is of few blocks
APART = 1e-6
UNCERTAIN = 0.05  # standard error by service speed beyond which a current is not known
# length of the mean unit vector of the headings, beyond which speed hides the current
ONE_HEADING = 0.85
# ship lengths at service speed that a trial lasts from which a current is estimated
SHORTEST = 5.0
REMEDY = (
    "add a turn of a whole circle, or runs on other headings at the same shaft speed,"
    " give the current (current = { north = 0.2, east = -0.1 }, m/s), or take none out"
    ' (current = "none")'
)


def in_still_water(
    trials: Sequence[Trial],
    options: Options,
    particulars: Particulars | Mapping[str, Any] | None,
) -> tuple[list[Trial], dict[str, Any]]:
    """The trials without current and with the accelerations by wind, and what was found, for the provenance.

    Trials that are skipped keep both; of those whose velocities are through the water a
    current in columns is taken out of the track.
    """
    if isinstance(options.current, str):
        check_choice(options.current, OPTIONS["current"].choices, "current")
    ship = (
        Particulars.from_mapping(particulars)
        if isinstance(particulars, Mapping)
        else particulars
    )
    if ship is None:
        return list(trials), {}
    used = {
        trial.name: trial
        for trial in trials
        if trial.use != "skip" and trial.kind != "captive"
    }
    remarks: list[str] = []
    found = _with_wind(used, ship, options.wind, remarks)
    windy = {
        t.name: float(t["wind_speed"].mean())
        for t in found.values()
        if "wind_udot" in t
    }
    report: dict[str, Any] = (
        {"wind": {"option": options.wind, "mean_speeds": windy}} if windy else {}
    )
    starts = [
        np.hypot(*over_ground(t))[0]
        for t in found.values()
        if {"u", "v"} <= t.channels.keys()
    ]
    speed = ship.speed or float(np.median(starts or [0.0]))
    if options.current != "none" and speed > 0.0:
        report["currents"] = _take_out_current(
            found, ship.length, speed, options.current, remarks
        )
    report["sea_remarks"] = remarks
    return [found.get(t.name, t) for t in trials], {
        name: part for name, part in report.items() if part
    }


def _with_wind(
    trials: dict[str, Trial], ship: Particulars, option: Any, remarks: list[str]
) -> dict[str, Trial]:
    """The trials by name, with the accelerations by their wind."""
    if option in ("none", "constant"):
        return dict(trials)
    try:
        found = {
            name: measured_wind(trial, ship, option) for name, trial in trials.items()
        }
    except InputError as error:
        if option != "auto":
            raise
        remarks.append(f"the logged wind is not removed: {error}")
        return dict(trials)
    if option != "auto" and not any("wind_udot" in trial for trial in found.values()):
        raise InputError(
            f"wind: {option!r} found, but no trial has the columns wind_speed and"
            " wind_from beside psi, u and v; name them in [columns], or take wind ="
            ' "constant"'
        )
    return found


def _take_out_current(
    found: dict[str, Trial],
    length: float,
    speed: float,
    option: Any,
    remarks: list[str],
) -> dict[str, Any]:
    """Take the current out of trials, by name, where it is known or asked for; what is known of each."""
    open_ = [
        t for t in found.values() if t.over_ground and t.use == "fit" and "psi" in t
    ]
    one_heading = (
        open_
        and abs(np.exp(1j * np.concatenate([t["psi"] for t in open_])).mean())
        > ONE_HEADING
    )
    rows, doubts = dict[str, Any](), dict[str, list[str]]()
    for trial, current, covariance, source in _currents(
        list(found.values()), length, speed, option
    ):
        mean = np.reshape(current, (2, -1)).mean(axis=1)
        row: dict[str, Any] = {"north": float(mean[0]), "east": float(mean[1])}
        row |= {"source": source, "taken_out": True}
        doubt = ""
        if covariance is not None:
            errors = np.sqrt(np.diag(covariance))
            # drift by the current and drift by the ship's own neutral helm look alike
            if one_heading:
                doubt = "the trials keep to one heading"
            else:
                row |= {
                    "standard_errors": errors.tolist(),
                    "probability": _probability(mean, covariance),
                }
                if errors.max() > UNCERTAIN * speed:
                    doubt = f"its standard error is {errors.max():.2g} m/s"
        if not doubt and np.hypot(*mean) > speed:
            doubt = (
                f"{np.hypot(*mean):.2g} m/s found, expected less than the ship's speed"
                f" of {speed:.3g} m/s"
            )
        if doubt and (option != "auto" or covariance is None):
            remedy = (
                "give it in m/s, towards north and east"
                if covariance is None
                else REMEDY
            )
            raise InputError(
                f"trial {trial.name!r}: no current can be removed: {doubt}; {remedy}"
            )
        if doubt:
            doubts.setdefault(doubt, []).append(PurePath(trial.name).name)
        if doubt or (option == "auto" and row.get("probability", 0.0) > SIGNIFICANT):
            row["taken_out"] = False
        else:
            found[trial.name] = through_water(trial, *current)
        rows[trial.name] = row
    for doubt, names in doubts.items():
        remarks.append(f"{', '.join(names)}: no current is removed: {doubt}; {REMEDY}")
    return rows


def _currents(
    trials: Sequence[Trial], length: float, speed: float, option: Any
) -> Iterator[tuple[Trial, Floats, Floats | None, str]]:
    """Each trial whose current is known or can be estimated, with it, its covariance and its source.

    The trials to fit have one current unless they contradict it or are asked one by
    one. That of a trial held out is theirs, or is found by their coefficients.
    """
    unknown = []
    for trial in trials:
        if (known := _known(trial, option)) is not None:
            yield trial, known, None, "columns" if COLUMNS[0] in trial else "given"
        elif trial.over_ground and trial.channels.keys() >= NEEDED:
            unknown += [trial] * (trial.duration > SHORTEST * length / speed)
    if not (fitted := [trial for trial in unknown if trial.use == "fit"]):
        return
    shared = option != "trial"
    found = estimate_current(fitted, length, speed, shared)
    if option == "auto" and len(fitted) > 1:
        each = estimate_current(fitted, length, speed, False)
        apart = np.kron(np.eye(len(fitted))[1:] - np.eye(len(fitted))[0], np.eye(2))
        if _probability(apart @ each.mean, apart @ each.covariance @ apart.T) < APART:
            found, shared = each, False
    for trial in unknown:
        own, k = found, 0 if shared or trial.use != "fit" else 2 * fitted.index(trial)
        if not shared and trial.use != "fit":
            own = estimate_current([trial], length, speed, True, found.coefficients)
        part = slice(k, k + 2)
        yield (
            trial,
            own.mean[part],
            own.covariance[part, part],
            "all trials" if shared else "trial",
        )


def _known(trial: Trial, option: Any) -> Floats | None:
    """North and east of a current in columns or given, shape (2,) or (2, n_samples); None where unknown."""
    given = None
    if isinstance(option, Mapping):
        check_keys(option, ("north", "east"), "current", ("north", "east"))
        given = np.array(
            [
                check_number(option[k], f"current {k}", hint="in m/s")
                for k in ("north", "east")
            ]
        )
    if not trial.channels.keys() >= set(COLUMNS):
        return given if trial.over_ground else None
    columns = np.array([trial[name] for name in COLUMNS])
    north, east = columns.mean(axis=1)
    if (
        given is not None
        and np.hypot(north - given[0], east - given[1]) > CONTRADICTION
    ):
        raise InputError(
            f"trial {trial.name!r}: columns current_north and current_east have means"
            f" of {north:.2f} and {east:.2f} m/s, current = {{ north = {given[0]:g},"
            f" east = {given[1]:g} }} was given, expected them to agree; leave one of"
            " them out"
        )
    return columns


def _probability(mean: Floats, covariance: Floats) -> float:
    """Probability of values as far from zero by chance (Wald's test)."""
    return float(chi2.sf(mean @ np.linalg.solve(covariance, mean), len(mean)))


def through_water(trial: Trial, north: Any, east: Any) -> Trial:
    """The trial without a current, m/s, each a number or of shape (n_samples,).

    Its track starts where it did; velocities over ground, but for one logged, become
    those through the water.
    """
    north, east = (
        np.broadcast_to(np.asarray(part, dtype=float), trial.t.shape)
        for part in (north, east)
    )
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

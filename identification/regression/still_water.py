"""Trials as they would have been in still water: current and wind removed, and what is known of them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np
from scipy.stats import chi2

from identification.regression.current import estimate_current, over_ground
from identification.regression.wind import CURRENT_COLUMNS, measured_wind
from shipgym import InputError, Particulars, Trial
from shipgym.arrays import Floats, integral
from shipgym.checks import check_choice, check_keys, check_number
from shipgym.trials.navigation import rotate_to_body

#: Probability of a current as large by chance below which it differs from zero.
SIGNIFICANT = 0.01
CURRENTS = ("auto", "shared", "trial", "none")
REMEDY = (
    "add a turn of a whole circle, or runs on other headings at the same shaft speed,"
    " give the current (current = { north = 0.2, east = -0.1 }, m/s), or take none out"
    ' (current = "none")'
)


@dataclass(frozen=True, eq=False)
class TrialCurrent:
    """The current of one trial.

    Attributes
    ----------
    velocity : array of shape (2,) or (2, n_samples)
        Towards north and east, m/s.
    covariance : array of shape (2, 2) or None
        None for one that is known.
    source : str
        "columns", "given", "all trials" or "trial".
    """

    velocity: Floats
    covariance: Floats | None
    source: str

    @property
    def mean(self) -> Floats:
        """Mean over the trial, m/s, shape (2,)."""
        return np.asarray(np.reshape(self.velocity, (2, -1)).mean(axis=1))

    @property
    def probability(self) -> float:
        """Probability of a current as far from zero by chance; 0 for one that is known."""
        if self.covariance is None:
            return 0.0
        return wald_probability(self.mean, self.covariance)


def check_current(option: Any) -> None:
    """Refuse a current that is neither a word nor a table of north and east, m/s."""
    if not isinstance(option, Mapping):
        check_choice(option, CURRENTS, "current", " or a table of north and east")
        return
    check_keys(option, ("north", "east"), "current", ("north", "east"))
    for name, value in option.items():
        check_number(value, f"current {name}", hint="in m/s")


def in_still_water(
    trials: Sequence[Trial],
    particulars: Particulars | Mapping[str, Any] | None,
    current: str | Mapping[str, float] = "auto",
    wind: str | Mapping[str, Any] = "auto",
) -> tuple[list[Trial], dict[str, Any]]:
    """The trials without current and with the accelerations by wind, and what was found, for the provenance.

    Trials that are skipped keep both; of those whose velocities are through the water a
    current in columns is taken out of the track. `current` and `wind` are those of
    `Options`.
    """
    check_current(current)
    if particulars is None:
        return list(trials), {}
    ship = particulars
    if isinstance(ship, Mapping):
        ship = Particulars.from_mapping(ship)

    free_running = {
        trial.name: trial
        for trial in trials
        if trial.use != "skip" and trial.kind != "captive"
    }
    remarks: list[str] = []
    report: dict[str, Any] = {}
    found = _with_wind(free_running, ship, wind, remarks)
    wind_speeds = {
        name: float(trial["wind_speed"].mean())
        for name, trial in found.items()
        if "wind_udot" in trial
    }
    if wind_speeds:
        report["wind"] = {"option": wind, "mean_speeds": wind_speeds}

    speed = ship.speed or _starting_speed(found.values())
    if current != "none" and speed > 0.0:
        rows = _without_current(found, ship.length, speed, current, remarks)
        if rows:
            report["currents"] = rows
    if remarks:
        report["sea_remarks"] = remarks
    return [found.get(trial.name, trial) for trial in trials], report


def _starting_speed(trials: Iterable[Trial]) -> float:
    """Median of the speeds over ground at which trials start, m/s; 0 where none is known."""
    starts = []
    for trial in trials:
        if {"u", "v"} <= trial.channels.keys():
            ahead, aside = over_ground(trial)
            starts.append(np.hypot(ahead[0], aside[0]))
    return float(np.median(starts or [0.0]))


def _with_wind(
    trials: Mapping[str, Trial], ship: Particulars, option: Any, remarks: list[str]
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

    is_logged = any("wind_udot" in trial for trial in found.values())
    if option != "auto" and not is_logged:
        raise InputError(
            f"wind: expected columns wind_speed and wind_from besides psi, u and v for"
            f" {option!r}, got no trial with them; name them in [columns], or take wind"
            ' = "constant"'
        )
    return found


def _without_current(
    found: dict[str, Trial],
    length: float,
    speed: float,
    option: Any,
    remarks: list[str],
) -> dict[str, Any]:
    """Take the current out of trials, by name, where it is known or asked for; report on each."""
    one_heading = _keep_to_one_heading(found.values())
    currents = currents_of(list(found.values()), length, speed, option)
    rows: dict[str, Any] = {}
    doubtful: dict[str, list[str]] = {}
    for name, current in currents.items():
        row = _row(current)
        if current.covariance is not None and not one_heading:
            errors = np.sqrt(np.diag(current.covariance))
            row["standard_errors"] = errors.tolist()
            row["probability"] = current.probability
        doubt = _doubt(current, speed, one_heading)
        if doubt and (option != "auto" or current.covariance is None):
            _refuse(name, doubt, current)
        if doubt:
            doubtful.setdefault(doubt, []).append(PurePath(name).name)

        is_chance = option == "auto" and current.probability > SIGNIFICANT
        row["taken_out"] = not doubt and not is_chance
        if row["taken_out"]:
            found[name] = through_water(found[name], *current.velocity)
        rows[name] = row

    for doubt, names in doubtful.items():
        remarks.append(f"{', '.join(names)}: no current is removed: {doubt}; {REMEDY}")
    return rows


def _row(current: TrialCurrent) -> dict[str, Any]:
    """A current for the provenance."""
    north, east = current.mean.tolist()
    return {"north": north, "east": east, "source": current.source, "taken_out": True}


def _refuse(name: str, doubt: str, current: TrialCurrent) -> None:
    remedy = REMEDY
    if current.covariance is None:
        remedy = "give it in m/s, towards north and east"
    raise InputError(f"trial {name!r}: no current can be removed: {doubt}; {remedy}")


def _doubt(current: TrialCurrent, speed: float, one_heading: bool) -> str:
    """Why a current cannot be removed; empty where it can."""
    if current.covariance is not None:
        # drift by the current and drift by the ship's own neutral helm look the same
        if one_heading:
            return "the trials keep to one heading"
        largest_error = np.sqrt(np.diag(current.covariance)).max()
        if largest_error > 0.05 * speed:
            return f"its standard error is {largest_error:.2g} m/s"

    size = np.hypot(*current.mean)
    if size > speed:
        return f"expected less than the ship's speed of {speed:.3g} m/s, got {size:.2g}"
    return ""


def _keep_to_one_heading(trials: Iterable[Trial]) -> bool:
    """Whether trials over ground keep so near to one heading that speed hides the current."""
    headings = [
        trial["psi"]
        for trial in trials
        if trial.over_ground and trial.use == "fit" and "psi" in trial
    ]
    if not headings:
        return False
    mean_direction = np.exp(1j * np.concatenate(headings)).mean()
    return bool(abs(mean_direction) > 0.85)


def currents_of(
    trials: Sequence[Trial], length: float, speed: float, option: Any
) -> dict[str, TrialCurrent]:
    """The current of each trial, by name, whose current is known or can be estimated.

    The trials to fit have one current unless they contradict it or are asked one by
    one. That of a trial held out is theirs, or is found by their coefficients. A
    current is estimated from trials of at least five ship lengths.

    Parameters
    ----------
    trials : sequence of Trial
        None of them skipped.
    length, speed : float
        Of the ship, m and m/s.
    option : str or mapping
        As of `Options.current`.
    """
    found: dict[str, TrialCurrent] = {}
    unknown = []
    shortest = 5.0 * length / speed
    for trial in trials:
        known = _known_current(trial, option)
        if known is not None:
            source = "columns" if CURRENT_COLUMNS[0] in trial else "given"
            found[trial.name] = TrialCurrent(known, None, source)
        elif _shows_current(trial) and trial.duration > shortest:
            unknown.append(trial)
    return found | _estimated_currents(unknown, length, speed, option)


def _shows_current(trial: Trial) -> bool:
    needed = {"psi", "u", "v", "r", "delta"}
    return trial.over_ground and trial.channels.keys() >= needed


def _estimated_currents(
    trials: Sequence[Trial], length: float, speed: float, option: Any
) -> dict[str, TrialCurrent]:
    fitted = [trial for trial in trials if trial.use == "fit"]
    if not fitted:
        return {}
    shared = option != "trial"
    estimate = estimate_current(fitted, length, speed, shared)
    if option == "auto" and len(fitted) > 1:
        each = estimate_current(fitted, length, speed, False)
        if _contradict(each.mean, each.covariance):
            estimate, shared = each, False

    found: dict[str, TrialCurrent] = {}
    for trial in trials:
        own, k = estimate, 0
        if not shared and trial.use == "fit":
            k = fitted.index(trial)
        elif not shared:
            own = estimate_current([trial], length, speed, True, estimate.coefficients)
        part = slice(2 * k, 2 * k + 2)
        source = "all trials" if shared else "trial"
        found[trial.name] = TrialCurrent(
            own.mean[part], own.covariance[part, part], source
        )
    return found


def _contradict(currents: Floats, covariance: Floats, chance: float = 1e-6) -> bool:
    """Whether the currents of trials differ by more than chance; their covariance is of few blocks."""
    n_trials = len(currents) // 2
    from_first = np.eye(n_trials)[1:] - np.eye(n_trials)[0]
    apart = np.kron(from_first, np.eye(2))
    probability = wald_probability(apart @ currents, apart @ covariance @ apart.T)
    return probability < chance


def _known_current(
    trial: Trial, option: Any, contradiction: float = 0.1
) -> Floats | None:
    """North and east of a current in columns or given, shape (2,) or (2, n_samples); None where unknown."""
    given = None
    if isinstance(option, Mapping):
        given = np.array([option["north"], option["east"]], dtype=float)
    if not trial.channels.keys() >= set(CURRENT_COLUMNS):
        return given if trial.over_ground else None

    columns = np.array([trial[name] for name in CURRENT_COLUMNS])
    if given is None:
        return columns
    north, east = columns.mean(axis=1)
    if np.hypot(north - given[0], east - given[1]) > contradiction:
        raise InputError(
            f"trial {trial.name!r}: expected columns current_north and current_east to"
            f" agree with current = {{ north = {given[0]:g}, east = {given[1]:g} }},"
            f" got means of {north:.2f} and {east:.2f} m/s; leave one of them out"
        )
    return columns


def wald_probability(mean: Floats, covariance: Floats) -> float:
    """Probability of values as far from zero by chance (Wald's test)."""
    statistic = mean @ np.linalg.solve(covariance, mean)
    return float(chi2.sf(statistic, len(mean)))


def through_water(trial: Trial, north: Any, east: Any) -> Trial:
    """The trial without a current, m/s, each a number or of shape (n_samples,).

    Its track starts where it did; velocities over ground, but for one logged, become
    those through the water.
    """
    north = np.broadcast_to(np.asarray(north, dtype=float), trial.t.shape)
    east = np.broadcast_to(np.asarray(east, dtype=float), trial.t.shape)
    channels = dict(zip(CURRENT_COLUMNS, (north, east), strict=True))
    for name, speed in (("x", north), ("y", east)):
        if name in trial:
            channels[name] = trial[name] - integral(trial.t, speed)

    if trial.over_ground and trial.channels.keys() >= {"u", "v", "psi"}:
        any_derived = bool(trial.derived & {"u", "v"})
        ground = over_ground(trial)
        drift = rotate_to_body(north, east, trial["psi"])
        for axis, name in enumerate(("u", "v")):
            is_logged = any_derived and name not in trial.derived
            if not is_logged:
                channels[name] = ground[axis] - drift[axis]
    return trial.with_channels(channels).with_(over_ground=False)

"""Trials as they would have been in still water: without current and wind."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np
from scipy.special import chdtrc

from identification.samples.current import (
    CURRENT_COLUMNS,
    SIGNIFICANT,
    estimate_current,
    over_ground,
    through_water,
)
from shipgym import InputError, Particulars, Trial
from shipgym.arrays import Floats
from shipgym.checks import (
    check_choice,
    check_flag,
    check_keys,
    check_number,
)
from shipgym.models.simulate import WIND
from shipgym.sea.harmonics import circle
from shipgym.sea.wind import AIR_DENSITY, wind_curves
from shipgym.ships.inertia import particulars_inertia
from shipgym.trials.navigation import rotate_to_body


def measured_wind(
    trial: Trial,
    particulars: Particulars,
    option: str | Mapping[str, Any],
) -> Trial:
    """The trial with the accelerations by the wind of its columns.

    The trial itself where it has none. Velocities through the water are completed by a
    current in columns.

    Parameters
    ----------
    trial : Trial
        With wind_speed, wind_from, psi, u and v.
    particulars : Particulars
        Of the ship.
    option : str or mapping
        A word, or a table of ``relative``: whether speed and direction are those felt
        on board, the latter from the bow.
    """
    if not {"wind_speed", "wind_from", "psi", "u", "v"} <= trial.channels.keys():
        return trial
    curves = wind_curves(particulars)
    is_relative = isinstance(option, Mapping) and option.get("relative", False)
    ahead, aside = _felt_wind(trial, is_relative)
    angle = np.arctan2(aside, ahead)
    by_angle = [
        np.interp(angle, circle(), row, period=2.0 * np.pi)
        for row in (curves.X, curves.Y, curves.N)
    ]
    forces = (ahead**2 + aside**2) * np.array(by_angle)
    # her resistance in still air is the model's own
    still_ahead, *_ = curves.X
    forces[0] -= still_ahead * trial["u"] ** 2
    inertia = particulars_inertia(particulars.completed())[:3, :3]
    accelerations = np.linalg.solve(inertia, 0.5 * AIR_DENSITY * forces)
    return trial.with_channels(dict(zip(WIND.values(), accelerations, strict=True)))


def _felt_wind(trial: Trial, relative: bool) -> tuple[Floats, Floats]:
    """Wind felt on board, from ahead and from starboard, m/s."""
    speed = trial["wind_speed"]
    direction = trial["wind_from"]
    along = speed * np.cos(direction)
    across = speed * np.sin(direction)
    if relative:
        return along, across

    north = along
    east = across
    has_current = trial.channels.keys() >= set(CURRENT_COLUMNS)
    if has_current and not trial.over_ground:
        north = north + trial["current_north"]
        east = east + trial["current_east"]
    ahead, aside = rotate_to_body(north, east, trial["psi"])
    return ahead + trial["u"], aside + trial["v"]


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
        """Probability of a current as far from zero by chance; 0 for a known one."""
        if self.covariance is None:
            return 0.0
        return wald_probability(self.mean, self.covariance)


def without_current(
    found: dict[str, Trial],
    length: float,
    speed: float,
    option: Any,
    remarks: list[str],
) -> dict[str, Any]:
    """Take the current out of trials, by name, where it is known or surely not zero.

    Returns a report on each; `remarks` get those that were doubtful.
    """
    trials = list(found.values())
    one_heading = _keep_to_one_heading(trials)
    currents = currents_of(trials, length=length, speed=speed, option=option)
    rows: dict[str, Any] = {}
    doubtful: dict[str, list[str]] = {}
    alike: list[str] = []
    for name, current in currents.items():
        doubt = _doubt(current, speed)
        if doubt and current.covariance is None:
            raise InputError(
                f"trial {name!r}: no current can be removed: {doubt}; give it in m/s,"
                " towards north and east"
            )
        if doubt:
            doubtful.setdefault(doubt, []).append(PurePath(name).name)
        taken_out = not doubt and current.probability <= SIGNIFICANT
        if taken_out:
            found[name] = through_water(found[name], *current.velocity)
            if one_heading and current.covariance is not None:
                alike.append(PurePath(name).name)
        rows[name] = _row(current, taken_out)
    magnetic = [PurePath(t.name).name for t in trials if t.over_ground and t.magnetic]
    if magnetic:
        doubt = (
            "the heading is magnetic and the variation would look like drift; write"
            " variation_deg (east positive) in [sensors]"
        )
        doubtful[doubt] = magnetic
    for doubt, names in doubtful.items():
        remarks.append(f"{', '.join(names)}: no current is removed: {doubt}; {REMEDY}")
    if alike:
        remarks.append(
            f"{', '.join(alike)}: a current is removed though the trials keep to one"
            " heading, on which the drift of the ship herself looks the same; where the"
            ' water stood still, take none out (current = "none")'
        )
    return rows


def _row(current: TrialCurrent, taken_out: bool) -> dict[str, Any]:
    """A current for the provenance, and how certain it is."""
    north, east = current.mean.tolist()
    row = {
        "north": north,
        "east": east,
        "source": current.source,
        "taken_out": taken_out,
    }
    if current.covariance is not None:
        errors = np.sqrt(np.diag(current.covariance))
        row["standard_errors"] = errors.tolist()
        row["probability"] = current.probability
    return row


def _doubt(current: TrialCurrent, speed: float) -> str:
    """Reason why a current cannot be removed; empty where it can."""
    if current.covariance is not None:
        errors = np.sqrt(np.diag(current.covariance))
        largest_error = errors.max()
        if largest_error > 0.05 * speed:
            return f"its standard error is {largest_error:.2g} m/s"

    size = np.hypot(*current.mean)
    if size > speed:
        return f"expected less than the ship's speed of {speed:.3g} m/s, got {size:.2g}"
    return ""


def _keep_to_one_heading(trials: Iterable[Trial]) -> bool:
    """Return whether trials are so near to one heading that speed hides the current.

    Only trials to fit whose velocities are over ground count.
    """
    headings = [
        trial["psi"]
        for trial in trials
        if trial.over_ground and trial.use == "fit" and "psi" in trial
    ]
    return bool(headings) and abs(np.exp(1j * np.concatenate(headings)).mean()) > 0.85


def currents_of(
    trials: Sequence[Trial],
    length: float,
    speed: float,
    option: Any,
) -> dict[str, TrialCurrent]:
    """Currents by trial, of those whose current is known or can be estimated.

    The trials to fit have one current unless they contradict it. That of a trial held
    out is theirs, or its own. A current is estimated from trials
    of at least five ship lengths.

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
    needed = {"psi", "u", "v", "r", "delta"}
    for trial in trials:
        known = trial.channels.keys()
        if known >= set(CURRENT_COLUMNS):
            velocity = np.array([trial[name] for name in CURRENT_COLUMNS])
            found[trial.name] = TrialCurrent(velocity, None, "columns")
        elif isinstance(option, Mapping) and trial.over_ground:
            velocity = np.array([option["north"], option["east"]], dtype=float)
            found[trial.name] = TrialCurrent(velocity, None, "given")
        elif trial.over_ground and not trial.magnetic and known >= needed:
            unknown.append(trial)
    unknown = [trial for trial in unknown if trial.duration > 5.0 * length / speed]
    return found | _estimated_currents(unknown, length, speed)


def _estimated_currents(
    trials: Sequence[Trial], length: float, speed: float
) -> dict[str, TrialCurrent]:
    fitted = [trial for trial in trials if trial.use == "fit"]
    if not fitted:
        return {}
    estimate = estimate_current(
        fitted,
        length=length,
        speed=speed,
        shared=True,
    )
    shared = True
    if len(fitted) > 1:
        each = estimate_current(fitted, length=length, speed=speed, shared=False)
        if _contradict(each.mean, each.covariance):
            estimate, shared = each, False

    found: dict[str, TrialCurrent] = {}
    for trial in trials:
        own, place = estimate, 0
        if not shared and trial.use == "fit":
            place = 2 * fitted.index(trial)
        elif not shared:
            own = estimate_current([trial], length=length, speed=speed, shared=True)
        pair = slice(place, place + 2)
        source = "all trials" if shared else "trial"
        found[trial.name] = TrialCurrent(
            own.mean[pair], own.covariance[pair, pair], source
        )
    return found


def _contradict(currents: Floats, covariance: Floats) -> bool:
    """Return whether the currents of trials differ by more than chance.

    The chance is small because their covariance is an average over few blocks.
    """
    n_others = len(currents) // 2 - 1
    from_first = np.hstack([-np.ones((n_others, 1)), np.eye(n_others)])
    apart = np.kron(from_first, np.eye(2))
    return wald_probability(apart @ currents, apart @ covariance @ apart.T) < 1e-6


def wald_probability(mean: Floats, covariance: Floats) -> float:
    """Probability of values as far from zero by chance (Wald's test)."""
    statistic = mean @ np.linalg.solve(covariance, mean)
    return float(chdtrc(len(mean), statistic))


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
    """Refuse a wind that is neither a known word nor a table."""
    if not isinstance(option, Mapping):
        check_choice(option, ("auto", "none"), "wind", " or a table: relative = true")
        return
    check_keys(option, ("relative",), "wind")
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
    is_usual = wind in ("auto", "none")
    columns = {"wind_speed", "wind_from", *CURRENT_COLUMNS}
    in_sea = any(one.over_ground or columns & one.channels.keys() for one in trials)
    if particulars is None or (is_usual and not in_sea):
        return list(trials), {}

    ship = particulars
    if isinstance(ship, Mapping):
        ship = Particulars.from_mapping(ship)
    remarks: list[str] = []
    report: dict[str, Any] = {}
    sailed = [one for one in trials if one.use != "skip" and one.kind != "captive"]
    found = _with_wind({one.name: one for one in sailed}, ship, wind, remarks)
    wind_speeds = {
        name: float(trial["wind_speed"].mean())
        for name, trial in found.items()
        if {"wind_udot", "wind_speed"} <= trial.channels.keys()
    }
    if wind_speeds:
        report["wind"] = {"option": wind, "mean_speeds": wind_speeds}

    speed = ship.speed or _starting_speed(found.values())
    if current != "none" and speed > 0.0:
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

"""The current of each trial, which is known or estimated, and how sure it is."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np
from scipy.stats import chi2

from identification.samples.current import estimate_current
from identification.samples.velocities import (
    CURRENT_COLUMNS,
    SIGNIFICANT,
    through_water,
)
from shipgym import InputError, Trial
from shipgym.arrays import Floats

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


def _contradict(currents: Floats, covariance: Floats, chance: float = 1e-6) -> bool:
    """Return whether the currents of trials differ by more than chance.

    The chance is small because their covariance is an average over few blocks.
    """
    n_others = len(currents) // 2 - 1
    from_first = np.hstack([-np.ones((n_others, 1)), np.eye(n_others)])
    apart = np.kron(from_first, np.eye(2))
    return wald_probability(apart @ currents, apart @ covariance @ apart.T) < chance


def wald_probability(mean: Floats, covariance: Floats) -> float:
    """Probability of values as far from zero by chance (Wald's test)."""
    statistic = mean @ np.linalg.solve(covariance, mean)
    return float(chi2.sf(statistic, len(mean)))

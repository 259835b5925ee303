"""Rows of the tables that reports show of a fit, as text where not a plain number."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.judging.fit import Fit
from identification.pipeline.summary import PRIME, are_derivatives
from shipgym import Trial
from shipgym.pages import NONE, fixed, number
from shipgym.trials.units import KNOT

FORCES = {
    "X": "Surge force X",
    "Y": "Sway force Y",
    "N": "Yaw moment N",
    "K": "Roll moment K",
}
#: Indices of manoeuvres: name and unit (L: ship lengths).
INDICES = {
    "overshoot_1_deg": ("1st overshoot", "deg"),
    "overshoot_2_deg": ("2nd overshoot", "deg"),
    "advance_lengths": ("advance", "L"),
    "transfer_lengths": ("transfer", "L"),
    "tactical_diameter_lengths": ("tactical diameter", "L"),
}


@dataclass(frozen=True)
class TrialRow:
    """A recorded manoeuvre: seconds, degrees, knots; None for what was not recorded."""

    name: str
    kind: str | None
    use: str
    derived: str  # channels that were not measured
    samples: int
    duration: float
    interval: float
    rudder: float | None  # largest
    speeds: str | None  # least to largest


@dataclass(frozen=True)
class CoefficientRow:
    """A coefficient with its standard error."""

    name: str
    value: str
    error: str
    t: float | None  # value by its error; None without one
    significant: bool


def short_names(trials: Sequence[Trial]) -> dict[str, str]:
    """Names of trials without their folders, unless two would be the same."""
    short = {}
    for trial in trials:
        short[trial.name] = PurePath(trial.name).name
    unique = set(short.values())
    if len(unique) < len(short):
        return {name: name for name in short}
    return short


def trial_row(trial: Trial, name: str) -> TrialRow:
    """The row of a trial under some name."""
    rudder = None
    if "delta" in trial:
        largest = np.abs(trial["delta"]).max()
        rudder = float(np.degrees(largest))

    speeds = None
    if "u" in trial and "v" in trial:
        knots = np.hypot(trial["u"], trial["v"]) / KNOT
        slowest = fixed(knots.min(), 1)
        fastest = fixed(knots.max(), 1)
        speeds = f"{slowest} to {fastest}"

    kind = trial.kind and trial.kind.replace("-", " ")
    derived = ", ".join(sorted(trial.derived))
    steps = np.diff(trial.t)
    return TrialRow(
        name=name,
        kind=kind,
        use=trial.use,
        derived=derived or "none",
        samples=len(trial),
        duration=trial.duration,
        interval=float(np.median(steps)),
        rudder=rudder,
        speeds=speeds,
    )


def coefficient_tables(fit: Fit) -> dict[str, list[CoefficientRow]]:
    """Rows of coefficients by the title of their table: one a force, or one for all."""
    derivatives = are_derivatives(fit.model)
    tables: dict[str, list[CoefficientRow]] = {}
    for name, error in fit.standard_errors.items():
        title = "coefficient"
        if derivatives:
            force, _, _ = name.partition("_")
            title = FORCES.get(force, title)
        rows = tables.setdefault(title, [])
        row = _coefficient_row(
            name,
            fit.coefficients[name],
            error,
            derivatives,
        )
        rows.append(row)
    return tables


def _coefficient_row(
    name: str, value: float, error: float, derivative: bool
) -> CoefficientRow:
    """The row of a coefficient, derivatives times 1e5.

    It is significant from two standard errors on.
    """
    t, significant = None, bool(value)
    if error > 0.0:
        t = value / error
        significant = abs(t) >= 2.0

    shown = [number(value), number(error)]
    if derivative:
        shown = [fixed(value / PRIME, 1), fixed(error / PRIME, 1)]
    return CoefficientRow(
        name=name,
        value=shown[0],
        error=shown[1],
        t=t,
        significant=significant,
    )


def index_lines(metrics: Mapping[str, Any]) -> list[str]:
    """The manoeuvre's indices, measured and predicted; a dash where it has none."""
    lines = []
    for name, (words, unit) in INDICES.items():
        values = metrics.get(name)
        if values is None:
            continue
        measured = fixed(values["measured"])
        predicted = fixed(values["predicted"])
        line = f"{words} {measured} → {predicted}"

        closed_loop = values.get("closed_loop")
        if closed_loop is not None:
            in_loop = fixed(closed_loop)
            line += f" ({in_loop})"
        lines.append(f"{line} {unit}")
    return lines or [NONE]

"""Rows of the tables that the templates show of a fit, as text where it is not a plain number."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np

from identification.fit import Fit
from identification.report.summary import PRIME, are_derivatives
from shipgym import ShipModel, Trial
from shipgym.pages import MINUS, NONE, fixed, number
from shipgym.ships.particulars import ADDED_MASSES
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
#: Particulars of the ship: name, unit, and the factor to it from the SI unit.
PARTICULARS = {
    "length": ("length between perpendiculars", "m", 1.0),
    "beam": ("beam", "m", 1.0),
    "draught": ("draught", "m", 1.0),
    "block_coefficient": ("block coefficient", "", 1.0),
    "mass": ("mass", "t", 1e-3),
    "xg": ("centre of gravity forward of midship", "m", 1.0),
    "yaw_gyradius": ("yaw gyradius", "m", 1.0),
    "speed": ("service speed", "m/s", 1.0),
    "water_density": ("water density", "kg/m³", 1.0),
}


@dataclass(frozen=True)
class TrialRow:
    """A recorded manoeuvre: seconds, degrees and knots; None for what it did not record."""

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
class Quantity:
    """A particular of the ship."""

    name: str
    estimated: bool
    value: str  # with its unit


@dataclass(frozen=True)
class CoefficientRow:
    """A coefficient with its standard error."""

    name: str
    value: str
    error: str
    t: float | None  # value by its error; None without one
    significant: bool


@dataclass(frozen=True)
class ErrorRow:
    """Errors of the prediction of a trial."""

    name: str
    use: str
    diverged: bool
    indices: list[str]  # measured and predicted, a line each
    rmse: Mapping[str, float | None]  # by channel, SI


def short_names(trials: Sequence[Trial]) -> dict[str, str]:
    """Names of trials without their folders, unless two would be the same."""
    short = {trial.name: PurePath(trial.name).name for trial in trials}
    if len(set(short.values())) < len(short):
        return {name: name for name in short}
    return short


def trial_row(trial: Trial, name: str) -> TrialRow:
    """The row of a trial under some name."""
    rudder = speeds = None
    if "delta" in trial:
        rudder = float(np.degrees(np.abs(trial["delta"]).max()))
    if "u" in trial and "v" in trial:
        speed = np.hypot(trial["u"], trial["v"]) / KNOT
        speeds = f"{fixed(speed.min(), 1)} to {fixed(speed.max(), 1)}"
    return TrialRow(
        name=name,
        kind=trial.kind and trial.kind.replace("-", " "),
        use=trial.use,
        derived=", ".join(sorted(trial.derived)) or "none",
        samples=len(trial),
        duration=trial.duration,
        interval=float(np.median(np.diff(trial.t))),
        rudder=rudder,
        speeds=speeds,
    )


def particulars(model: ShipModel) -> list[Quantity]:
    """Particulars of the ship that are known."""
    ship = model.particulars
    rows = []
    for name, (words, unit, factor) in PARTICULARS.items():
        if ship[name] is not None:
            value = f"{factor * ship[name]:.5g}".replace("-", MINUS)
            rows.append(Quantity(words, name in ship.estimated, f"{value} {unit}"))
    return rows


def added_masses(model: ShipModel) -> list[Quantity]:
    """Added masses that are known, in the prime system times 1e-5."""
    ship = model.particulars
    rows = []
    for name in ADDED_MASSES:
        if ship[name] is not None:
            value = fixed(ship[name] / PRIME, 1)
            rows.append(Quantity(name, name in ship.estimated, value))
    return rows


def steering_gear(model: ShipModel) -> dict[str, str]:
    """Values of the steering gear by name."""
    gear = model.steering
    return {
        "rudder limit": f"{number(gear.rudder_limit_deg)} deg",
        "rudder rate": f"{number(gear.rudder_rate_deg_s)} deg/s",
        "rudder lag": f"{number(gear.time_constant, 2)} s",
    }


def coefficient_tables(fit: Fit) -> dict[str, list[CoefficientRow]]:
    """Rows of coefficients by the title of their table: one for each force, or one for all."""
    derivatives = are_derivatives(fit.model)
    tables: dict[str, list[CoefficientRow]] = {}
    for name in fit.coefficients:
        title = "coefficient"
        if derivatives:
            force, _, _ = name.partition("_")
            title = FORCES.get(force, title)
        row = _coefficient_row(fit, name, derivatives)
        tables.setdefault(title, []).append(row)
    return tables


def _coefficient_row(fit: Fit, name: str, derivative: bool) -> CoefficientRow:
    """The row of a coefficient, derivatives times 1e5; significant from two standard errors on."""
    value, error = fit.coefficients[name], fit.standard_errors[name]
    t, significant = None, bool(value)
    if error > 0.0:
        t = value / error
        significant = abs(t) >= 2.0
    if derivative:
        shown = fixed(value / PRIME, 1), fixed(error / PRIME, 1)
    else:
        shown = number(value), number(error)
    return CoefficientRow(name, *shown, t, significant)


def error_rows(fit: Fit, short: Mapping[str, str]) -> list[ErrorRow]:
    """Errors of the predictions of all trials, by their short names."""
    rows = []
    for name, metrics in fit.metrics["trials"].items():
        row = ErrorRow(
            name=short[name],
            use=metrics["use"],
            diverged=metrics["diverged"],
            indices=index_lines(metrics),
            rmse=metrics["rmse"],
        )
        rows.append(row)
    return rows


def index_lines(metrics: Mapping[str, Any]) -> list[str]:
    """The manoeuvre's indices, measured and predicted; a dash where it has none."""
    lines = []
    for name, (words, unit) in INDICES.items():
        values = metrics.get(name)
        if values is None:
            continue
        line = f"{words} {fixed(values['measured'])} → {fixed(values['predicted'])}"
        again = values.get("closed_loop")
        if again is not None:
            line += f" ({fixed(again)})"
        lines.append(f"{line} {unit}")
    return lines or [NONE]


def reference_rows(
    fit: Fit, short: Mapping[str, str]
) -> list[tuple[str, float | None, float | None]]:
    """Name of each trial, and heading errors, rad, of a grey box and of its bare reference ship."""
    if "reference" not in fit.metrics:
        return []
    bare = fit.metrics["reference"]["trials"]
    rows = []
    for name, metrics in fit.metrics["trials"].items():
        rows.append((short[name], metrics["rmse"]["psi"], bare[name]["rmse"]["psi"]))
    return rows

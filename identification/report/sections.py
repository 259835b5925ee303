"""Sections of a report on the data, the fit and the predictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.report.predictions import overview_figure, prediction_figure
from shipgym.pages import (
    MINUS,
    NONE,
    Html,
    badge,
    columns,
    figure,
    fixed,
    html,
    join,
    note,
    number,
    paragraph,
    section,
    table,
)
from shipgym.ships.particulars import ADDED_MASSES
from shipgym.trials.trial import Trial

if TYPE_CHECKING:
    from identification.result import IdentificationResult
    from shipgym.ships import ShipModel

KNOT = 1852.0 / 3600.0
PRIME = 1e-5

EQUATIONS = {"u": "surge", "v": "sway", "r": "yaw"}
INDICES = {
    "overshoot_1_deg": ("1st overshoot", "deg"),
    "overshoot_2_deg": ("2nd overshoot", "deg"),
    "advance_lengths": ("advance", "L"),
    "transfer_lengths": ("transfer", "L"),
    "tactical_diameter_lengths": ("tactical diameter", "L"),
}
PARTICULARS = {
    "length": ("length between perpendiculars", "m"),
    "beam": ("beam", "m"),
    "draught": ("draught", "m"),
    "block_coefficient": ("block coefficient", ""),
    "mass": ("mass", "t"),
    "xg": ("centre of gravity forward of midship", "m"),
    "yaw_gyradius": ("yaw gyradius", "m"),
    "speed": ("service speed", "m/s"),
    "water_density": ("water density", "kg/m³"),
}


def data_section(result: IdentificationResult) -> Html:
    """The trials, how well the equations fit, and the ship."""
    fitted = [trial for trial in result.trials if trial.use == "fit"]
    drawn = overview_figure(fitted, result.predictions)
    return section(
        "data",
        "Data and fit",
        trials_table(result),
        figure(
            drawn,
            "fitted-trials",
            "The trials of the fit: heading change and rudder as measured, and the heading that the model "
            "gives when it is driven open loop by the measured rudder from the same initial state. "
            "Degrees; time in seconds.",
        ),
        Html("<h3>Fit of the equations of motion</h3>"),
        fit_table(result),
        Html("<h3>The ship</h3>"),
        ship_tables(result),
    )


def short_names(trials: Sequence[Trial]) -> dict[str, str]:
    """Names of trials without their folders, unless two would be the same."""
    short = {trial.name: PurePath(trial.name).name for trial in trials}
    return short if len(set(short.values())) == len(short) else {name: name for name in short}


def trials_table(result: IdentificationResult) -> Html:
    """One row for each trial."""
    rows = []
    short = short_names(result.trials)
    for trial in result.trials:
        step = float(np.median(np.diff(trial.t)))
        rudder = np.degrees(np.abs(trial["delta"]).max()) if "delta" in trial else None
        speeds = np.hypot(trial["u"], trial["v"]) / KNOT if "u" in trial and "v" in trial else None
        rows.append(
            [
                short[trial.name],
                (trial.kind or NONE).replace("-", " "),
                badge(trial.use, "plain" if trial.use == "fit" else "good"),
                ", ".join(sorted(trial.derived)) or "none",
                f"{len(trial)}",
                fixed(trial.duration, 0),
                fixed(step, 2),
                fixed(rudder, 1),
                None if speeds is None else Html(f"{fixed(speeds.min(), 1)} to {fixed(speeds.max(), 1)}"),
            ]
        )
    head = [
        "trial",
        "manoeuvre",
        "use",
        "derived",
        "samples",
        "duration, s",
        "interval, s",
        "rudder, deg",
        "speed, kn",
    ]
    caption = (
        "Recorded manoeuvres. Derived: channels that were not measured but computed from others. Trials "
        "marked validate had no part in the fit."
    )
    return table(head, rows, text_columns=4, caption=caption)


def fit_table(result: IdentificationResult) -> Html:
    """Diagnostics of each equation, and what the guard against runaway models did."""
    rows = [
        [
            EQUATIONS.get(name, name),
            found.samples,
            found.terms,
            found.rank,
            number(found.condition_number, 3),
            fixed(found.r_squared, 4),
            number(found.residual_rms, 2),
        ]
        for name, found in result.diagnostics.items()
    ]
    provenance = result.model.provenance or {}
    guard = provenance.get("guard", {})
    parts = [
        paragraph(
            f"Structure {result.model.structure}, method {provenance.get('method', NONE)}, samples "
            f"{provenance.get('samples', NONE)}: velocities integrated over windows of "
            f"{provenance.get('steps_per_window', 1)} sampling steps. Guard against models that run away: "
            f"{guard.get('decision', 'not used')}."
        ),
        table(
            ["equation", "rows", "terms", "directions kept", "condition number", "R²", "residual rms"],
            rows,
            caption=(
                "Regression of each equation. The residual is what remains of the change of velocity over "
                "one window, m/s (yaw: rad/s)."
            ),
        ),
    ]
    return join(parts)


def ship_tables(result: IdentificationResult) -> Html:
    """Particulars and added masses, those estimated marked so."""
    model = result.model
    estimated = model.particulars.estimated

    def cell(name: str) -> Html:
        return badge("estimated", "warn") if name in estimated else badge("given", "plain")

    dimensions = [
        [text, cell(name), f"{_particular(model, name):.5g} {unit}".replace("-", MINUS)]
        for name, (text, unit) in PARTICULARS.items()
        if model.particulars[name] is not None
    ]
    added = [
        [name, cell(name), fixed(model.particulars[name] / PRIME, 1)]
        for name in ADDED_MASSES
        if model.particulars[name] is not None
    ]
    gear = model.steering
    source = badge((model.provenance or {}).get("steering", "given"), "plain")
    steering = [
        ["rudder limit", source, Html(f"{number(gear.rudder_limit_deg, 3)} deg")],
        ["rudder rate", source, Html(f"{number(gear.rudder_rate_deg_s, 3)} deg/s")],
        ["rudder lag", source, Html(f"{number(gear.time_constant, 2)} s")],
    ]
    masses = [table(["added mass", "", "value, 10⁻⁵"], added, text_columns=2)] if added else []
    return columns(
        table(["particular", "", "value"], dimensions, text_columns=2),
        join([*masses, table(["steering gear", "", "value"], steering, text_columns=2)]),
    )


def _particular(model: ShipModel, name: str) -> float:
    value = float(model.particulars[name])
    return value / 1000.0 if name == "mass" else value


def prediction_section(result: IdentificationResult) -> Html:
    """Open-loop predictions of the trials that had no part in the fit."""
    validated = [trial for trial in result.trials if trial.use == "validate"]
    parts = [errors_table(result)]
    if "reference" in result.metrics:
        parts.append(reference_table(result))
    if not validated:
        parts.append(
            note(
                'No trial is marked use = "validate": nothing here tells how the model predicts manoeuvres '
                "that it has not seen. Record one more manoeuvre, or set one of these aside.",
                "warn",
            )
        )
    short = short_names(result.trials)
    for k, trial in enumerate(validated):
        drawn = prediction_figure(trial, result.predictions.get(trial.name))
        parts.append(
            figure(
                drawn,
                f"prediction-{k}",
                Html(f"<b>{html(short[trial.name])}</b> (not used for the fit): {_caption(trial)}"),
            )
        )
    return section("prediction", "Prediction of trials", *parts)


def _caption(trial: Trial) -> str:
    path = ", and path seen from above (m)" if "x" in trial else ""
    return (
        "the model is given the measured rudder and the initial state, nothing else. Heading and rudder "
        f"in deg, yaw rate in deg/s, speeds in m/s{path}."
    )


def errors_table(result: IdentificationResult) -> Html:
    """RMSE and indices of each trial, measured and predicted."""
    short = short_names(result.trials)
    rows = []
    for name, metrics in result.metrics["trials"].items():
        rmse = metrics["rmse"]
        row = [
            short[name],
            badge(metrics["use"], "plain" if metrics["use"] == "fit" else "good"),
            badge("ran away", "bad") if metrics["diverged"] else indices_text(metrics),
            fixed(_degrees(rmse["psi"]), 2),
            fixed(_degrees(rmse["r"]), 3),
            fixed(rmse["u"], 3),
            fixed(rmse["v"], 3),
        ]
        rows.append(row)
    head = [
        "trial", "use", "index: measured → predicted", "heading, deg", "yaw rate, deg/s", "surge, m/s",
        "sway, m/s",
    ]  # fmt: skip
    caption = (
        "Root mean square error of the open-loop simulation over the whole trial, sensor noise included, and "
        "the manoeuvre's indices (L: ship lengths)."
    )
    return table(head, rows, text_columns=3, caption=caption)


def reference_table(result: IdentificationResult) -> Html:
    """Errors of the heading of a grey box beside those of its bare reference ship."""
    reference, short = result.metrics["reference"], short_names(result.trials)
    rows = [
        [
            short[name],
            fixed(_degrees(metrics["rmse"]["psi"]), 2),
            fixed(_degrees(reference["trials"][name]["rmse"]["psi"]), 2),
        ]
        for name, metrics in result.metrics["trials"].items()
    ]
    caption = (
        f"What the correction is worth: heading beside that of the bare reference ship {reference['name']}."
    )
    return table(["trial", "model, deg", "bare reference, deg"], rows, text_columns=1, caption=caption)


def indices_text(metrics: Mapping[str, Any]) -> Html:
    """The manoeuvre's indices, measured and predicted, one below the other."""
    lines = [
        f"{text} {fixed(metrics[name]['measured'], 2)} → {fixed(metrics[name]['predicted'], 2)} {unit}"
        for name, (text, unit) in INDICES.items()
        if metrics.get(name) is not None
    ]
    return Html(f'<span class="sub" style="white-space:nowrap">{"<br>".join(lines) or NONE}</span>')


def _degrees(value: float | None) -> float | None:
    return None if value is None else float(np.degrees(value))

"""The report of the whole chain: one self-contained HTML page that works offline."""

from pathlib import Path
from typing import Any

import shipgym
from agents.verification import figures
from agents.verification.result import STEP_DEG, AutopilotResult, Verification
from agents.verification.view import (
    cheaper_sentence,
    headline,
    is_certain,
    verification_view,
)
from identification.report.view import fit_view, trial_figures
from identification.validation.warnings import held_out_error
from shipgym.files import write_text
from shipgym.pages import NONE, render


def write_report(result: AutopilotResult, path: str | Path) -> None:
    """Write the report.

    Of an unstable model it says that it is, and what to do; it shows no numbers of the
    model's own. `result`: what the chain found; `path`: the HTML file. Raises
    InputError if plotly is not installed.
    """
    found, provenance = result.verification, result.model.provenance or {}
    fit = fit_view(result.identification)
    view = cheaper = None
    drawn = dict[str, Any]()
    if found is not None:
        length = float(result.model.particulars["length"])
        view = verification_view(found, length)
        cheaper = cheaper_sentence(view)
        drawn = trial_figures(result.identification)
        drawn |= verification_figures(found, length)
    how = [provenance.get(key, NONE) for key in ("structure", "method", "samples")]
    verdict, kind = verdict_of(result)
    page = render(
        "agents.verification/report.html",
        ship=result.ship.particulars.name,
        fit=fit,
        found=view,
        cheaper=cheaper,
        figures=drawn,
        verdict=verdict,
        verdict_kind=kind,
        refusal=result.refusal,
        step_deg=STEP_DEG,
        origin={
            "software": provenance.get("software", f"shipgym {shipgym.__version__}"),
            "ship file": result.ship.path.name,
            "structure, method, samples": ", ".join(str(part) for part in how),
        },
        trials=result.trials,
    )
    write_text(page, Path(path))


def verdict_of(result: AutopilotResult) -> tuple[str, str]:
    """The sentence on top of the page, and whether it is good, a warning or bad."""
    found = result.verification
    held_out = held_out_error(result.identification)
    refused = f"No autopilot is given: {result.refusal}. " if result.refusal else ""
    if found is not None:
        kind = "good" if is_certain(found) else "warn"
        return f"{refused}{held_out} {headline(found)}", "bad" if refused else kind
    if refused:
        return f"{refused}{held_out}", "bad"
    return (
        f"The identified model is unstable: {result.instability}. It must not be used,"
        " and no coefficients, predictions, manoeuvres or autopilots are given."
    ), "bad"


def verification_figures(found: Verification, length: float) -> dict[str, Any]:
    """Figures of a verification by name."""
    by_name = found.by_name
    responses = {
        pilot.name: (pilot.step.heading, pilot.step.rudder) for pilot in by_name
    }
    costs = {pilot.name: pilot.episodes.cost for pilot in by_name}
    t = found.pilots[0].step.t
    shown = {
        "criteria": figures.criteria_figure(found.manoeuvres.criteria),
        "manoeuvres": figures.manoeuvres_figure(found.manoeuvres, length),
        "steps": figures.steps_figure(t, responses, STEP_DEG),
        "costs": figures.costs_figure(costs),
    }
    if found.tracks:
        tracks = {track.key.upper(): track for track in found.tracks}
        shown["track_keeping"] = figures.tracks_figure(tracks, length)
    return shown

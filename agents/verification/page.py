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
from identification import IdentificationResult
from identification.judging.warnings import held_out_error
from identification.report.view import fit_view, trial_figures
from shipgym.files import write_text
from shipgym.pages import NONE, render


def write_report(result: AutopilotResult, path: str | Path) -> None:
    """Write the report.

    Of an unstable model it says that it is, and what to do; it shows no numbers of the
    model's own. `result`: what the chain found; `path`: the HTML file. Raises
    InputError if plotly is not installed.
    """
    found = result.verification
    view = None
    cheaper = None
    drawn: dict[str, Any] = {}
    if found is not None:
        length = float(result.model.particulars["length"])
        view = verification_view(found, length)
        cheaper = cheaper_sentence(view)
        drawn = result_figures(result.identification, found, length)
    verdict, kind = verdict_of(result)
    page = render(
        "agents.verification/report.html",
        ship=result.ship.particulars.name,
        fit=fit_view(result.identification),
        found=view,
        cheaper=cheaper,
        figures=drawn,
        verdict=verdict,
        verdict_kind=kind,
        refusal=result.refusal,
        step_deg=STEP_DEG,
        origin=_origin(result),
        trials=result.trials,
    )
    write_text(page, Path(path))


def _origin(result: AutopilotResult) -> dict[str, str]:
    """Where the model comes from, by what the page calls it."""
    provenance = result.model.provenance or {}
    how = []
    for key in ("structure", "method", "samples"):
        how.append(str(provenance.get(key, NONE)))
    origin = ", ".join(how)
    own_version = f"shipgym {shipgym.__version__}"
    software = provenance.get("software", own_version)
    return {
        "software": software,
        "ship file": result.ship.path.name,
        "structure, method, samples": origin,
    }


def verdict_of(result: AutopilotResult) -> tuple[str, str]:
    """The sentence on top of the page, and whether it is good, a warning or bad."""
    if result.instability is not None:
        return (
            f"The identified model is unstable: {result.instability}. It must not be"
            " used, and no coefficients, predictions, manoeuvres or autopilots are"
            " given."
        ), "bad"

    found = result.verification
    sentences = [held_out_error(result.identification)]
    kind = "warn"
    if found is not None:
        sentences.append(headline(found))
        if is_certain(found):
            kind = "good"
    if result.remark:
        sentences.insert(0, f"{result.remark}.")
    if result.refusal:
        sentences.insert(0, f"No autopilot is given: {result.refusal}.")
        kind = "bad"
    return " ".join(sentences), kind


def result_figures(
    fit: IdentificationResult, found: Verification, length: float
) -> dict[str, Any]:
    """Figures of an identification and a verification by name."""
    return {**trial_figures(fit), **verification_figures(found, length)}


def verification_figures(found: Verification, length: float) -> dict[str, Any]:
    """Figures of a verification by name."""
    responses = {}
    costs = {}
    for pilot in found.by_name:
        step = pilot.step
        responses[pilot.name] = (step.heading, step.rudder)
        costs[pilot.name] = pilot.episodes.cost
    t = found.pilots[0].step.t
    manoeuvres = found.manoeuvres
    shown = {
        "criteria": figures.criteria_figure(manoeuvres.criteria),
        "manoeuvres": figures.manoeuvres_figure(manoeuvres, length),
        "steps": figures.steps_figure(t, responses, STEP_DEG),
        "costs": figures.costs_figure(costs),
    }
    if found.tracks:
        tracks = {track.key.upper(): track for track in found.tracks}
        shown["track_keeping"] = figures.tracks_figure(tracks, length)
    return shown

"""The report of the whole chain: one self-contained HTML page that works offline."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from agents.verification.figures import criterion_name, in_words
from agents.verification.result import STEP_DEG, AutopilotResult, Verification
from identification import IdentificationResult
from identification.judging.warnings import held_out_error
from identification.report.view import fit_view, trial_figures
from shipgym.files import write_text
from shipgym.manoeuvres import Criterion
from shipgym.pages import number, render
from shipgym.plots import panels

#: Name and unit of each margin.
MARGINS = {
    "gain_margin": ("gain margin, upwards", "factor"),
    "lowest_gain": ("gain margin, downwards", "factor"),
    "phase_margin_deg": ("phase margin", "deg"),
    "delay_margin_s": ("delay margin", "s"),
}


def write_report(result: AutopilotResult, path: str | Path) -> None:
    """Write the report.

    Of an unstable model it says that it is, and what to do; it shows no numbers of the
    model's own. `result`: what the chain found; `path`: the HTML file. Raises
    InputError if plotly is not installed.
    """
    verdict, kind = verdict_of(result)
    found = result.verification
    data = {}
    if found is not None:
        length = float(result.model.particulars["length"])
        data = {
            "figures": result_figures(result.identification, found, length),
            "criteria": in_words(found.criteria),
            **designs_of(found),
        }
    page = render(
        "agents.verification/report.html",
        ship=result.ship.particulars.name,
        length=float(result.ship.particulars.length),
        fit=fit_view(result.identification),
        found=found,
        gear=result.model.steering,
        metrics=result.metrics,
        verdict=verdict,
        verdict_kind=kind,
        refusal=result.refusal,
        step_deg=STEP_DEG,
        ship_file=result.ship.path.name,
        trials=result.identification.trials,
        **data,
    )
    write_text(page, Path(path))


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
    if result.refusal:
        sentences.insert(0, f"No autopilot is given: {result.refusal}.")
        kind = "bad"
    return " ".join(sentences), kind


def is_certain(found: Verification) -> bool:
    """Return True if all criteria are met and no model drawn is lost.

    A model is lost that runs away in a manoeuvre, or under the best autopilot.
    """
    criteria = found.criteria.values()
    lost = found.pilots[0].episodes.terminated
    is_met = all(criterion.passed for criterion in criteria)
    return is_met and not found.unstable.any() and not lost.any()


def headline(found: Verification) -> str:
    """The verdict in two or three sentences."""
    sentences = _criteria_sentences(found.criteria)
    unstable = int(found.unstable.sum())
    if unstable:
        sentences.append(
            f"{unstable} of {found.draws} models drawn run away in a manoeuvre."
        )
    best = found.pilots[0]
    lost = int(np.sum(best.episodes.terminated))
    control = f"loses control of {lost} of" if lost else "keeps control of all"
    sentences.append(
        f"{best.name} steers best and {control} {found.draws} models drawn."
    )
    if found.left_out:
        sentences.append(
            f"{found.left_out} of the models run away whatever steers them, in the"
            " trials themselves or straight ahead, and do not count."
        )
    if found.run_next:
        sentences.append(f"Run next: {found.run_next}.")
    return " ".join(sentences)


def _criteria_sentences(criteria: Mapping[str, Criterion]) -> list[str]:
    """The verdict on the IMO criteria, and those that are not decided."""
    missed = []
    undecided = []
    for name, criterion in criteria.items():
        words = criterion_name(name, criterion).lower()
        if criterion.passed is False:
            missed.append(words)
        if not criterion.decided:
            undecided.append(words)

    verdict = "and meets all IMO criteria"
    if missed:
        verdict = f"but misses the IMO criterion of {', '.join(missed)}"
    elif undecided:
        verdict = "and misses no IMO criterion that these trials decide"
    sentences = [f"The model is stable {verdict}."]
    if undecided:
        sentences.append(f"Not decided by these trials: {', '.join(undecided)}.")
    return sentences


def designs_of(found: Verification) -> dict[str, Any]:
    """Names and margins of the designs, for the tables of the page."""
    margins = []
    for field, words in MARGINS.items():
        values = [getattr(one.controller.margins, field) for one in found.by_name]
        shown = ["∞" if value == np.inf else number(value) for value in values]
        margins.append((*words, shown))
    return {
        "designs": [pilot.name for pilot in found.by_name],
        "margins": margins,
    }


def result_figures(
    fit: IdentificationResult, found: Verification, length: float
) -> dict[str, Any]:
    """Figures of an identification and a verification by name."""
    drawn = found.panels(length)
    height = 46 * len(found.criteria) + 100
    grid = {
        "shared_xaxes": True,
        "vertical_spacing": 0.06,
        "row_heights": [0.58, 0.42],
    }
    steps = [drawn["heading"], drawn["rudder"]]
    shown = {
        **trial_figures(fit),
        "criteria": panels([drawn["criteria"]], height, left=190, hovermode="closest"),
        "steps": panels(steps, 500, outer=True, grid=grid),
    }
    if found.tracks:
        both = [drawn["track"], drawn["cross-track error"]]
        grid = {"horizontal_spacing": 0.1}
        shown["track_keeping"] = panels(both, 430, 2, grid=grid, hovermode="closest")
    return shown

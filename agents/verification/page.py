"""The report of the whole chain: one self-contained HTML page that works offline."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import shipgym
from agents.controllers.controller import Controller
from agents.verification import figures
from agents.verification.figures import WORDS, criterion_name
from agents.verification.result import (
    STEP_DEG,
    AutopilotResult,
    Verification,
    pilot_metrics,
    track_metrics,
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
    length = float(result.model.particulars["length"])
    drawn = (
        {}
        if found is None
        else trial_figures(result.identification) | _figures(found, length)
    )
    page = render(
        "agents.verification/report.html",
        found=None if found is None else verification_view(found) | {"length": length},
        ship=result.ship.particulars.name,
        ship_file=result.ship.path.name,
        figures=drawn,
        fit=fit_view(result.identification),
        held_out=held_out_error(result.identification),
        instability=result.instability,
        refusal=result.refusal,
        trials=result.trials,
        step_deg=STEP_DEG,
        software=provenance.get("software", f"shipgym {shipgym.__version__}"),
        infinity=np.inf,
        settings=[
            str(provenance.get(key, NONE)) for key in ("structure", "method", "samples")
        ],
    )
    write_text(page, Path(path))


def verification_view(found: Verification) -> dict[str, Any]:
    """What the template shows of a verification but for its figures."""
    designed = {
        pilot.name: pilot.design for pilot in found.by_name if pilot.design is not None
    }
    criteria = {
        criterion_name(name, one): one
        for name, one in found.manoeuvres.criteria.items()
    }
    first, *others = found.pilots
    passed = [one.passed for one in criteria.values()]
    lost, unstable = (
        np.sum(first.episodes.terminated),
        int(found.manoeuvres.unstable.sum()),
    )
    return vars(found) | {
        "headline": headline(found),
        "certain": all(passed) and not unstable and not lost,
        "unstable": unstable,
        "course_unstable": int(found.course_unstable.sum()),
        "criteria": criteria,
        "met": passed.count(True),
        "missed": passed.count(False),
        "best": first.name,
        "pilots": {pilot.name: pilot_metrics(pilot) for pilot in found.pilots},
        "designs": designed,
        "linear": {name: one for name, one in designed.items() if one.feedback},
        "gains": _gains([one for one in designed.values() if one.feedback]),
        "tracks": {track.key.upper(): track_metrics(track) for track in found.tracks},
        "learned": [pilot.name for pilot in found.by_name if pilot.design is None],
        "cheaper": {
            one.name: float(np.mean(first.episodes.cost < one.episodes.cost))
            for one in others
        },
    }


def headline(found: Verification) -> str:
    """The verdict in two or three sentences."""
    criteria = found.manoeuvres.criteria
    names = {name: criterion_name(name, one).lower() for name, one in criteria.items()}
    missed = [names[name] for name, one in criteria.items() if one.passed is False]
    open_ones = [names[name] for name, one in criteria.items() if not one.decided]
    imo = (
        f"misses the IMO criterion of {', '.join(missed)}"
        if missed
        else "meets all IMO criteria"
    )
    if open_ones and not missed:
        imo = "misses no IMO criterion that these trials decide"
    imo = f"The model is stable {'but' if missed else 'and'} {imo}."
    if open_ones:
        imo += f" Not decided by these trials: {', '.join(open_ones)}."
    if unstable := int(found.manoeuvres.unstable.sum()):
        imo += f" {unstable} of {found.draws} models drawn run away in a manoeuvre."
    best = found.pilots[0]
    lost = int(np.sum(best.episodes.terminated))
    control = f"loses control of {lost} of" if lost else "keeps control of all"
    return f"{imo} {best.name} steers best and {control} {found.draws} models drawn."


def _gains(
    designs: Sequence[Controller],
) -> list[tuple[str, str, list[tuple[str, float] | None]]]:
    """Signal, unit, and of each design the gain on it by its name, with the sign that it has in the file."""
    gains = [
        {signal: (gain, one.gains[gain]) for gain, (signal, _) in one.feedback.items()}
        for one in designs
    ]
    return [
        (name, unit, [gain.get(signal) for gain in gains])
        for signal, (name, unit) in WORDS["signals"].items()
        if any(signal in gain for gain in gains)
    ]


def _figures(found: Verification, length: float) -> dict[str, Any]:
    responses = {pilot.name: pilot.step[1:] for pilot in found.by_name}
    return {
        "criteria": figures.criteria_figure(found.manoeuvres.criteria),
        "manoeuvres": figures.manoeuvres_figure(found.manoeuvres, length),
        "steps": figures.steps_figure(found.pilots[0].step[0], responses, STEP_DEG),
        "costs": figures.costs_figure(
            {pilot.name: pilot.episodes.cost for pilot in found.by_name}
        ),
        "track_keeping": figures.tracks_figure(
            {track.key.upper(): track for track in found.tracks}, length
        ),
    }

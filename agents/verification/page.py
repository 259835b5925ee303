"""The report of the whole chain: one self-contained HTML page that works offline."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import shipgym
from agents.verification.figures import CRITERIA
from agents.verification.sections import (
    autopilots_section,
    manoeuvres_section,
    ranking_section,
)
from identification.report.coefficients import coefficients_section
from identification.report.facts import concerns_list, data_card, quality_card, remedy_section, ship_card
from identification.report.sections import data_section, prediction_section, ship_tables, trials_table
from shipgym.files import write_text
from shipgym.pages import (
    NONE,
    Html,
    card,
    cards,
    header,
    note,
    number,
    page,
    percent,
    section,
    table,
)
from shipgym.pages import verdict as box

if TYPE_CHECKING:
    from agents.verification.result import AutopilotResult, Pilot, Verification

SURE = 0.95  # probability of passing from which on a criterion counts as met

TITLES = {
    "verdict": "Verdict",
    "data": "Data and fit",
    "coefficients": "Coefficients",
    "prediction": "Prediction of trials",
    "manoeuvres": "Manoeuvres and IMO",
    "autopilots": "Autopilots",
    "ranking": "Ranking",
    "origin": "How this was made",
    "remedy": "What to do",
}


def write_report(result: AutopilotResult, path: str | Path) -> None:
    """Write the report.

    Parameters
    ----------
    result : AutopilotResult
        What the chain found.
    path : str or Path
        The HTML file.

    Raises
    ------
    InputError
        If plotly is not installed.
    """
    found = result.verification
    body = unstable_body(result) if found is None else stable_body(result, found)
    write_text(page(f"{ship_name(result)}: autopilot report", body, TITLES), Path(path))


def stable_body(result: AutopilotResult, found: Verification) -> dict[str, Html]:
    """All sections."""
    return {
        "header": top(result),
        "verdict": verdict(result, found),
        "data": data_section(result.identification),
        "coefficients": coefficients_section(result.identification),
        "prediction": prediction_section(result.identification),
        "manoeuvres": manoeuvres_section(result, found),
        "autopilots": autopilots_section(result, found),
        "ranking": ranking_section(found),
        "origin": origin_section(result),
    }


def unstable_body(result: AutopilotResult) -> dict[str, Html]:
    """What can be said of an unstable model: that it is, and what to do; no numbers of its own."""
    identification = result.identification
    headline = (
        f"The identified model is unstable: {result.instability}. It must not be used, and no coefficients, "
        "predictions, manoeuvres or autopilots are given."
    )
    data = section("data", "Data", trials_table(result.identification), ship_tables(result.identification))
    return {
        "header": top(result),
        "verdict": box(headline, "bad", cards(ship_card(identification), data_card(identification))),
        "remedy": remedy_section(),
        "data": data,
        "origin": origin_section(result),
    }


def ship_name(result: AutopilotResult) -> str:
    """The name of the ship."""
    return str(result.ship.particulars.name)


def top(result: AutopilotResult) -> Html:
    """Title of the page."""
    return header(
        "Identified manoeuvring model and autopilots",
        ship_name(result),
        "Identified from recorded manoeuvres, with the uncertainty of every coefficient carried through to "
        "the manoeuvring criteria and to the autopilots.",
    )


def headline(found: Verification) -> str:
    """The verdict in two or three sentences."""
    criteria = found.manoeuvres.criteria
    missed = [CRITERIA[name].lower() for name, spread in criteria.items() if not spread.passed]
    unsure = [
        CRITERIA[name].lower()
        for name, spread in criteria.items()
        if spread.passed and (spread.share_passed or 0.0) < SURE
    ]
    imo = f"The model is stable but misses the IMO criterion of {', '.join(missed)}."
    if not missed:
        imo = "The model is stable and meets all IMO criteria."
    if unsure:
        imo += f" Not certain: {', '.join(unsure)}."
    unstable = int(found.manoeuvres.unstable.sum())
    if unstable:
        imo += f" {unstable} of {found.draws} models drawn run away in a manoeuvre."
    best = found.pilots[0]
    lost = int(np.sum(best.flights.terminated))
    control = f"keeps control of all {found.draws} models drawn"
    if lost:
        control = f"loses control of {lost} of {found.draws} models drawn"
    return f"{imo} {best.name} steers best and {control}."


def verdict(result: AutopilotResult, found: Verification) -> Html:
    """The box on top: ship, data, quality of the fit, IMO criteria, best autopilot."""
    best = found.pilots[0]
    spreads = found.manoeuvres.criteria.values()
    doubts = any((spread.share_passed or 0.0) < SURE for spread in spreads) or bool(
        found.manoeuvres.unstable.any()
    )
    lost = bool(np.any(best.flights.terminated))
    facts = [
        ship_card(result.identification),
        data_card(result.identification),
        quality_card(result.identification),
        imo_card(found),
        card(
            "Best autopilot",
            best.name,
            Html(
                f"mean cost {number(float(np.mean(best.flights.cost)), 3)}; {_margin(best)}heading rmse "
                f"{number(float(np.mean(best.flights.heading_rmse_deg)), 2)}°"
            ),
        ),
    ]
    return box(
        headline(found),
        "warn" if doubts or lost else "good",
        cards(*facts),
        concerns_list(result.identification),
    )


def _margin(pilot: Pilot) -> str:
    """Phase margin of an autopilot that was designed."""
    if pilot.design is None:
        return ""
    return f"phase margin {number(pilot.design.margins.phase_margin_deg, 2)}°, "


def imo_card(found: Verification) -> Html:
    """The criteria that pass, and the least certain one."""
    spreads = found.manoeuvres.criteria
    sure = sum((spread.share_passed or 0.0) >= SURE for spread in spreads.values())
    least = min(spreads, key=lambda name: spreads[name].share_passed or 0.0)
    detail = Html(
        f"pass with at least 95 %; lowest: {CRITERIA[least].lower()}, "
        f"{percent(spreads[least].share_passed or 0.0)}"
    )
    return card("IMO criteria", f"{sure} of {len(spreads)}", detail)


def origin_section(result: AutopilotResult) -> Html:
    """Software, settings and hashes, so that it can be done again."""
    provenance = result.model.provenance or {}
    settings = ("structure", "method", "samples")
    facts = [
        ["software", provenance.get("software", f"shipgym {shipgym.__version__}")],
        ["ship file", result.ship.path.name],
        [
            "structure, method, samples",
            ", ".join(str(provenance.get(key, NONE)) for key in settings),
        ],
    ]
    if result.verification is not None:
        facts.append(["models drawn, seed", f"{result.verification.draws}, {result.verification.seed}"])
    hashes = [[trial.name, Html(f"<code>{trial.sha256[:16]}</code>")] for trial in result.trials]
    return section(
        "origin",
        "How this was made",
        table(["", ""], facts, text_columns=2),
        table(["trial", "SHA-256 of its contents (first 16 digits)"], hashes, text_columns=2),
        note("The numbers of this page are in metrics.json beside it."),
    )

"""The report of an identification: one self-contained HTML page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from identification.report.coefficients import coefficients_section
from identification.report.facts import concerns_list, data_card, quality_card, remedy_section, ship_card
from identification.report.figures import (
    coefficients_figure,
    fit_figure,
    l_curve_figure,
    residual_figure,
    search_figure,
    truncated,
)
from identification.report.sections import data_section, prediction_section, ship_tables, trials_table
from identification.report.summary import undetermined
from identification.validation.warnings import why_unstable
from shipgym.pages import (
    Html,
    card,
    cards,
    figure,
    fixed,
    header,
    html,
    note,
    page,
    section,
    table,
    verdict,
)

if TYPE_CHECKING:
    from identification.result import IdentificationResult

TITLES = {
    "verdict": "Verdict",
    "remedy": "What to do",
    "data": "Data and fit",
    "fit": "Regression and residuals",
    "coefficients": "Coefficients",
    "prediction": "Prediction of trials",
    "origin": "How this was made",
}
CAPTIONS = {
    "fit": (
        "Mean acceleration over each window of time: as the trials have it, and as the regression explains "
        "it. On the right one against the other, with the line on which they are equal."
    ),
    "residuals": (
        "Correlation of the residuals, windows without overlap. White residuals stay within the bounds in 95 "
        "of 100 lags; if not, the errors last longer than a window, which the standard errors allow for, or "
        "a term is missing. Residuals that follow the rudder (lags above 0) show a term that is missing."
    ),
    "l-curve": (
        "Truncation: each point is a fit with one more direction of the features, the red one the model's. "
        "Unless asked otherwise it is the corner, where more directions make the solution larger and the "
        "residuals hardly smaller, if its residuals exceed those of full rank by no more than chance."
    ),
    "search": "The search for the settings of the method, round by round.",
    "coefficients": (
        "95 % intervals in per cent of the estimate; those beyond the frame are cut. Grey intervals reach 0."
    ),
}


def report_page(result: IdentificationResult) -> str:
    """The page, as text; the same result gives the same text.

    Raises
    ------
    InputError
        If plotly is not installed.
    """
    name = result.model.particulars.name or result.model.name
    instability = why_unstable(result)
    body = _stable(result) if instability is None else _unstable(result, instability)
    top = header("Identified manoeuvring model", name, _lead(result))
    return page(f"{name}: identification", {"header": top, **body, "origin": origin_section(result)}, TITLES)


def _lead(result: IdentificationResult) -> str:
    found = result.model.provenance or {}
    fitted = sum(trial.use == "fit" for trial in result.trials)
    return (
        f"Structure {found['structure']}, method {found['method']}, samples {found['samples']}, "
        f"from {fitted} recorded manoeuvres."
    )


def _stable(result: IdentificationResult) -> dict[str, Html]:
    guard = (result.model.provenance or {}).get("guard", {})
    kind = "warn" if "rejected" in guard else "good"
    facts = (ship_card(result), data_card(result), _fit_card(result), quality_card(result))
    sentence = "The identified model is stable in every simulation of the guard."
    return {
        "verdict": verdict(sentence, kind, cards(*facts), concerns_list(result)),
        "data": data_section(result),
        "fit": _fit_section(result),
        "coefficients": coefficients_section(
            result, figure(coefficients_figure(result), "coefficients", CAPTIONS["coefficients"])
        ),
        "prediction": prediction_section(result),
    }


def _unstable(result: IdentificationResult, why: str) -> dict[str, Html]:
    """What can be said of an unstable model; its coefficients are in its file, marked, and not here."""
    sentence = f"The identified model is unstable: {why}. It must not be used."
    return {
        "verdict": verdict(sentence, "bad", cards(ship_card(result), data_card(result), _fit_card(result))),
        "remedy": remedy_section(),
        "data": section("data", "Data", trials_table(result), ship_tables(result)),
        "fit": _fit_section(result),
    }


def _fit_card(result: IdentificationResult) -> Html:
    """How many directions of how many are kept, and how much is explained."""
    found = result.diagnostics.values()
    kept, terms = sum(equation.rank for equation in found), sum(equation.terms for equation in found)
    least = min(equation.r_squared for equation in found)
    detail = Html(f"directions of the features kept; least R² of an equation {fixed(least, 3)}")
    return card("Fit", f"{kept} of {terms}", detail)


def _fit_section(result: IdentificationResult) -> Html:
    drawn = {"fit": fit_figure(result), "residuals": residual_figure(result)}
    if truncated(result):
        drawn["l-curve"] = l_curve_figure(result)
    if result.searches:
        drawn["search"] = search_figure(result)
    parts = (figure(plot, name, CAPTIONS[name]) for name, plot in drawn.items())
    lost = [note(line[0].upper() + line[1:], "warn") for line in undetermined(result)]
    return section("fit", TITLES["fit"], *lost, *parts)


def origin_section(result: IdentificationResult) -> Html:
    """Software, settings and hashes, so that it can be done again."""
    settings = {k: v for k, v in result.settings.items() if k not in ("trials", "particulars", "steering")}
    rows = [[name.replace("_", " "), _shown(value)] for name, value in settings.items() if value is not None]
    hashes = [
        [trial["name"], trial["use"], Html(f"<code>{trial['sha256'][:16]}</code>")]
        for trial in result.settings["trials"]
    ]
    return section(
        "origin",
        TITLES["origin"],
        table(
            ["setting", "value"], rows, text_columns=2, caption="Arguments of identify, see settings.json."
        ),
        table(["trial", "use", "SHA-256 of its contents (first 16 digits)"], hashes, text_columns=3),
    )


def _shown(value: Any) -> Html:
    if isinstance(value, bool):
        return html("yes" if value else "no")
    if isinstance(value, list):
        return html(", ".join(str(item) for item in value) or None)
    return html(value)

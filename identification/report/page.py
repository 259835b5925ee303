"""The report of an identification: one self-contained HTML page."""

from typing import Any

from identification.fit import Fit
from identification.options import settings_in_words
from identification.report.figures import coefficients_figure, regression_figures
from identification.report.view import fit_view, trial_figures
from identification.validation.warnings import (
    held_out_error,
    undetermined,
    why_unstable,
)
from shipgym.pages import render


def report_page(fit: Fit) -> str:
    """The page, as text; the same fit gives the same text.

    The coefficients of an unstable model are in its file, marked, and not here. Raises
    InputError if plotly is not installed.
    """
    instability = why_unstable(fit)
    figures: dict[str, Any] = {"regression": regression_figures(fit)}
    if instability is None:
        figures |= {"coefficients": coefficients_figure(fit), **trial_figures(fit)}
    return render(
        "identification.report/report.html",
        name=fit.model.particulars.name or fit.model.name,
        fit=fit_view(fit),
        figures=figures,
        instability=instability,
        held_out=held_out_error(fit),
        undetermined=undetermined(fit),
        settings=settings_in_words(fit.settings),
        trials=fit.settings["trials"],
    )

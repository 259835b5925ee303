"""The report of an identification: one self-contained HTML page."""

import warnings
from pathlib import Path
from typing import Any

from identification.judging.fit import Fit
from identification.judging.warnings import why_unstable
from identification.report.figures import regression_figures
from identification.report.view import fit_view, trial_figures
from shipgym.files import write_text
from shipgym.pages import render


def report_page(fit: Fit) -> str:
    """The page, as text; the same fit gives the same text.

    The coefficients of an unstable model are in its file, marked, and not here. Raises
    InputError if plotly is not installed.
    """
    instability = why_unstable(fit)
    figures: dict[str, Any] = {"regression": regression_figures(fit)}
    if instability is None:
        figures |= trial_figures(fit)
    return render(
        "identification.report/report.html",
        name=fit.model.particulars.name or fit.model.name,
        fit=fit_view(fit),
        figures=figures,
        instability=instability,
        trials=fit.settings["trials"],
    )


def write_report(fit: Fit, folder: str | Path) -> None:
    """Write report.html, a page with the figures of a fit, into a folder.

    Without plotly there is none, and a warning says so.
    """
    try:
        import plotly  # noqa: F401
    except ModuleNotFoundError:
        remedy = "pip install 'shipgym[report]'"
        warnings.warn(
            f"plotly is not installed, so report.html was not written: {remedy}",
            stacklevel=2,
        )
        return
    write_text(report_page(fit), Path(folder) / "report.html")

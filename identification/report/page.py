"""The report of an identification: one self-contained HTML page."""

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from identification.judging.fit import Fit
from identification.judging.warnings import why_unstable
from identification.report.figures import regression_figures
from identification.report.view import fit_view, trial_figures
from shipgym.files import write_text
from shipgym.pages import NONE, render


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
        settings=settings_rows(fit.settings),
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


def settings_rows(settings: Mapping[str, Any]) -> dict[str, str]:
    """Arguments of `identify` in words, without those that have tables of their own."""
    shown_elsewhere = ("trials", "particulars", "steering")
    rows = {}
    for name, value in settings.items():
        if value is None or name in shown_elsewhere:
            continue
        words = name.replace("_", " ")
        rows[words] = setting_text(value)
    return rows


def setting_text(value: Any) -> str:
    """A setting in words; for a stage each of its own settings."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        parts = []
        for name, item in value.items():
            if item is not None:
                words = name.replace("_", " ")
                parts.append(f"{words} {setting_text(item)}")
        return ", ".join(parts)
    if isinstance(value, list | tuple):
        items = [str(item) for item in value]
        return ", ".join(items) or NONE
    return str(value)

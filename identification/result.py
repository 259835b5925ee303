"""What `identify` returns: a fit with its summary, figures and files."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from identification.fit import Fit
from identification.report.summary import summary_table
from shipgym import InputError
from shipgym.drafts import draft_folder
from shipgym.files import write_json, write_text

if TYPE_CHECKING:
    from shipgym.plots.style import Figure

#: Files of a saved result; the last one on request.
FILES = ("model.json", "metrics.json", "settings.json", "report.html")


class IdentificationResult(Fit):
    """An identified model and how it came about; `Fit` lists its attributes."""

    def summary(self) -> str:
        """Table of all coefficients and of the inertia they are based on.

        Name, value and standard error (of forces in the prime system 1e-5) and t;
        inertia that was not given is marked as estimated.
        """
        return summary_table(self)

    def plots(self) -> dict[str, Figure]:
        """Figures of the fit and of what the model predicts.

        Raises InputError if plotly is not installed.

        Returns
        -------
        dict of str to plotly.graph_objects.Figure
            "fit", "residuals" (autocorrelation, and cross-correlation with the rudder),
            "l-curve" and "search" for methods that have one, "coefficients", "trials",
            and "prediction: NAME" for each trial held out.
        """
        from identification.report.figures import all_figures

        return all_figures(self)

    def save(self, folder: str | Path, report: bool = False) -> None:
        """Write model.json, metrics.json and settings.json, all or none.

        The same call on the same data gives the same files, byte for byte.

        Raises InputError where it cannot be written.

        Parameters
        ----------
        folder : str or Path
            Created where it does not exist.
        report : bool
            Write report.html too, a page with the figures. Without plotly there is
            none, and a warning says so.
        """
        folder = Path(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with draft_folder(folder / "identification") as draft:
                self._write(draft, report)
                for name in FILES:
                    if (draft / name).exists():
                        (draft / name).replace(folder / name)
                    else:  # an earlier one would describe another model
                        (folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise InputError(
                f"{folder}: expected a folder that can be written, got"
                f" {error.strerror!r}; choose another folder"
            ) from error

    def _write(self, folder: Path, report: bool) -> None:
        self.model.save(folder / "model.json")
        write_json(self.metrics, folder / "metrics.json")
        write_json(self.settings, folder / "settings.json")
        if not report:
            return
        try:
            import plotly  # noqa: F401
        except ModuleNotFoundError:
            remedy = "pip install 'shipgym[report]'"
            warnings.warn(
                f"plotly is not installed, so report.html was not written: {remedy}",
                stacklevel=3,
            )
            return

        from identification.report.page import report_page

        write_text(report_page(self), folder / "report.html")

"""What `identify` returns: a fit with its summary, figures and files."""

import warnings
from pathlib import Path

from identification.fit import Fit
from identification.report.figures import all_figures
from identification.report.page import report_page
from identification.report.summary import summary_table
from shipgym import InputError
from shipgym.drafts import draft_folder
from shipgym.files import write_json, write_text
from shipgym.plots.style import Figure

#: Files of a saved result.
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
        return all_figures(self)

    def save(self, folder: str | Path) -> None:
        """Write model.json, metrics.json, settings.json and report.html, all or none.

        The same call on the same data gives the same files, byte for byte. Without
        plotly there is no report, and a warning says so.

        Raises InputError where it cannot be written.

        Parameters
        ----------
        folder : str or Path
            Created where it does not exist.
        """
        folder = Path(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with draft_folder(folder / "identification") as draft:
                self._write(draft)
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

    def _write(self, folder: Path) -> None:
        self.model.save(folder / "model.json")
        write_json(self.metrics, folder / "metrics.json")
        write_json(self.settings, folder / "settings.json")
        try:
            import plotly  # noqa: F401
        except ModuleNotFoundError:
            remedy = "pip install 'shipgym[report]'"
            warnings.warn(
                f"plotly is not installed, so report.html was not written: {remedy}",
                stacklevel=3,
            )
            return
        write_text(report_page(self), folder / "report.html")

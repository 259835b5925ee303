"""What `identify` returns: a model, how it came about, and its summary, figures and files."""

from __future__ import annotations

import tempfile
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.estimators.estimator import Machine
from identification.regression.samples import Samples
from identification.search import SearchResult
from identification.validation.diagnostics import EquationDiagnostics
from shipgym.errors import InputError
from shipgym.files import write_json, write_text
from shipgym.ships import ShipModel
from shipgym.trials.trial import Trial

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

#: Files of a saved result.
FILES = ("model.json", "metrics.json", "settings.json", "report.html")


@dataclass(frozen=True, eq=False)
class IdentificationResult:
    """An identified model and how it came about.

    Attributes
    ----------
    model : ShipModel
        With covariance, envelope and provenance.
    stable : bool
        Whether the model passed every simulation of the guard and sails every recorded trial, those held out
        too; if not, its predictions are not to be used. Its file says the same.
    metrics : dict
        For each trial by its name the errors of the open-loop prediction and the manoeuvre's indices.
    diagnostics : dict of str to EquationDiagnostics
        Of each equation: those of `u`, `v`, `r` that the structure has.
    predictions : dict of str to Trial or None
        The open-loop predictions by trial; None where the model ran away.
    trials : tuple of Trial
        Those predicted, as they were given, marked "fit" or "validate".
    samples : Samples
        The regression.
    machines : dict of str to Machine
        Fitted to it, by equation.
    settings : dict
        The arguments that `identify` was called with, defaults among them, as JSON knows them.
    searches : dict of str to SearchResult
        How the settings of each equation were found, for methods that search: log10 C, or
        the insensitive band of RM-SVM.
    """

    model: ShipModel
    stable: bool
    metrics: dict[str, Any]
    diagnostics: dict[str, EquationDiagnostics]
    predictions: dict[str, Trial | None]
    trials: tuple[Trial, ...]
    samples: Samples
    machines: dict[str, Machine]
    settings: dict[str, Any]
    searches: dict[str, SearchResult] = field(default_factory=dict)

    @property
    def coefficients(self) -> dict[str, float]:
        """Coefficients by name, in the normalisation of the structure, rudder positive to starboard."""
        return self.model.coefficients

    @property
    def standard_errors(self) -> dict[str, float]:
        """Standard error of each coefficient, in its units."""
        covariance = self.model.covariance
        if covariance is None:
            return dict.fromkeys(self.coefficients, float("nan"))
        return dict(zip(self.coefficients, np.sqrt(np.diag(covariance)).tolist(), strict=True))

    def summary(self) -> str:
        """Table of all coefficients and of the inertia they are based on.

        Returns
        -------
        str
            Name, value and standard error (of forces in the prime system 1e-5) and t; inertia that was
            not given is marked as estimated.
        """
        from identification.report.summary import summary_table

        return summary_table(self)

    def plots(self) -> dict[str, Figure]:
        """Figures of the fit and of what the model predicts.

        Returns
        -------
        dict of str to plotly.graph_objects.Figure
            "fit", "residuals" (autocorrelation, and cross-correlation with the rudder), "l-curve" and
            "search" for methods that have one, "coefficients", "trials", and "prediction: NAME" for each
            trial held out.

        Raises
        ------
        InputError
            If plotly is not installed.
        """
        from identification.report.figures import all_figures

        return all_figures(self)

    def save(self, folder: str | Path) -> None:
        """Write `model.json`, `metrics.json`, `settings.json` and `report.html`, all or none.

        The same call on the same data gives the same files, byte for byte. Without plotly there is no
        report, and a warning says so.

        Parameters
        ----------
        folder : str or Path
            Created where it does not exist.

        Raises
        ------
        InputError
            Where it cannot be written.
        """
        folder = Path(folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory(prefix=".identified-", dir=folder) as draft:
                self._write(Path(draft))
                for name in FILES:
                    if (Path(draft) / name).exists():
                        (Path(draft) / name).replace(folder / name)
                    else:  # an earlier one would tell of another model
                        (folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise InputError(
                f"{folder}: cannot be written ({error.strerror}); choose another folder"
            ) from error

    def _write(self, folder: Path) -> None:
        from identification.report import report_page

        self.model.save(folder / "model.json")
        write_json(self.metrics, folder / "metrics.json")
        write_json(self.settings, folder / "settings.json")
        try:
            import plotly  # noqa: F401
        except ModuleNotFoundError:
            warnings.warn(
                "plotly is not installed, so report.html was not written: pip install 'shipgym[report]'",
                stacklevel=3,
            )
            return
        write_text(report_page(self), folder / "report.html")

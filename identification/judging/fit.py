"""An identified model and how it came about, as reports and warnings read it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from identification.estimators.linear import Estimator
    from identification.judging.diagnostics import EquationDiagnostics
    from identification.samples.samples import Samples
    from shipgym import ShipModel, Trial


@dataclass(frozen=True, eq=False)
class Fit:
    """An identified model and how it came about.

    Attributes
    ----------
    model : ShipModel
        With covariance, envelope and provenance.
    stable : bool
        Whether the model passed every simulation of the guard and sails every recorded
        trial, those held out too; if not, its predictions are not to be used. Its file
        says the same.
    metrics : dict
        For each trial by its name the errors of the open-loop prediction and the
        manoeuvre's indices.
    diagnostics : dict of str to EquationDiagnostics
        Of each equation: those of `u`, `v`, `r` that the structure has.
    predictions : dict of str to Trial or None
        The open-loop predictions by trial; None where the model ran away.
    trials : tuple of Trial
        Those predicted, as they were given, marked "fit" or "validate".
    samples : Samples
        The regression.
    estimators : dict of str to Estimator
        Fitted to it, by equation.
    settings : dict
        The arguments that `identify` was called with, defaults among them, as JSON
        knows them.
    """

    model: ShipModel
    stable: bool
    metrics: dict[str, Any]
    diagnostics: dict[str, EquationDiagnostics]
    predictions: dict[str, Trial | None]
    trials: tuple[Trial, ...]
    samples: Samples
    estimators: dict[str, Estimator]
    settings: dict[str, Any]

    @property
    def coefficients(self) -> dict[str, float]:
        """Coefficients by name, in units of the structure; rudder to starboard."""
        return self.model.coefficients

    @property
    def standard_errors(self) -> dict[str, float]:
        """Standard error of each coefficient, in its units."""
        names = self.coefficients
        covariance = self.model.covariance
        if covariance is None:
            return dict.fromkeys(names, float("nan"))
        variances = np.diag(covariance)
        errors = np.sqrt(variances).tolist()
        return dict(zip(names, errors, strict=True))

"""An identified model and how it came about, as reports and warnings read it."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from identification.estimators.estimator import Estimator
from identification.regression.samples import Samples
from identification.search import SearchResult
from identification.validation.diagnostics import EquationDiagnostics
from shipgym import ShipModel, Trial


@dataclass(frozen=True, eq=False)
class Fit:
    """An identified model and how it came about."""

    model: ShipModel  # with covariance, envelope and provenance
    #: whether the model passed every simulation of the guard and sails every recorded
    #: trial, those held out too; if not, its predictions are not to be used. Its file
    #: says the same
    stable: bool
    #: for each trial by its name the errors of the open-loop prediction and the
    #: manoeuvre's indices
    metrics: dict[str, Any]
    #: of each equation: those of `u`, `v`, `r` that the structure has
    diagnostics: dict[str, EquationDiagnostics]
    predictions: dict[
        str, Trial | None
    ]  # the open-loop predictions by trial; None where the model ran away
    trials: tuple[
        Trial, ...
    ]  # those predicted, as they were given, marked "fit" or "validate"
    samples: Samples  # the regression
    estimators: dict[str, Estimator]  # fitted to it, by equation
    #: the arguments that `identify` was called with, defaults among them, as JSON knows
    #: them
    settings: dict[str, Any]
    #: how the settings of each equation were found, for methods that search: log10 C,
    #: or the insensitive band of RM-SVM
    searches: dict[str, SearchResult] = field(default_factory=dict)

    @property
    def coefficients(self) -> dict[str, float]:
        """Coefficients by name, in the normalisation of the structure, rudder positive to starboard."""
        return self.model.coefficients

    @property
    def standard_errors(self) -> dict[str, float]:
        """Standard error of each coefficient, in its units."""
        if (covariance := self.model.covariance) is None:
            return dict.fromkeys(self.coefficients, float("nan"))
        return dict(
            zip(self.coefficients, np.sqrt(np.diag(covariance)).tolist(), strict=True)
        )

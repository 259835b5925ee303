"""Identification of manoeuvring models from recorded trials."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from identification.design.experiment import Advice, advise
    from identification.design.reduced import ReducedIdentification, identify_reduced
    from identification.design.reduction import (
        Reduction,
        backward_elimination,
        forward_selection,
        sensitivity,
    )
    from identification.estimators.coefficient_history import Course, follow
    from identification.estimators.lssvm import LSSVM, TruncatedLSSVM
    from identification.estimators.polynomial import polynomial_coefficients
    from identification.estimators.recursive import (
        MultiInnovationLeastSquares,
        RecursiveLeastSquares,
        StochasticGradient,
    )
    from identification.estimators.rm_svm import RMSVM
    from identification.options import Options
    from identification.pipeline import identify
    from identification.regression.forces import ForceRegression, force_regression, identify_forces
    from identification.regression.samples import Samples, build_samples
    from identification.result import IdentificationResult
    from identification.search import (
        ArtificialBeeColony,
        DifferentialEvolution,
        GridSearch,
        ParticleSwarm,
        SearchResult,
        TunedLSSVM,
        minimise,
    )
    from identification.validation.comparison import Comparison, compare_methods
    from identification.validation.cross_validation import cross_validate

_HOME = {
    "Advice": "identification.design.experiment",
    "ArtificialBeeColony": "identification.search",
    "Comparison": "identification.validation.comparison",
    "Course": "identification.estimators.coefficient_history",
    "DifferentialEvolution": "identification.search",
    "ForceRegression": "identification.regression.forces",
    "GridSearch": "identification.search",
    "IdentificationResult": "identification.result",
    "LSSVM": "identification.estimators.lssvm",
    "MultiInnovationLeastSquares": "identification.estimators.recursive",
    "Options": "identification.options",
    "ParticleSwarm": "identification.search",
    "RecursiveLeastSquares": "identification.estimators.recursive",
    "ReducedIdentification": "identification.design.reduced",
    "Reduction": "identification.design.reduction",
    "RMSVM": "identification.estimators.rm_svm",
    "Samples": "identification.regression.samples",
    "SearchResult": "identification.search",
    "StochasticGradient": "identification.estimators.recursive",
    "TruncatedLSSVM": "identification.estimators.lssvm",
    "TunedLSSVM": "identification.search",
    "advise": "identification.design.experiment",
    "backward_elimination": "identification.design.reduction",
    "build_samples": "identification.regression.samples",
    "compare_methods": "identification.validation.comparison",
    "cross_validate": "identification.validation.cross_validation",
    "follow": "identification.estimators.coefficient_history",
    "force_regression": "identification.regression.forces",
    "forward_selection": "identification.design.reduction",
    "identify": "identification.pipeline",
    "identify_forces": "identification.regression.forces",
    "identify_reduced": "identification.design.reduced",
    "minimise": "identification.search",
    "polynomial_coefficients": "identification.estimators.polynomial",
    "sensitivity": "identification.design.reduction",
}

__all__ = [
    "LSSVM",
    "RMSVM",
    "Advice",
    "ArtificialBeeColony",
    "Comparison",
    "Course",
    "DifferentialEvolution",
    "ForceRegression",
    "GridSearch",
    "IdentificationResult",
    "MultiInnovationLeastSquares",
    "Options",
    "ParticleSwarm",
    "RecursiveLeastSquares",
    "ReducedIdentification",
    "Reduction",
    "Samples",
    "SearchResult",
    "StochasticGradient",
    "TruncatedLSSVM",
    "TunedLSSVM",
    "advise",
    "backward_elimination",
    "build_samples",
    "compare_methods",
    "cross_validate",
    "follow",
    "force_regression",
    "forward_selection",
    "identify",
    "identify_forces",
    "identify_reduced",
    "minimise",
    "polynomial_coefficients",
    "sensitivity",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: scikit-learn takes a second."""
    if name not in _HOME:
        raise AttributeError(f"module 'identification' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])

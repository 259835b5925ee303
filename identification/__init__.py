"""Identification of manoeuvring models from recorded trials."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from identification.comparison import Comparison, compare_methods
    from identification.cross_validation import cross_validate
    from identification.experiment import Advice, advise
    from identification.following import Course, follow
    from identification.forces import ForceRegression, force_regression, identify_forces
    from identification.lssvm import LSSVM, TruncatedLSSVM
    from identification.options import Options
    from identification.pipeline import identify
    from identification.polynomial import polynomial_coefficients
    from identification.recursive import (
        MultiInnovationLeastSquares,
        RecursiveLeastSquares,
        StochasticGradient,
    )
    from identification.reduced import ReducedIdentification, identify_reduced
    from identification.reduction import Reduction, backward_elimination, forward_selection, sensitivity
    from identification.result import IdentificationResult
    from identification.rm_svm import RMSVM
    from identification.samples import Samples, build_samples
    from identification.tuning import (
        ArtificialBeeColony,
        DifferentialEvolution,
        GridSearch,
        ParticleSwarm,
        SearchResult,
        TunedLSSVM,
        minimise,
    )

_HOME = {
    "Advice": "identification.experiment",
    "ArtificialBeeColony": "identification.tuning",
    "Comparison": "identification.comparison",
    "Course": "identification.following",
    "DifferentialEvolution": "identification.tuning",
    "ForceRegression": "identification.forces",
    "GridSearch": "identification.tuning",
    "IdentificationResult": "identification.result",
    "LSSVM": "identification.lssvm",
    "MultiInnovationLeastSquares": "identification.recursive",
    "Options": "identification.options",
    "ParticleSwarm": "identification.tuning",
    "RecursiveLeastSquares": "identification.recursive",
    "ReducedIdentification": "identification.reduced",
    "Reduction": "identification.reduction",
    "RMSVM": "identification.rm_svm",
    "Samples": "identification.samples",
    "SearchResult": "identification.tuning",
    "StochasticGradient": "identification.recursive",
    "TruncatedLSSVM": "identification.lssvm",
    "TunedLSSVM": "identification.tuning",
    "advise": "identification.experiment",
    "backward_elimination": "identification.reduction",
    "build_samples": "identification.samples",
    "compare_methods": "identification.comparison",
    "cross_validate": "identification.cross_validation",
    "follow": "identification.following",
    "force_regression": "identification.forces",
    "forward_selection": "identification.reduction",
    "identify": "identification.pipeline",
    "identify_forces": "identification.forces",
    "identify_reduced": "identification.reduced",
    "minimise": "identification.tuning",
    "polynomial_coefficients": "identification.polynomial",
    "sensitivity": "identification.reduction",
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

"""Identification of manoeuvring models from recorded trials."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from identification.cross_validation import cross_validate
    from identification.lssvm import LSSVM, TruncatedLSSVM
    from identification.pipeline import IdentificationResult, identify
    from identification.polynomial import polynomial_coefficients
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
    "ArtificialBeeColony": "identification.tuning",
    "DifferentialEvolution": "identification.tuning",
    "GridSearch": "identification.tuning",
    "LSSVM": "identification.lssvm",
    "IdentificationResult": "identification.pipeline",
    "ParticleSwarm": "identification.tuning",
    "RMSVM": "identification.rm_svm",
    "Samples": "identification.samples",
    "SearchResult": "identification.tuning",
    "TruncatedLSSVM": "identification.lssvm",
    "TunedLSSVM": "identification.tuning",
    "build_samples": "identification.samples",
    "cross_validate": "identification.cross_validation",
    "identify": "identification.pipeline",
    "minimise": "identification.tuning",
    "polynomial_coefficients": "identification.polynomial",
}

__all__ = [
    "LSSVM",
    "RMSVM",
    "ArtificialBeeColony",
    "DifferentialEvolution",
    "GridSearch",
    "IdentificationResult",
    "ParticleSwarm",
    "Samples",
    "SearchResult",
    "TruncatedLSSVM",
    "TunedLSSVM",
    "build_samples",
    "cross_validate",
    "identify",
    "minimise",
    "polynomial_coefficients",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: scikit-learn takes a second."""
    if name not in _HOME:
        raise AttributeError(f"module 'identification' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])

"""Identification of manoeuvring models from recorded trials."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from identification.forces import ForceRegression, force_regression, identify_forces
    from identification.lssvm import LSSVM, TruncatedLSSVM
    from identification.pipeline import IdentificationResult, identify
    from identification.samples import Samples, build_samples

_HOME = {
    "ForceRegression": "identification.forces",
    "LSSVM": "identification.lssvm",
    "IdentificationResult": "identification.pipeline",
    "Samples": "identification.samples",
    "TruncatedLSSVM": "identification.lssvm",
    "build_samples": "identification.samples",
    "force_regression": "identification.forces",
    "identify": "identification.pipeline",
    "identify_forces": "identification.forces",
}

__all__ = [
    "LSSVM",
    "ForceRegression",
    "IdentificationResult",
    "Samples",
    "TruncatedLSSVM",
    "build_samples",
    "force_regression",
    "identify",
    "identify_forces",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: scikit-learn takes a second."""
    if name not in _HOME:
        raise AttributeError(f"module 'identification' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])

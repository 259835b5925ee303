"""Collinearity of the data, and residuals that a fit left over."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from identification.arrays import by_name, column_rms, mean_square, root_mean_square
from identification.estimators.covariance import residuals
from identification.estimators.linear import Estimator, Estimators
from identification.samples.samples import Samples
from shipgym.arrays import Floats
from shipgym.ships import Structure

COLLINEAR = 0.98  # correlation of two features
# of a correlation matrix, so that exact collinearity shows as a large inflation
JITTER = 1e-12


@dataclass(frozen=True)
class EquationDiagnostics:
    """Fit of one equation of motion."""

    #: rows and columns of the regression
    samples: int
    terms: int
    rank: int  # directions that were kept
    #: largest by smallest singular value of the features, each scaled to a root mean
    #: square of 1
    condition_number: float
    r_squared: float  # share of the change of velocity that is explained
    # root mean square of what is left of the change of velocity over a window, SI units
    residual_rms: float
    #: by term: how much the others increase its variance
    variance_inflation: dict[str, float]
    #: pairs of terms with a correlation beyond 0.98, and the correlation
    collinear_pairs: tuple[tuple[str, str, float], ...]
    dropped: tuple[tuple[str, ...], ...]  # terms that make up each dropped direction

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return asdict(self)


def diagnose(
    estimators: Estimators, samples: Samples, structure: Structure
) -> dict[str, EquationDiagnostics]:
    """Diagnostics of each equation, of estimators fitted to the samples."""
    errors = residuals(estimators, samples)
    found = {}
    for q, estimator in estimators.items():
        found[q] = _of_equation(
            estimator,
            names=structure.regression_names(q),
            features=samples.features[q],
            target=samples.targets[q],
            error=errors[q],
        )
    return found


def _of_equation(
    estimator: Estimator,
    names: Sequence[str],
    features: Floats,
    target: Floats,
    error: Floats,
) -> EquationDiagnostics:
    """Diagnostics of an equation."""
    scaled, condition = scaled_features(features)
    groups = getattr(estimator, "collinear_groups_", ())
    return EquationDiagnostics(
        samples=len(target),
        terms=len(names),
        rank=int(getattr(estimator, "rank_", min(features.shape))),
        condition_number=condition,
        r_squared=1.0 - mean_square(error) / (mean_square(target) or 1.0),
        residual_rms=root_mean_square(error),
        variance_inflation=by_name(names, variance_inflation(scaled)),
        collinear_pairs=collinear_pairs(scaled, names),
        dropped=tuple(tuple(names[term] for term in group) for group in groups),
    )


def scaled_features(features: Floats) -> tuple[Floats, float]:
    """Features divided by their root mean squares, and their condition number."""
    size = column_rms(features)
    scaled = features / np.where(
        size > 0.0,
        size,
        1.0,
    )
    singular = np.linalg.svd(scaled, compute_uv=False)
    rounding = np.finfo(float).eps * singular[0]
    return scaled, float(singular[0] / max(singular[-1], rounding))


def correlation_matrix(scaled: Floats) -> Floats:
    """Correlation about zero of features of a root mean square of 1.

    Shape (n_terms, n_terms).
    """
    return scaled.T @ scaled / len(scaled)


def variance_inflation(scaled: Floats) -> Floats:
    """Factor by which the other features increase the variance of each coefficient.

    Features have a root mean square of 1; of exactly collinear ones it is large, up to
    1e12.
    """
    moment = correlation_matrix(scaled)
    regular = moment + JITTER * np.eye(len(moment))
    return np.diag(np.linalg.inv(regular)) * np.diag(moment)


def collinear_pairs(
    scaled: Floats, names: Sequence[str]
) -> tuple[tuple[str, str, float], ...]:
    """Pairs of terms whose correlation is beyond the limit, and the correlation."""
    moment = correlation_matrix(scaled)
    places = np.argwhere(
        np.triu(
            np.abs(moment) > COLLINEAR,
            k=1,
        )
    )
    return tuple((names[i], names[j], float(moment[i, j])) for i, j in places.tolist())

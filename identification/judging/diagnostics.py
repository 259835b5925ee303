"""Collinearity of the data, and residuals that a fit left over."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from identification.arrays import by_name, column_rms, root_mean_square
from identification.estimators.covariance import residuals
from identification.estimators.estimator import Estimator, Estimators
from identification.samples.samples import Samples
from shipgym.arrays import Floats, Integers
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
    #: of the residuals at lags of 1 to 10 windows, without overlap
    residual_autocorrelation: tuple[float, ...]
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
    apart = without_overlap(samples)
    found = {}
    for q, estimator in estimators.items():
        found[q] = _of_equation(
            estimator,
            names=structure.regression_names(q),
            features=samples.features[q],
            target=samples.targets[q],
            error=errors[q],
            apart=apart,
        )
    return found


def _of_equation(
    estimator: Estimator,
    names: Sequence[str],
    features: Floats,
    target: Floats,
    error: Floats,
    apart: Integers,
) -> EquationDiagnostics:
    """Diagnostics of an equation; `apart`: rows whose windows do not overlap."""
    scaled, condition = scaled_features(features)
    full_rank = min(features.shape)
    rank = getattr(estimator, "rank_", full_rank)
    return EquationDiagnostics(
        samples=len(target),
        terms=len(names),
        rank=int(rank),
        condition_number=condition,
        r_squared=_r_squared(target, error),
        residual_rms=root_mean_square(error),
        residual_autocorrelation=autocorrelation(error[apart], 10),
        variance_inflation=by_name(names, variance_inflation(scaled)),
        collinear_pairs=collinear_pairs(scaled, names),
        dropped=_dropped(estimator, names),
    )


def _r_squared(target: Floats, error: Floats) -> float:
    """Share of the target's mean square that a fit explains."""
    smallest = np.finfo(float).tiny
    power = max(float(target @ target), smallest)
    unexplained = float(error @ error)
    return 1.0 - unexplained / power


def _dropped(estimator: Estimator, names: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    """Terms that make up each direction that an estimator dropped."""
    groups = getattr(estimator, "collinear_groups_", ())
    dropped = []
    for group in groups:
        terms = tuple(names[term] for term in group)
        dropped.append(terms)
    return tuple(dropped)


def scaled_features(features: Floats) -> tuple[Floats, float]:
    """Features divided by their root mean squares, and their condition number."""
    size = column_rms(features)
    size[size == 0.0] = 1.0
    scaled = features / size

    singular = np.linalg.svd(scaled, compute_uv=False)
    largest = singular[0]
    smallest = singular[-1]
    rounding = np.finfo(float).eps * largest
    condition = largest / max(smallest, rounding)
    return scaled, float(condition)


def autocorrelation(values: Floats, lags: int) -> tuple[float, ...]:
    """Autocorrelation of a series at lags of 1, 2, ... samples.

    Fewer lags for a short series, none for a constant one.
    """
    centred = values - values.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return ()

    most = min(lags, len(values) - 1)
    correlations = []
    for lag in range(1, most + 1):
        later = centred[lag:]
        earlier = centred[:-lag]
        product = float(later @ earlier)
        correlations.append(product / power)
    return tuple(correlations)


def correlation_matrix(scaled: Floats) -> Floats:
    """Correlation about zero of features of a root mean square of 1.

    Shape (n_terms, n_terms).
    """
    return np.asarray(scaled.T @ scaled / len(scaled))


def variance_inflation(scaled: Floats) -> Floats:
    """Factor by which the other features increase the variance of each coefficient.

    Features have a root mean square of 1; of exactly collinear ones it is large, up to
    1e12.
    """
    moment = correlation_matrix(scaled)
    regular = moment + JITTER * np.eye(len(moment))
    return np.diag(np.linalg.inv(regular)) * np.diag(moment)


def without_overlap(samples: Samples) -> Integers:
    """Rows whose windows do not overlap."""
    between = max(samples.window // 2, 1)  # steps from one row to the next
    every = int(np.ceil(samples.window / between))
    return np.arange(0, len(samples), every)


def collinear_pairs(
    scaled: Floats, names: Sequence[str]
) -> tuple[tuple[str, str, float], ...]:
    """Pairs of terms whose correlation is beyond the limit, and the correlation."""
    moment = correlation_matrix(scaled)
    beyond = np.abs(moment) > COLLINEAR
    places = np.argwhere(np.triu(beyond, k=1))
    pairs = []
    for i, j in places.tolist():
        correlation = float(moment[i, j])
        pairs.append((names[i], names[j], correlation))
    return tuple(pairs)

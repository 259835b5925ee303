"""What the data can determine and what the fit left over: excitation, collinearity, residuals."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.signal import correlate

from identification.estimators.estimator import Estimators
from identification.regression import preprocess
from identification.regression.samples import Samples
from identification.uncertainty.covariance import residuals
from shipgym import InputError, Trial
from shipgym.arrays import Floats, Integers
from shipgym.ships import Structure

LEAST_RUDDER = np.radians(0.5)  # a rudder that moves less than this excites nothing
RUDDER_NOISE = 6.0  # neither does one that moves less than this many times its noise,
MOST_RUDDER = np.radians(3.0)  # unless it moves more than this
SHORTEST_STEP = 1e-4  # of the median time step; a shorter one is a row written twice
MEDIAN_WIDTH = 5  # samples; shorter excursions of a rudder are outliers
COLLINEAR = 0.98  # correlation of two features
# of a correlation matrix, so that exact collinearity shows as a large inflation
JITTER = 1e-12
MOTIONS = {"u": "surge speed", "v": "sway speed", "r": "yaw rate", "p": "roll rate"}


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
    variance_inflation: dict[
        str, float
    ]  # by term: how much the others increase its variance
    #: pairs of terms with a correlation beyond 0.98, and the correlation
    collinear_pairs: tuple[tuple[str, str, float], ...]
    dropped: tuple[tuple[str, ...], ...]  # terms that make up each dropped direction

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return asdict(self)


def check_trials(trials: Sequence[Trial], structure: Structure) -> None:
    """Refuse no trial, a missing channel, times that nearly coincide, and rudders that never move."""
    if structure.captive:
        raise InputError(
            f"structure: '{structure.name}' found, which is identified from captive"
            " tests with the channels X, Y, N, expected one for free-running trials;"
            " use identification.identify_forces"
        )
    if not trials:
        raise InputError(
            'trials: none is marked use = "fit", expected at least one; mark the trials'
            " to identify from"
        )
    for trial in trials:
        for channel in structure.required_channels:
            if channel not in trial:
                raise InputError(
                    f"trial {trial.name!r}: channel {channel!r} is missing, structure"
                    f" {structure.name!r} needs"
                    f" {', '.join(structure.required_channels)}; name its column, or"
                    ' leave the trial out (use = "skip")'
                    + (
                        "; nomoto, norrbin and nomoto2 take the speed of [ship]"
                        if channel == "u"
                        else ""
                    )
                )
        _check_steps(trial)
    if not structure.has_rudder:
        return
    still = [trial for trial in trials if _is_still(trial.t, trial["delta"])]
    if len(still) == len(trials):
        angle = np.degrees(np.median(still[0]["delta"]))
        raise InputError(
            f"trial {still[0].name!r}: the rudder stays at {angle:.2f} deg throughout,"
            " expected it to move: nothing is excited and these coefficients cannot be"
            " identified; add a trial in which the rudder moves, such as a zigzag"
        )


def _check_steps(trial: Trial) -> None:
    steps = np.diff(trial.t)
    k, usual = int(np.argmin(steps)), float(np.median(steps))
    if steps[k] < SHORTEST_STEP * usual:
        raise InputError(
            f"trial {trial.name!r}: samples at {trial.t[k]:.12g} and"
            f" {trial.t[k + 1]:.12g} s are only {steps[k]:.2g} s apart, expected a step"
            f" near the usual {usual:.3g} s; remove the repeated row"
        )


def _is_still(t: Floats, delta: Floats) -> bool:
    """Whether a rudder does nothing but scatter: its running median moves no more than noise would."""
    width = min(MEDIAN_WIDTH, len(delta))
    medians = np.median(np.lib.stride_tricks.sliding_window_view(delta, width), axis=1)
    scatter = min(RUDDER_NOISE * preprocess.noise_level(t, delta), MOST_RUDDER)
    return bool(np.ptp(medians) < max(LEAST_RUDDER, scatter))


def check_samples(
    samples: Samples, trials: Sequence[Trial], structure: Structure
) -> None:
    """Refuse a regression with fewer rows than terms, or of a motion that never changes."""
    for q, change in samples.targets.items():
        if not np.any(change):
            raise InputError(
                f"trial {trials[0].name!r}: channel {q!r} never changes, in none of the"
                f" {len(trials)} trials to fit, expected the {MOTIONS.get(q, q)} to be"
                " excited and measured; leave the column out if it was not measured,"
                " or choose a structure without that equation"
            )
    terms = max(len(structure.regression_names(q)) for q in structure.regressed)
    if len(samples) <= terms:
        shortest = min(trials, key=len)
        raise InputError(
            f"trial {shortest.name!r}: {len(shortest)} samples found, in all"
            f" {len(samples)} rows for {terms} coefficients in one equation, expected"
            " several times as many; add trials, longer or sampled more often"
        )


def diagnose(
    estimators: Estimators, samples: Samples, structure: Structure
) -> dict[str, EquationDiagnostics]:
    """Diagnostics of each equation, of estimators fitted to the samples."""
    errors = residuals(estimators, samples)
    apart = without_overlap(samples)
    found = {}
    for q, estimator in estimators.items():
        names = structure.regression_names(q)
        features, target, error = samples.features[q], samples.targets[q], errors[q]
        scaled, condition = scaled_features(features)
        groups = getattr(estimator, "collinear_groups_", ())
        found[q] = EquationDiagnostics(
            samples=len(target),
            terms=len(names),
            condition_number=condition,
            rank=int(getattr(estimator, "rank_", min(features.shape))),
            r_squared=1.0
            - float(error @ error) / max(float(target @ target), np.finfo(float).tiny),
            residual_rms=float(np.sqrt(np.mean(error**2))),
            residual_autocorrelation=autocorrelation(error[apart], 10),
            variance_inflation=dict(
                zip(names, variance_inflation(scaled).tolist(), strict=True)
            ),
            collinear_pairs=_collinear_pairs(scaled, names),
            dropped=tuple(tuple(names[i] for i in group) for group in groups),
        )
    return found


def scaled_features(features: Floats) -> tuple[Floats, float]:
    """Features divided by their root mean squares, of the same shape, and their condition number."""
    size = np.sqrt(np.mean(features**2, axis=0))
    scaled = features / np.where(size > 0.0, size, 1.0)
    singular = np.linalg.svd(scaled, compute_uv=False)
    return scaled, float(
        singular[0] / max(singular[-1], np.finfo(float).eps * singular[0])
    )


def autocorrelation(values: Floats, lags: int) -> tuple[float, ...]:
    """Autocorrelation of a series at lags of 1, 2, ... samples; fewer lags for a short series."""
    centred = values - values.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return ()
    return tuple(
        float(centred[k:] @ centred[:-k]) / power
        for k in range(1, min(lags + 1, len(values)))
    )


def cross_correlation(first: Floats, second: Floats, lags: Integers) -> Floats:
    """Correlation, shape (n_lags,), of one series with another at the same times that is shifted.

    Lags are samples by which the first comes after the second. 0 for a constant or
    shorter series.
    """
    a, b = first - first.mean(), second - second.mean()
    power = float(np.sqrt((a @ a) * (b @ b)))
    shifted = correlate(a, b, method="fft") / (power or 1.0)
    return np.where(
        np.abs(lags) < len(a), shifted.take(lags + len(a) - 1, mode="clip"), 0.0
    )


def variance_inflation(scaled: Floats) -> Floats:
    """Factor by which the other features increase the variance of each coefficient.

    Features have a root mean square of 1; of exactly collinear ones it is large, up to
    1e12.
    """
    moment = scaled.T @ scaled / len(scaled)
    return np.diag(np.linalg.inv(moment + JITTER * np.eye(len(moment)))) * np.diag(
        moment
    )


def without_overlap(samples: Samples) -> Integers:
    """Rows whose windows do not overlap."""
    return np.arange(
        0, len(samples), int(np.ceil(samples.window / max(samples.window // 2, 1)))
    )


def _collinear_pairs(
    scaled: Floats, names: Sequence[str]
) -> tuple[tuple[str, str, float], ...]:
    moment = scaled.T @ scaled / len(scaled)
    pairs = np.argwhere(np.triu(np.abs(moment) > COLLINEAR, k=1)).tolist()
    return tuple((names[i], names[j], float(moment[i, j])) for i, j in pairs)

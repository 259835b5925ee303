"""How much worse trials left out are predicted than the covariance says, because of the structure.

The covariance of a regression says what noise does to the coefficients, not what the
equations cannot do. So each trial is left out in turn and predicted, motion and indices
of the manoeuvre, by the model of the others and by models drawn from its covariance;
standard errors are scaled until these errors are of size one.
"""

import copy
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.stats import t as student

from identification.arrays import mean_square
from identification.estimators.estimator import Estimator, Estimators, weights
from identification.regression.preprocess import smoothed_channels
from identification.regression.preprocess.noise import noise_level
from identification.regression.samples import Samples
from identification.uncertainty.covariance import residuals
from identification.validation.closed_loop import closed_loop
from identification.validation.prediction import COMPARED, ZIGZAG, index_reader, predict
from shipgym import ShipModel, Trial
from shipgym.arrays import Flags, Floats

FEWEST_TRIALS = 3  # to leave one out and learn something from it
# factor for fewer: found were 2.1 to 2.6 on ships of other equations than the
# structure's
DEFAULT = 2.5
DRAWS = 20  # of each model that a trial was left out of
INDICES = (
    "initial_turning_lengths",
    *ZIGZAG,
    "advance_lengths",
    "tactical_diameter_lengths",
)


class PredictionError(NamedTuple):
    """An error of prediction, and what of it is to be expected."""

    square: float  # the error squared
    variance: float  # over models drawn from the covariance
    noise: float  # variance of the measurement, and of the start that it gives


class ErrorSizes(NamedTuple):
    """Factors on the standard errors at which errors of prediction are of size one."""

    factor: float  # root mean square of those by kind; 0 without any
    by_kind: dict[str, float]  # of the motion and of indices
    predicted: int  # number of trials that could be predicted


def without_trial(
    estimators: Estimators, samples: Samples, trial: int
) -> tuple[Estimators, Samples]:
    """Estimators as if fitted without a trial, and the rows of the others.

    Exact for linear estimators that keep their directions and penalty: the normal
    equations less the rows left out.
    """
    errors = residuals(estimators, samples)
    out = samples.trial == trial
    found = {
        q: _without_rows(estimator, samples.features[q], errors[q], out)
        for q, estimator in estimators.items()
    }
    return found, samples.select(~out)


def _without_rows(
    estimator: Estimator, features: Floats, errors: Floats, out: Flags
) -> Estimator:
    """An estimator less the rows of its normal equations that are `out`.

    With M the inverse moment of all, that of the others is (1 - M X'W X)^-1 M, with the
    features X and weights W of the rows left out.
    """
    weight = weights(estimator, features)
    M = estimator.inverse_moment_
    X = features[out]
    left = X.T * weight[out]
    change = np.linalg.pinv(np.eye(len(M)) - M @ left @ X)

    found = copy.copy(estimator)
    found.coef_ = estimator.coef_ - change @ M @ (left @ errors[out])
    found.inverse_moment_ = change @ M
    if hasattr(estimator, "weights_"):
        found.weights_ = weight[~out]  # type: ignore[attr-defined]
    return found


def model_error(
    own: ShipModel, left_out: Sequence[ShipModel], trials: Sequence[Trial]
) -> dict[str, Any]:
    """The factor on the standard errors at which errors of prediction are of size one, never below 1.

    `own`: the model of all trials; `left_out`: each identified without the trial of the
    same place; all with covariance. Trials left out ask for a factor, and so do, where
    it is larger, the errors of the own model on the trials that it was fitted to: a
    trial left out is known from its mirror image, and the covariance shrinks with each
    trial while the error of the equations does not. Returns `factor`, `how` it was
    found, and what it is made of, for the provenance.
    """
    fitted = error_sizes([own] * len(trials), trials)
    error = _generalisation(left_out, trials)
    if fitted.factor > error["factor"]:
        error["factor"] = fitted.factor
        error["how"] = "errors on the fitted trials"
    return {**error, "fitted": fitted.by_kind}


def _generalisation(
    left_out: Sequence[ShipModel], trials: Sequence[Trial]
) -> dict[str, Any]:
    """The factor of trials left out, times Student's t with as many degrees of freedom over the normal's.

    Of few trials the scatter itself is uncertain. `DEFAULT` where fewer than three can
    be predicted.
    """
    if len(trials) < FEWEST_TRIALS:
        return _assumed(f"too few trials to leave one out ({len(trials)})")
    sizes = error_sizes(left_out, trials)
    if sizes.predicted < FEWEST_TRIALS:
        return _assumed(
            f"only {sizes.predicted} of {len(trials)} trials can be predicted when they"
            " are left out"
        )
    of_normal = 1.96
    for_few = float(student.ppf(0.975, sizes.predicted)) / of_normal
    return {
        "factor": max(1.0, for_few * sizes.factor),
        "how": "trials left out in turn",
        "trials": sizes.predicted,
        "for_few_trials": for_few,
        **sizes.by_kind,
    }


def _assumed(why: str) -> dict[str, Any]:
    return {"factor": DEFAULT, "how": f"assumed: {why}"}


def error_sizes(models: Sequence[ShipModel], trials: Sequence[Trial]) -> ErrorSizes:
    """How large the errors of models, with covariance, are on the trials of the same places."""
    motion, indices = list[PredictionError](), list[PredictionError]()
    predicted = 0
    for model, trial in zip(models, trials, strict=True):
        names = [name for name in COMPARED if name in trial]
        # extremes are read from smoothed channels
        clean = trial.with_channels(smoothed_channels(trial, names, "spline"))
        own = replace(model, covariance=None)
        drawn = model.sample(DRAWS, 0)

        errors = motion_errors(own, drawn, trial, clean)
        if errors:
            predicted += 1
            motion += errors
            indices += index_errors(own, drawn, trial, clean)

    by_kind = dict[str, float]()
    if motion:
        by_kind["motion"] = scale_of(motion)
    if indices:
        by_kind["indices"] = scale_of(indices)
    squares = [size**2 for size in by_kind.values()]
    return ErrorSizes(float(np.sqrt(np.mean(squares or 0.0))), by_kind, predicted)


def scale_of(errors: Sequence[PredictionError]) -> float:
    """The factor k at which errors are of size one: the mean of error^2 / (k^2 variance + noise^2) is 1.

    Between a thousandth and a thousand.
    """
    square, variance, noise = np.array(errors).T

    def excess(log_factor: float) -> float:
        expected = np.exp(2.0 * log_factor) * variance + noise
        return float(np.mean(square / expected)) - 1.0

    smallest, largest = np.log(1e-3), -np.log(1e-3)
    if excess(smallest) <= 0.0:
        return 1e-3
    if excess(largest) >= 0.0:
        return 1e3
    return float(np.exp(brentq(excess, smallest, largest)))


def motion_errors(
    own: ShipModel, drawn: Sequence[ShipModel], trial: Trial, clean: Trial
) -> list[PredictionError]:
    """Mean square error of each channel; none where the model or most draws run away."""
    predicted = predict(own, clean)
    runs = list[Trial]()
    for draw in drawn:
        run = predict(draw, clean)
        if run is not None:
            runs.append(run)
    if predicted is None or len(runs) < DRAWS / 2:
        return []

    levels = {
        name: noise_level(trial.t, trial[name]) for name in COMPARED if name in trial
    }
    shifted = _shifted_starts(own, clean, levels)
    found = []
    for name, level in levels.items():
        scatter = np.array([run[name] for run in runs]) - predicted[name]
        variance = float(np.mean(_robust_variance(scatter)))
        if variance <= 0.0:
            continue
        by_start = [mean_square(run[name] - predicted[name]) for run in shifted]
        by_timing = mean_square(_timing(trial) * np.gradient(clean[name], trial.t))
        noise = level**2 + by_timing + sum(by_start)
        square = mean_square(predicted[name] - trial[name])
        found.append(PredictionError(square, variance, noise))
    return found


def _shifted_starts(
    own: ShipModel, clean: Trial, levels: dict[str, float]
) -> list[Trial]:
    """Predictions from starts off by half the noise of a channel, to which smoothing leaves it known."""
    runs = []
    for name, level in levels.items():
        if level:
            shifted = clean.with_channels({name: clean[name] + 0.5 * level})
            run = predict(own, shifted)
            if run is not None:
                runs.append(run)
    return runs


def _robust_variance(scatter: Floats) -> Floats:
    """Variance along the first axis from the median of the squares, which of a normal number is 0.455."""
    return np.asarray(np.median(scatter**2, axis=0) / 0.455)


def index_errors(
    own: ShipModel, drawn: Sequence[ShipModel], trial: Trial, clean: Trial
) -> list[PredictionError]:
    """Error of each index of a zigzag or a turning circle; a time read from samples is known to a step."""
    read = index_reader(own, clean)
    if read is None:
        return []
    sail = closed_loop if trial.kind == "zigzag" else predict
    measured = read(clean)
    predicted = read(sail(own, clean))
    draws = [read(sail(draw, clean)) for draw in drawn]

    found = []
    for name in INDICES:
        truth = getattr(measured, name, None)
        mine = getattr(predicted, name, None)
        values = [getattr(indices, name, None) for indices in draws]
        known = np.array([value for value in values if value is not None])
        if truth is None or mine is None or len(known) < DRAWS / 2:
            continue
        variance = float(_robust_variance(known - mine))
        if variance > 0.0:
            noise = _reading_noise(trial, name, own)
            found.append(PredictionError((truth - mine) ** 2, variance, noise))
    return found


def _timing(trial: Trial) -> float:
    """Standard deviation of a time that is known to a step, such as that of a rudder's corner, s."""
    return float(np.median(np.diff(trial.t)) / np.sqrt(12.0))


def _reading_noise(trial: Trial, index: str, model: ShipModel) -> float:
    """Variance of an index as it is read from samples: noise, and a time that is known to a step."""
    timing = _timing(trial)
    if index.endswith("_deg"):
        noise = noise_level(trial.t, trial["psi"])
        rate = float(np.abs(trial["r"]).max())
        error_deg = np.degrees(np.hypot(noise, timing * rate))
        return float(error_deg) ** 2

    noise = 0.0
    if "x" in trial and trial.kind != "zigzag":
        noise = noise_level(trial.t, trial["x"])
    error = np.hypot(noise, timing * trial["u"].max())
    return float(error / model.particulars["length"]) ** 2

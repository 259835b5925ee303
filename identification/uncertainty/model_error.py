"""What a structure misses: by how much trials left out are worse predicted than the covariance says.

The covariance of a regression says what noise does to the coefficients, not what the
equations cannot do. So each trial is left out in turn and predicted, motion and indices
of the manoeuvre, by the model of the others and by models drawn from its covariance;
standard errors are scaled until these errors are of size one.
"""

import copy
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.stats import t as student

from identification.estimators.estimator import Estimators, weights
from identification.regression.preprocess import smoothed_channels
from identification.regression.preprocess.noise import noise_level
from identification.regression.samples import Samples
from identification.uncertainty.covariance import residuals
from identification.validation.closed_loop import closed_loop
from identification.validation.prediction import COMPARED, ZIGZAG, index_reader, predict
from shipgym import ShipModel, Trial

Error = tuple[
    float, float, float
]  # squared error, variance over the draws, variance of the measurement

FEWEST_TRIALS = 3  # to leave one out and learn something from it
# factor for fewer: found were 2.1 to 2.6 on ships of other equations than the
# structure's
DEFAULT = 2.5
DRAWS = 20  # of each model that a trial was left out of
# of which Student's t is taken as a multiple: few trials say little about their own
# scatter
NORMAL = 1.96
SMALLEST = 1e-3  # factor looked for; the largest is its inverse
START = 0.5  # of the noise, to which the smoothed state at a trial's start is known
MEDIAN = 0.455  # median of a squared standard normal number
INDICES = (
    "initial_turning_lengths",
    *ZIGZAG,
    "advance_lengths",
    "tactical_diameter_lengths",
)


def without_trial(
    estimators: Estimators, samples: Samples, trial: int
) -> tuple[Estimators, Samples]:
    """Estimators as if fitted without a trial, and the rows of the others.

    Exact for linear estimators that keep their directions and penalty: the normal
    equations less the rows left out.
    """
    errors = residuals(estimators, samples)
    out, kept = samples.trial == trial, samples.trial != trial
    found: Estimators = {}
    for q, estimator in estimators.items():
        X, weight = samples.features[q][out], weights(estimator, samples.features[q])
        moment = estimator.inverse_moment_
        left = np.linalg.pinv(np.eye(len(moment)) - moment @ (X.T * weight[out]) @ X)
        found[q] = copy.copy(estimator)
        found[q].coef_ = estimator.coef_ - left @ moment @ (
            X.T @ (weight[out] * errors[q][out])
        )
        found[q].inverse_moment_ = left @ moment
        if hasattr(estimator, "weights_"):
            found[q].weights_ = weight[kept]  # type: ignore[attr-defined]
    return found, samples.select(kept)


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
    least, fitted, _ = _sizes([own] * len(trials), trials)
    error = _generalisation(left_out, trials)
    if least > error["factor"]:
        error |= {"factor": least, "how": "errors on the fitted trials"}
    return {**error, "fitted": fitted}


def _generalisation(
    left_out: Sequence[ShipModel], trials: Sequence[Trial]
) -> dict[str, Any]:
    """The factor of trials left out, times Student's t with as many degrees of freedom over the normal's.

    Of few trials the scatter itself is uncertain. `DEFAULT` where fewer than three can
    be predicted.
    """
    if len(trials) < FEWEST_TRIALS:
        return _assumed(f"too few trials to leave one out ({len(trials)})")
    factor, sizes, predicted = _sizes(left_out, trials)
    if predicted < FEWEST_TRIALS:
        return _assumed(
            f"only {predicted} of {len(trials)} trials can be predicted when they are"
            " left out"
        )
    few, how = float(student.ppf(0.975, predicted)) / NORMAL, "trials left out in turn"
    return {
        "factor": max(1.0, few * factor),
        "how": how,
        "trials": predicted,
        "for_few_trials": few,
        **sizes,
    }


def _sizes(
    models: Sequence[ShipModel], trials: Sequence[Trial]
) -> tuple[float, dict[str, float], int]:
    """The root mean square of the factors by motion and by indices, these, and how many are predicted."""
    motion, indices, predicted = list[Error](), list[Error](), 0
    for model, trial in zip(models, trials, strict=True):
        own, drawn = replace(model, covariance=None), model.sample(DRAWS, 0)
        names = [name for name in COMPARED if name in trial]
        clean = trial.with_channels(
            smoothed_channels(trial, names, "spline")
        )  # extremes are read from it
        if found := _motion_errors(own, drawn, trial, clean):
            predicted += 1
            motion += found
            indices += _index_errors(own, drawn, trial, clean)
    sizes = {
        name: scale_of(of)
        for name, of in (("motion", motion), ("indices", indices))
        if of
    }
    return (
        float(np.sqrt(np.mean(np.square([*sizes.values()] or [0.0])))),
        sizes,
        predicted,
    )


def _assumed(why: str) -> dict[str, Any]:
    return {"factor": DEFAULT, "how": f"assumed: {why}"}


def scale_of(errors: Sequence[Error]) -> float:
    """The factor k at which errors are of size one: the mean of error^2 / (k^2 variance + noise^2) is 1."""
    square, variance, noise = np.array(errors).T

    def excess(log_factor: float) -> float:
        return (
            float(np.mean(square / (np.exp(2.0 * log_factor) * variance + noise))) - 1.0
        )

    low, high = np.log(SMALLEST), -np.log(SMALLEST)
    if excess(low) <= 0.0 or excess(high) >= 0.0:
        return SMALLEST if excess(low) <= 0.0 else 1.0 / SMALLEST
    return float(np.exp(brentq(excess, low, high)))


def _motion_errors(
    own: ShipModel, drawn: Sequence[ShipModel], trial: Trial, clean: Trial
) -> list[Error]:
    """Of each channel the mean square error; none where the model or most draws run away."""
    predicted = predict(own, clean)
    runs = [run for run in (predict(draw, clean) for draw in drawn) if run is not None]
    if predicted is None or len(runs) < DRAWS / 2:
        return []
    noise = {
        name: noise_level(trial.t, trial[name]) for name in COMPARED if name in trial
    }
    shifted = [
        (name, clean[name] + START * level) for name, level in noise.items() if level
    ]
    started = [
        predict(own, clean.with_channels({name: values})) for name, values in shifted
    ]
    found = []
    for name, level in noise.items():
        values = np.array([run[name] for run in runs]) - predicted[name]
        variance = float(np.mean(np.median(values**2, axis=0))) / MEDIAN
        square = float(np.mean((predicted[name] - trial[name]) ** 2))
        starts = [
            float(np.mean((run[name] - predicted[name]) ** 2))
            for run in started
            if run is not None
        ]
        if variance > 0.0:
            timing = float(
                np.mean((_timing(trial) * np.gradient(clean[name], trial.t)) ** 2)
            )
            found.append((square, variance, level**2 + timing + sum(starts)))
    return found


def _index_errors(
    own: ShipModel, drawn: Sequence[ShipModel], trial: Trial, clean: Trial
) -> list[Error]:
    """Of each index of a zigzag or a turning circle; a time read from samples is known to a step."""
    if (read := index_reader(own, clean)) is None:
        return []
    sail = closed_loop if trial.kind == "zigzag" else predict
    measured, predicted = read(clean), read(sail(own, clean))
    draws = [read(sail(draw, clean)) for draw in drawn]
    found = []
    for name in INDICES:
        values = [
            value
            for value in (getattr(one, name, None) for one in draws)
            if value is not None
        ]
        truth, mine = getattr(measured, name, None), getattr(predicted, name, None)
        if truth is None or mine is None or len(values) < DRAWS / 2:
            continue
        variance = float(np.median((np.array(values) - mine) ** 2)) / MEDIAN
        if variance > 0.0:
            found.append(
                ((truth - mine) ** 2, variance, _reading_noise(trial, name, own))
            )
    return found


def _timing(trial: Trial) -> float:
    """Standard deviation of a time that is known to a step, such as that of a rudder's corner, s."""
    return float(np.median(np.diff(trial.t)) / np.sqrt(12.0))


def _reading_noise(trial: Trial, index: str, model: ShipModel) -> float:
    """Variance of an index as it is read from samples: noise, and a time that is known to a step."""
    timing = _timing(trial)
    if index.endswith("_deg"):
        rate = float(np.abs(trial["r"]).max())
        return (
            float(
                np.degrees(np.hypot(noise_level(trial.t, trial["psi"]), timing * rate))
            )
            ** 2
        )
    noise = (
        noise_level(trial.t, trial["x"])
        if "x" in trial and trial.kind != "zigzag"
        else 0.0
    )
    return (
        float(np.hypot(noise, timing * trial["u"].max()) / model.particulars["length"])
        ** 2
    )

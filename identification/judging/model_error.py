"""Error of the structure: how much worse trials are predicted than noise explains.

The covariance of a regression says what noise does to the coefficients, not what the
equations cannot do. So each trial is left out in turn and predicted, motion and indices
of the manoeuvre, by the model of the others and by models drawn from its covariance;
standard errors are scaled until these errors are of size one.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import stdtrit

from identification.arrays import mean_square, root_mean_square, rounded
from identification.judging.prediction import ZIGZAG, closed_loop, indices_of
from identification.samples.prediction import (
    COMPARED,
    predict,
    predicted_channels,
    predicts_track,
    with_start,
)
from identification.samples.preprocess import noise_level, smoothed_channels
from shipgym import ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats
from shipgym.models.simulate import open_loop
from shipgym.ships import Structure
from shipgym.trials.resampling import usual_step

FEWEST_TRIALS = 3  # to leave one out and learn something from it
# factor for fewer: found were 2.1 to 2.6 on ships of other equations than the
# structure's
DEFAULT = 2.5
DRAWS = 20  # of each model that a trial was left out of
LEAST = 1e-3  # factor
RUDDERS = 5  # with the noise of the logged one


class PredictionError(NamedTuple):
    """An error of prediction, and what of it is to be expected."""

    square: float  # the error squared
    variance: float  # over models drawn from the covariance
    noise: float  # variance of the measurement, and of the start that it gives


def model_error(
    own: ShipModel,
    left_out: Sequence[ShipModel],
    trials: Sequence[Trial],
) -> dict[str, Any]:
    """Factor on the standard errors at which errors of prediction are of size one.

    It is never below 1. `own`: the model of all trials; `left_out`: each identified
    without the trial of the same place; all with covariance. Trials left out ask for a
    factor, and so do, where it is larger, the errors of the own model on the trials
    that it was fitted to: a trial left out is known from its mirror image, and the
    covariance shrinks with each trial while the error of the equations does not.
    Returns `factor`, `how` it was found, and what it is made of, for the provenance.
    """
    fitted, _ = error_sizes([own] * len(trials), trials)
    error = _generalisation(left_out, trials)
    own_factor = _common(fitted)
    if own_factor > error["factor"]:
        error["factor"] = own_factor
        error["how"] = "errors on the fitted trials"
    return {**error, "fitted": fitted}


def _common(sizes: Mapping[str, float]) -> float:
    """Root mean square of the factors by kind; 0 without any.

    A kind whose errors noise alone explains tells nothing of the equations.
    """
    told = [size for size in sizes.values() if size > LEAST]
    return root_mean_square(np.array(told)) if told else 0.0


def _generalisation(
    left_out: Sequence[ShipModel], trials: Sequence[Trial]
) -> dict[str, Any]:
    """Factor by trials left out, widened for few trials.

    Of few trials the scatter itself is uncertain, hence the quantile of Student's t
    over that of the normal distribution. `DEFAULT` where fewer than three can be
    predicted.
    """
    sizes, predicted = error_sizes(
        left_out,
        trials[: len(left_out)],
    )
    if predicted < FEWEST_TRIALS:
        how = (
            f"assumed, since finding it takes {FEWEST_TRIALS} trials that are predicted"
            f" when left out, and there are {predicted}"
        )
        return {"factor": DEFAULT, "how": how}
    for_few = float(stdtrit(predicted, 0.975)) / 1.96
    return {
        "factor": max(1.0, for_few * _common(sizes)),
        "how": "trials left out in turn",
        "trials": predicted,
        "for_few_trials": for_few,
        **sizes,
    }


def error_sizes(
    models: Sequence[ShipModel], trials: Sequence[Trial]
) -> tuple[dict[str, float], int]:
    """Sizes of the errors of models, with covariance, each on its trial.

    Factors on the standard errors by kind, of the motion and of indices, and the number
    of trials that could be predicted.
    """
    found: dict[str, list[PredictionError]] = {"motion": [], "indices": []}
    predicted = 0
    for model, trial in zip(models, trials, strict=True):
        clean = _smoothed(trial)
        own = replace(model, covariance=None)
        drawn = model.sample(DRAWS, 0)
        errors = motion_errors(
            own,
            drawn,
            trial,
            clean,
        )
        if errors:
            predicted += 1
            found["motion"] += errors
            found["indices"] += index_errors(own, drawn, trial, clean)
    sizes = {kind: scale_of(errors) for kind, errors in found.items() if errors}
    return sizes, predicted


def _smoothed(trial: Trial) -> Trial:
    """The trial that extremes are read from."""
    names = [name for name in COMPARED if name in trial]
    return trial.with_channels(smoothed_channels(trial, names, "spline"))


def scale_of(errors: Sequence[PredictionError]) -> float:
    """Factor k at which errors are of size one.

    There the mean of error^2 / (k^2 variance + noise^2) is 1. It is between `LEAST`,
    where noise alone explains them, and a thousand.
    """
    square, variance, noise = np.array(errors).T

    def excess(log_factor: float) -> float:
        expected = np.exp(2.0 * log_factor) * variance + noise
        return float(np.mean(square / expected)) - 1.0

    least = np.log(LEAST)
    largest = np.log(1e3)
    if excess(least) <= 0.0:
        return LEAST
    if excess(largest) >= 0.0:
        return 1e3
    return float(np.exp(brentq(excess, least, largest)))


def motion_errors(
    own: ShipModel,
    drawn: Sequence[ShipModel],
    trial: Trial,
    clean: Trial,
) -> list[PredictionError]:
    """Mean square error of each channel that the model predicts.

    None where the model or most draws fail. What a structure has no equation of, such
    as the speed in a structure of yaw, is no error of its coefficients.
    """
    begun = with_start(own, trial) if "psi" in trial else clean
    predicted = _runs([own], begun)
    runs = _runs(drawn, begun)
    if not predicted or len(runs) < DRAWS / 2:
        return []

    names = counted_channels(own, trial)
    levels = {name: noise_level(trial.t, trial[name]) for name in names}
    shifted = list[Trial]()
    if "psi" in levels and "r" in trial.derived:
        # the yaw rate of a start that is estimated from headings
        error = levels["psi"] / own.travel_time
        shifted = _runs([own], begun.with_channels({"r": begun["r"] + error}))
    noisy = _with_noisy_rudder(own, begun)
    # where the heading is differentiated, jitter of the clock is in its noise already
    timing = 0.0 if "r" in trial.derived else _timing(trial)
    found = []
    for name, level in levels.items():
        mine = predicted[0][name]
        scatter = np.array([run[name] for run in runs]) - mine
        variance = float(np.mean(_robust_variance(scatter)))
        if variance <= 0.0:
            continue
        # the level is known to a tenth
        noise = (1.1 * level) ** 2
        noise += mean_square(timing * np.gradient(clean[name], clean.t))
        noise += sum(mean_square(run[name] - mine) for run in shifted)
        noise += sum(mean_square(run[name] - mine) for run in noisy) / RUDDERS
        square = mean_square(mine - trial[name])
        found.append(PredictionError(square, variance, noise))
    return found


def counted_channels(model: ShipModel, trial: Trial) -> list[str]:
    """Channels whose errors count: those predicted that are no other one's double.

    Heading and yaw rate, of which one was derived from the other, have the same
    information; smoothing hides the noise of a derivative from `noise_level`.
    """
    names = [name for name in predicted_channels(model) if name in trial]
    for name, source in (("r", "psi"), ("psi", "r")):
        if name in trial.derived and name in names and source in names:
            names.remove(name)
    return names


def _runs(models: Sequence[ShipModel], trial: Trial) -> list[Trial]:
    """Simulations of a trial from its first samples, of those that do not run away."""
    found = []
    for model in models:
        with suppress(UnstableModelError):
            found.append(open_loop(model, trial))
    return found


def _with_noisy_rudder(own: ShipModel, trial: Trial) -> list[Trial]:
    """Predictions with the noise of the logged rudder once more.

    It makes the heading walk off, which is no error of the model.
    """
    delta = trial["delta"]
    level = noise_level(trial.t, delta)
    smallest = math.radians(0.01)
    if level < smallest or "r" not in trial.derived:
        return []
    rng = np.random.default_rng(0)
    noise = level * rng.standard_normal((RUDDERS, len(delta)))
    found = list[Trial]()
    for error in noise:
        found += _runs([own], trial.with_channels({"delta": delta + error}))
    return found


def _robust_variance(scatter: Floats) -> Floats:
    """Variance along the first axis from the median of the squares."""
    of_normal = 0.455  # median of the square of a standard normal number
    return np.median(scatter**2, axis=0) / of_normal


def index_errors(
    own: ShipModel,
    drawn: Sequence[ShipModel],
    trial: Trial,
    clean: Trial,
) -> list[PredictionError]:
    """Error of each index of a zigzag or a turning circle that the model predicts."""
    measured = indices_of(own, clean, clean)
    if measured is None:
        return []
    sail = closed_loop if trial.kind == "zigzag" else predict
    predicted, *draws = [
        indices_of(own, clean, sail(model, clean)) for model in (own, *drawn)
    ]

    names = list(ZIGZAG)
    if predicts_track(own):
        names += [
            "initial_turning_lengths",
            "advance_lengths",
            "tactical_diameter_lengths",
        ]
    found = []
    for name in names:
        truth, mine, *others = [
            getattr(one, name, None) for one in (measured, predicted, *draws)
        ]
        values = [value for value in others if value is not None]
        if truth is None or mine is None or len(values) < DRAWS / 2:
            continue
        variance = float(_robust_variance(np.array(values) - mine))
        if variance > 0.0:
            noise = _reading_noise(trial, name, own)
            found.append(PredictionError((truth - mine) ** 2, variance, noise))
    return found


def _timing(trial: Trial) -> float:
    """Standard deviation of a time that is known to a step, s."""
    return usual_step(trial.t) / math.sqrt(12.0)


def _reading_noise(trial: Trial, index: str, model: ShipModel) -> float:
    """Variance of an index as it is read from samples, by noise and timing."""
    noise, fastest, unit = 0.0, trial["u"].max(), model.particulars["length"]
    if index.endswith("_deg"):
        noise = noise_level(trial.t, trial["psi"])
        fastest, unit = np.abs(trial["r"]).max(), math.radians(1.0)
    elif "x" in trial and trial.kind != "zigzag":
        noise = noise_level(trial.t, trial["x"])
    return float(np.hypot(noise, _timing(trial) * fastest) / unit) ** 2


def with_sound_draws(model: ShipModel, trials: Sequence[Trial]) -> ShipModel:
    """The model, with draws where some of its covariance run away in its own trials.

    The log itself rejects those: no such ship sailed it. The covariance stays.
    """
    if type(model.dynamics) is not Structure:
        return model
    whole = model.sample(128, 0)
    drawn = [draw for draw in whole if all(_runs([draw], trial) for trial in trials)]
    if not 0.5 * len(whole) <= len(drawn) < len(whole):
        return model
    draws = np.array([[*draw.coefficients.values()] for draw in drawn])
    return replace(model, draws=rounded(draws))

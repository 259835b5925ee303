"""Error of the structure: how much worse trials are predicted than noise explains.

The covariance of a regression says what noise does to the coefficients, not what the
equations cannot do. So each trial is left out in turn and predicted, motion and indices
of the manoeuvre, by the model of the others and by models drawn from its covariance;
standard errors are scaled until these errors are of size one.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import stdtrit

from identification.arrays import column_rms, mean_square, root_mean_square, rounded
from identification.judging.prediction import ZIGZAG, closed_loop, indices_of
from identification.samples.prediction import (
    COMPARED,
    predict,
    predicted_channels,
    predicts_track,
)
from identification.samples.preprocess import noise_level, smoothed_channels
from identification.samples.problem import largest_rudders
from shipgym import InputError, ManoeuvreError, ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats, Integers, integral
from shipgym.manoeuvres import turning_circle
from shipgym.models.simulate import open_loop
from shipgym.ships import Structure
from shipgym.ships.structures import MMG
from shipgym.trials.resampling import usual_step

FEWEST_TRIALS = 3  # to leave one out and learn something from it
# factor for fewer: found were 2.1 to 2.6 on ships of other equations than the
# structure's
DEFAULT = 2.5
DRAWS = 20  # of each model that a trial was left out of
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
    """Root mean square of the factors by kind; 0 without any."""
    return root_mean_square(np.array([*sizes.values()])) if sizes else 0.0


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

    There the mean of error^2 / (k^2 variance + noise^2) is 1. It is between a
    thousandth and a thousand.
    """
    square, variance, noise = np.array(errors).T

    def excess(log_factor: float) -> float:
        expected = np.exp(2.0 * log_factor) * variance + noise
        return float(np.mean(square / expected)) - 1.0

    least = np.log(1e-3)
    largest = np.log(1e3)
    if excess(least) <= 0.0:
        return 1e-3
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
    predicted = predict(own, clean)
    runs = _runs([(draw, clean) for draw in drawn])
    if predicted is None or len(runs) < DRAWS / 2:
        return []

    names = counted_channels(own, trial)
    levels = {name: noise_level(trial.t, trial[name]) for name in names}
    # smoothing leaves the start known to half the noise of a channel
    shifted = _runs(
        [
            (own, clean.with_channels({name: clean[name] + 0.5 * level}))
            for name, level in levels.items()
            if level
        ]
    )
    noisy = _with_noisy_rudder(own, clean)
    # where the heading is differentiated, jitter of the clock is in its noise already
    timing = 0.0 if "r" in trial.derived else _timing(trial)
    found = []
    for name, level in levels.items():
        mine = predicted[name]
        scatter = np.array([run[name] for run in runs]) - mine
        variance = float(np.mean(_robust_variance(scatter)))
        if variance <= 0.0:
            continue
        noise = level**2 + mean_square(timing * np.gradient(clean[name], clean.t))
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


def _runs(cases: Sequence[tuple[ShipModel, Trial]]) -> list[Trial]:
    """Predictions of trials by models, of those that do not run away."""
    runs = [predict(*case) for case in cases]
    return [run for run in runs if run is not None]


def _with_noisy_rudder(own: ShipModel, clean: Trial) -> list[Trial]:
    """Predictions with the noise of the logged rudder once more.

    It makes the heading walk off, which is no error of the model.
    """
    delta = clean["delta"]
    level = noise_level(clean.t, delta)
    smallest = math.radians(0.01)
    if level < smallest or "r" not in clean.derived:
        return []
    rng = np.random.default_rng(0)
    noise = level * rng.standard_normal((RUDDERS, len(delta)))
    noisy = [clean.with_channels({"delta": delta + error}) for error in noise]
    return _runs([(own, trial) for trial in noisy])


def _robust_variance(scatter: Floats) -> Floats:
    """Variance along the first axis from the median of the squares."""
    of_normal = 0.455  # median of the square of a standard normal number
    return np.asarray(np.median(scatter**2, axis=0) / of_normal)


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

    def sails(draw: ShipModel) -> bool:
        try:
            for trial in trials:
                open_loop(draw, trial)
        except UnstableModelError:
            return False
        return True

    if type(model.dynamics) is not Structure:
        return model
    whole = model.sample(128, 0)
    drawn = [draw for draw in whole if sails(draw)]
    if not 0.5 * len(whole) <= len(drawn) < len(whole):
        return model
    draws = np.array([[*draw.coefficients.values()] for draw in drawn])
    return replace(model, draws=rounded(draws))


#: The model of the trials other than those at some places.
Without = Callable[[Sequence[int]], ShipModel]


class HardTurn(NamedTuple):
    """What a covariance lets a hard turn do."""

    deviation: float  # of the logarithm of the angle turned through
    direction: Floats  # of the coefficients, that moves it by one deviation


def holds_turn(trials: Sequence[Trial]) -> bool:
    """Return True if a trial turns through half a circle or more, one way."""
    return any(_turned(trial) >= math.pi for trial in trials)


def _turned(trial: Trial) -> float:
    """Largest change of heading from the start of a trial, rad."""
    known = "psi" in trial
    heading = np.unwrap(trial["psi"]) if known else integral(trial.t, trial["r"])
    return float(np.abs(heading - heading[0]).max())


def hardest(trials: Sequence[Trial]) -> Integers:
    """Places of the trials of the largest rudder; none where fewer than two stay."""
    largest = largest_rudders(trials)
    return np.flatnonzero(largest & (np.sum(~largest) >= 2))


def extrapolation_error(
    model: ShipModel, without: Without, trials: Sequence[Trial]
) -> float | None:
    """Error of the trials of the largest rudder by a fit to the others.

    That of the MMG form goes to terms that grow with the turn: it is the error beyond a
    steady drift, which makes turns to one side wider and to the other tighter, and
    beyond what the fit to all trials misses, which no rudder explains. None where no
    trials would be left, or a fit runs away.
    """
    largest = hardest(trials)
    if not largest.size:
        return None
    shown = [trials[place] for place in largest]
    grows = model.structure == MMG
    by_others = _mean_square(without(largest.tolist()), shown, grows)
    by_all = _mean_square(model, shown, grows) if grows else 0.0
    if by_others is None or by_all is None:
        return None
    return math.sqrt(max(by_others - by_all, 0.0))


def _mean_square(
    model: ShipModel, trials: Sequence[Trial], without_drift: bool
) -> float | None:
    """Mean square of the relative errors of some trials.

    Of the heading, where none is of the yaw rate.
    """
    squares = []
    for trial in trials:
        run = predict(model, trial)
        if run is None:
            return None
        name, degree = ("psi", 1) if "psi" in trial else ("r", 0)
        error = run[name] - trial[name]
        both = np.column_stack([error, trial[name]])
        left, scatter = _rms_without_drift(trial.t, both, degree)
        size = left if without_drift else root_mean_square(error)
        squares.append((size / max(scatter, 1e-12)) ** 2)
    return float(np.mean(squares))


def _rms_without_drift(t: Floats, values: Floats, degree: int) -> Floats:
    """Root mean square of columns beyond a polynomial of time."""
    powers = np.vander(t - t[0], degree + 1)
    slopes, *_ = np.linalg.lstsq(powers, values)
    return column_rms(values - powers @ slopes)


def beyond_trials(
    model: ShipModel, without: Without, trials: Sequence[Trial]
) -> tuple[ShipModel, dict[str, Any]]:
    """The model with its covariance widened by the error of a hard turn, and a report.

    As it is where a trial turns, or where it has no hard turn itself. So are tables of
    many terms: the trials of less rudder do not fix these, so that the error of such a
    fit says nothing, and the covariance lets their turns go far.
    """
    is_mmg = model.structure == MMG
    most_terms = 20  # of a table that a fit to the lesser rudders still determines
    has_many = len(model.coefficients) > most_terms and not is_mmg
    if has_many or holds_turn(trials) or math.isnan(_log_angle(model)):
        return model, {}
    error = extrapolation_error(
        model,
        without,
        trials,
    )
    how = "trials of the largest rudder by a fit to the others"
    if error is None:
        error = 0.12  # found were 0.06 to 0.2 on ships of other equations
        how = "assumed, since too few trials of less rudder are left to find it"
    smallest, largest = 0.04, 0.15
    error = min(max(error, smallest), largest)
    report = {"hard_turn": {"size": error, "how": how}}
    if is_mmg:
        return with_growing_terms(model, error), report
    return widened(model, error), report


def with_growing_terms(model: ShipModel, error: float) -> ShipModel:
    """The MMG form whose draws' hard turn has this deviation at least, and more.

    What its covariance lacks goes to the terms that grow beyond the trials.
    """
    # the error is that of two trials or so, whose mean square may well be half as large
    few = 1.5
    due = few * error
    turn = hard_turn(model)
    own = 0.0 if turn is None else turn.deviation
    lacking = math.sqrt(max(due**2 - own**2, 0.0))
    share = 0.7  # of that, which each of the two has
    covariance = np.array(model.covariance)
    for name in ("N_vvr", "X_rr"):
        place = list(model.coefficients).index(name)
        step = 0.01 * np.eye(len(covariance))[place]  # coefficients are of size 0.1
        slope = (_log_angle(model, step) - _log_angle(model, -step)) / 0.02
        if slope and math.isfinite(slope):
            covariance[place, place] += (share * lacking / slope) ** 2
    return replace(model, covariance=covariance)


def widened(model: ShipModel, deviation: float) -> ShipModel:
    """The model in whose draws the hard turn has at least this deviation.

    Given the turn, the coefficients are distributed as before.
    """
    turn = hard_turn(model)
    if turn is None or turn.deviation >= deviation:
        return model
    ratio = deviation / turn.deviation
    added = ratio**2 - 1.0
    along = np.outer(turn.direction, turn.direction)
    covariance = np.asarray(model.covariance) + added * along
    return replace(
        model,
        covariance=covariance,
    )


def hard_turn(model: ShipModel) -> HardTurn | None:
    """How far its covariance lets a model's hard turn change; None where it does not.

    By moves of one standard deviation along each principal axis.
    """
    own = _log_angle(model)
    variances, axes = np.linalg.eigh(np.asarray(model.covariance))
    known = variances > 1e-12 * variances.max()
    moves = (axes[:, known] * np.sqrt(variances[known])).T
    slopes = np.array([(_log_angle(model, 0.1 * move) - own) / 0.1 for move in moves])
    slopes = np.nan_to_num(slopes)
    deviation = float(np.linalg.norm(slopes))
    if deviation == 0.0:
        return None
    return HardTurn(deviation, slopes @ moves / deviation)


def _log_angle(model: ShipModel, move: Floats | float = 0.0) -> float:
    """Logarithm of the angle turned through in ten lengths, mean of both sides.

    Of the model with its coefficients moved; NaN where it does not turn.
    """
    moved = model.with_coefficients(np.array([*model.coefficients.values()]) + move)
    travel = model.travel_time
    rudder = min(35.0, model.steering.rudder_limit_deg)
    angles = []
    for side in (1.0, -1.0):
        try:
            run = turning_circle(
                moved,
                side * rudder,
                10.0 * travel,
                travel / 20.0,
            )
        except (UnstableModelError, ManoeuvreError, InputError):
            return math.nan
        angles.append(side * float(run["psi"][-1]))
    return float(np.mean(np.log(angles))) if min(angles) > 0.0 else math.nan

"""Error of a hard turn that no trial holds: how far beyond the trials a model is right.

It is that of the trials of the largest rudder by a fit to the others. Covariances are
widened until a hard turn of the models drawn has at least this deviation.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import column_rms, root_mean_square, rounded
from identification.samples.prediction import predict
from identification.samples.problem import largest_rudders
from shipgym import InputError, ManoeuvreError, ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats, Integers, integral
from shipgym.manoeuvres import turning_circle
from shipgym.ships.structures import MMG

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
    units = np.eye(len(model.coefficients))
    for name in ("N_vvr", "X_rr"):
        unit = units[list(model.coefficients).index(name)]
        step = 0.01 * unit  # coefficients are of size 0.1
        slope = (_log_angle(model, step) - _log_angle(model, -step)) / 0.02
        if slope and math.isfinite(slope):
            model = spread(model, share * lacking / slope * unit)
    return model


def spread(model: ShipModel, along: Floats) -> ShipModel:
    """The model with a deviation more of its coefficients, and of draws that it has."""
    draws = model.draws
    if draws is not None:
        # other normal numbers for each coefficient that moves
        rng = np.random.default_rng(int(np.abs(along).argmax()))
        draws = rounded(draws + np.outer(rng.standard_normal(len(draws)), along))
    covariance = np.asarray(model.covariance) + np.outer(along, along)
    return replace(model, covariance=covariance, draws=draws)


def widened(model: ShipModel, deviation: float) -> ShipModel:
    """The model in whose draws the hard turn has at least this deviation.

    Given the turn, the coefficients are distributed as before.
    """
    turn = hard_turn(model)
    if turn is None or turn.deviation >= deviation:
        return model
    ratio = deviation / turn.deviation
    return spread(model, math.sqrt(ratio**2 - 1.0) * turn.direction)


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

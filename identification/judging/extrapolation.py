"""Error of a hard turn where no trial is one: what trials of less rudder leave unknown.

The covariance of coefficients says how well the trials fix the motion that they hold.
A turn at full rudder lies beyond zigzags, and there the terms that a structure has, and
those that it lacks, go apart. How far, the trials show themselves: those of the largest
rudder are predicted by a fit to the others, and their error is taken for that of the
turn. The form of the MMG gets it, less what is a drift or is missed anyway, in terms
that grow beyond the trials, the moment N'vvr of the hull and its resistance X'rr in a
turn, which zigzags hardly show. A table of few terms gets it along the one direction in
which its covariance lets the turn change most; what does not move with the turn stays
as certain as it was.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import root_mean_square
from identification.samples.prediction import predict
from shipgym import InputError, ManoeuvreError, ShipModel, Trial, UnstableModelError
from shipgym.arrays import Floats, Integers
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
    if "psi" in trial:
        heading = np.unwrap(trial["psi"])
    else:
        steps = np.diff(trial.t, prepend=trial.t[0])
        heading = np.cumsum(trial["r"] * steps)
    change = heading - heading[0]
    return float(np.abs(change).max())


def largest_rudders(trials: Sequence[Trial]) -> Integers:
    """Places of the trials of the largest rudder; none where few would be left."""
    reached = np.array([np.abs(trial["delta"]).max() for trial in trials])
    is_largest = reached > 0.9 * reached.max()
    n_left = np.sum(~is_largest)
    if n_left < 2:
        is_largest[:] = False
    return np.flatnonzero(is_largest)


def extrapolation_error(without: Without, trials: Sequence[Trial]) -> float | None:
    """Error of the trials of the largest rudder by a fit to the others.

    That of the heading by its standard deviation, without a heading of the yaw rate;
    None where no trials would be left, or the fit runs away.
    """
    largest = largest_rudders(trials)
    if not largest.size:
        return None
    model = without(largest.tolist())
    errors = []
    for place in largest:
        trial = trials[place]
        error = _error(model, trial)
        if error is None:
            return None
        name = _compared(trial)
        errors.append(root_mean_square(error) / _size(np.std(trial[name])))
    return root_mean_square(np.array(errors))


def growing_error(
    model: ShipModel, without: Without, trials: Sequence[Trial]
) -> float | None:
    """The same beyond a steady drift, and beyond what the fit to all trials misses.

    A drift makes turns to one side wider and to the other tighter, and what all trials
    miss no rudder explains: terms that grow with the turn are due to the rest.
    """
    largest = largest_rudders(trials)
    if not largest.size:
        return None
    shown = [trials[place] for place in largest]
    by_others = _mean_square(without(largest.tolist()), shown)
    by_all = _mean_square(model, shown)
    if by_others is None or by_all is None:
        return None
    return math.sqrt(max(by_others - by_all, 0.0))


def _mean_square(model: ShipModel, trials: Sequence[Trial]) -> float | None:
    """Mean square of the relative errors of some trials, without their drift."""
    squares = []
    for trial in trials:
        error = _error(model, trial)
        if error is None:
            return None
        name = _compared(trial)
        degree = 1 if name == "psi" else 0
        left = root_mean_square(_without_drift(trial.t, error, degree))
        scatter = root_mean_square(_without_drift(trial.t, trial[name], degree))
        squares.append((left / _size(scatter)) ** 2)
    return float(np.mean(squares))


def _compared(trial: Trial) -> str:
    """The channel that is compared: the heading, or the yaw rate where none is."""
    return "psi" if "psi" in trial else "r"


def _error(model: ShipModel, trial: Trial) -> Floats | None:
    """Error of a prediction of that channel; None if the model runs away."""
    run = predict(model, trial)
    if run is None:
        return None
    name = _compared(trial)
    error = run[name] - trial[name]
    return np.asarray(error)


def _size(scatter: Any) -> float:
    """Scatter of what was measured, not below what can be divided by."""
    return max(float(scatter), 1e-12)


def _without_drift(t: Floats, values: Floats, degree: int) -> Floats:
    """Values without the polynomial of time that fits them best."""
    since_start = t - t[0]
    drift = np.polyfit(since_start, values, degree)
    return np.asarray(values - np.polyval(drift, since_start))


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
    if has_many or holds_turn(trials) or _log_angle(model) is None:
        return model, {}
    if is_mmg:
        error = growing_error(model, without, trials)
    else:
        error = extrapolation_error(without, trials)
    how = "trials of the largest rudder by a fit to the others"
    if error is None:
        error = 0.12  # found were 0.06 to 0.2 on ships of other equations
        how = "assumed"
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
    names = list(model.coefficients)
    more = np.zeros(len(names))
    for name in ("N_vvr", "X_rr"):
        slope = _slope(model, name)
        if slope:
            deviation = share * lacking / slope
            more[names.index(name)] = deviation**2

    covariance = np.asarray(model.covariance) + np.diag(more)
    return replace(model, covariance=covariance)


def _slope(model: ShipModel, name: str) -> float:
    """Slope of the logarithm of the angle of a hard turn by a coefficient; 0 for none.

    By central differences; the coefficients have no unit and are of size 0.1.
    """
    step = 0.01
    own = model.coefficients[name]
    more = _log_angle(_changed(model, name, own + step))
    less = _log_angle(_changed(model, name, own - step))
    if more is None or less is None:
        return 0.0
    return (more - less) / (2.0 * step)


def _changed(model: ShipModel, name: str, value: float) -> ShipModel:
    coefficients = {**model.coefficients, name: value}
    return replace(model, coefficients=coefficients)


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
    return replace(model, covariance=covariance)


def hard_turn(model: ShipModel) -> HardTurn | None:
    """How far its covariance lets a model's hard turn change; None without a turn."""
    own = _log_angle(model)
    if own is None:
        return None
    moves = _principal_moves(model)
    slopes = np.zeros(len(moves))
    for k, move in enumerate(moves):
        slopes[k] = _slope_along(model, move, own)

    deviation = float(np.linalg.norm(slopes))
    if deviation == 0.0:
        return None
    direction = slopes @ moves / deviation
    return HardTurn(deviation, direction)


def _principal_moves(model: ShipModel) -> Floats:
    """Moves of the coefficients by one standard deviation along each principal axis.

    Shape (n_moves, n_coefficients).
    """
    covariance = np.asarray(model.covariance)
    variances, axes = np.linalg.eigh(covariance)
    least = 1e-12 * variances.max()
    known = variances > least
    deviations = np.sqrt(variances[known])
    moves = axes[:, known] * deviations
    return np.asarray(moves.T)


def _slope_along(model: ShipModel, move: Floats, own: float) -> float:
    """Change of the logarithm of the angle by a move; 0 where there is no turn."""
    step = 0.1
    values = np.array(list(model.coefficients.values()))
    moved = _log_angle(model.with_coefficients(values + step * move))
    if moved is None:
        return 0.0
    return (moved - own) / step


def _log_angle(model: ShipModel) -> float | None:
    """Logarithm of the angle turned through in ten lengths, mean of both sides."""
    travel = model.travel_time
    rudder = min(35.0, model.steering.rudder_limit_deg)
    angles = []
    for side in (1.0, -1.0):
        try:
            run = turning_circle(model, side * rudder, 10.0 * travel, travel / 20.0)
        except (UnstableModelError, ManoeuvreError, InputError):
            return None
        angles.append(side * float(run["psi"][-1]))
    if min(angles) <= 0.0:
        return None
    return float(np.mean(np.log(angles)))

"""Refusals: models that contradict their trials, and designs that lose control."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from agents.rollouts.course_keeping import Episodes
from agents.verification.closed_loop import MOST_LOST, loses_too_many
from agents.verification.result import Verification
from agents.verification.tracks import Track
from identification.design.experiment import advise
from identification.judging.fit import Fit
from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.models import ShipModel
from shipgym.models.linear import steering_state_space
from shipgym.trials.trial import Trial


class Steering(NamedTuple):
    """A model's steering about straight running: (v, r)' = A (v, r) + B delta."""

    A: Floats
    B: Floats

    @property
    def steady_side(self) -> float:
        """A number with the sign of the yaw rate for a steady rudder to starboard."""
        A, B = self.A, self.B
        return float(A[1, 0] * B[0, 0] - A[0, 0] * B[1, 0])


def why_refused(fit: Fit) -> str | None:
    """Reason against any design on a stable model, with the trial that would help.

    Its steering at low frequency has another sign than in the trials. None if there is
    no reason; what a model drawn does by itself is none, designs are judged in closed
    loop.
    """
    steering = _steering_of(fit.model)
    if steering is None:  # no straight course: the designs say so
        return None
    why = _steers_to_other_side(fit, steering)
    return None if why is None else f"{why}; run {helpful_trial(fit)}"


def _steering_of(model: ShipModel) -> Steering | None:
    """A model's steering; None if it has no straight course."""
    try:
        A, B = steering_state_space(model)
    except InputError:
        return None
    return Steering(A, B)


def _steers_to_other_side(fit: Fit, steering: Steering) -> str | None:
    """The side to which the rudder turns is known from three standard errors on."""
    fitted = [trial for trial in fit.trials if trial.use == "fit"]
    measured = rudder_effect(fitted, fit.model)
    if abs(measured) <= 3.0 or measured * steering.steady_side >= 0.0:
        return None
    return (
        "at low frequency the model's rudder turns the ship to the other side than in"
        " the trials"
    )


def rudder_effect(trials: Sequence[Trial], model: ShipModel) -> float:
    """Student's t of the rudder in yaw; 0 for too few samples.

    Regression of the change of yaw rate over half a ship length on mean yaw rate, mean
    rudder and a constant.
    """
    window = 0.5 * model.travel_time
    parts = [_changes(trial, window) for trial in trials]
    X = np.concatenate([part.features for part in parts])
    y = np.concatenate([part.changes for part in parts])
    rudder = 1  # column of `_Changes.features`
    return _t_statistic(X, y, rudder)


def _t_statistic(X: Floats, y: Floats, column: int) -> float:
    """Student's t of the coefficient of a column; 0 for too few samples."""
    freedom = len(y) - X.shape[1]
    if freedom <= 0:
        return 0.0

    coefficients, *_ = np.linalg.lstsq(X, y, rcond=None)
    residuals = y - X @ coefficients
    variance = float(residuals @ residuals) / freedom
    covariance = variance * np.linalg.pinv(X.T @ X)
    error = float(np.sqrt(covariance[column, column]))
    if error == 0.0:
        return 0.0
    return float(coefficients[column]) / error


class _Changes(NamedTuple):
    """Changes of the yaw rate over windows of a trial, and the means over each."""

    features: Floats  # yaw rate, rudder and 1, shape (n_windows, 3)
    changes: Floats  # shape (n_windows,)


def _changes(trial: Trial, window: float) -> _Changes:
    """Changes and means over windows of a length, s, that have samples."""
    t = trial.t
    edges = np.arange(t[0], t[-1], window)
    first = np.searchsorted(t, edges)
    counts = np.diff(first)[:-1]

    filled = counts > 0  # none in a gap of the log

    def means(channel: str) -> Floats:
        sums = np.add.reduceat(trial[channel], first[:-1])[:-1]
        return np.asarray(sums[filled] / counts[filled])

    constant = np.ones(np.count_nonzero(filled))
    features = np.column_stack([means("r"), means("delta"), constant])
    rates = np.interp(edges, t, trial["r"])
    changes = np.diff(rates)[: len(counts)]
    return _Changes(features, changes[filled])


def helpful_trial(fit: Fit) -> str:
    """The trial that shrinks most what is least certain in a hard turn."""
    fitted = [trial for trial in fit.trials if trial.use == "fit"]
    try:
        advice = advise(fit.model, fitted)
    except InputError:  # a grey box has no table to advise on
        return "a 20/20 zigzag to both sides"
    return f"a {advice.chosen[0]} to both sides"


def simpler_structures(
    ranking: Sequence[Mapping[str, Any]], structure: str
) -> list[str]:
    """The next best structures, two at most, with fewer coefficients than the chosen.

    `ranking`: of `structure = "auto"`, as `Ranking.to_dict` has it. Where the trials
    leave coefficients open, some of the models drawn run away whatever steers them.
    """
    own_counts = []
    for fit in ranking:
        if fit["structure"] == structure:
            own_counts.append(fit["coefficients"])
    fewest = min(own_counts, default=0)

    simpler: dict[str, None] = {}  # each once, in the order of the ranking
    for fit in ranking:
        is_steady = fit["stable"] and not fit["ran_away"]
        if is_steady and fit["coefficients"] < fewest:
            simpler[fit["structure"]] = None
    return list(simpler)[:2]


class Refusals(NamedTuple):
    """Which designs are refused, and whether none is given."""

    by_design: dict[str, str]  # why, by the key of the autopilot
    of_all: str | None  # why no autopilot is given; None where one is


def refused_designs(
    found: Verification, fit: Fit, most_lost: float = MOST_LOST
) -> Refusals:
    """The designs that lose control of too many models drawn, and what would help."""
    designed = [pilot for pilot in found.pilots if pilot.design is not None]
    lost = {}
    for pilot in designed:
        why = lost_control(found, pilot.episodes, most_lost)
        if why is not None:
            lost[pilot.key] = why
    tracks = {}
    for track in found.tracks:
        why = lost_track(track, most_lost)
        if why is not None:
            tracks[track.key] = why
    if not lost and not tracks:
        return Refusals({}, None)

    remedy = helpful_trial(fit)
    refused = {key: f"{why}; run {remedy}" for key, why in {**lost, **tracks}.items()}
    if len(lost) < len(designed):
        return Refusals(refused, None)

    for track in found.tracks:
        refused[track.key] = "what steers on its course loses control"
    names = ", ".join([key.upper() for key in lost])
    of_first = refused[designed[0].key]
    return Refusals(refused, f"{names}: {of_first}")


def lost_control(
    found: Verification, episodes: Episodes, most_lost: float = MOST_LOST
) -> str | None:
    """Reason to refuse a design that loses too many models drawn, or None.

    It says how many, which, when, and what is special about them.
    """
    terminated = episodes.terminated
    counted = found.counted
    if counted is None:
        counted = np.ones(len(terminated), dtype=np.bool_)
    if not loses_too_many(terminated, counted, most_lost):
        return None

    lost = np.flatnonzero(terminated & counted)
    n_counted = int(np.sum(counted))
    why = f"it loses control of {len(lost)} of {n_counted} models drawn"
    if len(lost):
        median_s = float(np.median(episodes.duration_s[lost]))
        why += (
            f" in course keeping (numbers {_shortened(lost.tolist())}, after"
            f" {median_s:.0f} s in the median"
            f"{_off_course(found.course_unstable[lost])})"
        )
    if found.left_out:
        why += f"; {found.left_out} more run away whatever steers them"
    return why


def _off_course(unstable: Flags) -> str:
    """How many of some models keep no straight course by themselves."""
    return f", {int(unstable.sum())} of them unstable on course"


def _shortened(numbers: list[int]) -> str:
    """The first few of some numbers."""
    most = 8
    words = ", ".join([str(number) for number in numbers[:most]])
    return f"{words}, ..." if len(numbers) > most else words


def lost_track(track: Track, most_lost: float = MOST_LOST) -> str | None:
    """Reason to refuse a guide that does not reach the end of the track, or None."""
    if not track.arrived[0]:
        return "it does not reach the end of the track on the identified model"
    arrived = track.arrived[1:]
    lost = int(np.sum(~arrived))
    if not len(arrived) or lost <= most_lost * len(arrived):
        return None
    return (
        f"it does not reach the end of the track with {lost} of {len(arrived)} models"
        " drawn"
    )

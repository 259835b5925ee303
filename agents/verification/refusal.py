"""Refusals: models that contradict their trials, and designs that lose control."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from agents.verification.result import Verification
from identification.design.experiment import advise
from identification.fit import Fit
from shipgym.arrays import Flags, Floats
from shipgym.errors import InputError
from shipgym.ships import ShipModel
from shipgym.ships.linear import steering_state_space
from shipgym.trials.trial import Trial

#: Share of the models drawn that an autopilot may lose control of.
MOST_LOST = 0.05


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
    """Reason against designs on a stable model, with the trial that would help.

    Its steering at low frequency has another sign than in the trials, or a damping
    derivative has, significantly, a sign that no ship has. None if there is no reason.
    """
    model = fit.model
    try:
        drawn = []
        for ship in (model, *model.sample(60, 0)):
            A, B = steering_state_space(ship)
            steering = Steering(A, B)
            drawn.append(steering)
    except InputError:  # no straight course: the designs say so
        return None

    why = _steers_to_other_side(fit, drawn[0])
    equations = getattr(model.dynamics, "equations", ("v",))
    if why is None and "v" in equations:
        why = why_driven(drawn)
    if why is None:
        return None
    return f"{why}; run {helpful_trial(fit)}"


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


def why_driven(drawn: Sequence[Steering]) -> str | None:
    """Damping of the wrong sign in 97.5 % of models; None without one."""
    dampings = ("sway damping (Y_v)", "yaw damping (N_r)")
    for row, name in enumerate(dampings):
        driven = [steering.A[row, row] > 0.0 for steering in drawn]
        share = float(np.mean(driven))
        per_cent = 100.0 * share
        if share >= 0.975:
            return (
                f"its {name} has the sign of a force that drives the motion, in"
                f" {per_cent:.0f} % of the models drawn, which no ship has"
            )
    return None


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
    """The trial that shrinks the uncertainty of all coefficients most."""
    fitted = [trial for trial in fit.trials if trial.use == "fit"]
    try:
        advice = advise(fit.model, fitted, criterion="D")
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


def lost_control(terminated: Flags, most_lost: float = MOST_LOST) -> str | None:
    """Reason to refuse an autopilot that loses control of too many models, or None."""
    lost = int(np.sum(terminated))
    n_models = len(terminated)
    if np.mean(terminated) <= most_lost:
        return None
    return f"it loses control of {lost} of {n_models} models drawn"


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
        terminated = pilot.episodes.terminated
        why = lost_control(terminated, most_lost)
        if why is not None:
            lost[pilot.key] = why
    if not lost:
        return Refusals({}, None)

    remedy = helpful_trial(fit)
    refused = {key: f"{why}; run {remedy}" for key, why in lost.items()}
    if len(lost) < len(designed):
        return Refusals(refused, None)

    for track in found.tracks:
        refused[track.key] = "what steers on its course loses control"
    names = ", ".join([key.upper() for key in lost])
    of_first = refused[designed[0].key]
    return Refusals(refused, f"{names}: {of_first}")

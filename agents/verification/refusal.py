"""Why no autopilot is given: models that contradict their trials, and designs that lose control."""

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
        """A number with the sign of the yaw rate to which a steady rudder to starboard leads."""
        A, B = self.A, self.B
        return float(A[1, 0] * B[0, 0] - A[0, 0] * B[1, 0])


def why_refused(fit: Fit) -> str | None:
    """Why nothing may be designed on a stable model, with the trial that would help; None where it may.

    Its steering at low frequency has another sign than in the trials, or a damping
    derivative has, significantly, a sign that no ship has.
    """
    model = fit.model
    try:
        models = [model, *model.sample(60, 0)]
        drawn = [Steering(*steering_state_space(one)) for one in models]
    except InputError:  # no straight course: the designs say so
        return None
    why = _steers_to_other_side(fit, drawn[0])
    if why is None and "v" in getattr(model.dynamics, "equations", ("v",)):
        why = why_driven(drawn)
    return None if why is None else f"{why}; run {helpful_trial(fit)}"


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
    """Which damping has the wrong sign in 97.5 % of models; None for a ship as there are."""
    for row, name in enumerate(("sway damping (Y_v)", "yaw damping (N_r)")):
        driven = [steering.A[row, row] > 0.0 for steering in drawn]
        share = float(np.mean(driven))
        if share >= 0.975:
            return (
                f"its {name} has the sign of a force that drives the motion, in"
                f" {100.0 * share:.0f} % of the models drawn, which no ship has"
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
    n_rows, n_terms = X.shape
    if n_rows <= n_terms:
        return 0.0

    coefficients, *_ = np.linalg.lstsq(X, y, rcond=None)
    residuals = y - X @ coefficients
    variance = float(residuals @ residuals) / (n_rows - n_terms)
    covariance = variance * np.linalg.pinv(X.T @ X)
    rudder = 1
    error = float(np.sqrt(covariance[rudder, rudder]))
    if error == 0.0:
        return 0.0
    return float(coefficients[rudder]) / error


class _Changes(NamedTuple):
    """Changes of the yaw rate over windows of a trial, and the means over each."""

    features: Floats  # yaw rate, rudder and 1, shape (n_windows, 3)
    changes: Floats  # shape (n_windows,)


def _changes(trial: Trial, window: float) -> _Changes:
    edges = np.arange(trial.t[0], trial.t[-1], window)
    first = np.searchsorted(trial.t, edges)
    counts = np.diff(first)[:-1]

    def means(channel: str) -> Floats:
        sums = np.add.reduceat(trial[channel], first[:-1])[:-1]
        return np.asarray(sums / counts)

    features = np.column_stack([means("r"), means("delta"), np.ones(len(counts))])
    rates = np.interp(edges, trial.t, trial["r"])
    return _Changes(features, np.diff(rates)[: len(counts)])


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
    """The next best two structures with fewer coefficients than the one that was chosen, or fewer than two.

    `ranking`: of `structure = "auto"`, as `Ranking.to_dict` has it. Where the trials
    leave coefficients open, some of the models drawn run away whatever steers them.
    """
    counts = [fit["coefficients"] for fit in ranking if fit["structure"] == structure]
    fewest = min(counts, default=0)
    names = list[str]()
    for fit in ranking:
        steady = fit["stable"] and not fit["ran_away"]
        new = fit["structure"] not in names
        if new and steady and fit["coefficients"] < fewest:
            names.append(fit["structure"])
    return names[:2]


def lost_control(terminated: Flags, most_lost: float = MOST_LOST) -> str | None:
    """Why an autopilot that loses control of too many models drawn is refused; None where it is not."""
    if np.mean(terminated) <= most_lost:
        return None
    lost = int(np.sum(terminated))
    return f"it loses control of {lost} of {len(terminated)} models drawn"


class Refusals(NamedTuple):
    """Which designs are refused, and whether none is given."""

    by_design: dict[str, str]  # why, by the key of the autopilot
    of_all: str | None  # why no autopilot is given; None where one is


def refused_designs(
    found: Verification, fit: Fit, most_lost: float = MOST_LOST
) -> Refusals:
    """The designs that lose control of too many models drawn, and what would help."""
    designed = [pilot for pilot in found.pilots if pilot.design is not None]
    lost = dict[str, str]()
    for pilot in designed:
        why = lost_control(pilot.episodes.terminated, most_lost)
        if why is not None:
            lost[pilot.key] = why
    if not lost:
        return Refusals({}, None)

    remedy = _remedy(fit)
    refused = {key: f"{why}; run {remedy}" for key, why in lost.items()}
    if len(lost) < len(designed):
        return Refusals(refused, None)
    for track in found.tracks:
        refused[track.key] = "what steers on its course loses control"
    names = ", ".join(key.upper() for key in lost)
    return Refusals(refused, f"{names}: {lost[designed[0].key]}; run {remedy}")


def _remedy(fit: Fit) -> str:
    """A trial to run, and where the structure was chosen, a simpler one."""
    remedy = helpful_trial(fit)
    ranking = fit.metrics.get("selection", {}).get("ranking", ())
    structure = (fit.model.provenance or {}).get("structure", "")
    simpler = simpler_structures(ranking, structure)
    if simpler:
        remedy += f", or try --structure {' or '.join(simpler)}"
    return remedy

"""Why no autopilot is given: models that contradict their trials, and designs that lose control."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.design.experiment import advise
from identification.fit import Fit
from shipgym.errors import InputError
from shipgym.ships import ShipModel
from shipgym.ships.linear import steering_state_space
from shipgym.trials.trial import Trial

DRAWS = 60  # models drawn that a sign has to have to be significant,
SIGNIFICANT = 0.975  # in this share of them
MOST_LOST = 0.05  # share of the models drawn that an autopilot may lose control of
WINDOW = 0.5  # over which motions are averaged, of the time to sail one ship length
SURE_T = 3.0  # of the rudder's effect in the trials, from which on its sign is known
FALLBACK = "a 20/20 zigzag to both sides"


def why_refused(fit: Fit) -> str | None:
    """Why nothing may be designed on a stable model, with the trial that would help; None where it may.

    Its steering at low frequency has another sign than in the trials, or a damping
    derivative has, significantly, a sign that no ship has.
    """
    model = fit.model
    try:
        drawn = [
            steering_state_space(draw) for draw in (model, *model.sample(DRAWS, 0))
        ]
    except InputError:  # no straight course: the designs say so
        return None
    A, B = drawn[0]
    steering = float(
        A[1, 0] * B[0, 0] - A[0, 0] * B[1, 0]
    )  # a steady rudder turns to that side
    measured = rudder_effect(
        [trial for trial in fit.trials if trial.use == "fit"], model
    )
    if measured * steering < 0.0 and abs(measured) > SURE_T:
        why = (
            "at low frequency the model's rudder turns the ship to the other side than"
            " in the trials"
        )
        return f"{why}; run {helpful_trial(fit)}"
    sway = "v" in getattr(model.dynamics, "equations", ("v",))
    for row, name in (
        ((0, "sway damping (Y_v)"), (1, "yaw damping (N_r)")) if sway else ()
    ):
        share = float(np.mean([found[0][row, row] > 0.0 for found in drawn]))
        if share >= SIGNIFICANT:
            return (
                f"its {name} has the sign of a force that drives the motion, in"
                f" {100.0 * share:.0f} % of the models drawn, which no ship has; run"
                f" {helpful_trial(fit)}"
            )
    return None


def rudder_effect(trials: Sequence[Trial], model: ShipModel) -> float:
    """Student's t of the rudder in yaw: change of yaw rate over half a ship length on yaw rate and rudder."""
    window = WINDOW * model.particulars["length"] / model.particulars["speed"]
    rows, changes = [], []
    for trial in trials:
        edges = np.arange(trial.t[0], trial.t[-1], window)
        at = np.searchsorted(trial.t, edges)
        means = [
            np.add.reduceat(trial[c], at[:-1])[:-1] / np.diff(at)[:-1]
            for c in ("r", "delta")
        ]
        changes.append(np.diff(np.interp(edges, trial.t, trial["r"]))[: len(means[0])])
        rows.append(np.column_stack([*means, np.ones(len(means[0]))]))
    X, y = np.concatenate(rows), np.concatenate(changes)
    if len(y) <= X.shape[1]:
        return 0.0
    found, *_ = np.linalg.lstsq(X, y, rcond=None)
    noise = float(np.sum((y - X @ found) ** 2)) / (len(y) - X.shape[1])
    error = float(np.sqrt(noise * np.linalg.pinv(X.T @ X)[1, 1]))
    return float(found[1]) / error if error > 0.0 else 0.0


def helpful_trial(fit: Fit) -> str:
    """The trial that shrinks the uncertainty of all coefficients most."""
    try:
        used = [trial for trial in fit.trials if trial.use == "fit"]
        return f"a {advise(fit.model, used, criterion='D').chosen[0]} to both sides"
    except InputError:  # a grey box has no table to advise on
        return FALLBACK


def simpler_structures(
    ranking: Sequence[Mapping[str, Any]], structure: str
) -> list[str]:
    """The next best two structures with fewer coefficients than the one that was chosen, or fewer than two.

    `ranking`: of `structure = "auto"`, as `Ranking.to_dict` has it. Where the trials
    leave coefficients open, some of the models drawn run away whatever steers them.
    """
    fewest = min(
        (one["coefficients"] for one in ranking if one["structure"] == structure),
        default=0,
    )
    fewer = (
        one
        for one in ranking
        if one["coefficients"] < fewest and one["stable"] and not one["ran_away"]
    )
    return list(dict.fromkeys(str(one["structure"]) for one in fewer))[:2]


def lost_control(terminated: NDArray[np.bool_]) -> str | None:
    """Why an autopilot that loses control of too many models drawn is refused; None where it is not."""
    share = float(np.mean(terminated))
    if share <= MOST_LOST:
        return None
    return (
        f"it loses control of {int(np.sum(terminated))} of {len(terminated)} models"
        " drawn"
    )

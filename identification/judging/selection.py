"""Which fit predicts trials held out best: errors of each, and the choice."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from identification.arrays import root_mean_square
from identification.judging.extrapolation import largest_rudders
from identification.samples.prediction import predict, predicts_track
from shipgym import ShipModel, Trial
from shipgym.arrays import Integers
from shipgym.ships.structures import GREY_BOX, MMG
from shipgym.trials.resampling import usual_step

#: Of few coefficients, those with the bias of the rudder last; by the simulated motion
#: of whole trials, in which a small bias shows, too.
RESPONSES = ("nomoto", "norrbin", "nomoto-bias", "norrbin-bias")
#: Methods that a table that predicts best is also fitted by; quick ones.
OTHERS = ("ls", "cv-lssvr")

#: Metrics of trials by their names, see `prediction.trial_metrics`.
Metrics = Mapping[str, Mapping[str, Any]]


class Fitted(Protocol):
    """A structure fitted to trials."""

    @property
    def problem(self) -> Any:
        """The problem that it was fitted to."""

    @property
    def model(self) -> ShipModel:
        """The model of all trials."""

    @property
    def free_coefficients(self) -> int:
        """Number of coefficients that the trials determine."""

    @property
    def stable(self) -> bool:
        """Whether it passed the guard."""

    def without(self, trials: Sequence[int]) -> ShipModel:
        """The model of the other trials, by their places."""


@dataclass(frozen=True)
class RankedFit:
    """Errors of a method on the trials held out."""

    structure: str  # of its model
    method: str  # its name
    coefficients: int  # their number
    stable: bool  # whether its model passed the guard
    ran_away: int  # trials held out on which its simulation ran away
    #: root mean square error of the simulated u, v, r and psi by the standard deviation
    #: of what was measured, mean over channels and trials: 0 for perfect, 1 for no
    #: better than a constant. None where one ran away
    error: float | None
    #: root mean square error, mean over the trials on which it did not run away
    heading_deg: float | None
    yaw_rate_deg_s: float | None
    errors: dict[str, float | None]  # `error` of each trial
    #: whether it explains half of the variance of the speed in trials held out
    predicts_speed: bool = False

    @property
    def rank(self) -> tuple[Any, ...]:
        """Sort key: first those that never run away, then by the error."""
        return self.ran_away, not self.stable, self.error is None, self.error or 0.0


def fit_name(structure: str, method: str) -> str:
    """A structure fitted by a method, in words."""
    return f"{structure} by {method}"


def shown_to_turn(ranked: Sequence[RankedFit]) -> list[RankedFit]:
    """The fits that are known to turn where no trial does; all where none is.

    Those of few parameters, and those that a prior, formulas or a reference ship hold
    in a hard turn. The terms of a table that zigzags fix are not known beyond them.
    """
    known = []
    for fit in ranked:
        turns = fit.structure in (*RESPONSES, GREY_BOX, MMG)
        if turns and not fit.ran_away:
            known.append(fit)
    return known or list(ranked)


def what_turns(taken: RankedFit, by_error: RankedFit) -> dict[str, Any]:
    """What holds a hard turn of the fit that is taken, where no trial turns.

    `by_error`: the fit that would be taken by its error alone.
    """
    shown_by = "nothing"
    if taken.structure in RESPONSES:
        shown_by = "its few parameters"
    elif taken.structure in (GREY_BOX, MMG):
        shown_by = "its prior"
    passed_over = None
    if by_error is not taken:
        passed_over = fit_name(by_error.structure, by_error.method)
    return {"shown_by": shown_by, "predicts_better": passed_over}


class HeldOut(NamedTuple):
    """Errors of the prediction of a trial held out."""

    #: of the heading, by its standard deviation; without one, of the yaw rate; in wind
    #: that of `_turning_error`
    relative: float
    heading: float  # root mean square, rad
    yaw_rate: float  # rad/s
    speed: float  # of the surge speed, by its standard deviation


def rank_by_turns(structure: str, method: str, fit: Fitted) -> RankedFit:
    """Rank of a fit, by what it predicts of its own trials, each held out in turn."""
    trials = fit.problem.used
    seen: dict[str, list[HeldOut | None]] = {trial.name: [] for trial in trials}
    for group in _groups(trials):
        model = fit.without(group.tolist())
        for place in group:
            trial = trials[place]
            seen[trial.name].append(_held_out(model, trial))

    every = [error for errors in seen.values() for error in errors]
    ran_away = [error for error in every if error is None]
    known = [error for error in every if error is not None]
    errors = {name: _mean_error(found) for name, found in seen.items()}
    mean_error = None
    heading = None
    yaw_rate = None
    if known:
        heading = float(np.degrees(np.mean([error.heading for error in known])))
        yaw_rate = float(np.degrees(np.mean([error.yaw_rate for error in known])))
    if known and not ran_away:
        mean_error = float(np.mean(list(errors.values())))
    return RankedFit(
        structure=structure,
        method=method,
        coefficients=fit.free_coefficients,
        stable=fit.stable,
        ran_away=len(ran_away),
        error=mean_error,
        heading_deg=heading,
        yaw_rate_deg_s=yaw_rate,
        errors=errors,
        predicts_speed=_predicts_speed(fit.model, known),
    )


def _predicts_speed(model: ShipModel, known: Sequence[HeldOut]) -> bool:
    """Whether the speed in trials held out is better predicted than by a constant."""
    if not known or not predicts_track(model):
        return False
    most = np.sqrt(0.5)
    return bool(np.mean([error.speed for error in known]) < most)


def _groups(trials: Sequence[Trial]) -> list[Integers]:
    """Places of the trials that are held out together: each, and the largest rudders.

    These are what a hard turn is to trials of less rudder.
    """
    groups = [np.array([place]) for place in range(len(trials))]
    largest = largest_rudders(trials)
    if largest.size:
        groups.append(largest)
    return groups


def _held_out(model: ShipModel, trial: Trial) -> HeldOut | None:
    """Errors of the prediction of a trial; None where the model runs away."""
    run = predict(model, trial)
    if run is None:
        return None
    errors = {}
    relative = {}
    for name in ("psi", "r", "u"):
        if name in trial:
            errors[name] = root_mean_square(run[name] - trial[name])
            relative[name] = errors[name] / max(float(np.std(trial[name])), 1e-12)
    error = next(iter(relative.values()))
    if "psi" in trial and in_wind([trial]):
        error = _turning_error(model, run, trial)
    return HeldOut(
        relative=error,
        heading=errors.get("psi", np.nan),
        yaw_rate=errors["r"],
        speed=relative.get("u", np.inf),
    )


def in_wind(trials: Sequence[Trial]) -> bool:
    """Return True where wind was logged and its force is known."""
    return any("wind_rdot" in trial for trial in trials)


def _turning_error(model: ShipModel, run: Trial, trial: Trial) -> float:
    """Error of a prediction in how far the ship turns in one ship length, relative.

    Root mean squares. What is left of the moment of the wind makes the heading of a
    gentle zigzag drift, and hardly matters in a turn.
    """
    steps = model.travel_time / usual_step(trial.t)
    lag = min(max(round(steps), 1), len(trial) - 1)
    heading = trial["psi"]
    turned = heading[lag:] - heading[:-lag]
    error = run["psi"] - heading
    change = error[lag:] - error[:-lag]
    return root_mean_square(change) / max(root_mean_square(turned), 1e-12)


def _mean_error(found: Sequence[HeldOut | None]) -> float | None:
    """Mean relative error of a trial; None where a model ran away on it."""
    known = [error.relative for error in found if error is not None]
    if len(known) < len(found):
        return None
    return float(np.mean(known))


def simplest(ranked: Sequence[RankedFit], in_wind: bool = False) -> RankedFit:
    """The fit of fewest coefficients whose errors differ from the first's by chance.

    Of those with no larger error than it has, one that predicts the speed, too. In wind
    no other is taken while there is one: the speed changes with the course, and with it
    how the ship turns.
    """
    if in_wind:
        with_speed = [fit for fit in ranked if fit.predicts_speed]
        ranked = with_speed or ranked
    first = ranked[0]
    if first.error is None:
        return first
    as_good = []
    for fit in ranked:
        sails = fit.stable and not fit.ran_away
        if sails and _differs_by_chance(fit, first):
            as_good.append(fit)
    if not as_good:
        return first

    fewest = min(as_good, key=_coefficients)
    most = fewest.error or 0.0
    with_speed = []
    for fit in as_good:
        if fit.predicts_speed and (fit.error or 0.0) <= most:
            with_speed.append(fit)
    return min(with_speed, key=_coefficients, default=fewest)


def _coefficients(fit: RankedFit) -> tuple[int, bool]:
    """Number of coefficients, of methods of one structure the usual first."""
    return fit.coefficients, fit.method in OTHERS


def _differs_by_chance(fit: RankedFit, first: RankedFit) -> bool:
    """Tell whether errors exceed the first's by no more than chance.

    By one standard error of the difference, but no more than a quarter of the first's:
    of few trials a single one that goes wrong makes that error large. 2 % are nothing.
    """
    differences = []
    for name, error in first.errors.items():
        own = fit.errors[name] or 0.0
        difference = own - (error or 0.0)
        differences.append(difference)
    n_trials = len(differences)
    excess = np.mean(differences)
    deviation = float(np.std(differences, ddof=1))
    standard_error = deviation / np.sqrt(n_trials)
    least = first.error or 0.0
    by_chance = min(standard_error, 0.25 * least)
    nothing = 0.02 * least
    return bool(excess <= max(by_chance, nothing))

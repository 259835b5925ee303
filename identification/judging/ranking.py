"""Structures and methods ranked by how well they predict trials held out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from identification.result import IdentificationResult
from shipgym import Trial

#: Metrics of trials by their names, see `prediction.trial_metrics`.
Metrics = Mapping[str, Mapping[str, Any]]


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


@dataclass(frozen=True, eq=False)
class Ranking:
    """Structures and methods on the same trials, ranked."""

    #: the best first: those that run away on fewest trials, and among them the smallest
    #: error
    ranked: tuple[RankedFit, ...]
    #: identified from all trials to fit, in the same order, by method, of several
    #: structures by `fit_name`
    results: dict[str, IdentificationResult]
    refused: dict[str, str]  # why a method could not be fitted
    #: settings that a method does not have and was not given
    left_out: dict[str, tuple[str, ...]]
    #: whether no trial was marked `validate`, so that each trial to fit was held out in
    #: turn
    in_turn: bool

    @property
    def best(self) -> IdentificationResult:
        """The result of the first of the ranking."""
        return next(iter(self.results.values()))

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        held_out = "trials marked validate"
        if self.in_turn:
            held_out = "each trial in turn"
        left_out = {name: list(left) for name, left in self.left_out.items()}
        methods = {"method": list(self.results)}
        return {
            "held_out": held_out,
            "ranking": [asdict(fit) for fit in self.ranked],
            "refused": self.refused,
            "settings_left_out": left_out,
            "settings": self.best.settings | methods,
        }


def in_turn(
    identify: Callable[[list[str]], IdentificationResult],
    trials: Sequence[Trial],
    groups: int,
) -> tuple[dict[str, Any], list[IdentificationResult]]:
    """Metrics of each trial by its name, predicted with its group held out.

    `identify`: from the names held out; `groups`: at most one per trial, in their
    order. Returns what was identified, too.
    """
    names = [trial.name for trial in trials]
    metrics = dict[str, Any]()
    results = list[IdentificationResult]()
    for held in _divided(names, groups):
        result = identify(held)
        results.append(result)
        of_trials = result.metrics["trials"]
        for name in held:
            metrics[name] = of_trials[name]
    return metrics, results


def _divided(names: list[str], groups: int) -> list[list[str]]:
    """Names in groups of neighbours of about the same size."""
    n_names = len(names)
    groups = max(1, min(groups, n_names))
    members: list[list[str]] = [[] for _ in range(groups)]
    for place, name in enumerate(names):
        group = place * groups // n_names
        members[group].append(name)
    return members


def fit_name(structure: str, method: str) -> str:
    """A structure fitted by a method, in words."""
    return f"{structure} by {method}"


def ranked_fit(
    results: Sequence[IdentificationResult], seen: Metrics, trials: Sequence[Trial]
) -> RankedFit:
    """Rank of a method that gave `results`, by what it predicts of trials.

    `seen`: metrics of those held out, by name.
    """
    errors = {}
    for trial in trials:
        if trial.name in seen:
            errors[trial.name] = _relative_error(seen[trial.name], trial)
    known = [error for error in errors.values() if error is not None]
    mean_error = None
    if len(known) == len(errors):
        mean_error = float(np.mean(known))

    first = results[0]
    provenance = first.model.provenance or {}
    return RankedFit(
        structure=provenance["structure"],
        method=provenance["method"],
        coefficients=len(first.coefficients),
        stable=all(result.stable for result in results),
        ran_away=sum(metrics["diverged"] for metrics in seen.values()),
        error=mean_error,
        heading_deg=_mean_degrees(seen, "psi"),
        yaw_rate_deg_s=_mean_degrees(seen, "r"),
        errors=errors,
    )


def _relative_error(metrics: Mapping[str, Any], trial: Trial) -> float | None:
    """Mean error of the channels by their standard deviation.

    None where the simulation ran away.
    """
    ratios = []
    for name, error in metrics["rmse"].items():
        if error is None:
            continue
        deviation = float(np.std(trial[name]))
        if deviation > 0.0:
            ratio = error / deviation
            ratios.append(ratio)
    if not ratios:
        return None
    return float(np.mean(ratios))


def _mean_degrees(seen: Metrics, channel: str) -> float | None:
    """Mean over the trials of the error of an angle, degrees; None for none known."""
    known = []
    for metrics in seen.values():
        error = metrics["rmse"][channel]
        if error is not None:
            known.append(error)
    if not known:
        return None
    return float(np.degrees(np.mean(known)))

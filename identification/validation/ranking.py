"""Structures and methods on the same trials, ranked by how well they predict trials held out."""

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
    """How well a method predicts the trials held out."""

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

    @property
    def rank(self) -> tuple[Any, ...]:
        """By which fits are sorted: first those that never run away, then by the error."""
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
        in_turn = "each trial in turn"
        return {
            "held_out": in_turn if self.in_turn else "trials marked validate",
            "ranking": [asdict(fit) for fit in self.ranked],
            "refused": self.refused,
            "settings_left_out": {
                name: list(left) for name, left in self.left_out.items()
            },
            "settings": self.best.settings | {"method": list(self.results)},
        }


def in_turn(
    identify: Callable[[list[str]], IdentificationResult],
    trials: Sequence[Trial],
    groups: int,
) -> tuple[dict[str, Any], list[IdentificationResult]]:
    """Metrics of each trial by its name, predicted by what was identified with its group held out.

    `identify`: from the names held out; `groups`: at most one per trial, in their
    order.
    """
    metrics, results = dict[str, Any](), list[IdentificationResult]()
    groups = max(1, min(groups, len(trials)))
    group_of = np.arange(len(trials)) * groups // len(trials)
    for group in range(groups):
        held = [
            trial.name
            for trial, own in zip(trials, group_of, strict=True)
            if own == group
        ]
        result = identify(held)
        results.append(result)
        for name in held:
            metrics[name] = result.metrics["trials"][name]
    return metrics, results


def fit_name(structure: str, method: str) -> str:
    """A structure fitted by a method, in words."""
    return f"{structure} by {method}"


def ranked_fit(
    results: Sequence[IdentificationResult], seen: Metrics, trials: Sequence[Trial]
) -> RankedFit:
    """How well a method that gave `results` predicts trials; `seen`: metrics of those held out, by name."""
    measured = {trial.name: trial for trial in trials}
    errors = {
        name: _relative_error(metrics, measured[name]) for name, metrics in seen.items()
    }
    known = [error for error in errors.values() if error is not None]
    provenance = results[0].model.provenance or {}
    return RankedFit(
        structure=provenance["structure"],
        method=provenance["method"],
        coefficients=len(results[0].coefficients),
        stable=all(result.stable for result in results),
        ran_away=sum(metrics["diverged"] for metrics in seen.values()),
        error=float(np.mean(known)) if len(known) == len(errors) else None,
        heading_deg=_mean_degrees(seen, "psi"),
        yaw_rate_deg_s=_mean_degrees(seen, "r"),
        errors=errors,
    )


def _relative_error(metrics: Mapping[str, Any], trial: Trial) -> float | None:
    """Errors of the channels by their standard deviation; None where the simulation ran away."""
    ratios = []
    for name, error in metrics["rmse"].items():
        if error is None:
            continue
        deviation = float(np.std(trial[name]))
        if deviation > 0.0:
            ratios.append(error / deviation)
    return float(np.mean(ratios)) if ratios else None


def _mean_degrees(seen: Metrics, channel: str) -> float | None:
    """Mean over the trials of the error of an angle, degrees; None where none is known."""
    errors = [metrics["rmse"][channel] for metrics in seen.values()]
    known = [error for error in errors if error is not None]
    return float(np.degrees(np.mean(known))) if known else None

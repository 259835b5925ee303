"""Structures and methods on the same trials, ranked by how well they predict trials held out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from identification.result import IdentificationResult
from shipgym import Trial


@dataclass(frozen=True)
class Standing:
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
        """By which standings are sorted: first those that never run away, then by the error."""
        return self.ran_away, not self.stable, self.error is None, self.error or 0.0


@dataclass(frozen=True, eq=False)
class Ranking:
    """Structures and methods on the same trials, ranked."""

    #: the best first: those that run away on fewest trials, and among them the smallest
    #: error
    standings: tuple[Standing, ...]
    #: identified from all trials to fit, in the same order, by method, of several
    #: structures by `named`
    results: dict[str, IdentificationResult]
    refused: dict[str, str]  # why a method could not be fitted
    left_out: dict[
        str, tuple[str, ...]
    ]  # settings that a method does not have and was not given
    # whether no trial was marked `validate`, so that each trial to fit was held out in
    # turn
    in_turn: bool

    @property
    def best(self) -> IdentificationResult:
        """What the first of the ranking identified."""
        return next(iter(self.results.values()))

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {
            "held_out": (
                "each trial in turn" if self.in_turn else "trials marked validate"
            ),
            "ranking": [asdict(standing) for standing in self.standings],
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
    metrics, results = dict[str, Any](), []
    groups = max(1, min(groups, len(trials)))
    for k in range(groups):
        held = [
            trial.name
            for i, trial in enumerate(trials)
            if i * groups // len(trials) == k
        ]
        results.append(identify(held))
        metrics |= {name: results[-1].metrics["trials"][name] for name in held}
    return metrics, results


def named(structure: str, method: str) -> str:
    """A structure fitted by a method, in words."""
    return f"{structure} by {method}"


def standing(
    results: Sequence[IdentificationResult],
    seen: Mapping[str, Any],
    trials: Sequence[Trial],
) -> Standing:
    """How well a method that gave `results` predicts trials; `seen`: metrics of those held out, by name."""
    measured = {trial.name: trial for trial in trials}
    errors = {
        trial: _error(metrics, measured[trial]) for trial, metrics in seen.items()
    }
    known = [error for error in errors.values() if error is not None]
    provenance = results[0].model.provenance or {}
    return Standing(
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


def _error(metrics: Mapping[str, Any], trial: Trial) -> float | None:
    """Errors of the channels by their standard deviation; None where the simulation ran away."""
    known = {
        name: error for name, error in metrics["rmse"].items() if error is not None
    }
    ratios = [
        error / float(np.std(trial[c]))
        for c, error in known.items()
        if np.std(trial[c]) > 0.0
    ]
    return float(np.mean(ratios)) if ratios else None


def _mean_degrees(seen: Mapping[str, Any], channel: str) -> float | None:
    found = [
        m["rmse"][channel] for m in seen.values() if m["rmse"][channel] is not None
    ]
    return float(np.degrees(np.mean(found))) if found else None

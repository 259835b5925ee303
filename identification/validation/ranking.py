"""Methods of identification on the same trials, ranked by how well they predict trials held out."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from identification.result import IdentificationResult


@dataclass(frozen=True)
class Standing:
    """How well a method predicts the trials held out."""

    method: str  # its name
    stable: bool  # whether its model passed the guard
    ran_away: int  # trials held out on which its simulation ran away
    #: root mean square error of the simulated u, v, r and psi by the standard deviation of what was
    #: measured, mean over channels and trials: 0 for perfect, 1 for no better than a constant. None where
    #: one ran away
    error: float | None
    #: root mean square error, mean over the trials on which it did not run away
    heading_deg: float | None
    yaw_rate_deg_s: float | None
    errors: dict[str, float | None]  # `error` of each trial


@dataclass(frozen=True, eq=False)
class Ranking:
    """Methods on the same trials, ranked."""

    #: the best first: those that run away on fewest trials, and among them the smallest error
    standings: tuple[Standing, ...]
    results: dict[str, IdentificationResult]  # by method, identified from all trials to fit
    refused: dict[str, str]  # why a method could not be fitted
    left_out: dict[str, tuple[str, ...]]  # settings that a method does not have and was not given
    in_turn: bool  # whether no trial was marked `validate`, so that each trial to fit was held out in turn

    @property
    def best(self) -> IdentificationResult:
        """What the first of the ranking identified."""
        return self.results[self.standings[0].method]

    def to_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        return {
            "held_out": "each trial in turn" if self.in_turn else "trials marked validate",
            "ranking": [asdict(standing) for standing in self.standings],
            "refused": self.refused,
            "settings_left_out": {name: list(left) for name, left in self.left_out.items()},
            "settings": next(iter(self.results.values())).settings | {"method": list(self.results)},
        }

"""The manoeuvring criteria of the International Maritime Organization: resolution MSC.137(76), 2002."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shipgym.checks import check_number
from shipgym.manoeuvres.intervals import IndexInterval, attempt, intervals_of, worst
from shipgym.manoeuvres.registry import Manoeuvre
from shipgym.manoeuvres.stopping import standard_stops
from shipgym.manoeuvres.turning import standard_circles
from shipgym.manoeuvres.zigzags import standard_zigzags
from shipgym.ships.ship_model import ShipModel

DRAWS = 100  # of an identified ship
STOPPING_LIMIT = 15.0  # ship lengths
LARGE_DISPLACEMENT = (
    "where large displacement makes 15 lengths impracticable, the Administration may allow up to 20"
)


@dataclass(frozen=True)
class Criterion:
    """One criterion; the worse of both sides counts."""

    value: float | None  # in `unit`; None where the manoeuvre never got so far
    limit: float  # largest value allowed
    passed: bool | None  # None where the ship's equations do not allow the test; `note` says why
    unit: str  # "ship lengths" or "deg"
    source: str  # paragraph of the annex of MSC.137(76)
    # the value over models drawn from the covariance of an identified ship
    drawn: IndexInterval | None = None
    note: str = ""  # remarks

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval over the draws (`IndexInterval.interval`)."""
        return None if self.drawn is None else self.drawn.interval

    @property
    def share_passed(self) -> float | None:
        """Share of the draws that pass; those that run away or never get so far do not."""
        if self.drawn is None or not len(self.drawn.values):
            return None
        return float(np.mean(self.drawn.values <= self.limit))  # NaN is not

    def to_dict(self) -> dict[str, Any]:
        """As JSON knows it."""
        fields: dict[str, Any] = {
            "value": self.value,
            "limit": self.limit,
            "passed": self.passed,
            "unit": self.unit,
            "source": self.source,
        }
        if self.note:
            fields["note"] = self.note
        if self.drawn is not None and len(self.drawn.values):
            low, median, high = self.drawn.quantiles(0.05, 0.5, 0.95)
            fields |= {"probability": self.share_passed, "interval_95": self.interval}
            fields |= {"quantile_05": low, "median": median, "quantile_95": high}
            fields |= {"draws": len(self.drawn.values), "ran_away": self.drawn.n_ran_away}
            fields |= {"without_value": int(np.isnan(self.drawn.values).sum())}
        return fields


def imo_assessment(
    model: ShipModel, n_draws: int | None = None, seed: int | np.random.Generator = 0
) -> dict[str, Criterion]:
    """Assess a ship by MSC.137(76): turning, initial turning, yaw checking, course keeping and stopping.

    Simulated from service speed in deep water: turning circles with 35 degrees of rudder, or the
    rudder's limit where that is less, and zigzags 10/10 and 20/20, each to both sides; a full astern stop
    where the ship's equations hold for a shaft astern.

    Parameters
    ----------
    model : ShipModel
    n_draws : int, optional
        Models drawn from the covariance of an identified ship, to show how certain each verdict is; by
        default 100, and none for a ship without covariance.
    seed : int or Generator
        Of the draw.

    Returns
    -------
    dict of str to Criterion
        `advance`, `tactical_diameter`, `initial_turning`, `overshoot_1_10_10`, `overshoot_2_10_10`,
        `overshoot_1_20_20`, `stopping`.

    Raises
    ------
    InputError
        If draws are asked for and the model has no covariance.
    """
    usual = 0 if model.covariance is None else DRAWS
    count = int(check_number(usual if n_draws is None else n_draws, "n_draws", at_least=0))
    draws = model.sample(count, seed) if count else []
    return assess_draws(model, draws)


def assess_draws(
    model: ShipModel, draws: Sequence[ShipModel], progress: Callable[[int], None] | None = None
) -> dict[str, Criterion]:
    """The criteria of a model and of models drawn from it; `progress` gets the number of draws done."""
    needed = imo_manoeuvres(model)
    own = {name: attempt(test.evaluate, model)[0] or test.no_indices for name, test in needed.items()}
    evaluated = {name: test.evaluate for name, test in needed.items()}
    return imo_criteria(model, intervals_of(own, draws, evaluated, progress))


def imo_manoeuvres(model: ShipModel) -> dict[str, Manoeuvre]:
    """The standard manoeuvres that the criteria need."""
    stops = {name: stop for name, stop in standard_stops(model).items() if name == "crash stop"}
    return standard_circles(model) | standard_zigzags(model) | stops


def imo_criteria(model: ShipModel, found: Mapping[str, Mapping[str, IndexInterval]]) -> dict[str, Criterion]:
    """The criteria of a ship from the indices of her standard manoeuvres, by their names.

    A manoeuvre that never got so far fails its criteria.
    """
    needed = imo_manoeuvres(model)
    first, second = overshoot_limits_deg(model.particulars["length"] / model.particulars["speed"])

    def worst_of(manoeuvre: str, index: str, limit: float, unit: str, paragraph: str) -> Criterion:
        runs = [run for name, run in found.items() if name in needed and name.startswith(manoeuvre)]
        return _criterion(runs, index, limit, unit, paragraph)

    return {
        "advance": worst_of("turning circle", "advance_lengths", 4.5, "ship lengths", "5.3.1"),
        "tactical_diameter": worst_of(
            "turning circle", "tactical_diameter_lengths", 5.0, "ship lengths", "5.3.1"
        ),
        "initial_turning": worst_of("zigzag 10/10", "initial_turning_lengths", 2.5, "ship lengths", "5.3.2"),
        "overshoot_1_10_10": worst_of("zigzag 10/10", "overshoot_1_deg", first, "deg", "5.3.3.1"),
        "overshoot_2_10_10": worst_of("zigzag 10/10", "overshoot_2_deg", second, "deg", "5.3.3.2"),
        "overshoot_1_20_20": worst_of("zigzag 20/20", "overshoot_1_deg", 25.0, "deg", "5.3.3.3"),
        "stopping": _stopping(model, found.get("crash stop")),
    }


def overshoot_limits_deg(seconds_per_length: float) -> tuple[float, float]:
    """Limits of the first and second overshoot in the 10/10 zigzag, degrees, for L/V in s."""
    first = np.clip(5.0 + 0.5 * seconds_per_length, 10.0, 20.0)
    second = np.clip(17.5 + 0.75 * seconds_per_length, 25.0, 40.0)
    return float(first), float(second)


def _criterion(
    runs: Sequence[Mapping[str, IndexInterval]],
    index: str,
    limit: float,
    unit: str,
    paragraph: str,
    note: str = "",
) -> Criterion:
    """The worst value of some runs against its limit; a run that never got so far fails it."""
    drawn = worst([run[index] for run in runs])
    passed = drawn.value is not None and drawn.value <= limit
    return Criterion(drawn.value, limit, passed, unit, f"MSC.137(76), annex, {paragraph}", drawn, note)


def _stopping(model: ShipModel, stop: Mapping[str, IndexInterval] | None) -> Criterion:
    """The full astern stopping test."""
    if stop is not None:
        return _criterion(
            [stop], "track_reach_lengths", STOPPING_LIMIT, "ship lengths", "5.3.4", LARGE_DISPLACEMENT
        )
    why = "its equations hold for a shaft turning ahead only"
    if "n" not in model.command_names:
        why = "its thrust is inside its surge coefficients, so it cannot be ordered astern"
    note = f"not assessable: {why}"
    return Criterion(None, STOPPING_LIMIT, None, "ship lengths", "MSC.137(76), annex, 5.3.4", None, note)

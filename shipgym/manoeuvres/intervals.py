"""Uncertainty of an identified ship's indices, by models drawn from its covariance."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from shipgym.arrays import Flags, Floats
from shipgym.checks import check_choice, check_number
from shipgym.errors import InputError, ManoeuvreError, UnstableModelError
from shipgym.manoeuvres.quantiles import DRAWS, LEVELS_95
from shipgym.manoeuvres.registry import Manoeuvre
from shipgym.manoeuvres.standard import standard_manoeuvres
from shipgym.models.by_name import takes_name
from shipgym.models.ship_model import ShipModel

#: From a ship to the indices of one of her manoeuvres, a dataclass such as
#: `ZigzagIndices`.
Evaluation = Callable[[ShipModel], Any]
#: Indices of manoeuvres by manoeuvre and name; None where one was not completed.
Indices = Mapping[str, Mapping[str, float | None]]

#: Indices of a draw as far as it got, and whether it ran away.
Outcome = tuple[dict[str, float | None], bool]


@dataclass(frozen=True, eq=False)
class IndexInterval:
    """One index of a model and of models drawn from its covariance."""

    value: float | None  # of the model itself; None where it was not completed
    #: of the draws, NaN where one ran away or did not complete it, shape
    #: (n_draws,)
    values: Floats
    ran_away: Flags  # draws that ran away in the manoeuvre, shape (n_draws,)
    #: whether it is a length, an angle or a time that is never negative, and has no
    #: bound for a ship that does not complete her manoeuvre
    is_size: bool = True

    @property
    def interval(self) -> tuple[float, float | None] | None:
        """The 95 % interval: quantiles of 2.5 and 97.5 per cent of the draws.

        It contains the value of the model itself. Draws that ran away or were not
        completed count at the upper end of a size, and the upper end is None where they
        reach it: there is no upper bound. Another index, such as a drift angle, has no
        interval where more than 2.5 per cent of the draws have none; so has one without
        draws.
        """
        if not len(self.values):
            return None
        is_lost = np.isnan(self.values)
        known = self.values[~is_lost]
        if self.is_size:
            known = np.where(is_lost, np.inf, np.maximum(self.values, 0.0))
        elif self.value is None or is_lost.mean() > LEVELS_95[0]:
            return None
        with np.errstate(invalid="ignore"):  # between a value and infinity
            low, high = np.quantile(known, LEVELS_95).tolist()
        if self.value is None:  # the model itself did not complete it
            return (low, None) if np.isfinite(low) else None
        upper = max(high, self.value) if np.isfinite(high) else None
        return float(np.fmin(low, self.value)), upper

    @property
    def n_ran_away(self) -> int:
        """Draws that ran away."""
        return int(self.ran_away.sum())

    @property
    def n_never_reached(self) -> int:
        """Draws that did not run away, but did not complete their manoeuvre."""
        without = np.isnan(self.values) & ~self.ran_away
        return int(without.sum())

    def to_dict(self) -> dict[str, Any]:
        """Value, interval and counts, as JSON knows them."""
        return {
            "value": self.value,
            "interval_95": self.interval,
            "draws": len(self.values),
            "ran_away": self.n_ran_away,
            "never_reached": self.n_never_reached,
        }

    def __repr__(self) -> str:
        """Value, interval and draws without a value."""
        text = "-" if self.value is None else f"{self.value:.4g}"
        interval = self.interval
        if interval is not None:
            low, high = interval
            upper = "no upper bound" if high is None else f"{high:.4g}"
            text += f" [{low:.4g}, {upper}]"
        if self.lost_in_words:
            text += f" ({self.lost_in_words})"
        return text

    @property
    def lost_in_words(self) -> str:
        """Say how many draws have no value."""
        lost = {"ran away": self.n_ran_away, "did not finish": self.n_never_reached}
        draws = len(self.values)
        return ", ".join(f"{n} of {draws} draws {how}" for how, n in lost.items() if n)


@takes_name
def index_intervals(
    model: ShipModel,
    manoeuvre: str | Evaluation = "zigzag 20/20, starboard first",
    n_draws: int = DRAWS,
    seed: int | np.random.Generator = 0,
) -> dict[str, IndexInterval]:
    """Indices of a manoeuvre with their 95 % intervals over a model's covariance.

    Returns an IndexInterval by the name of each index, with its unit in the name. Draws
    that run away or do not finish are counted. Raises InputError for a model without
    covariance, or a manoeuvre that is not known or that the ship cannot sail. Raises
    UnstableModelError if the model itself runs away. Raises ManoeuvreError if the model
    itself never reaches its switch heading or its speed.

    Parameters
    ----------
    model : ShipModel
        With a covariance.
    manoeuvre : str or callable
        A name of `standard_manoeuvres`, or a function from a ship to the indices of a
        manoeuvre, such as ``lambda ship: zigzag_indices(zigzag(ship, 15, 10))``.
    n_draws : int
        Models drawn (`ShipModel.sample`).
    seed : int or Generator
        Of the draw.

    Examples
    --------
    >>> from shipgym import load_model, manoeuvres
    >>> ship = load_model("mariner-tls-svm")
    >>> found = manoeuvres.index_intervals(ship, n_draws=50, seed=1)
    >>> low, high = found["overshoot_1_deg"].interval
    >>> low < found["overshoot_1_deg"].value < high
    True
    """
    evaluate = manoeuvre
    if isinstance(evaluate, str):
        known = standard_manoeuvres(model)
        check_choice(evaluate, tuple(known), "manoeuvre")
        evaluate = known[evaluate].evaluate
    check_number(n_draws, "n_draws", at_least=2)
    own = asdict(evaluate(model))
    draws = model.sample(int(n_draws), seed)
    intervals = intervals_of(
        {"manoeuvre": own},
        draws,
        {"manoeuvre": evaluate},
    )
    return intervals["manoeuvre"]


def own_indices(
    model: ShipModel, needed: Mapping[str, Manoeuvre]
) -> dict[str, dict[str, float | None]]:
    """Indices of a model in some manoeuvres; None for one that it cannot complete."""
    own = {}
    for name, manoeuvre in needed.items():
        indices, _ = attempt(manoeuvre.evaluate, model)
        if not indices:
            indices = manoeuvre.no_indices
        own[name] = indices
    return own


def intervals_of(
    own: Indices,
    draws: Iterable[ShipModel],
    evaluations: Mapping[str, Evaluation],
) -> dict[str, dict[str, IndexInterval]]:
    """Indices of several manoeuvres over the same draws, by manoeuvre and index.

    `own` are those of the model itself, `evaluations` give them from a ship; both by
    manoeuvre. Without draws the values stand alone.
    """
    outcomes: dict[str, list[Outcome]] = {name: [] for name in own}
    for draw in draws:
        for name, found in outcomes.items():
            found.append(attempt(evaluations[name], draw))
    intervals = {}
    for name, indices in own.items():
        drawn = outcomes[name]
        intervals[name] = {
            index: _interval(index, value, drawn) for index, value in indices.items()
        }
    return intervals


def _interval(
    index: str, value: float | None, outcomes: Sequence[Outcome]
) -> IndexInterval:
    """One index over the outcomes of a manoeuvre."""
    values = [indices.get(index) for indices, _ in outcomes]
    return IndexInterval(
        value=value,
        values=np.array(values, dtype=float),  # None becomes NaN
        ran_away=np.array([ran_away for _, ran_away in outcomes], dtype=bool),
        is_size=is_size(index),
    )


def is_size(index: str) -> bool:
    """Return whether an index is a length, an angle or a time, larger for worse ships.

    Others, such as a drift angle or a speed, have a sign or no worse end.
    """
    sizes = (
        "advance_lengths",
        "tactical_diameter_lengths",
        "steady_diameter_lengths",
        "overshoot_1_deg",
        "overshoot_2_deg",
        "initial_turning_lengths",
        "period_s",
        "track_reach_lengths",
        "time_s",
    )
    return index in sizes


def attempt(evaluate: Evaluation, model: ShipModel) -> Outcome:
    """Indices of a manoeuvre as far as it got, and whether the ship ran away.

    A spiral of a draw that turns to one side only, or whose rudder has the wrong sign,
    has no indices either: there the error lies in the draw and not in what the user
    gave.
    """
    try:
        return asdict(evaluate(model)), False
    except UnstableModelError:
        return {}, True
    except (ManoeuvreError, InputError):
        return {}, False


def worst(runs: Sequence[IndexInterval]) -> IndexInterval:
    """The largest of an index over some manoeuvres, for the model and for each draw.

    It has no value where one of the manoeuvres has none.
    """
    own = [run.value for run in runs if run.value is not None]
    draws = [run.values for run in runs]
    ran_away = [run.ran_away for run in runs]
    is_complete = len(own) == len(runs)
    return IndexInterval(
        value=max(own) if is_complete else None,
        values=np.max(draws, axis=0),
        ran_away=np.any(ran_away, axis=0),
        is_size=all(run.is_size for run in runs),
    )

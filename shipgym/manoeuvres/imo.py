"""The manoeuvring criteria of the International Maritime Organization: resolution MSC.137(76), 2002."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shipgym.checks import check_number
from shipgym.errors import InputError, ManoeuvreError, UnstableModelError
from shipgym.manoeuvres.execution import rudder
from shipgym.manoeuvres.intervals import IndexInterval, attempt, intervals_of, worst
from shipgym.manoeuvres.registry import Manoeuvre
from shipgym.manoeuvres.stopping import StoppingIndices, standard_stops
from shipgym.manoeuvres.turning import (
    full_rudder_deg,
    standard_circles,
    turning_indices,
)
from shipgym.manoeuvres.zigzags import (
    STANDARD_DEG,
    standard_zigzags,
    switch_heading_deg,
    zigzag_indices,
)
from shipgym.ships.ship_model import ShipModel
from shipgym.trials.trial import Trial

DRAWS = 100  # of an identified ship
SURE = (
    0.975  # of the draws on one side of a limit, from which on a criterion is decided
)
# distance from the trials' envelope, by its size, from which on a manoeuvre is not
# theirs
OUTSIDE = 1.15
# by which the rudder and heading of a trial may differ from those of the manoeuvre
ANGLE_DEG = 1.0
SPEED = 0.1  # likewise its approach speed, by that of service
STOPPING_LIMIT = 15.0  # ship lengths
#: Manoeuvre, index, paragraph of the annex and largest value of each criterion; those
#: of the overshoots in the 10/10 zigzag are smaller for some ships
#: (`overshoot_limits_deg`).
RULES = {
    "advance": ("turning circle", "advance_lengths", "5.3.1", 4.5),
    "tactical_diameter": ("turning circle", "tactical_diameter_lengths", "5.3.1", 5.0),
    "initial_turning": ("zigzag 10/10", "initial_turning_lengths", "5.3.2", 2.5),
    "overshoot_1_10_10": ("zigzag 10/10", "overshoot_1_deg", "5.3.3.1", 20.0),
    "overshoot_2_10_10": ("zigzag 10/10", "overshoot_2_deg", "5.3.3.2", 40.0),
    "overshoot_1_20_20": ("zigzag 20/20", "overshoot_1_deg", "5.3.3.3", 25.0),
}
LARGE_DISPLACEMENT = (
    "where large displacement makes 15 lengths impracticable, the Administration may"
    " allow up to 20"
)


@dataclass(frozen=True)
class Criterion:
    """One criterion; the worse of the two sides counts."""

    value: (
        float | None
    )  # of the model, in `unit`; None where the manoeuvre never got so far
    limit: float  # largest value allowed
    # None where it is not decided, or the ship's equations do not allow the test: see
    # `note`
    passed: bool | None
    unit: str  # "ship lengths" or "deg"
    source: str  # paragraph of the annex of MSC.137(76)
    # the value over models drawn from the covariance of an identified ship
    drawn: IndexInterval | None = None
    note: str = ""  # remarks
    #: whether there is a verdict: by a measured trial, or by a model within the
    #: envelope of its trials, with the interval on one side of the limit
    decided: bool = True
    measured: float | None = (
        None  # of a trial that is the manoeuvre; it goes before the model's
    )
    manoeuvre: str = (
        ""  # such as "35 deg turn", with the rudder's limit where that is less
    )

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

    @property
    def probability(self) -> float | None:
        """Of passing: 1 or 0 where it was measured, the share of the draws otherwise; None if not decided."""
        if not self.decided:
            return None
        return self.share_passed if self.measured is None else float(bool(self.passed))

    def to_dict(self) -> dict[str, Any]:
        """As JSON knows it."""
        names = (
            "manoeuvre",
            "value",
            "measured",
            "limit",
            "decided",
            "passed",
            "unit",
            "source",
        )
        fields: dict[str, Any] = {name: getattr(self, name) for name in names}
        if self.note:
            fields["note"] = self.note
        if self.drawn is not None and len(self.drawn.values):
            (median,) = self.drawn.quantiles(0.5)
            fields |= {
                "probability": self.probability,
                "interval_95": self.interval,
                "median": median,
            }
            fields |= {
                "draws": len(self.drawn.values),
                "ran_away": self.drawn.n_ran_away,
            }
            fields |= {"without_value": int(np.isnan(self.drawn.values).sum())}
        return fields


def imo_assessment(
    model: ShipModel, n_draws: int | None = None, seed: int | np.random.Generator = 0
) -> dict[str, Criterion]:
    """Assess a ship by MSC.137(76): turning, initial turning, yaw checking, course keeping and stopping.

    Simulated from service speed in deep water: turning circles with 35 degrees of
    rudder, or the rudder's limit where that is less, and zigzags 10/10 and 20/20, each
    to both sides; a full astern stop where the ship's equations hold for a shaft
    astern. To show how certain each verdict is, `n_draws` models are drawn from the
    covariance of an identified ship, by default 100, and none for a ship without one.

    Returns the criteria `advance`, `tactical_diameter`, `initial_turning`,
    `overshoot_1_10_10`, `overshoot_2_10_10`, `overshoot_1_20_20` and `stopping`. Raises
    InputError for draws without covariance.
    """
    usual = 0 if model.covariance is None else DRAWS
    count = int(
        check_number(usual if n_draws is None else n_draws, "n_draws", at_least=0)
    )
    draws = model.sample(count, seed) if count else []
    return assess_draws(model, draws)


def assess_draws(model: ShipModel, draws: Sequence[ShipModel]) -> dict[str, Criterion]:
    """The criteria of a model and of models drawn from it."""
    needed = imo_manoeuvres(model)
    own = {
        name: attempt(test.evaluate, model)[0] or test.no_indices
        for name, test in needed.items()
    }
    evaluated = {name: test.evaluate for name, test in needed.items()}
    return imo_criteria(model, intervals_of(own, draws, evaluated))


def imo_manoeuvres(model: ShipModel) -> dict[str, Manoeuvre]:
    """The standard manoeuvres that the criteria need."""
    stops = {
        name: stop
        for name, stop in standard_stops(model).items()
        if name == "crash stop"
    }
    return standard_circles(model) | standard_zigzags(model) | stops


def imo_criteria(
    model: ShipModel, found: Mapping[str, Mapping[str, IndexInterval]]
) -> dict[str, Criterion]:
    """The criteria of a ship from the indices of her standard manoeuvres, by their names.

    A manoeuvre that never got so far fails its criteria. Of an identified ship a
    criterion is decided only where the manoeuvre is within the envelope of her trials
    and the draws are on one side of the limit.
    """
    needed = imo_manoeuvres(model)
    beyond = {
        name for name, test in needed.items() if name in found and _outside(model, test)
    }
    first, second = overshoot_limits_deg(model.travel_time)
    limits = {"overshoot_1_10_10": first, "overshoot_2_10_10": second}
    criteria = {}
    for criterion, (manoeuvre, index, paragraph, limit) in RULES.items():
        names = [
            name for name in found if name in needed and name.startswith(manoeuvre)
        ]
        one = _criterion(
            [found[name] for name in names],
            index,
            limits.get(criterion, limit),
            paragraph,
        )
        criteria[criterion] = _decided(
            one, trial_in_words(model, manoeuvre), bool(beyond & set(names))
        )
    return {**criteria, "stopping": _stopping(model, found.get("crash stop"))}


def with_measured(
    criteria: Mapping[str, Criterion], model: ShipModel, trials: Sequence[Trial]
) -> dict[str, Criterion]:
    """The criteria of a ship, decided by her trials where one of them is the manoeuvre; the worst counts.

    `trials`: as recorded; those of another rudder angle, heading or approach speed
    count for nothing.
    """
    most: dict[str, float] = {}
    for trial in trials:
        for name, value in _measured(model, trial).items():
            most[name] = max(value, most.get(name, value))
    decided = dict(criteria)
    for name in most.keys() & criteria.keys():
        passed = most[name] <= criteria[name].limit
        decided[name] = replace(
            criteria[name], measured=most[name], decided=True, passed=passed, note=""
        )
    return decided


def _measured(model: ShipModel, trial: Trial) -> dict[str, float]:
    """The criteria that a trial measures, by name; none where it is not one of the manoeuvres."""
    speed, length = model.particulars["speed"], model.particulars["length"]
    start = (
        float(np.hypot(trial["u"][0], trial["v"][0]))
        if "u" in trial and "v" in trial
        else 0.0
    )
    if (
        trial.kind not in ("zigzag", "turning-circle")
        or abs(start - speed) > SPEED * speed
    ):
        return {}
    indices: Any
    try:
        angle = float(np.degrees(np.percentile(np.abs(rudder(trial)), 75)))
        if trial.kind == "zigzag":
            heading, indices = (
                switch_heading_deg(trial) or 0.0,
                zigzag_indices(trial, length),
            )
            off = {
                f"zigzag {deg:.0f}/{deg:.0f}": max(abs(angle - deg), abs(heading - deg))
                for deg in STANDARD_DEG
            }
        else:
            indices = turning_indices(trial, length)
            off = {"turning circle": abs(angle - full_rudder_deg(model))}
    except InputError:  # a channel such as the position is missing
        return {}
    values = {
        name: getattr(indices, index)
        for name, (manoeuvre, index, *_) in RULES.items()
        if off.get(manoeuvre, np.inf) <= ANGLE_DEG
    }
    return {name: value for name, value in values.items() if value is not None}


def trial_in_words(model: ShipModel, manoeuvre: str) -> str:
    """A trial of a standard manoeuvre, of a turn with the rudder's limit where that is less than 35 deg."""
    full = full_rudder_deg(model)
    return (
        f"{full:g} deg turn"
        if manoeuvre == "turning circle"
        else f"{manoeuvre.split()[-1]} zigzag"
    )


def _outside(model: ShipModel, test: Manoeuvre) -> bool:
    """Whether a manoeuvre leaves the envelope of the trials, in a turn up to 180 degrees of heading."""
    if model.envelope is None or test.outcome is StoppingIndices:
        return False
    try:
        run = test.sail(model)
    except (UnstableModelError, ManoeuvreError):
        return True
    turned = np.abs(run["psi"] - run["psi"][0]) > np.pi
    last = int(np.argmax(turned)) if turned.any() else len(run.t)
    states = (
        run[c][:last] if c in run else np.zeros(last) for c in ("u", "v", "r", "delta")
    )
    return bool(model.envelope.distance(*states).max() > OUTSIDE)


def _decided(criterion: Criterion, manoeuvre: str, outside: bool) -> Criterion:
    """The criterion without verdict where the trials do not decide it, and the trial that would."""
    criterion, drawn = replace(criterion, manoeuvre=manoeuvre), criterion.drawn
    why = "it is outside the envelope of the trials" if outside else None
    if why is None and drawn is not None and len(drawn.values):
        failed = float(np.mean(~(drawn.values <= criterion.limit) & ~drawn.ran_away))
        if max(criterion.share_passed or 0.0, failed) < SURE:
            why = "the models drawn lie on both sides of the limit"
    if why is None:
        return criterion
    note = f"not decided by these trials: {why}; run a {manoeuvre} to both sides"
    return replace(criterion, passed=None, decided=False, note=note)


def overshoot_limits_deg(seconds_per_length: float) -> tuple[float, float]:
    """Limits of the first and second overshoot in the 10/10 zigzag, degrees, for L/V in s."""
    first = np.clip(5.0 + 0.5 * seconds_per_length, 10.0, 20.0)
    second = np.clip(17.5 + 0.75 * seconds_per_length, 25.0, 40.0)
    return float(first), float(second)


def _criterion(
    runs: Sequence[Mapping[str, IndexInterval]],
    index: str,
    limit: float,
    paragraph: str,
    note: str = "",
) -> Criterion:
    """The worst value of some runs against its limit; a run that never got so far fails it."""
    drawn, unit = (
        worst([run[index] for run in runs]),
        "deg" if index.endswith("_deg") else "ship lengths",
    )
    passed = drawn.value is not None and drawn.value <= limit
    return Criterion(
        drawn.value,
        limit,
        passed,
        unit,
        f"MSC.137(76), annex, {paragraph}",
        drawn,
        note,
    )


def _stopping(model: ShipModel, stop: Mapping[str, IndexInterval] | None) -> Criterion:
    """The full astern stopping test."""
    if stop is not None:
        return _criterion(
            [stop], "track_reach_lengths", STOPPING_LIMIT, "5.3.4", LARGE_DISPLACEMENT
        )
    why = "its equations hold for a shaft turning ahead only"
    if "n" not in model.command_names:
        why = (
            "its thrust is inside its surge coefficients, so it cannot be ordered"
            " astern"
        )
    note = f"not assessable: {why}"
    source = "MSC.137(76), annex, 5.3.4"
    return Criterion(
        None, STOPPING_LIMIT, None, "ship lengths", source, note=note, decided=False
    )

"""Criteria of manoeuvrability, judged by measured trials and models drawn.

A side of a manoeuvre counts by its trial where there is one, else by the models drawn
from the covariance, if the manoeuvre lies within the envelope of the trials.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from shipgym.errors import ManoeuvreError, UnstableModelError
from shipgym.manoeuvres.imo_rules import Rule
from shipgym.manoeuvres.intervals import IndexInterval, worst
from shipgym.manoeuvres.measured import MeasuredIndex, measured_indices
from shipgym.manoeuvres.registry import Manoeuvre
from shipgym.manoeuvres.stopping import StoppingIndices
from shipgym.models.ship_model import ShipModel
from shipgym.ships.envelope import ENVELOPE_CHANNELS
from shipgym.trials.trial import Trial


class Side(NamedTuple):
    """Evidence about an index on one side."""

    name: str  # "starboard" or "port"; empty of a manoeuvre without sides
    drawn: IndexInterval
    outside: bool = False  # whether the manoeuvre leaves the envelope of the trials
    measured: MeasuredIndex | None = None


class Chances(NamedTuple):
    """Probabilities that a criterion is met and that it is missed.

    What is not known counts for neither.
    """

    passes: float
    fails: float

    @property
    def is_sure(self) -> bool:
        """True if one of them decides."""
        sure = 0.975
        return max(self.passes, self.fails) >= sure


def chances_of(sides: Sequence[Side], limit: float) -> Chances:
    """Probabilities for the worse side: a side by its trial, else by the model.

    Where the model was off on the side that was measured, it is taken to be off by as
    much on the other.
    """
    passes = 1.0
    offsets = [0.0]
    unmeasured = []
    for side in sides:
        measured = side.measured
        if measured is None:
            unmeasured.append(side)
            continue
        passes *= measured.share_below(limit)
        if side.drawn.value is not None:
            offsets.append(measured.value - side.drawn.value)

    model = _chances_by_model(unmeasured, limit, offsets)
    holds = passes * (1.0 - model.fails)
    return Chances(
        passes=passes * model.passes,
        fails=1.0 - holds,
    )


def _chances_by_model(
    sides: Sequence[Side], limit: float, offsets: Sequence[float]
) -> Chances:
    """Probabilities by the models drawn; runaways count for neither.

    `offsets`: measured by predicted index of the other side, with 0.
    """
    inside = [side.drawn for side in sides if not side.outside]
    if not sides:
        return Chances(passes=1.0, fails=0.0)
    if not inside:
        return Chances(passes=0.0, fails=0.0)
    drawn = worst(inside)
    if len(drawn.values):
        high = drawn.values + max(offsets)
        low = drawn.values + min(offsets)
        meets = high <= limit
        is_beyond = ~(low <= limit)  # or has no value
        misses = is_beyond & ~drawn.ran_away
        passes = float(meets.mean())
        fails = float(misses.mean())
    else:
        passes = float(drawn.value is not None and drawn.value <= limit)
        fails = 1.0 - passes

    if len(inside) < len(sides):
        passes = 0.0
    return Chances(passes, fails)


def worse_measured(sides: Sequence[Side]) -> MeasuredIndex | None:
    """The largest index that trials measured; None without any."""
    found = [side.measured for side in sides if side.measured is not None]
    return max(found, key=lambda measured: measured.value, default=None)


def worse_side(sides: Sequence[Side]) -> str:
    """Name of the side whose index is largest, by trials or else by the model."""
    measured = worse_measured(sides)
    if measured is not None:
        return measured.side
    values = {}
    for side in sides:
        value = side.drawn.value
        values[side.name] = np.inf if value is None else value
    return max(values, key=lambda name: values[name])


@dataclass(frozen=True)
class Criterion:
    """One criterion; the worse of the two sides counts."""

    value: float | None  # of the model, in `unit`; None where it did not finish
    limit: float  # largest value allowed
    # None where it is not decided, or the ship's equations do not allow the test: see
    # `note`
    passed: bool | None
    unit: str  # "ship lengths" or "deg"
    source: str  # paragraph of the annex of MSC.137(76)
    # the value over models drawn from the covariance of an identified ship
    drawn: IndexInterval | None = None
    note: str = ""  # remarks
    #: whether there is a verdict: by measured trials, or by a model within the
    #: envelope of its trials, with 97.5 % certainty
    decided: bool = True
    #: the worse of the trials that are the manoeuvre; it goes before the model's
    measured: float | None = None
    #: such as "35 deg turn", with the rudder's limit where that is less
    manoeuvre: str = ""
    measured_error: float | None = None  # standard error of what was measured
    side: str = ""  # the worse side: of the trials, without any of the model
    decided_by: str | None = None  # "trials", "model" or "trials and model"
    certainty: float | None = None  # of the verdict
    #: where it is not decided: the trials that were not run, one to a side
    deciding_trials: tuple[str, ...] = ()
    sides: tuple[Side, ...] = ()  # what is known on each

    @property
    def interval(self) -> tuple[float, float | None] | None:
        """95 % interval over the draws (`IndexInterval.interval`)."""
        return None if self.drawn is None else self.drawn.interval

    @property
    def share_passed(self) -> float | None:
        """Share of the draws that pass; runaways and incomplete runs do not."""
        if self.drawn is None or not len(self.drawn.values):
            return None
        return float(np.mean(self.drawn.values <= self.limit))  # NaN is not

    @property
    def probability(self) -> float | None:
        """Probability to pass, by trials and models drawn; None if undecided."""
        if not self.decided:
            return None
        by_value = self.measured is None and self.share_passed is None
        if by_value or self.certainty is None:
            return self.share_passed
        return self.certainty if self.passed else 1.0 - self.certainty

    def to_dict(self) -> dict[str, Any]:
        """Dictionary ready for JSON."""
        fields: dict[str, Any] = {
            "manoeuvre": self.manoeuvre,
            "value": self.value,
            "measured": self.measured,
            "measured_error": self.measured_error,
            "side": self.side,
            "limit": self.limit,
            "interval_95": self.interval,
            "probability": self.probability,
            "decided": self.decided,
            "decided_by": self.decided_by,
            "deciding_trials": list(self.deciding_trials),
            "passed": self.passed,
            "unit": self.unit,
            "source": self.source,
        }
        if self.note:
            fields["note"] = self.note
        drawn = self.drawn
        if drawn is not None and len(drawn.values):
            (median,) = drawn.quantiles(0.5)
            fields |= {
                "median": median,
                "draws": len(drawn.values),
                "ran_away": drawn.n_ran_away,
                "without_value": int(np.isnan(drawn.values).sum()),
            }
        return fields


def criterion_of(
    rule: Rule, sides: Sequence[Side], manoeuvre: str = "", note: str = ""
) -> Criterion:
    """A rule judged on the worse side; an incomplete run fails it.

    `sides`: what is known of the index on each; `manoeuvre`: the trial in words.
    """
    drawn = worst([side.drawn for side in sides])
    criterion = Criterion(
        value=drawn.value,
        limit=rule.limit,
        passed=None,
        unit=rule.unit,
        source=rule.source,
        drawn=drawn,
        note=note,
        manoeuvre=manoeuvre,
        sides=tuple(sides),
    )
    return judged(criterion)


def judged(criterion: Criterion) -> Criterion:
    """The criterion with its verdict, or with the trial that would decide it."""
    sides = criterion.sides
    measured = worse_measured(sides)
    chances = chances_of(sides, criterion.limit)
    criterion = replace(
        criterion,
        side=worse_side(sides),
        measured=None if measured is None else measured.value,
        measured_error=None if measured is None else measured.error,
    )
    if not chances.is_sure:
        return _undecided(criterion)
    passed = chances.passes > chances.fails
    return replace(
        criterion,
        passed=passed,
        decided=True,
        decided_by=_source_of(criterion, passed),
        certainty=max(chances),
        deciding_trials=(),
        note="" if measured is not None else criterion.note,
    )


def _source_of(criterion: Criterion, passed: bool) -> str:
    """Evidence that decides a criterion: "trials", "model", or both."""
    measured = [side for side in criterion.sides if side.measured is not None]
    if not measured:
        return "model"
    by_trials = chances_of(measured, criterion.limit)
    all_measured = len(measured) == len(criterion.sides)
    if all_measured or (by_trials.is_sure and not passed):
        return "trials"
    return "trials and model"


def _undecided(criterion: Criterion) -> Criterion:
    """The criterion without verdict, with the trials that are left to run."""
    left = [side.name for side in criterion.sides if side.measured is None]
    trials = [side_in_words(criterion.manoeuvre, name) for name in left]
    note = f"not decided by these trials: {_why_undecided(criterion)}"
    if len(trials) == 1:
        note += f"; run a {trials[0]}"
    elif trials:
        note += f"; run a {criterion.manoeuvre} to both sides"
    return replace(
        criterion,
        passed=None,
        decided=False,
        decided_by=None,
        certainty=None,
        deciding_trials=tuple(trials),
        note=note,
    )


def side_in_words(manoeuvre: str, side: str) -> str:
    """Trial of a manoeuvre to one side: "35 deg turn to port"."""
    if manoeuvre.endswith("turn"):
        return f"{manoeuvre} to {side}"
    if not side:
        return manoeuvre
    return f"{manoeuvre}, {side} first"


def _why_undecided(criterion: Criterion) -> str:
    """Reason why there is no verdict."""
    measured = [side for side in criterion.sides if side.measured is not None]
    unmeasured = [side for side in criterion.sides if side.measured is None]
    why = "the models drawn lie on both sides of the limit"
    if any(side.outside for side in unmeasured):
        why = "it is outside the envelope of the trials"
    if not unmeasured:
        return (
            f"{criterion.measured:.2f} was measured with a standard error of"
            f" {criterion.measured_error:.2g}, too near the limit"
        )
    if measured:
        return f"it was measured to {measured[0].name} alone, and otherwise {why}"
    return why


def outside_envelope(model: ShipModel, test: Manoeuvre) -> bool:
    """Return whether a manoeuvre leaves the envelope of the trials.

    By more than 0.15 of its size, in a turn up to 180 degrees.
    """
    if model.envelope is None or test.outcome is StoppingIndices:
        return False
    try:
        run = test.sail(model)
    except (UnstableModelError, ManoeuvreError):
        return True
    psi = run["psi"]
    within_half_turn = np.abs(psi - psi[0]) <= np.pi
    part = np.logical_and.accumulate(within_half_turn)
    none = np.zeros(len(run))
    states = []
    for name in ENVELOPE_CHANNELS:
        values = run.channels.get(name, none)
        states.append(values[part])
    distances = model.envelope.distance(*states)
    return bool(distances.max() > 1.15)


def with_measured(
    criteria: Mapping[str, Criterion], model: ShipModel, trials: Sequence[Trial]
) -> dict[str, Criterion]:
    """Criteria of a ship, by her trials where they measure them.

    Of several trials to one side the worst counts. `trials`: as recorded; those of
    another rudder angle, heading or approach speed count for nothing.
    """
    found = dict(criteria)
    for trial in trials:
        for name, measured in measured_indices(model, trial).items():
            if name in found:
                sides = _with_trial(found[name].sides, measured)
                found[name] = replace(found[name], sides=sides)
    for name, criterion in found.items():
        if worse_measured(criterion.sides) is not None:
            found[name] = judged(criterion)
    return found


def _with_trial(sides: Sequence[Side], measured: MeasuredIndex) -> tuple[Side, ...]:
    """The sides with a trial on its own, if it is the worst there."""
    after = []
    for side in sides:
        known = side.measured
        is_worst = known is None or measured.value > known.value
        if side.name == measured.side and is_worst:
            after.append(side._replace(measured=measured))
        else:
            after.append(side)
    return tuple(after)

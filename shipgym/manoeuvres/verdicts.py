"""Verdicts on criteria by a model, the models drawn from it, and measured trials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shipgym.errors import InputError, ManoeuvreError, UnstableModelError
from shipgym.manoeuvres.execution import usual_rudder
from shipgym.manoeuvres.imo_rules import RULES, Rule
from shipgym.manoeuvres.intervals import IndexInterval, worst
from shipgym.manoeuvres.registry import Manoeuvre
from shipgym.manoeuvres.stopping import StoppingIndices
from shipgym.manoeuvres.turning import full_rudder_deg, turning_indices
from shipgym.manoeuvres.zigzags import (
    STANDARD_DEG,
    switch_heading_deg,
    zigzag_indices,
)
from shipgym.ships.envelope import ENVELOPE_CHANNELS
from shipgym.ships.ship_model import ShipModel
from shipgym.trials.trial import Trial


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
    #: whether there is a verdict: by a measured trial, or by a model within the
    #: envelope of its trials, with the interval on one side of the limit
    decided: bool = True
    #: of a trial that is the manoeuvre; it goes before the model's
    measured: float | None = None
    #: such as "35 deg turn", with the rudder's limit where that is less
    manoeuvre: str = ""

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
        """Probability to pass: 1 or 0 if measured; None if undecided."""
        if not self.decided:
            return None
        if self.measured is not None:
            return float(bool(self.passed))
        return self.share_passed

    def to_dict(self) -> dict[str, Any]:
        """Dictionary ready for JSON."""
        fields: dict[str, Any] = {
            "manoeuvre": self.manoeuvre,
            "value": self.value,
            "measured": self.measured,
            "limit": self.limit,
            "decided": self.decided,
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
                "probability": self.probability,
                "interval_95": self.interval,
                "median": median,
                "draws": len(drawn.values),
                "ran_away": drawn.n_ran_away,
                "without_value": int(np.isnan(drawn.values).sum()),
            }
        return fields


def criterion_of(
    rule: Rule, runs: Sequence[Mapping[str, IndexInterval]], note: str = ""
) -> Criterion:
    """The worst value of some runs against its limit; an incomplete run fails it."""
    drawn = worst([run[rule.index] for run in runs])
    value = drawn.value
    return Criterion(
        value=value,
        limit=rule.limit,
        passed=value is not None and value <= rule.limit,
        unit=rule.unit,
        source=rule.source,
        drawn=drawn,
        note=note,
    )


def decided_by_model(criterion: Criterion, manoeuvre: str, outside: bool) -> Criterion:
    """The criterion without verdict where a model does not decide it.

    It names the trial that would decide it.

    `manoeuvre`: the trial in words; `outside`: whether it is outside the envelope of
    the trials that the model was identified from.
    """
    criterion = replace(criterion, manoeuvre=manoeuvre)
    if outside:
        why = "it is outside the envelope of the trials"
    elif _on_both_sides(criterion):
        why = "the models drawn lie on both sides of the limit"
    else:
        return criterion
    note = f"not decided by these trials: {why}; run a {manoeuvre} to both sides"
    return replace(criterion, passed=None, decided=False, note=note)


def _on_both_sides(criterion: Criterion) -> bool:
    """Return whether the draws lie on both sides of the limit; runaways on none."""
    drawn = criterion.drawn
    if drawn is None or not len(drawn.values):
        return False
    passes = drawn.values <= criterion.limit
    fails = ~passes & ~drawn.ran_away
    larger_share = max(passes.mean(), fails.mean())
    # Share of the draws on one side of a limit, from which on a criterion is decided.
    sure = 0.975
    return bool(larger_share < sure)


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
    """Criteria of a ship, by her trials where they measure them; the worst counts.

    `trials`: as recorded; those of another rudder angle, heading or approach speed
    count for nothing.
    """
    decided = dict(criteria)
    for trial in trials:
        for name, value in measured_indices(model, trial).items():
            criterion = decided.get(name)
            if criterion is None:
                continue
            worse = criterion.measured is None or value > criterion.measured
            if worse:
                decided[name] = replace(
                    criterion,
                    measured=value,
                    decided=True,
                    passed=value <= criterion.limit,
                    note="",
                )
    return decided


def measured_indices(model: ShipModel, trial: Trial) -> dict[str, float]:
    """Criteria that a trial measures, by name; none for another manoeuvre."""
    if trial.kind not in ("zigzag", "turning-circle") or not _at_speed(model, trial):
        return {}
    length = model.particulars["length"]
    indices: Any
    try:
        manoeuvre = _manoeuvre_of(model, trial)
        if trial.kind == "zigzag":
            indices = zigzag_indices(trial, length)
        else:
            indices = turning_indices(trial, length)
    except InputError:  # a channel such as the position is missing
        return {}

    values = {}
    for name, rule in RULES.items():
        if rule.manoeuvre == manoeuvre:
            value = getattr(indices, rule.index)
            if value is not None:
                values[name] = value
    return values


def _at_speed(model: ShipModel, trial: Trial) -> bool:
    """Return whether a trial begins at service speed, to a tenth."""
    if "u" not in trial or "v" not in trial:
        return False
    service = model.particulars["speed"]
    first = np.hypot(trial["u"][0], trial["v"][0])
    off = abs(first - service)
    return bool(off <= 0.1 * service)


def _manoeuvre_of(model: ShipModel, trial: Trial) -> str | None:
    """Manoeuvre of the rules that a trial is, to a degree; None for another."""
    rudder_deg = float(np.degrees(usual_rudder(trial)))
    if trial.kind == "turning-circle":
        off = abs(rudder_deg - full_rudder_deg(model))
        return "turning circle" if off <= 1.0 else None
    heading_deg = switch_heading_deg(trial) or 0.0
    for angle in STANDARD_DEG:
        rudder_off = abs(rudder_deg - angle)
        heading_off = abs(heading_deg - angle)
        if rudder_off <= 1.0 and heading_off <= 1.0:
            return f"zigzag {angle:.0f}/{angle:.0f}"
    return None

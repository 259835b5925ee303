"""Criteria of manoeuvrability, judged by measured trials and models drawn.

A side of a manoeuvre counts by its trial where there is one, else by the models drawn
from the covariance, if the manoeuvre lies within the envelope of the trials.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from shipgym.errors import ManoeuvreError, UnstableModelError
from shipgym.manoeuvres.imo_rules import Rule
from shipgym.manoeuvres.intervals import IndexInterval, worst
from shipgym.manoeuvres.measured import MeasuredIndex
from shipgym.manoeuvres.registry import Manoeuvre
from shipgym.manoeuvres.stopping import StoppingIndices
from shipgym.manoeuvres.turning import TurningIndices
from shipgym.models.ship_model import ShipModel
from shipgym.ships.envelope import ENVELOPE_CHANNELS


class Side(NamedTuple):
    """Evidence about an index on one side."""

    name: str  # "starboard" or "port"; empty of a manoeuvre without sides
    drawn: IndexInterval
    outside: bool = False  # whether the manoeuvre leaves the envelope of the trials
    measured: MeasuredIndex | None = None

    @property
    def by_execution(self) -> float:
        """What the rudder of the trial changes of the index, by the model."""
        known = self.measured
        if known is None or known.predicted is None or self.drawn.value is None:
            return 0.0
        return abs(known.predicted - self.drawn.value)


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
        is_met = drawn.value is not None and drawn.value <= limit
        passes = float(is_met)
        fails = 1.0 - passes

    if len(inside) < len(sides):
        passes = 0.0
    return Chances(passes, fails)


@dataclass(frozen=True)
class Criterion:
    """One criterion; the worse of the two sides counts.

    There is a verdict by measured trials, or by a model within the envelope of its
    trials, with 97.5 % certainty.
    """

    rule: Rule
    #: such as "35 deg turn", with the rudder's limit where that is less
    manoeuvre: str = ""
    # what is known on each; none where the ship's equations do not allow the test
    sides: tuple[Side, ...] = ()
    remark: str = ""

    @property
    def limit(self) -> float:
        """Largest value allowed, in `unit`."""
        return self.rule.limit

    @property
    def unit(self) -> str:
        """Unit of the index: "ship lengths" or "deg"."""
        return self.rule.unit

    @cached_property
    def drawn(self) -> IndexInterval | None:
        """The index over models drawn from the covariance, on the worse side."""
        return worst([side.drawn for side in self.sides]) if self.sides else None

    @property
    def value(self) -> float | None:
        """The index of the model, in `unit`; None where it did not finish."""
        return None if self.drawn is None else self.drawn.value

    @property
    def worse_measured(self) -> MeasuredIndex | None:
        """The worse of the trials that are the manoeuvre; None without any."""
        found = [side.measured for side in self.sides if side.measured is not None]
        return max(found, key=lambda measured: measured.value, default=None)

    @property
    def measured(self) -> float | None:
        """The index that trials measured; it goes before the model's."""
        found = self.worse_measured
        return None if found is None else found.value

    @property
    def measured_error(self) -> float | None:
        """Standard error of what was measured."""
        found = self.worse_measured
        return None if found is None else found.error

    @property
    def side(self) -> str:
        """Side of the worse trial; empty without any."""
        return "" if self.worse_measured is None else self.worse_measured.side

    @cached_property
    def _chances(self) -> Chances:
        return chances_of(self.sides, self.limit)

    @property
    def decided(self) -> bool:
        """True where there is a verdict."""
        return bool(self.sides) and self._chances.is_sure

    @property
    def passed(self) -> bool | None:
        """The verdict; None without one."""
        if not self.decided:
            return None
        return self._chances.passes > self._chances.fails

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        if not self.sides:
            return "not assessable"
        words = {True: "passes", False: "fails", None: "not decided"}
        return words[self.passed]

    def __repr__(self) -> str:
        """Index by the model and by trials, its limit and the verdict."""
        if not self.sides:
            return self.remark
        found = f"{self.drawn}"
        measured = self.worse_measured
        if measured is not None:
            found += f", measured {measured}"

        unit = self.unit
        limit = f"limit {self.limit:.4g} {unit}"
        return f"{found}; {limit}: {self.verdict}"

    @property
    def deciding_trials(self) -> tuple[str, ...]:
        """Without verdict: the trials that were not run, one to a side."""
        if self.decided:
            return ()
        left = [side.name for side in self.sides if side.measured is None]
        return tuple(side_in_words(self.manoeuvre, name) for name in left)

    @property
    def note(self) -> str:
        """Remarks, such as why there is no verdict."""
        if self.contradicted:
            return (
                "the model is at fault: its 95 % interval excludes the measured"
                f" {self.measured:.3g} (standard error {self.measured_error:.2g})"
            )
        if self.decided or not self.sides:
            return self.remark
        return f"not decided by these trials: {_why_undecided(self)}"

    @property
    def contradicted(self) -> bool:
        """Whether the model's interval on a side excludes what was measured there.

        Up to what the trial's own rudder, instead of the standard one, changes.
        """
        for side in self.sides:
            interval = side.drawn.interval
            if side.measured is None or interval is None:
                continue
            low, high = interval
            reach = 1.96 * side.measured.error + side.by_execution
            above = high is not None and side.measured.value - reach > high
            if above or side.measured.value + reach < low:
                return True
        return False

    @property
    def interval(self) -> tuple[float, float | None] | None:
        """95 % interval over the draws (`IndexInterval.interval`)."""
        return None if self.drawn is None else self.drawn.interval

    @property
    def probability(self) -> float | None:
        """Probability to pass, by trials and models drawn; None if undecided."""
        if not self.decided or self.drawn is None:
            return None
        if self.measured is None and not len(self.drawn.values):
            return None
        certainty = max(self._chances)
        return certainty if self.passed else 1.0 - certainty

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
            "deciding_trials": list(self.deciding_trials),
            "passed": self.passed,
            "unit": self.unit,
            "source": self.rule.source,
        }
        if self.note:
            fields["note"] = self.note
        return fields


class Assessment(dict[str, Criterion]):
    """Criteria of a ship by name."""

    def __repr__(self) -> str:
        """A line for each criterion."""
        lines = [f"{name}: {criterion}" for name, criterion in self.items()]
        return "\n".join(lines)


def trials_to_run(criteria: Mapping[str, Criterion]) -> str:
    """The trials that would decide all criteria, in words; empty if none would."""
    wanted = {}
    for criterion in criteria.values():
        trials = criterion.deciding_trials
        if trials:
            to_both = f"{criterion.manoeuvre} to both sides"
            wanted[criterion.manoeuvre] = trials[0] if len(trials) == 1 else to_both
    return ", ".join(wanted.values())


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
        why = "it is outside the envelope of the trials or of the structure"
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

    By more than 0.15 of its size, in a turn up to 180 degrees. A structure without
    speed says nothing about a turn's size.
    """
    if model.envelope is None or test.outcome is StoppingIndices:
        return False
    has_speed = "u" in getattr(model.dynamics, "equations", "u")
    if test.outcome is TurningIndices and not has_speed:
        return True
    try:
        run = test.sail(model)
    except (UnstableModelError, ManoeuvreError):
        return True
    psi = run["psi"]
    within_half_turn = np.abs(psi - psi[0]) <= np.pi
    part = np.logical_and.accumulate(within_half_turn)
    none = np.zeros(len(run))
    states = [run.channels.get(name, none)[part] for name in ENVELOPE_CHANNELS]
    distances = model.envelope.distance(*states)
    return bool(distances.max() > 1.15)


def with_measured(
    criteria: Mapping[str, Criterion], measured: Iterable[tuple[str, MeasuredIndex]]
) -> Assessment:
    """Criteria of a ship, by her trials where they measure them.

    Of several trials to one side the worst counts. `measured`: as `measured_by` and
    `measured_in_file` find them; trials of another rudder angle, heading or approach
    speed are not among them.
    """
    found = Assessment(criteria)
    for name, index in measured:
        if name in found:
            sides = _with_trial(found[name].sides, index)
            found[name] = replace(found[name], sides=sides)
    return found


def _with_trial(sides: Sequence[Side], measured: MeasuredIndex) -> tuple[Side, ...]:
    """The sides with a trial on its own, if it is the worst there."""

    def with_trial(side: Side) -> Side:
        known = side.measured
        is_worst = known is None or measured.value > known.value
        is_own = side.name == measured.side and is_worst
        return side._replace(measured=measured) if is_own else side

    return tuple(with_trial(side) for side in sides)

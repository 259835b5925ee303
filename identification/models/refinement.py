"""The settings of a refinement by simulation error (`refine`)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from identification.estimators.lssvm import TruncatedLSSVM
from shipgym import ShipModel, Trial
from shipgym.checks import check_choice, check_flag, check_number


@dataclass(frozen=True, eq=False)
class Refinement:
    """Refinement of a fit by the errors of the motion that it simulates (output error).

    Parameters
    ----------
    segment_lengths : float, from 0.1
        Length of a segment: the time to sail that many ship lengths at service speed.
    staggered : bool
        Whether a second set of segments begins half a segment later.
    segment_start : {"free", "measured"}
        State at the start of each segment: fitted too, which leaves no bias by noise,
        or the smoothed measurement.
    pull : float, at least 0
        Strength of the pull toward the start: relative cost of a coefficient whose term
        changes by the whole acceleration (root mean squares over the trials).
    rudder_offsets : bool
        Whether the trials differ in the zero of their rudders, known beforehand to a
        degree. The model has the mean of them: its own terms give the neutral helm.
    extra_trials : sequence of Trial
        Further trials that the refinement alone sees, such as turns of another ship; in
        a ship file their names.
    extra_weight : float, above 0
        Weight of their squared residuals, relative to those of the trials.
    anchor : str, ShipModel or None
        A reference ship whose turning circles, at the target's scale, join the extra
        trials: what holds the steady turn, which lies outside all zigzags. "auto" for
        the shipped one most like the target.
    anchor_weight : float, above 0
        Weight of the squared residuals of those turns.
    start : estimator
        Fits what is refined.
    """

    name: ClassVar[str] = "output-error"
    options: ClassVar[tuple[str, ...]] = (
        "segment_lengths",
        "staggered",
        "segment_start",
        "pull",
        "rudder_offsets",
        "extra_trials",
        "extra_weight",
        "anchor",
        "anchor_weight",
    )

    segment_lengths: float = 3.4
    staggered: bool = True
    segment_start: str = "free"
    pull: float = 1e-6
    rudder_offsets: bool = False
    extra_trials: Sequence[Trial] = ()
    extra_weight: float = 1.0
    anchor: str | ShipModel | None = None
    anchor_weight: float = 1e-3
    start: Any = field(default_factory=TruncatedLSSVM)

    def __post_init__(self) -> None:
        check_number(
            self.segment_lengths,
            "segment_lengths",
            at_least=0.1,
            at_most=1e6,
            hint="in ship lengths",
        )
        check_flag(self.staggered, "staggered")
        starts = ("free", "measured")
        check_choice(self.segment_start, starts, "segment_start")
        check_number(self.pull, "pull", at_least=0.0)
        check_flag(self.rudder_offsets, "rudder_offsets")
        check_number(self.extra_weight, "extra_weight", above=0.0)
        check_number(self.anchor_weight, "anchor_weight", above=0.0)

    def plain(self) -> dict[str, Any]:
        """The settings for the provenance, extra trials by name and hash."""
        settings = {name: getattr(self, name) for name in self.options}
        if isinstance(self.anchor, ShipModel):
            settings["anchor"] = self.anchor.name
        settings["extra_trials"] = [
            {"name": trial.name, "sha256": trial.sha256} for trial in self.extra_trials
        ]
        return settings


def whole_trials() -> Refinement:
    """Output error of whole trials, each a single segment."""
    return Refinement(segment_lengths=1e6, staggered=False)

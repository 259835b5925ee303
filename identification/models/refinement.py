"""The settings of a refinement by simulation error (`refine`)."""

from dataclasses import dataclass, field
from typing import Any, ClassVar

from identification.estimators.lssvm import TruncatedLSSVM
from shipgym.checks import check_flag, check_number


@dataclass(frozen=True, eq=False)
class Refinement:
    """Refinement of a fit by the errors of the motion that it simulates (output error).

    Parameters
    ----------
    segment_lengths : float, from 0.1
        Length of a segment: the time to sail that many ship lengths at service speed.
        The state at its start is fitted too, which leaves no bias by noise.
    staggered : bool
        Whether a second set of segments begins half a segment later.
    pull : float, at least 0
        Strength of the pull toward the start: relative cost of a coefficient whose term
        changes by the whole acceleration (root mean squares over the trials).
    start : estimator
        Fits what is refined.
    """

    name: ClassVar[str] = "output-error"
    options: ClassVar[tuple[str, ...]] = ("segment_lengths", "staggered", "pull")

    segment_lengths: float = 3.4
    staggered: bool = True
    pull: float = 1e-6
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
        check_number(self.pull, "pull", at_least=0.0)


def whole_trials() -> Refinement:
    """Output error of whole trials, each a single segment."""
    return Refinement(segment_lengths=1e6, staggered=False)
